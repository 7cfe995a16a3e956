#pragma once

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

}  // namespace quoin
