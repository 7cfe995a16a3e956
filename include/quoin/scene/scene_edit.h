#pragma once

#include <cstdint>

#include <quoin/core/shapes.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/scene/scene.h>

namespace quoin {

// Edits of a scene's voxels by shapes in world space. To edit fields, use DensityGrid's own functions, with positions
// from `grid_from_world`. The edits go through Scene::edit, so the change journals of scene and grid record them. An
// edit of a grid shows in all its instances.
//
// Requires: the handle names an instance of the scene, and the scene contains the instance's grid.
// Invalid:  does nothing and returns false or 0 if the instance has no valid transform (`has_valid_transform`), or a
//           number of the shape is negative or not finite.

/// Sets the voxel that contains a world point (see `voxel_from_world`). Returns true if its type changed.
bool set_voxel(Scene& scene, InstanceHandle instance, DVec3 point_in_world, VoxelType type);

/// Sets the voxels of an instance's grid whose centres are within `radius` (world units) of `centre_in_world`, like
/// Grid::fill_sphere in grid space. Returns the number of changed voxels.
/// Cost: O(voxels of the box around the sphere); for air, only those in existing chunks.
std::int64_t fill_sphere(Scene& scene, InstanceHandle instance, DVec3 centre_in_world, double radius, VoxelType type);

/// Sets the voxels of an instance's grid whose centres lie inside a world-space box or on its surface, to the
/// rounding of doubles. Returns the number of changed voxels.
/// Cost: O(rows of 64 voxels in the chunks at the box's surface + chunks inside it); for air, only existing chunks. A
///       long rotated box costs only the chunks that it crosses.
std::int64_t fill_box(Scene& scene, InstanceHandle instance, const OrientedBox& box_in_world, VoxelType type);

}  // namespace quoin
