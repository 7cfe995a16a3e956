#include "scene/frustum.h"

#include <cmath>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>

namespace quoin {

Frustum::Frustum(const Camera& camera, int width, int height) {
  QUOIN_ASSERT(width > 0 && height > 0, "width and height are positive");
  const bool is_perspective = camera.projection == Camera::Projection::Perspective;
  const double up = is_perspective ? std::tan(camera.vertical_fov_radians / 2.0) : 0.5 * camera.view_height;
  const double across = up * width / height;
  const std::array<DVec3, 4> edges = {across * camera.right, -across * camera.right, up * camera.up, -up * camera.up};
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const DVec3 outward = glm::normalize(edges[i]);
    if (is_perspective) {
      // Perpendicular to the edge's own ray, in the plane of it and the axis.
      const DVec3 ray = camera.forward + edges[i];
      set(i, glm::normalize(ray * glm::dot(outward, ray) - outward * glm::dot(ray, ray)), 0.0);
    } else {
      set(i, -outward, -glm::length(edges[i]));
    }
  }
  for (const std::size_t plane : {4U, 5U}) set(plane, glm::normalize(camera.forward), 0.0);
}

void Frustum::set(std::size_t plane, DVec3 inward, double offset) {
  QUOIN_ASSERT(plane / 2 < planes_.size(), "one of the six planes");
  Planes& planes = planes_[plane / 2];
  planes.x[plane % 2] = inward.x;
  planes.y[plane % 2] = inward.y;
  planes.z[plane % 2] = inward.z;
  planes.offset[plane % 2] = offset;
}

}  // namespace quoin
