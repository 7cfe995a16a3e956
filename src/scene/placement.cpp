// Transforms between an instance's grid and the world.

#include <cmath>
#include <limits>

#include <glm/common.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <quoin/scene/scene.h>

#include "scene/instance_axes.h"

namespace quoin {
namespace {

constexpr DVec3 kNowhere{std::numeric_limits<double>::quiet_NaN()};

}  // namespace

glm::dmat4 world_from_grid(const Instance& instance, const SceneGrid& grid) {
  glm::dmat4 matrix(world_axes(instance) * instance.voxel_size);
  matrix[3] = glm::dvec4(world_from_grid(instance, grid, DVec3(0.0)), 1.0);
  return matrix;
}

// Uses the inverse instead of the transpose: a quaternion may be slightly longer than 1, which matters far from the
// pivot.
DVec3 grid_from_world(const Instance& instance, const SceneGrid& grid, DVec3 point_in_world) {
  if (!has_valid_transform(instance)) return kNowhere;
  // The difference of two far positions is taken first: it is small, and mostly exact.
  const DVec3 offset = glm::inverse(world_axes(instance)) * (point_in_world - instance.position);
  return offset / instance.voxel_size + grid.pivot;
}

DVec3 world_from_grid_direction(const Instance& instance, DVec3 direction_in_grid) {
  return world_axes(instance) * (direction_in_grid * instance.voxel_size);
}

DVec3 grid_from_world_direction(const Instance& instance, DVec3 direction_in_world) {
  if (!has_valid_transform(instance)) return kNowhere;
  return glm::inverse(world_axes(instance)) * direction_in_world / instance.voxel_size;
}

DVec3 transformed_point(const Instance& before, const Instance& after, DVec3 point_in_world) {
  if (!has_valid_transform(before) || !has_valid_transform(after)) return point_in_world;
  const DVec3 in_grid = glm::inverse(world_axes(before)) * (point_in_world - before.position) / before.voxel_size;
  return after.position + world_axes(after) * (in_grid * after.voxel_size);
}

std::optional<IVec3> voxel_from_world(const Instance& instance, const SceneGrid& grid, DVec3 point_in_world) {
  const DVec3 voxel = glm::floor(grid_from_world(instance, grid, point_in_world));
  for (int axis = 0; axis < 3; ++axis) {
    // Rejects NaN.
    if (!(voxel[axis] >= std::numeric_limits<int>::min() && voxel[axis] <= std::numeric_limits<int>::max())) {
      return std::nullopt;
    }
  }
  return IVec3(voxel);
}

}  // namespace quoin
