#include <bit>
#include <memory>
#include <vector>

#include <glm/common.hpp>

#include <quoin/core/assert.h>
#include <quoin/render/impostor.h>

#include "core/srgb.h"
#include "light/lighting.h"
#include "render/camera_rays.h"
#include "render/image_request.h"
#include "render/impostor/pass.h"

namespace quoin {
namespace {

constexpr int kTile = ImpostorPass::kTile;
constexpr int kBlock = CameraRays::kBlock;

// Draws one square of the image.
class FarTile {
 public:
  FarTile(const ImpostorPass& pass, const SceneView& view, const CameraRays& rays, const Lighting& lighting,
          OcclusionMode mode, RenderedImage& image)
      : pass_(&pass), view_(&view), rays_(&rays), lighting_(&lighting), mode_(mode), image_(&image) {}

  void draw(int column, int row) {
    pass_->draw(column, row, 0, *far_);
    RayPacket rays;
    for (int y = row; y < row + kTile; y += kBlock) {
      for (int x = column; x < column + kTile; x += kBlock) {
        rays_->block(x, y, PixelPoint{}, rays);
        if (rays.active != 0) draw_block(x, y, rays);
      }
    }
    std::vector<Vec3> lit(points_.size());
    lighting_->light(points_, lit);
    const SrgbEncoder& encode = SrgbEncoder::shared();
    for (std::size_t i = 0; i < lit.size(); ++i) {
      // The minimum comes second, so that NaN becomes 0.
      const Vec3 colour = glm::min(glm::max(Vec3(0.0F), lit[i]), Vec3(1.0F));
      for (int channel = 0; channel < 3; ++channel) {
        image_->colour.rgb[3 * pixels_[i] + static_cast<std::size_t>(channel)] = encode(colour[channel]);
      }
    }
  }

 private:
  void draw_block(int column, int row, const RayPacket& rays) {
    SceneHits hits;
    FarFaces faces;
    hits.grids.hit = hits.grids.starts_inside = hits.in_field = 0;
    pass_->find(column, row, rays, *far_, hits, faces);
    for (std::uint32_t left = faces.found; left != 0; left &= left - 1) {
      const int lane = std::countr_zero(left);
      const auto i = static_cast<std::size_t>(lane);
      const auto pixel = static_cast<std::size_t>(row + lane / kBlock) * static_cast<std::size_t>(image_->depth.width) +
                         static_cast<std::size_t>(column + lane % kBlock);
      const auto depth = static_cast<float>(hits.grids.t[i]);
      if (!(depth < image_->depth.values[pixel])) continue;
      image_->depth.values[pixel] = depth;
      const Ray ray = rays.ray(lane);
      SurfacePoint& point = points_.emplace_back();
      point.voxel = {hits.grids.x[i], hits.grids.y[i], hits.grids.z[i]};
      point.face = hits.grids.face[i];
      point.placed = hits.placed[i];
      point.position = view_->grid_from_view(point.placed).point(ray.origin + ray.direction * hits.grids.t[i]);
      point.in_field = (hits.in_field >> lane & 1U) != 0;
      if (point.in_field) {
        point.normal = hits.normal(i);
        point.position = faces.start_of_light(i, point.position);
        point.lift = ImpostorFaces::kSurfelLift;
        point.is_blended = true;
      } else {
        point.position = on_face(point.position, point.voxel, point.face);
      }
      point.type = faces.face[i]->type;
      point.openness = openness_of(*faces.face[i], mode_, point.position);
      pixels_.push_back(pixel);
    }
  }

  const ImpostorPass* pass_;
  const SceneView* view_;
  const CameraRays* rays_;
  const Lighting* lighting_;
  OcclusionMode mode_;
  RenderedImage* image_;
  std::unique_ptr<raster::Canvas> far_ = std::make_unique<raster::Canvas>();
  std::vector<SurfacePoint> points_;
  std::vector<std::size_t> pixels_;
};

}  // namespace

void draw_impostors(const SceneTracer& scene, std::span<const FarInstance> far, const Camera& camera,
                    const RenderOptions& options, RenderedImage& image, Threads threads) {
  QUOIN_ASSERT(check(camera, options).has_value(), "a camera and options that CpuRenderer accepts");
  QUOIN_ASSERT(options.light.model == LightModel::Rays, "ray-traced light");
  QUOIN_ASSERT(image.colour.width == options.width && image.colour.height == options.height &&
                   image.depth.width == options.width && image.depth.height == options.height,
               "an image of the options' size, with depth");
  const SceneView view(scene, camera.position);
  const VoxelRegistry& types = scene.scene().types;
  const Surfaces surfaces(types);
  const Lighting lighting(view, types, surfaces, options.light);
  const CameraRays rays(camera, options.width, options.height);
  const ImpostorPass pass(scene, far, camera, options.width, options.height);
  const int across = (options.width + kTile - 1) / kTile;
  const int down = (options.height + kTile - 1) / kTile;
  parallel_for(static_cast<std::size_t>(across * down), threads, [&](std::size_t i) {
    const int column = static_cast<int>(i) % across * kTile;
    const int row = static_cast<int>(i) / across * kTile;
    if (pass.may_show(column, row))
      FarTile(pass, view, rays, lighting, options.light.occlusion_mode, image).draw(column, row);
  });
}

}  // namespace quoin
