#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/axis_orientation.h>
#include <quoin/core/result.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/grid/voxel_shape.h>

#include "io/packs/families.h"
#include "io/packs/pack_files.h"

// The looks of Luanti nodes: shapes by node name from tables, in the form of a resource pack, and textures of a game's
// or mod's folder. Node definitions are programs (Lua), so a map contains only names of nodes.
// docs/formats/luanti.md describes the tables.

namespace quoin::packs {

/// Returns the path of a tile ("default_stone.png") as a file of a pack: assets/luanti/textures/block/NAME.png.
[[nodiscard]] std::string tile_path(std::string_view name);

/// Returns the tile that stands for a missing one with the end "_top", "_bottom", "_side" or "_front": the path without
/// it. Empty for other paths.
[[nodiscard]] std::string tile_without_end(std::string_view path);

/// Returns the orientations that `param2` selects: "facedir" (24 of 32 values), "4dir", or "wallmounted" (the
/// direction of the wall); empty for other texts. They turn nodes in the axes of grids, where z is mirrored.
/// Source: Luanti's doc/lua_api.md, "Node paramtypes", and the wall directions in src/mapnode.cpp.
[[nodiscard]] StateOrientations node_orientations(std::string_view turn);

/// Returns the state of a node after a rotation or mirror, by the turn of its family. Families with a mirror (an axis,
/// or the diagonal of corners of stairs) have exact states for mirrored nodes too. Returns nullopt if there is none:
/// families without a turn that do not stay upright.
[[nodiscard]] std::optional<std::uint32_t> turned_node_state(const VoxelProperties& type, std::uint32_t state,
                                                             const AxisOrientation& turn);

/// The block states, models and textures of all nodes, made when they are read. Tables are parsed at the first use.
class NodePack final : public PackFiles {
 public:
  /// `draws_tiles`: the pack has textures, in the colours of the table of nodes (models::node_properties).
  explicit NodePack(bool draws_tiles) : draws_tiles_(draws_tiles) {}

  [[nodiscard]] Result<std::optional<std::vector<std::byte>>> read(std::string_view path,
                                                                   std::size_t max_bytes) const override;
  [[nodiscard]] std::string identity() const override { return draws_tiles_ ? "nodes" : "nodes without tiles"; }
  /// The tables of families and rules, by full node names.
  [[nodiscard]] static const BlockFamilies& families();

 private:
  bool draws_tiles_;
};

/// Returns true for a folder of a Luanti game, mod, modpack or texture pack: it has game.conf, mod.conf, modpack.conf,
/// modpack.txt, texture_pack.conf, init.lua, or a folder `mods` or `textures`.
[[nodiscard]] bool is_node_folder(const std::filesystem::path& folder);

/// Returns the PNG files in all folders `textures` of such a folder, or in the whole folder of a texture pack, by their
/// names without ".png". Of equal names, the path that sorts last wins. Folders that are links are not searched, and
/// files may be links out of the folder (check_inside).
/// Errors: CannotRead; LimitExceeded beyond 100,000 files. Depth: folders below 8 levels are not searched.
[[nodiscard]] Result<std::map<std::string, std::filesystem::path, std::less<>>> tiles_of_folder(
    const std::filesystem::path& folder);

/// Opens the files of tiles_of_folder as tiles (tile_path). Links out of the folder are errors when they are read.
/// Tiles of frames below each other have an animation.
/// Errors: those of tiles_of_folder.
[[nodiscard]] Result<std::shared_ptr<const PackFiles>> open_node_folder(const std::filesystem::path& folder);

}  // namespace quoin::packs
