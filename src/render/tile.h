#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/render/cpu_renderer.h>

#include "light/glass_bodies.h"
#include "light/lighting.h"
#include "render/camera_rays.h"
#include "render/impostor/pass.h"
#include "scene/tracer/scene_view.h"

namespace quoin {

/// The data shared by all tiles of an image.
struct TileContext {
  const SceneView* view = nullptr;
  const CameraRays* camera = nullptr;
  const Lighting* lighting = nullptr;
  const RenderOptions* options = nullptr;
  const ImpostorPass* impostors = nullptr;  ///< null if there are none
};

/// One square of an image: its rays, their hits, and the light at the hits.
class Tile {
 public:
  static constexpr int kEdge = 32;  ///< pixels; a multiple of CameraRays::kBlock
  static_assert(kEdge == ImpostorPass::kTile);

  /// `column` and `row`: its upper left pixel.
  Tile(const TileContext& context, int column, int row);

  /// Renders all samples of all pixels. The numbers do not depend on the tile's size and position.
  ///
  /// Calls `goes_on(1)` after each sample. If that returns false, this returns false and the tile must not be used.
  [[nodiscard]] bool render(const std::function<bool(std::size_t)>& goes_on);
  /// Writes the pixels within the image.
  void write_to(RenderedImage& image) const;

  [[nodiscard]] std::int64_t rays() const { return rays_; }
  [[nodiscard]] std::int64_t pixels_hit() const { return pixels_hit_; }

 private:
  static constexpr std::size_t kPixels = std::size_t{kEdge} * kEdge;

  void take_sample(int sample);
  void take_block(int x, int y, const RayPacket& rays, int sample);
  [[nodiscard]] std::uint32_t lanes_through_glass(const RayPacket& rays, const SceneHits& hits) const;
  void add_opaque(int lane, const RayPacket& rays, const SceneHits& hits, std::size_t pixel, Vec3 weight);
  // The effect of glass on a ray.
  struct Sight {
    Vec3 passed{1.0F};    // transmittance for the light behind
    Vec3 mirrored{0.0F};  // light reflected by surfaces
  };
  // Adds the glass visible before `max_t`, without the reflections of its surfaces.
  Sight add_glass(const Ray& ray, double max_t, std::size_t pixel);
  // Processes a ray's entry into a body from air (null) or from a touching body. `normal`: of that surface, in its
  // grid.
  void enter_body(const Ray& ray, const GlassBody* from, const GlassBody& to, const DVec3& normal, Sight& sight) const;
  // Processes a ray's exit from a body into air.
  void leave_body(const Ray& ray, const GlassBody& from, Sight& sight) const;
  // Adds the surface reflection on the way out of a body, or out of air (null).
  void meet_surface(const Mirror& mirror, const GlassBody* from, Sight& sight) const;
  void fill_in(const Ray& ray, const GlassBody& body, const DVec3& normal, SurfacePoint& point) const;
  // Adds a point for the caller to fill in; its light counts with `weight` in that pixel.
  SurfacePoint& add_point(std::size_t pixel, Vec3 weight);
  void light_points();

  const TileContext* context_;
  int column_;
  int row_;
  std::uint32_t sample_seed_ = 0;
  int sample_number_ = 0;
  std::int64_t rays_ = 0;
  std::int64_t pixels_hit_ = 0;
  std::array<Vec3, kPixels> sum_{};     // of the samples so far
  std::array<Vec3, kPixels> sample_{};  // of the current sample
  std::array<float, kPixels> depth_{};
  // A point to be lit for the current sample, with its pixel and weight.
  struct Target {
    std::uint32_t pixel = 0;
    Vec3 weight{1.0F};
  };
  std::vector<SurfacePoint> points_;
  std::vector<Target> targets_;
  std::vector<Vec3> lit_;
  std::vector<GlassBody> glass_;
  std::unique_ptr<raster::Canvas> far_;  // of the current sample; null if there are none
  FarFaces far_faces_;                   // of the current block
};

}  // namespace quoin
