#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

// Converts scenes for formats with whole voxels in one lattice: the placed grids, and the content that such formats
// drop.

namespace quoin::models {

/// The properties of models that a format can store, except their voxels' colours.
struct FormatHolds {
  std::string_view extension;   ///< for messages: ".qb"
  bool names = false;           ///< names of models
  bool hidden = false;          ///< hidden models; otherwise they are dropped
  bool several = false;         ///< several models; otherwise they are merged
  bool colours = true;          ///< colours of voxels
  bool transparency = false;    ///< transparency of colours
  bool materials = false;       ///< roughness, metalness and light of voxels
  bool type_names = false;      ///< names of types, and states of voxels
  bool place_in_units = false;  ///< the size of a voxel
};

/// A placement of a grid in the file's lattice.
struct PlacedGrid {
  std::string name;  ///< the instance's name, or the grid's if it has none
  bool visible = true;
  Grid voxels{};  ///< rotated and moved, in voxels of the file; shares chunks with the scene's grid if possible
  IBox box{};     ///< the declared box in the same space; never empty
};

/// A scene in one lattice: voxel v of it lies at voxel_size * v in the world.
struct PlacedGrids {
  std::vector<PlacedGrid> grids;  ///< in the order of the instances' handles
  double voxel_size = 1.0;        ///< world units
  std::vector<std::string> warnings;
};

/// Rotates and moves each placement of a scene. Instances between voxels move to the nearest voxel, with a warning.
/// Content that the format lacks is counted in other warnings. States of voxels (VoxelData) are not rotated, which also
/// causes a warning.
///
/// Errors: Unsupported for density fields, rotations that are not multiples of 90 degrees, and voxels of different
/// sizes; LimitExceeded for positions beyond 2^26 voxels; InvalidArgument for voxels whose type is not registered.
[[nodiscard]] Result<PlacedGrids> place_grids(const Scene& scene, const FormatHolds& holds);

/// The same, merged into one grid; the last grid wins where several have a voxel. Memory: all grids, and one rotated
/// copy.
struct MergedGrid {
  std::string name;
  Grid voxels{};
  IBox box{};  ///< empty if the scene has no visible voxel
  double voxel_size = 1.0;
  std::vector<std::string> warnings;
};
[[nodiscard]] Result<MergedGrid> merge_grids(const Scene& scene, const FormatHolds& holds);

/// Returns the longest prefix of a text that fits, without a partial character at its end. Warns if it is shortened.
[[nodiscard]] std::string cut_name(const std::string& name, std::size_t bytes, std::vector<std::string>& warnings);

/// Reads the types of the voxels from `first` along x.
void read_voxels(const Grid& grid, IVec3 first, std::span<VoxelType> out);

/// Returns the colours of all types. Alpha is 255 for opaque types, and at least 1 for transparent types. Air is 0, 0,
/// 0, 0.
[[nodiscard]] std::vector<Rgba8> colours_of(const VoxelRegistry& types);

}  // namespace quoin::models
