#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>
#include <quoin/scene/camera.h>

namespace quoin {

/// The part of the world in a camera's image, as five half-spaces: four image edges, and the space in front of the
/// camera.
///
/// Space: the world's axes and units, with the camera's position as origin.
class Frustum {
 public:
  /// Requires: width and height are positive; the camera's axes are perpendicular. They may be a little off unit
  /// length: the planes are those of `ray_through`.
  Frustum(const Camera& camera, int width, int height) {
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

  /// Returns false only if no ray of the image hits the sphere. Some spheres near the corners of the image count as
  /// hit. NaN counts as hit.
  [[nodiscard]] bool meets(DVec3 centre, double radius) const {
    // Tolerance for rounding, also for far centres.
    constexpr double kRoom = 1e-9;
    const double reach = radius + kRoom * (radius + std::abs(centre.x) + std::abs(centre.y) + std::abs(centre.z));
    TwoBits is_out{};
    for (const Planes& planes : planes_) {
      const Two along = planes.x * centre.x + planes.y * centre.y + planes.z * centre.z;
      is_out |= along < planes.offset - reach;
    }
    return (is_out[0] | is_out[1]) == 0;
  }

 private:
  using Two = double __attribute__((vector_size(16)));
  using TwoBits = std::int64_t __attribute__((vector_size(16)));
  /// Points p with dot(inward, p) >= offset are inside; `inward` is unit.
  struct Planes {
    Two x{}, y{}, z{};
    Two offset{};
  };
  void set(std::size_t plane, DVec3 inward, double offset) {
    QUOIN_ASSERT(plane / 2 < planes_.size(), "one of the six planes");
    Planes& planes = planes_[plane / 2];
    planes.x[plane % 2] = inward.x;
    planes.y[plane % 2] = inward.y;
    planes.z[plane % 2] = inward.z;
    planes.offset[plane % 2] = offset;
  }

  std::array<Planes, 3> planes_;  // the last one twice
};

}  // namespace quoin
