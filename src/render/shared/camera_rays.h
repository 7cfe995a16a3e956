#pragma once

#include <algorithm>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/scene/camera.h>
#include <quoin/trace/packet.h>

namespace quoin {

/// A position in a pixel, 0 to 1 from its upper left corner.
struct PixelPoint {
  double x = 0.5;
  double y = 0.5;
};

/// Returns the position of sample `index` within every pixel. The first is the centre; all form a low-discrepancy
/// sequence.
///
/// Source: M. Roberts, "The unreasonable effectiveness of quasirandom sequences" (2018): R2.
[[nodiscard]] PixelPoint sample_point(int index);

/// The rays of an image, relative to the camera's position (view space).
class CameraRays {
 public:
  /// Pixels across and pixels down. Cost of a block: 16 square roots.
  static constexpr int kBlock = 4;

  CameraRays(const Camera& camera, int width, int height);

  /// Makes the rays of the 4x4 pixels from (`column`, `row`); lane x + 4 y. Directions are unit, so distances are in
  /// world units. Pixels outside the image are inactive.
  void block(int column, int row, PixelPoint point, RayPacket& rays) const;
  /// Returns the sky height of a ray that hits nothing: the y of its direction. Orthographic rays are all parallel, so
  /// they use the directions of a perspective camera of 50 degrees.
  [[nodiscard]] float sky_up(const RayPacket& rays, std::size_t lane) const;

  // For renderers that make rays elsewhere: pixel (x, y) lies at corner + x right + y down; for a perspective camera at
  // distance 1.
  [[nodiscard]] bool is_perspective() const { return is_perspective_; }
  [[nodiscard]] DVec3 forward() const { return forward_; }
  [[nodiscard]] DVec3 right() const { return right_; }
  [[nodiscard]] DVec3 down() const { return down_; }
  [[nodiscard]] DVec3 corner() const { return corner_; }
  /// Orthographic: converts the distance from the image's centre to the tangent of an angle.
  [[nodiscard]] double sky_scale() const { return sky_scale_; }

 private:
  int width_;
  int height_;
  bool is_perspective_;
  DVec3 forward_;
  double sky_scale_ = 0.0;  // orthographic: converts the distance from the image's centre to the tangent of an angle
  // Per pixel to the right and down, and the image's upper left corner, at distance 1.
  DVec3 right_;
  DVec3 down_;
  DVec3 corner_;
};

/// Returns a ray's hit on a face, in the grid: `position`, which is exact except for rounding, moved onto the face.
[[nodiscard]] inline DVec3 on_face(DVec3 position, IVec3 voxel, Direction face) {
  // Secondary rays start at least this far inside the face that was hit, in voxels, so that they start in front of it
  // despite rounding.
  constexpr double kRim = 1e-6;
  const FaceFrame& frame = frame_of(face);
  const double front = frame.sign > 0 ? 1.0 : 0.0;
  // Selects instead of indexing with a late-known axis: an indexed write would stall the following read.
  const auto along = [&](int axis, double at, int cell) {
    const auto low = static_cast<double>(cell);
    return axis == frame.axis ? low + front : std::clamp(at, low + kRim, low + (1.0 - kRim));
  };
  return {along(0, position.x, voxel.x), along(1, position.y, voxel.y), along(2, position.z, voxel.z)};
}

}  // namespace quoin
