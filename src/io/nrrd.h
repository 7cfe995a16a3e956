#pragma once

#include <span>

#include "io/volume_header.h"

namespace quoin::nrrd {

/// How many bytes a header may have; one of a few dozen lines has some thousand.
inline constexpr std::size_t kMostHeaderBytes = std::size_t{1} << 16;

/// Whether a NRRD header begins here.
[[nodiscard]] bool is_header(std::span<const std::byte> bytes);

/// Reads a header; sources as in decode_volume. `bytes` may be the file's first kMostHeaderBytes.
/// Requires: is_header(bytes). Offsets in errors count from `bytes`.
[[nodiscard]] Result<VolumeHeader> read_header(std::span<const std::byte> bytes, const VolumeOptions& options);

}  // namespace quoin::nrrd
