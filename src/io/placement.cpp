#include "io/placement.h"

#include <cmath>

#include <quoin/io/scene_meshes.h>

#include "scene/instance_axes.h"

namespace quoin {

namespace {

bool is_sound(const Instance& instance) {
  const DVec3& p = instance.position;
  const double length = glm::length(instance.rotation);
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && std::isfinite(length) && length > 0.0 &&
         std::isfinite(instance.voxel_size) && instance.voxel_size > 0.0;
}

}  // namespace

Status check_placements(const Scene& scene, bool hidden) {
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (is_drawn(scene, instance, hidden) && !is_sound(instance)) {
      return fail(
          ErrorCode::InvalidArgument,
          "instance \"" + instance.name + "\" has a transform that is not finite or a size that is not positive");
    }
  }
  return {};
}

glm::dmat4 world_from_pivot(const Instance& instance) {
  glm::dmat4 matrix(world_axes(instance) * instance.voxel_size);
  matrix[3] = glm::dvec4(instance.position, 1.0);
  return matrix;
}

}  // namespace quoin
