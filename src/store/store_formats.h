#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/loaded_scene.h>

#include "core/bytes/bytes.h"

// The format of Quoin's worlds, registered with io. Builds without SQLite detect it, and return an error when reading.

namespace quoin {

/// The SQLite application id of a world: "Quon".
inline constexpr std::uint32_t kWorldApplicationId = 0x51756F6E;
/// The number of bytes that `is_world_format` needs.
inline constexpr std::size_t kWorldHeaderBytes = 100;

/// Returns true if bytes begin like a world: with SQLite's header, and Quoin's application id.
[[nodiscard]] inline bool is_world_format(std::span<const std::byte> beginning) {
  constexpr std::string_view kSqliteHeader{"SQLite format 3\0", 16};
  constexpr std::size_t kIdAt = 68;  // the application id
  return beginning.size() >= kWorldHeaderBytes && text_of(beginning).starts_with(kSqliteHeader) &&
         load<std::uint32_t>(beginning.data() + kIdAt, std::endian::big) == kWorldApplicationId;
}
[[nodiscard]] Result<LoadedScene> read_world_format(const std::filesystem::path& path, const LoadOptions& options,
                                                    Threads threads, const Progress& progress);
[[nodiscard]] Result<LoadedScene> read_world_format(std::span<const std::byte> bytes, const LoadOptions& options,
                                                    Threads threads, const Progress& progress);

}  // namespace quoin
