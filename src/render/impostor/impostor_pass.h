#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/parallel.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/render/impostor.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene_tracer.h>

#include "render/impostor/impostor_screen.h"
#include "render/impostor/raster/raster.h"
#include "render/shared/image_detail.h"
#include "render/shared/image_request.h"
#include "scene/tracer/scene_view.h"

namespace quoin {

/// The face of an impostor that lights the hit, for the lanes whose bit is set.
struct FarFaces {
  std::uint32_t found = 0;
  RayPacket::Lanes<const ImpostorFaces::Face*> face{};
  RayPacket::Lanes<const ImpostorFaces::Surfel*> surfel{};  ///< null: the face is a voxel's
  std::uint32_t in_shape = 0;                               ///< lanes whose surfel is a piece of a shape

  /// Returns the start of light rays for a point on a lane's surfel, in the grid.
  [[nodiscard]] DVec3 start_of_light(std::size_t lane, const DVec3& point) const {
    QUOIN_ASSERT(surfel[lane] != nullptr && face[lane] != nullptr, "a lane that found a surfel");
    return surfel[lane]->start_of_light(point, DVec3(face[lane]->voxel), face[lane]->direction);
  }
  /// Moves a point onto a lane's piece of a shape, as `on_face` does for a voxel. `point`: in the grid.
  [[nodiscard]] DVec3 on_shape(std::size_t lane, DVec3 point) const;
};

/// The far instances of one image: the tiles where each may be visible, and the hits of rays on them.
class ImpostorPass {
 public:
  static constexpr int kTile = raster::kTile;  ///< pixels; blocks of rays lie in one tile

  /// All arguments except the camera must outlive it. Cost: O(far instances + tiles that they touch).
  ImpostorPass(const SceneTracer& tracer, std::span<const FarInstance> far, const Camera& camera, int width,
               int height);

  /// Returns true if an instance may be visible in the tile from (`column`, `row`), multiples of kTile.
  [[nodiscard]] bool may_show(int column, int row) const { return !bin_of(column, row).empty(); }

  /// Draws the impostors visible in that tile, for one sample ray per pixel. Cost: about 10 ns per rectangle.
  void draw(int column, int row, int sample, raster::Canvas& canvas) const;

  /// Replaces `hits` by nearer hits on far instances, for the 4x4 pixels from (`column`, `row`), whose rays from the
  /// camera are `rays_in_view`. Hits report the faces and voxels used for lighting, and the sides of shapes.
  /// Requires: `canvas` belongs to the tile.
  void find(int column, int row, const RayPacket& rays_in_view, const raster::Canvas& canvas, SceneHits& hits,
            FarFaces& faces) const;

 private:
  void fill_bins();
  [[nodiscard]] const std::vector<std::uint32_t>& bin_of(int column, int row) const;
  [[nodiscard]] static bool is_hidden(const DrawnImpostor& drawn, const raster::Job& job, const raster::Canvas& canvas);
  // Returns the distance along a ray to the plane of an axis-aligned rectangle.
  [[nodiscard]] static double distance_to(const DrawnImpostor& drawn, const ImpostorFaces::Level& level,
                                          std::size_t number, const Ray& ray);
  [[nodiscard]] static double distance_to_surfel(const DrawnImpostor& drawn, const ImpostorFaces::Face& face,
                                                 const ImpostorFaces::Surfel& surfel, const Ray& ray);

  int width_;
  int height_;
  int across_;
  int down_;
  DVec3 forward_;
  raster::Draw draw_;
  std::vector<DrawnImpostor> drawn_;              // in the order of `placed`
  std::vector<std::vector<std::uint32_t>> bins_;  // by tile: indices into `drawn_`, nearest first
};

/// Draws far instances into an image that was rendered without them.
///
/// Chooses the views nearest to the camera's direction in the instance's own frame, and intersects each pixel's ray
/// with the faces of these views. Silhouettes, depth and roll are therefore correct between views. Light is as in
/// CpuRenderer, with shadows traced through all of `scene`. Exceptions: with OcclusionMode::Rays, occlusion is the
/// unoccluded share of nine rays of 6 voxels from the face's centre against the grid only; lamps and propagated light
/// add no light.
///
/// Depth:    the nearer surface wins against the image; among far instances at equal depth the lower handle wins.
///           Pixels without any part of an instance keep colour and depth.
/// Left out: instances whose content's centre is behind the camera's plane, on it or not finite; instances whose
///           content's radius spans less than a pixel; instances that `scene` does not hold or holds halved;
///           transparent parts of voxels and fields.
///
/// Requires: CpuRenderer accepts the camera and the options; the light model is LightModel::Rays; `image` has the
///           size of the options, and depth. Takes one sample per pixel, at its centre.
void draw_impostors(const SceneTracer& scene, std::span<const FarInstance> far, const Camera& camera,
                    const RenderOptions& options, RenderedImage& image, Threads threads = {});

/// Returns the indices in SceneTracer::placed of the far instances in a tracer.
[[nodiscard]] std::vector<std::int32_t> placed_of(const SceneTracer& tracer, std::span<const FarInstance> far);

}  // namespace quoin
