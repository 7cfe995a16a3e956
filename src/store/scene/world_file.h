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

}  // namespace quoin

namespace quoin::store {

/// Renames a closed world and replaces any file with that name. After a power cut the file is complete, old or new.
/// Errors: CannotWrite.
[[nodiscard]] Status put_world_in_place(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace quoin::store
