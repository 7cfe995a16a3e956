#pragma once

#include <array>
#include <cmath>

#include <quoin/core/vec.h>
#include <quoin/scene/camera.h>

namespace quoin {

/// What a camera's picture shows of the world, as five half-spaces: its four edges, and what is not behind it.
///
/// Space: the world's axes and units, with the camera's position as origin.
class Frustum {
 public:
  /// Requires: width and height are positive; the camera's axes are perpendicular. They may be a little off unit
  /// length: the planes are those of `ray_through`.
  Frustum(const Camera& camera, int width, int height);

  /// False only when no ray of the picture meets the sphere; some spheres near the picture's corners count as met.
  /// What is not a number counts as met.
  [[nodiscard]] bool meets(DVec3 centre, double radius) const {
    // Room for rounding, of far centres too.
    constexpr double kRoom = 1e-9;
    const double reach = radius + kRoom * (radius + std::abs(centre.x) + std::abs(centre.y) + std::abs(centre.z));
    bool is_out = false;
    for (const Plane& plane : planes_) {
      const DVec3& inward = plane.inward;
      is_out |= inward.x * centre.x + inward.y * centre.y + inward.z * centre.z < plane.offset - reach;
    }
    return !is_out;
  }

 private:
  struct Plane {
    DVec3 inward{0.0};    ///< unit
    double offset = 0.0;  ///< points p with dot(inward, p) >= offset are inside
  };
  std::array<Plane, 5> planes_;
};

}  // namespace quoin
