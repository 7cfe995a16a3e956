#pragma once

#include <cstdint>

#include <quoin/core/shapes.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/scene/scene.h>

namespace quoin {

// Edits of the voxels of a scene's grids by shapes in the world; fields are edited by DensityGrid's own functions, at
// places from `grid_from_world`. They go through Scene::edit, so that the journals of scene and grid tell of them. A
// grid that is placed several times changes in all its places.
//
// Requires: the handle names an instance of the scene, and the instance's grid is in the scene.
// Nothing:  is changed, and `false` or 0 returned, where the instance has no place (`has_place`) or a number
//           of the shape is not finite or is negative.

/// Sets the voxel that fills the place of a point of the world (see `voxel_from_world`). Returns true when it had
/// another type before.
bool set_voxel(Scene& scene, InstanceHandle instance, DVec3 point_in_world, VoxelType type);

/// Sets the voxels of an instance's grid whose centre is at most `radius` (world units) from `centre_in_world`, as
/// Grid::fill_sphere does in the grid. Returns how many changed.
/// Cost: O(voxels of the box around the sphere); of air, of those in chunks that there are.
std::int64_t fill_sphere(Scene& scene, InstanceHandle instance, DVec3 centre_in_world, double radius, VoxelType type);

/// Sets the voxels of an instance's grid whose centre lies in a box in the world or on its surface, to the rounding of
/// doubles. Returns how many changed.
/// Cost: O(rows of 64 voxels in the chunks at the box's surface + chunks within it); of air, of the chunks that there
/// are. A long box that lies askew costs no more than what it crosses.
std::int64_t fill_box(Scene& scene, InstanceHandle instance, const OrientedBox& box_in_world, VoxelType type);

}  // namespace quoin
