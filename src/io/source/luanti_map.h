#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>

#include <quoin/io/chunk_source.h>

// Luanti worlds, which are SQLite databases. The store, a layer above this one, opens them; builds without SQLite
// return an error.

namespace quoin {

/// Returns true if bytes begin like a Luanti map: with SQLite's header, and the table of blocks.
[[nodiscard]] bool is_luanti_map(std::span<const std::byte> beginning);
/// Returns true if a folder is a Luanti world: it contains world.mt.
[[nodiscard]] bool is_luanti_folder(const std::filesystem::path& path);

/// Opens a Luanti world: its folder, or the database in it (map.sqlite).
/// Errors: CannotRead; BadFormat; Unsupported if world.mt names another storage.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_luanti(const std::filesystem::path& path);
/// Opens the bytes of a database, which are copied.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_luanti(std::span<const std::byte> database);

}  // namespace quoin
