#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/chunk_source.h>
#include <quoin/io/loaded_scene.h>

// The formats of SQLite databases, registered with io: Quoin's worlds, and Luanti's. Builds without SQLite detect them,
// and return an error when reading.

namespace quoin {

/// The SQLite application id of a world: "Quon".
inline constexpr std::uint32_t kWorldApplicationId = 0x51756F6E;
/// The number of bytes that `is_world_format` needs.
inline constexpr std::size_t kWorldHeaderBytes = 100;

/// Returns true if bytes begin like a world: with SQLite's header, and Quoin's application id.
[[nodiscard]] bool is_world_format(std::span<const std::byte> beginning);
[[nodiscard]] Result<LoadedScene> read_world_format(const std::filesystem::path& path, const LoadOptions& options,
                                                    Threads threads, const Progress& progress);
[[nodiscard]] Result<LoadedScene> read_world_format(std::span<const std::byte> bytes, const LoadOptions& options,
                                                    Threads threads, const Progress& progress);

/// Returns true if bytes begin like a Luanti map: with SQLite's header, and the table of blocks.
[[nodiscard]] bool is_luanti_map(std::span<const std::byte> beginning);

/// Opens a Luanti world: its folder, or the database in it (map.sqlite).
/// Errors: CannotRead; BadFormat; Unsupported if world.mt names another storage.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_luanti(const std::filesystem::path& path);
/// Opens the bytes of a database, which are copied.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_luanti(std::span<const std::byte> database);

}  // namespace quoin
