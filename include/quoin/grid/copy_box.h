#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include <quoin/core/axis_orientation.h>
#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

struct CopyOptions {
  bool copy_air = true;  ///< false: air in the box leaves what is there
  /// [type]: the type that takes its place, which may be air. [0] means nothing: air stays air. Types beyond its end
  /// stay as they are. Lifetime: it must outlive the call.
  std::span<const VoxelType> type_map{};
  /// The state (VoxelData) with which a voxel of this type arrives, where it has one: what is turned with its box says
  /// another direction there, which only the game knows. Empty: as it was.
  std::function<std::uint32_t(VoxelType type, std::uint32_t state)> map_state{};
};

/// Copies the voxels of a box into another grid, or another place of the same: turned and mirrored by `orientation`,
/// so that the least corner of the turned box is at `to_min`; their data goes with them. Returns how many types differ.
///
/// Space:   voxel coordinates of each grid. Voxel `v` of the box arrives at `to_min` + (the turned v - box.min, moved
///          so that the turned box begins at 0). The turned box's size is `orientation.size_of(box.size())`.
/// Overlap: `from` and `to` may be one grid, and the boxes may overlap: as if all were copied at once.
/// Partial: what is not loaded of `from` is not copied, and leaves what is there; of `to` it is not changed.
/// Ends:    what would come to lie outside the world (see Grid) is left out; an empty box copies nothing.
/// Cost:    O(chunks of the box) where it is moved by whole chunks and not turned: these are shared with `from`, no
///          voxel is copied until one is edited. So are chunks of one type, wherever they go. Otherwise O(rows of 64
///          voxels of the box), turned or not, and 0.5 MiB of memory for the call. Of a box larger than what the grids
///          hold only their chunks are looked at.
std::int64_t copy_box(const Grid& from, const IBox& box, Grid& to, IVec3 to_min, AxisOrientation orientation = {},
                      const CopyOptions& options = {});

}  // namespace quoin
