#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <quoin/io/heights.h>

namespace quoin::heights {

/// Upper limit of HeightOptions::depth.
inline constexpr int kMaxDepth = 4096;

/// Returns true if a file of this size may be .hgt.
[[nodiscard]] bool is_hgt_size(std::uint64_t bytes);
[[nodiscard]] bool is_png(std::span<const std::byte> beginning);
/// Errors: InvalidArgument.
[[nodiscard]] Status check(const HeightOptions& options);

}  // namespace quoin::heights
