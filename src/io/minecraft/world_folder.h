#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>

// The folders of regions in worlds of Minecraft (Java). Until 1.21: region, DIM-1/region and DIM1/region for the game's
// own dimensions, dimensions/NAMESPACE/NAME/region for others. Since 26.1 all lie in dimensions/NAMESPACE/NAME/region.

namespace quoin::minecraft {

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
