#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/io/chunk_source.h>
#include <quoin/io/loaded_scene.h>

#include "io/format_driver.h"

namespace quoin::minecraft {

/// Returns true if a folder is a Minecraft (Java) world or one of its dimensions, or holds region files. Also accepts
/// the path of a world's level.dat.
[[nodiscard]] bool is_minecraft_folder(const std::filesystem::path& path);

/// Opens a Minecraft (Java) world: its folder or level.dat, the folder of a dimension, a folder of region files, or a
/// region file. `dimension`: "overworld", "nether", "end" or NAMESPACE:NAME; empty: the overworld, or the first.
/// Errors: CannotRead; BadFormat if no region can be read; Unsupported for regions of entities or points of interest;
/// InvalidArgument for a missing dimension, with a list of the present ones.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_minecraft(const std::filesystem::path& path,
                                                                  std::string_view dimension = {});

/// Opens the bytes of a region file, which are copied. Errors: BadFormat.
[[nodiscard]] Result<std::unique_ptr<ChunkSource>> open_minecraft(std::span<const std::byte> region);

// Pieces of Minecraft worlds, as players and programs share them:
//   .schem      https://github.com/SpongePowered/Schematic-Specification, versions 1 to 3
//   .schematic  https://minecraft.wiki/w/Schematic_file_format
//   .litematic  of the mod Litematica, versions 1 to 7
//   .nbt        structures of the game: https://minecraft.wiki/w/Structure_file

/// Returns true if an NBT file begins here, gzipped or plain; the reader decides if it is a schematic. `beginning`:
/// about a hundred bytes suffice.
[[nodiscard]] bool begins_nbt(std::span<const std::byte> beginning);

/// Reads any schematic format, detected by content. Makes one grid per region, in blocks from its minimum corner, at
/// the offset in a .schem. The regions of a litematic keep their relative positions; regions of equal names get a
/// number.
///
/// Types and states: as in worlds, docs/formats/minecraft.md.
/// Warnings: dropped data: entities, block contents, biomes.
/// Errors: BadFormat, with the offset in the decompressed file; LimitExceeded (2^30 blocks, 65,535 kinds, 1 GiB);
///         Unsupported for other NBT files; Cancelled.
[[nodiscard]] Result<LoadedScene> read_schematic(std::span<const std::byte> bytes, const Progress& progress = {});

/// Writes a scene as a .schem, version 2: its instances are merged. Types named like blocks become these blocks, with
/// their states. Others become blocks of the nearest colour: concrete, wool, clay and some more, glass for transparent
/// types, lights for emissive types.
///
/// Errors, warnings: as in placed_grids.h; LimitExceeded beyond 65,535 blocks per side or 2^30 in total.
[[nodiscard]] Result<EncodedFile> write_schematic(const Scene& scene, const Progress& progress = {});

// The folders of regions in worlds of Minecraft (Java). Until 1.21: region, DIM-1/region and DIM1/region for the game's
// own dimensions, dimensions/NAMESPACE/NAME/region for others. Since 26.1 all lie in dimensions/NAMESPACE/NAME/region.

/// A dimension of a world that has regions.
struct Dimension {
  std::string name;               ///< "minecraft:overworld", "minecraft:worlds/2b2t/2b2t_2"; of older mods "DIM7"
  std::filesystem::path regions;  ///< the folder that holds r.X.Z.mca
};

/// The regions at a path, and the dimensions of its world.
struct WorldFolder {
  std::vector<Dimension> dimensions;             ///< the overworld first if there is one, then by name
  std::vector<std::string> warnings{};           ///< a line per duplicate dimension
  std::optional<std::filesystem::path> level{};  ///< level.dat
};

/// Returns the full name of a dimension: "nether" is "minecraft:the_nether", "a" is "minecraft:a".
[[nodiscard]] std::string dimension_name(std::string_view text);

/// Returns true if the folder holds region files.
[[nodiscard]] bool has_regions(const std::filesystem::path& folder);

/// Finds the dimensions of a world folder, or the dimension of a dimension or region folder. A path to level.dat counts
/// as its folder. Finds no dimensions if the folder is not a Java world, or has no chunks.
/// Cost: lists the folders below `dimensions`.
[[nodiscard]] WorldFolder find_dimensions(const std::filesystem::path& path);

/// Explains why a folder (or its level.dat) without regions is not read. Requires: find_dimensions found none.
[[nodiscard]] Error no_regions(const std::filesystem::path& path);

/// The world properties in level.dat.
struct LevelFile {
  std::string name;
  std::string version;  ///< "1.18.2"; empty before 1.9
  std::optional<DVec3> spawn;
  std::string spawn_dimension = "minecraft:overworld";
};

/// Errors: BadFormat, with the offset (in the decompressed bytes if it is compressed); LimitExceeded.
[[nodiscard]] Result<LevelFile> parse_level_file(std::span<const std::byte> bytes);

}  // namespace quoin::minecraft
