#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include <quoin/core/result.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/io/chunk_source.h>

namespace quoin::models {

/// The attribute of node types with a guessed look, as for Minecraft blocks.
inline constexpr const char* kNodeGuessAttribute = "luanti.look";

/// Returns the type of a Luanti node by its name ("default:stone"): from a table for the names of Luanti's own game,
/// otherwise by the words of the name. Returns nullopt for "air" and for "ignore" (not generated).
[[nodiscard]] std::optional<VoxelProperties> node_properties(std::string_view name);

}  // namespace quoin::models

namespace quoin {

/// Returns true if bytes begin like a Luanti map: with SQLite's header, and the table of blocks.
[[nodiscard]] bool is_luanti_map(std::span<const std::byte> beginning);

/// Opens a Luanti world: its folder, or the database in it (map.sqlite).
/// Errors: CannotRead; BadFormat; Unsupported if world.mt names another storage, and in builds without SQLite.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_luanti(const std::filesystem::path& path);
/// Opens the bytes of a database, which are copied.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_luanti(std::span<const std::byte> database);

}  // namespace quoin
