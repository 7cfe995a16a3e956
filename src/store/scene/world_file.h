#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include <quoin/core/result.h>
#include <quoin/store/world_store.h>

namespace quoin {

/// Estimates the bytes of memory that load_world needs for a world, from a sample of its chunks. Returns nullopt if
/// they cannot be read.
[[nodiscard]] std::optional<std::uint64_t> memory_of_world(const WorldStore& world);
/// Checks that the world's whole grids (WorldGrid::whole) fit in `max_bytes` and in the available memory.
/// Cost:   reads the keys of their chunks; a sample of the chunks too, if the largest possible chunks would not fit.
/// Errors: LimitExceeded, with the first grid that does not fit; those of reading.
[[nodiscard]] Status check_whole_grids(const WorldStore& world, std::uint64_t max_bytes);

}  // namespace quoin

namespace quoin::store {

/// Renames a closed world and replaces any file with that name. After a power cut the file is complete, old or new.
/// Errors: CannotWrite.
[[nodiscard]] Status put_world_in_place(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace quoin::store
