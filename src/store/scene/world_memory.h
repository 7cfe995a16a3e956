#pragma once

#include <cstdint>
#include <optional>

#include <quoin/store/world_store.h>

namespace quoin {

/// Estimates the bytes of memory that load_world needs for a world, from a sample of its chunks. Returns nullopt if
/// they cannot be read.
[[nodiscard]] std::optional<std::uint64_t> memory_of_world(const WorldStore& world);

}  // namespace quoin
