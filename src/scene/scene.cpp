#include <quoin/scene/scene.h>

#include <algorithm>
#include <cmath>

#include "scene/instance_axes.h"

namespace quoin {

namespace {

/// The rotation's matrix, exact for quarter turns, whose quaternions hold the irrational square root of one half.
glm::dmat3 exact_matrix(const DQuat& rotation) {
  constexpr double kRounding = 1e-12;
  glm::dmat3 matrix = glm::mat3_cast(unit_rotation(rotation));
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) {
      const double nearest = std::round(matrix[column][row]);
      if (std::abs(matrix[column][row] - nearest) < kRounding) matrix[column][row] = nearest;
    }
  }
  return matrix;
}

}  // namespace

DQuat made_unit(const DQuat& q) {
  if (q.x == 0.0 && q.y == 0.0 && q.z == 0.0 && q.w == 0.0) return {1.0, 0.0, 0.0, 0.0};
  // Scaled first: the square of a very small or large number is 0 or infinite.
  const double largest = std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z), std::abs(q.w)});
  const DQuat scaled = q / largest;
  return scaled / std::sqrt(glm::dot(scaled, scaled));
}

glm::dmat3 world_axes(const Instance& instance) {
  glm::dmat3 axes = exact_matrix(instance.rotation);
  if (instance.mirrored) axes[0] = -axes[0];
  return axes;
}

bool has_place(const Instance& instance) {
  const DQuat& q = instance.rotation;
  return is_finite(instance.position) && is_finite({q.x, q.y, q.z}) && std::isfinite(q.w) &&
         std::isfinite(instance.voxel_size) && instance.voxel_size > 0.0;
}

bool Scene::remove_grid(GridHandle handle) {
  if (!grids_.remove(handle)) return false;
  for (const InstanceHandle instance : instances_.handles()) {
    if (instances_[instance].grid == handle) instances_.remove(instance);
  }
  return true;
}

std::int64_t Scene::voxel_count() const {
  std::int64_t count = 0;
  for (const GridHandle handle : grids_.handles()) count += grids_[handle].grid.voxel_count();
  return count;
}

DBox Scene::bounds(bool hidden_too) const {
  DBox box;
  for (const InstanceHandle handle : instances_.handles()) {
    const Instance& instance = instances_[handle];
    const SceneGrid* grid = grids_.find(instance.grid);
    if (grid == nullptr || (!instance.visible && !hidden_too) || !has_place(instance)) continue;
    const IBox tight = grid->grid.bounds();
    if (tight.empty()) continue;
    for (int corner = 0; corner < 8; ++corner) {
      const DVec3 point{(corner & 1) != 0 ? tight.max.x : tight.min.x, (corner & 2) != 0 ? tight.max.y : tight.min.y,
                        (corner & 4) != 0 ? tight.max.z : tight.min.z};
      box.extend(world_from_grid(instance, *grid, point));
    }
  }
  return box;
}

DVec3 world_from_grid(const Instance& instance, const SceneGrid& grid, DVec3 point_in_grid) {
  DVec3 offset = (point_in_grid - grid.pivot) * instance.voxel_size;
  if (instance.mirrored) offset.x = -offset.x;
  return instance.position + exact_matrix(instance.rotation) * offset;
}

}  // namespace quoin
