#include "io/placement.h"

#include <cmath>

#include <quoin/io/scene_meshes.h>

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

}  // namespace quoin
