#include "scene/placed_grid.h"

#include <cmath>

#include <glm/common.hpp>

#include "scene/instance_axes.h"

namespace quoin {

bool can_be_traced(const Instance& instance, const SceneGrid* grid, bool hidden) {
  if (grid == nullptr || (!instance.visible && !hidden)) return false;
  const DQuat& q = instance.rotation;
  return is_finite(instance.position) && is_finite(grid->pivot) && is_finite({q.x, q.y, q.z}) && std::isfinite(q.w) &&
         std::isfinite(instance.voxel_size) && instance.voxel_size > 0.0 && !grid->grid.bounds().empty();
}

PlacedGrid placed_as(const Scene& scene, InstanceHandle handle) {
  const Instance& instance = scene.instances()[handle];
  const SceneGrid& grid = scene.grids()[instance.grid];
  PlacedGrid placed;
  placed.instance = handle;
  placed.grid = &grid;
  placed.voxels = &grid.grid;
  placed.pivot = grid.pivot;
  placed.world_axes = world_axes(instance);
  placed.position = instance.position;
  placed.voxel_size = instance.voxel_size;
  return placed;
}

DBox bounds_of(const PlacedGrid& placed) {
  const IBox tight = placed.voxels->bounds();
  DBox box;
  for (int corner = 0; corner < 8; ++corner) {
    const DVec3 point{(corner & 1) != 0 ? tight.max.x : tight.min.x, (corner & 2) != 0 ? tight.max.y : tight.min.y,
                      (corner & 4) != 0 ? tight.max.z : tight.min.z};
    box.extend(placed.position + placed.world_axes * ((point - placed.pivot) * placed.voxel_size));
  }
  const DVec3 room = (box.max - box.min) * 1e-6 + (glm::abs(box.min) + glm::abs(box.max)) * 1e-15;
  return {box.min - room, box.max + room};
}

}  // namespace quoin
