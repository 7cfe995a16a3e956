#include "render/impostor/impostor_pass.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/render/impostor.h>

#include "core/srgb.h"
#include "render/impostor/seen_faces.h"
#include "render/light/lighting.h"
#include "render/shared/image_request.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {
namespace {

constexpr int kBlock = CameraRays::kBlock;
constexpr std::size_t kLanes = RayPacket::kSize;
// Parts per instance in job numbers: the levels, and the unseen faces.
constexpr std::int32_t kParts = ImpostorFaces::kLevels + 1;

// Returns the index of an instance in SceneTracer::placed; -1 if it is not there.
std::int32_t index_of(const BlockVector<PlacedGrid>& placed, InstanceHandle instance) {
  const auto found =
      std::lower_bound(placed.begin(), placed.end(), instance,
                       [](const PlacedGrid& grid, InstanceHandle handle) { return grid.instance < handle; });
  if (found == placed.end() || found->instance != instance) return -1;
  return static_cast<std::int32_t>(found - placed.begin());
}

}  // namespace

std::vector<std::int32_t> placed_of(const SceneTracer& tracer, std::span<const FarInstance> far) {
  std::vector<std::int32_t> indices;
  for (const FarInstance& instance : far) {
    const std::int32_t index = index_of(placed_in(tracer), instance.instance);
    if (index >= 0) indices.push_back(index);
  }
  return indices;
}

DVec3 FarFaces::on_shape(std::size_t lane, DVec3 point) const {
  QUOIN_ASSERT(surfel[lane] != nullptr && (in_shape >> lane & 1U) != 0, "a lane that found a piece of a shape");
  constexpr double kRim = 1e-6;  // as in `on_face`
  const ImpostorFaces::Surfel& piece = *surfel[lane];
  const FaceFrame& frame = frame_of(face[lane]->direction);
  const DVec3 middle = piece.middle(DVec3(face[lane]->voxel), face[lane]->direction);
  double rise = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    const auto axis = static_cast<int>(k == 0 ? frame.u : frame.v);
    const double reach = std::max(piece.half[k] - kRim, 0.0);
    point[axis] = std::clamp(point[axis], middle[axis] - reach, middle[axis] + reach);
    rise += piece.slope[k] * (point[axis] - middle[axis]);
  }
  point[frame.axis] = middle[frame.axis] + rise;
  return point;
}

ImpostorPass::ImpostorPass(const SceneTracer& tracer, std::span<const FarInstance> far, const Camera& camera, int width,
                           int height)
    : width_(width),
      height_(height),
      across_((width + kTile - 1) / kTile),
      down_((height + kTile - 1) / kTile),
      forward_(camera.forward),
      draw_(raster::draw()) {
  const BlockVector<PlacedGrid>& placed = placed_in(tracer);
  const ImpostorScreen screen(camera, width, height);
  for (const FarInstance& instance : far) {
    const std::int32_t index = index_of(placed, instance.instance);
    if (index < 0 || instance.impostor == nullptr) continue;
    const auto drawn = screen.drawn(placed[static_cast<std::size_t>(index)], index, *instance.impostor);
    if (drawn) drawn_.push_back(*drawn);
  }
  std::stable_sort(drawn_.begin(), drawn_.end(),
                   [](const DrawnImpostor& a, const DrawnImpostor& b) { return a.placed < b.placed; });
  fill_bins();
}

void ImpostorPass::fill_bins() {
  bins_.resize(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_));
  std::vector<std::uint32_t> order(drawn_.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return drawn_[a].nearest < drawn_[b].nearest; });
  for (const std::uint32_t i : order) {
    const PixelArea& area = drawn_[i].area;
    for (int y = area.top / kTile; y <= (area.bottom - 1) / kTile; ++y) {
      for (int x = area.left / kTile; x <= (area.right - 1) / kTile; ++x) {
        bins_[static_cast<std::size_t>(y * across_ + x)].push_back(i);
      }
    }
  }
}

const std::vector<std::uint32_t>& ImpostorPass::bin_of(int column, int row) const {
  QUOIN_ASSERT(column >= 0 && column < width_ && row >= 0 && row < height_, "a pixel of the image");
  return bins_[static_cast<std::size_t>(row / kTile * across_ + column / kTile)];
}

void ImpostorPass::draw(int column, int row, int sample, raster::Canvas& canvas) const {
  canvas.clear();
  const PixelPoint point = sample_point(sample);
  const double x = column + point.x - 0.5 * width_;
  const double y = row + point.y - 0.5 * height_;
  const std::vector<std::uint32_t>& bin = bin_of(column, row);
  if (std::any_of(bin.begin(), bin.end(), [&](std::uint32_t i) { return drawn_[i].coarser > 0; })) {
    canvas.set_pattern(column, row, static_cast<std::uint32_t>(sample));
  }
  raster::Job job;
  job.views = kAllImpostorViews;
  for (const std::uint32_t i : bin) {
    const DrawnImpostor& drawn = drawn_[i];
    const PixelArea& area = drawn.area;
    job.left = std::max(area.left - column, 0), job.right = std::min(area.right - column, kTile);
    job.top = std::max(area.top - row, 0), job.bottom = std::min(area.bottom - row, kTile);
    if (is_hidden(drawn, job, canvas)) continue;
    raster::set_aim(drawn.aim, x, y, job);
    std::array<DrawnImpostor::Part, DrawnImpostor::kMaxParts> room;
    for (const DrawnImpostor::Part& part : drawn.parts(room)) {
      job.id = static_cast<std::int32_t>(i) * kParts + static_cast<std::int32_t>(part.level);
      job.level = &drawn.faces->level(part.level);
      job.share = part.share;
      job.near = drawn.near;
      draw_(job, canvas);
    }
  }
}

bool ImpostorPass::is_hidden(const DrawnImpostor& drawn, const raster::Job& job, const raster::Canvas& canvas) {
  for (int y = job.top / kBlock; y <= (job.bottom - 1) / kBlock; ++y) {
    for (int x = job.left / kBlock; x <= (job.right - 1) / kBlock; ++x) {
      if (!(canvas.furthest[raster::index_of(x * kBlock, y * kBlock) / kLanes] < drawn.nearest)) return false;
    }
  }
  return true;
}

double ImpostorPass::distance_to(const DrawnImpostor& drawn, const ImpostorFaces::Level& level, std::size_t number,
                                 const Ray& ray) {
  QUOIN_ASSERT(number < level.count(), "a rectangle of the level");
  const auto after = std::upper_bound(level.begin.begin(), level.begin.end(), static_cast<std::uint32_t>(number));
  const std::size_t axis = static_cast<std::size_t>(after - level.begin.begin() - 1) / 2;
  const auto a = static_cast<int>(axis);
  const double plane = level.centre[axis][number];
  const DVec3 row{drawn.axes[0][a], drawn.axes[1][a], drawn.axes[2][a]};
  return ((plane - drawn.offset[a]) * drawn.aim.voxel_size - glm::dot(row, ray.origin)) / glm::dot(row, ray.direction);
}

double ImpostorPass::distance_to_surfel(const DrawnImpostor& drawn, const ImpostorFaces::Face& face,
                                        const ImpostorFaces::Surfel& surfel, const Ray& ray) {
  const FaceFrame& frame = frame_of(face.direction);
  DVec3 upright(0.0);
  upright[frame.axis] = 1.0;
  upright[frame.u] = -double{surfel.slope[0]};
  upright[frame.v] = -double{surfel.slope[1]};
  const DVec3 centre = surfel.middle(DVec3(face.voxel) - drawn.faces->centre, face.direction);
  const DVec3 in_view = upright * drawn.axes;  // the transposed matrix times it
  return (glm::dot(upright, centre - drawn.offset) * drawn.aim.voxel_size - glm::dot(in_view, ray.origin)) /
         glm::dot(in_view, ray.direction);
}

void ImpostorPass::find(int column, int row, const RayPacket& rays, const raster::Canvas& canvas, SceneHits& hits,
                        FarFaces& faces) const {
  faces.found = faces.in_shape = 0;
  const std::size_t first = raster::index_of(column % kTile, row % kTile);
  for (std::uint32_t left = rays.active; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const auto i = static_cast<std::size_t>(lane);
    const std::uint32_t bit = 1U << lane;
    if (std::isinf(canvas.depth[first + i])) continue;
    const std::int32_t id = canvas.id[first + i];
    QUOIN_ASSERT(id >= 0 && static_cast<std::size_t>(id / kParts) < drawn_.size(), "an id of this pass");
    const DrawnImpostor& drawn = drawn_[static_cast<std::size_t>(id / kParts)];
    const ImpostorFaces::Level& level = drawn.faces->level(static_cast<std::size_t>(id % kParts));
    const raster::Met met = raster::Met::of(canvas.face[first + i]);
    const std::size_t number = raster::face_of(level, met);
    QUOIN_ASSERT(number < drawn.faces->faces.size(), "a face of the impostor");
    const ImpostorFaces::Face& face = drawn.faces->faces[number];
    const Ray ray = rays.ray(lane);
    double t = 0.0;
    if (!level.cells.empty()) {
      t = (canvas.depth[first + i] - glm::dot(ray.origin, forward_)) / glm::dot(ray.direction, forward_);
    } else if (met.rectangle < level.begin[ImpostorFaces::kSides / 2]) {
      t = distance_to(drawn, level, met.rectangle, ray);
    } else {
      t = distance_to_surfel(drawn, face, drawn.faces->surfel_of(number), ray);
    }
    const bool is_hit = (hits.grids.hit & bit) != 0;
    if (is_hit ? hits.grids.t[i] < t || (hits.grids.t[i] == t && hits.placed[i] < drawn.placed) : rays.max_t[i] < t) {
      continue;
    }
    hits.grids.set(lane, {face.voxel, face.direction, t, false});
    hits.grids.starts_inside &= ~bit;
    hits.placed[i] = drawn.placed;
    hits.in_field &= ~bit;
    hits.in_shape &= ~bit;
    faces.surfel[i] = drawn.faces->has_surfel(number) ? &drawn.faces->surfel_of(number) : nullptr;
    if (const ImpostorFaces::ShapeSide* const shape = drawn.faces->shape_of(number); shape != nullptr) {
      hits.shapes[i] = {t,         face.voxel,  shape->model,   faces.surfel[i]->normal,
                        face.type, shape->face, face.direction, false};
      hits.in_shape |= bit;
      faces.in_shape |= bit;
    }
    if (face.in_field) {
      const Vec3 normal = faces.surfel[i]->normal;
      hits.normal_x[i] = normal.x, hits.normal_y[i] = normal.y, hits.normal_z[i] = normal.z;
      hits.material[i] = face.type;
      hits.in_field |= bit;
    }
    faces.found |= bit;
    faces.face[i] = &face;
  }
}

namespace {

constexpr int kTile = ImpostorPass::kTile;

// Draws one square of the image.
class FarTile {
 public:
  FarTile(const ImpostorPass& pass, const SceneView& view, const CameraRays& rays, const Lighting& lighting,
          OcclusionMode mode, RenderedImage& image)
      : pass_(&pass),
        view_(&view),
        types_(&view.tracer().scene().types),
        rays_(&rays),
        lighting_(&lighting),
        mode_(mode),
        image_(&image) {}

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
    hits.grids.hit = hits.grids.starts_inside = hits.in_field = hits.in_shape = 0;
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
      point.is_far = true;
      point.position = view_->grid_from_view(point.placed).point(ray.origin + ray.direction * hits.grids.t[i]);
      point.in_field = (hits.in_field >> lane & 1U) != 0;
      if (point.in_field) {
        point.normal = hits.normal(i);
        point.position = faces.start_of_light(i, point.position);
        point.lift = ImpostorFaces::kSurfelLift;
        point.is_blended = true;
      } else if ((faces.in_shape >> lane & 1U) != 0) {
        put_on_shape(*hits.shapes[i].model, hits.shapes[i].face, hits.shapes[i].normal, point);
        point.position = faces.on_shape(i, point.position);
      } else {
        point.position = on_face(point.position, point.voxel, point.face);
      }
      point.type = faces.face[i]->type;
      if (types_->is_turned_by_state(point.type)) {
        turn_by_state(placed_in(view_->tracer())[static_cast<std::size_t>(point.placed)], *types_, point);
      }
      point.openness = openness_of(*faces.face[i], mode_, point.position);
      pixels_.push_back(pixel);
    }
  }

  const ImpostorPass* pass_;
  const SceneView* view_;
  const VoxelRegistry* types_;
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
  const Environment environment = options.environment.value_or(environment_of(scene.scene()));
  QUOIN_ASSERT(check(camera, options).has_value(), "a camera and options that CpuRenderer accepts");
  QUOIN_ASSERT(options.light.model == LightModel::Rays, "ray-traced light");
  QUOIN_ASSERT(image.colour.width == options.width && image.colour.height == options.height &&
                   image.depth.width == options.width && image.depth.height == options.height,
               "an image of the options' size, with depth");
  const SceneView view(scene, camera.position);
  const VoxelRegistry& types = scene.scene().types;
  const Surfaces surfaces(types);
  Lighting lighting(view, types, surfaces, options.light, environment);
  const CameraRays rays(camera, options.width, options.height);
  if (types.has_textures() || types.has_shapes())
    lighting.show_textures(glm::length(rays.down()), rays.is_perspective());
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
