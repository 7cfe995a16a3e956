#include "scene/frustum.h"

#include <cmath>

#include <glm/geometric.hpp>

namespace quoin {

Frustum::Frustum(const Camera& camera, int width, int height) {
  const bool is_perspective = camera.projection == Camera::Projection::Perspective;
  const double up = is_perspective ? std::tan(camera.vertical_fov / 2.0) : 0.5 * camera.view_height;
  const double across = up * width / height;
  const std::array<DVec3, 4> edges = {across * camera.right, -across * camera.right, up * camera.up, -up * camera.up};
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const DVec3 outward = glm::normalize(edges[i]);
    if (is_perspective) {
      // Perpendicular to the edge's own ray, in the plane of it and the axis.
      const DVec3 ray = camera.forward + edges[i];
      planes_[i] = {glm::normalize(ray * glm::dot(outward, ray) - outward * glm::dot(ray, ray)), 0.0};
    } else {
      planes_[i] = {-outward, -glm::length(edges[i])};
    }
  }
  planes_[4] = {glm::normalize(camera.forward), 0.0};
}

}  // namespace quoin
