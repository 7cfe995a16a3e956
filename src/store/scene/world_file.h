#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>

#include <quoin/core/result.h>
#include <quoin/store/world_store.h>

namespace quoin {

/// Estimates the bytes of memory that load_world needs for a world, from a sample of its chunks. Returns nullopt if
/// they cannot be read.
[[nodiscard]] std::optional<std::uint64_t> memory_of_world(const WorldStore& world);

/// Maximum memory for the whole grids of a world (WorldGrid::whole).
struct WholeGridLimit {
  std::uint64_t bytes = std::numeric_limits<std::uint64_t>::max();
  bool is_memory = false;  ///< the available memory is less than the caller allows

  /// Returns the lesser of `max_bytes` and the memory that is available now.
  [[nodiscard]] static WholeGridLimit of(std::uint64_t max_bytes);
  /// Returns an error for the grid whose chunks, with those of the grids before it, exceed the limit.
  [[nodiscard]] Error error(const WorldStore& world, std::uint32_t number, const std::string& name,
                            std::uint64_t needed) const;
};

/// Checks, before they are loaded, that the world's whole grids probably fit. Skips grids with chunks that cannot be
/// listed.
/// The estimate leaves out per-voxel data if chunks of the greatest size without data would fit.
/// Cost:   reads the keys of their chunks; a sample of the chunks too, if chunks of that size would not fit.
/// Errors: LimitExceeded, with the first grid that does not fit; CannotRead.
[[nodiscard]] Status check_whole_grids(const WorldStore& world, const WholeGridLimit& limit);

}  // namespace quoin

namespace quoin::store {

/// Renames a closed world and replaces any file with that name. After a power cut the file is complete, old or new.
/// Errors: CannotWrite.
[[nodiscard]] Status put_world_in_place(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace quoin::store
