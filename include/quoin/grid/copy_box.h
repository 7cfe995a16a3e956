#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include <quoin/core/axis_orientation.h>
#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

namespace [[gnu::visibility("default")]] quoin {

struct CopyOptions {
  bool copy_air = true;  ///< false: air voxels of the box are not copied
  /// Maps each type to its replacement, which may be air. Entry 0 is ignored: air stays air. Types beyond the end are
  /// kept.
  /// Lifetime: must outlive the call.
  std::span<const VoxelType> type_map{};
  /// The types of `to`. A rotated or mirrored copy turns the states of types with orientations by
  /// StateOrientations::turned, also of voxels whose state is 0. Null: states are copied unchanged.
  /// Lifetime: must outlive the call.
  const VoxelRegistry* types = nullptr;
  /// Returns the state of a voxel of `types` after the rotation or mirror `turn`, instead of StateOrientations::turned,
  /// for all types with state bits (VoxelProperties::state_bits), also if the state is 0. Orientations do
  /// not describe the states of fences and doors, for example: turned_block_state in io/block_packs.h. Requires:
  /// `types`.
  std::function<std::uint32_t(const VoxelProperties& type, std::uint32_t state, const AxisOrientation& turn)>
      turn_state{};
  /// Maps the state (VoxelData) of a copied voxel, for voxels that have a state, instead of `types`: for states that
  /// encode a direction in a way that only the game knows.
  std::function<std::uint32_t(VoxelType type, std::uint32_t state)> map_state{};
};

/// Copies the voxels of a box and their data into another grid, or to another position in the same grid. The box is
/// rotated and mirrored by `orientation`; the minimum corner of the result is at `to_min`. Returns the number of voxels
/// whose type changed in `to`.
///
/// Space:    voxel coordinates of each grid. Voxel `v` of the box arrives at `to_min` plus the rotated `v - box.min`,
///           shifted so that the rotated box begins at 0. The rotated box has size `orientation.size_of(box.size())`.
/// Overlap:  `from` and `to` may be the same grid, and the boxes may overlap. The copy acts as if all voxels were read
///           before the first is written.
/// Partial:  unloaded chunks of `from` are not copied; unloaded chunks of `to` are not changed.
/// Limits:   voxels that would land outside the world (see Grid) are left out. An empty box copies nothing.
/// Cost:     O(chunks of the box) for a move by whole chunks without rotation. These chunks are shared with `from`
///           until edited; so are uniform chunks in every case. Otherwise O(rows of 64 voxels in the box), rotated or
///           not, and 0.5 MiB of memory for the call. Chunks that do not exist in either grid cost nothing. A voxel
///           whose state turns costs as `set_data`.
std::int64_t copy_box(const Grid& from, const IBox& box, Grid& to, IVec3 to_min, AxisOrientation orientation = {},
                      const CopyOptions& options = {});

}  // namespace quoin
