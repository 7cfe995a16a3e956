#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include <quoin/core/direction.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/camera.h>
#include <quoin/trace/packet.h>

#include "core/work/progress_steps.h"

namespace quoin {

/// Returns InvalidArgument for sizes and cameras that every renderer rejects.
[[nodiscard]] Status check_image(const Camera& camera, int width, int height);

/// Returns the argument errors of CpuRenderer::render, which all renderers share.
[[nodiscard]] Status check(const Camera& camera, const RenderOptions& options);

/// Returns the options of an image with the environment set: their own, or that of the scene.
template <class Options>
[[nodiscard]] Options with_environment(Options options, const Environment& of_scene) {
  if (!options.environment) options.environment = of_scene;
  return options;
}

/// Returns an image of the requested size, with depths if requested.
[[nodiscard]] RenderedImage empty_image(const RenderOptions& options);

/// Draws an image in squares of Tile::kEdge pixels. `Tile(context, column, row)`, given the upper left pixel, draws its
/// samples and writes them to the image. Reports one or several samples of a tile at a time, because a tile with many
/// samples can take minutes. Errors: Cancelled.
template <class Tile, class Context, class Options, class Drawn>
[[nodiscard]] Status draw_tiles(const Context& context, const Options& options, Threads threads,
                                const Progress& progress, Drawn& image) {
  const auto across = static_cast<std::size_t>((options.width + Tile::kEdge - 1) / Tile::kEdge);
  const auto down = static_cast<std::size_t>((options.height + Tile::kEdge - 1) / Tile::kEdge);
  ProgressSteps done(progress, across * down * static_cast<std::size_t>(options.samples));
  std::atomic<std::int64_t> rays{0};
  std::atomic<std::int64_t> pixels_hit{0};
  parallel_for(across * down, threads, [&](std::size_t i) {
    if (done.cancelled()) return;
    Tile tile(context, static_cast<int>(i % across) * Tile::kEdge, static_cast<int>(i / across) * Tile::kEdge);
    if (!tile.render([&](std::size_t samples) { return done.add(static_cast<double>(samples)); })) return;
    tile.write_to(image);
    rays += tile.rays();
    pixels_hit += tile.pixels_hit();
  });
  if (done.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  image.rays = rays;
  image.pixels_hit = pixels_hit;
  return {};
}

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
