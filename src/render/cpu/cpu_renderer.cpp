#include <quoin/render/cpu_renderer.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/render/propagated_light.h>

#include "core/moved_from.h"
#include "core/srgb.h"
#include "render/impostor/impostor_pass.h"
#include "render/light/glass_bodies.h"
#include "render/light/light_model.h"
#include "render/light/lighting.h"
#include "render/light/surface/light_bricks.h"
#include "render/shared/image_detail.h"
#include "render/shared/image_request.h"
#include "scene/tracer/placed_grid.h"
#include "scene/tracer/scene_view.h"

namespace quoin {
namespace {

constexpr int kBlock = CameraRays::kBlock;
// Light that passes less than this share is not seen: a sixteenth of the smallest step of an 8-bit image.
constexpr float kUnseen = 1.6e-5F;

bool is_unseen(Vec3 passed) {
  return std::max(std::max(passed.x, passed.y), passed.z) < kUnseen;
}

// The data shared by all tiles of an image.
struct TileContext {
  const SceneView* view = nullptr;
  const CameraRays* camera = nullptr;
  const Lighting* lighting = nullptr;
  const RenderOptions* options = nullptr;
  const ImpostorPass* impostors = nullptr;  // null if there are none
};

// One square of an image: its rays, their hits, and the light at the hits.
class Tile {
 public:
  static constexpr int kEdge = 32;  // pixels; a multiple of CameraRays::kBlock
  static_assert(kEdge == ImpostorPass::kTile);

  // `column` and `row`: its upper left pixel.
  Tile(const TileContext& context, int column, int row);

  // Renders all samples of all pixels. The numbers do not depend on the tile's size and position.
  //
  // Calls `goes_on(1)` after each sample. If that returns false, this returns false and the tile must not be used.
  [[nodiscard]] bool render(const std::function<bool(std::size_t)>& goes_on);
  // Writes the pixels within the image.
  void write_to(RenderedImage& image) const;

  [[nodiscard]] std::int64_t rays() const { return rays_; }
  [[nodiscard]] std::int64_t pixels_hit() const { return pixels_hit_; }

 private:
  static constexpr std::size_t kPixels = std::size_t{kEdge} * kEdge;

  void take_sample(int sample);
  void take_block(int x, int y, const RayPacket& rays, int sample);
  // Finds the transparent content in front of the hits. Returns the rays that may meet some.
  [[nodiscard]] std::uint32_t find_through(const RayPacket& rays, const SceneHits& hits);
  void add_opaque(int lane, const RayPacket& rays, const SceneHits& hits, std::size_t pixel, Vec3 weight);
  // The effect of glass on a ray.
  struct Sight {
    Vec3 passed{1.0F};       // transmittance for the light behind
    Vec3 mirrored{0.0F};     // light reflected by surfaces
    bool is_closed = false;  // nothing behind is visible
  };
  // Adds the transparent content visible before `max_t`, without the reflections of its surfaces.
  // Not inlined: the loop over pixels stays small.
  __attribute__((noinline)) Sight add_transparent(const Ray& ray, int lane, double max_t, std::size_t pixel);
  void add_face(const Ray& ray, const MetFace& face, std::size_t pixel, Sight& sight);
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
  BlockVector<SurfacePoint> points_;
  BlockVector<Target> targets_;
  BlockVector<Vec3> lit_;
  ThroughHits through_;                  // of the current block
  SeenThrough seen_;                     // of the current ray
  std::unique_ptr<raster::Canvas> far_;  // of the current sample; null if there are none
  FarFaces far_faces_;                   // of the current block
};

Tile::Tile(const TileContext& context, int column, int row) : context_(&context), column_(column), row_(row) {
  QUOIN_ASSERT(column >= 0 && row >= 0, "a pixel of the image");
  QUOIN_ASSERT(
      context.view != nullptr && context.camera != nullptr && context.lighting != nullptr && context.options != nullptr,
      "a context with a view, a camera, light and options");
  points_.reserve(kPixels);
  targets_.reserve(kPixels);
  if (context.impostors != nullptr && context.impostors->may_show(column, row))
    far_ = std::make_unique<raster::Canvas>();
}

bool Tile::render(const std::function<bool(std::size_t)>& goes_on) {
  const int samples = context_->options->samples;
  for (int sample = 0; sample < samples; ++sample) {
    take_sample(sample);
    for (std::size_t i = 0; i < kPixels; ++i) {
      // The minimum comes second, so that NaN becomes 0.
      sum_[i] += glm::min(glm::max(Vec3(0.0F), sample_[i]), Vec3(1.0F));
    }
    if (!goes_on(1)) return false;
  }
  return true;
}

void Tile::take_sample(int sample) {
  points_.clear();
  targets_.clear();
  sample_seed_ = hash_of(static_cast<std::uint32_t>(sample), 0);
  sample_number_ = sample;
  const PixelPoint point = sample_point(sample);
  if (far_ != nullptr) context_->impostors->draw(column_, row_, sample, *far_);
  RayPacket rays;
  for (int y = 0; y < kEdge; y += kBlock) {
    for (int x = 0; x < kEdge; x += kBlock) {
      context_->camera->block(column_ + x, row_ + y, point, rays);
      if (rays.active != 0) take_block(x, y, rays, sample);
    }
  }
  light_points();
}

void Tile::take_block(int x, int y, const RayPacket& rays, int sample) {
  SceneHits hits;
  context_->view->first_hits(rays, hits);
  rays_ += std::popcount(rays.active);
  if (far_ != nullptr) context_->impostors->find(column_ + x, row_ + y, rays, *far_, hits, far_faces_);
  const std::uint32_t through_glass = find_through(rays, hits);
  for (std::uint32_t left = rays.active; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    const auto i = static_cast<std::size_t>(lane);
    const auto pixel = static_cast<std::size_t>((y + lane / kBlock) * kEdge + x + lane % kBlock);
    const bool is_hit = (hits.grids.hit >> lane & 1U) != 0;
    const double t = is_hit ? hits.grids.t[i] : std::numeric_limits<double>::infinity();
    double begin = t;
    Sight sight;
    if ((through_glass >> lane & 1U) != 0) {
      sight = add_transparent(rays.ray(lane), lane, t, pixel);
      begin = std::min(t, seen_.begin());
    }
    if (sample == 0) {
      depth_[pixel] = static_cast<float>(begin);
      pixels_hit_ += begin < std::numeric_limits<double>::infinity();
    }
    sample_[pixel] = sight.mirrored;
    if (sight.is_closed) continue;
    if (is_hit) {
      add_opaque(lane, rays, hits, pixel, sight.passed);
    } else {
      sample_[pixel] += sight.passed * context_->lighting->sky(context_->camera->sky_up(rays, i));
    }
  }
}

std::uint32_t Tile::find_through(const RayPacket& rays, const SceneHits& hits) {
  if (!context_->view->tracer().has_transparent()) return 0;
  RayPacket visible = rays;
  for (std::size_t i = 0; i < RayPacket::kSize; ++i) {
    if ((hits.grids.hit >> i & 1U) != 0) visible.max_t[i] = hits.grids.t[i];
  }
  context_->view->find_through(visible, through_);
  return through_.glass | through_.faces;
}

void Tile::add_opaque(int lane, const RayPacket& rays, const SceneHits& hits, std::size_t pixel, Vec3 weight) {
  const auto i = static_cast<std::size_t>(lane);
  const Ray ray = rays.ray(lane);
  SurfacePoint& point = add_point(pixel, weight);
  point.voxel = {hits.grids.x[i], hits.grids.y[i], hits.grids.z[i]};
  point.face = hits.grids.face[i];
  point.placed = hits.placed[i];
  point.position = context_->view->grid_from_view(point.placed).point(ray.origin + ray.direction * hits.grids.t[i]);
  point.in_field = (hits.in_field >> lane & 1U) != 0;
  if (point.in_field) {
    point.normal = hits.normal(i);
    point.type = hits.material[i];
  } else if ((hits.in_shape >> lane & 1U) != 0) {
    const ShapeHit& hit = hits.shapes[i];
    point.type = hit.type;
    if (hit.face >= 0) put_on_shape(*hit.model, hit.face, hit.normal, point);
  } else {
    point.position = on_face(point.position, point.voxel, point.face);
  }
  if ((hits.grids.starts_inside >> lane & 1U) != 0) point.kind = PointKind::Unlit;
  const bool is_far = (far_faces_.found >> lane & 1U) != 0;
  point.is_blended = point.in_field && point.kind == PointKind::Surface;
  if (!is_far) return;
  point.is_far = true;
  QUOIN_ASSERT(far_faces_.face[i] != nullptr, "a lane that found a far face");
  if (point.in_field) {
    point.position = far_faces_.start_of_light(i, point.position);
    point.lift = ImpostorFaces::kSurfelLift;
  } else if ((far_faces_.in_shape >> lane & 1U) != 0) {
    point.position = far_faces_.on_shape(i, point.position);
  }
  point.type = far_faces_.face[i]->type;
  point.openness = openness_of(*far_faces_.face[i], context_->options->light.occlusion_mode, point.position);
}

Tile::Sight Tile::add_transparent(const Ray& ray, int lane, double max_t, std::size_t pixel) {
  const Surfaces& surfaces = context_->lighting->surfaces();
  find_transparent(*context_->view, surfaces, through_, lane, max_t, seen_);
  Sight sight;
  const LightOptions& light = context_->options->light;
  const bool as_solid = shows_values(light.shading);
  const bool has_surfaces = light.glass_surfaces && light.shading == Shading::Lit;
  const GlassBody* last = nullptr;
  auto face = seen_.faces.begin();
  const auto faces_end = seen_.faces.end();
  const auto add_faces = [&](double up_to) {
    for (; face != faces_end && face->t <= up_to; ++face) add_face(ray, *face, pixel, sight);
  };
  for (const GlassBody& body : seen_.bodies) {
    const DVec3 normal = normal_entered(*context_->view, ray, body);
    const bool touches = last != nullptr && reaches(*last, body.t_enter);
    if (has_surfaces && last != nullptr && !touches) {
      add_faces(last->t_exit);
      leave_body(ray, *last, sight);
    }
    add_faces(body.t_enter);
    if (has_surfaces && (touches || !body.starts_inside)) {
      enter_body(ray, touches ? last : nullptr, body, normal, sight);
    }
    last = &body;
    if (as_solid && body.starts_inside) continue;
    if (!as_solid && is_unseen(sight.passed)) break;
    std::optional<Surface> textured;
    const GlassLook look = as_solid ? GlassLook{Vec3(0.0F), 1.0F} : look_of(surface_of(surfaces, body, textured), body);
    fill_in(ray, body, normal, add_point(pixel, sight.passed * look.own));
    sight.passed *= look.passed;
  }
  if (has_surfaces && last != nullptr) {
    add_faces(last->t_exit);
    if (!lies_on_opaque(*context_->view, ray, *last, seen_.end)) leave_body(ray, *last, sight);
  }
  add_faces(std::numeric_limits<double>::infinity());
  sight.is_closed |= !as_solid && is_unseen(sight.passed);
  return sight;
}

void Tile::add_face(const Ray& ray, const MetFace& face, std::size_t pixel, Sight& sight) {
  const bool is_solid = face.cover >= 1.0F || shows_values(context_->options->light.shading);
  SurfacePoint& point = add_point(pixel, is_solid ? sight.passed : sight.passed * face.cover);
  point.voxel = face.voxel;
  point.face = face.face;
  point.shown_side = static_cast<std::uint16_t>(face.side + 1);
  point.placed = face.placed;
  point.type = face.type;
  point.position = on_face(context_->view->grid_from_view(face.placed).point(ray.origin + ray.direction * face.t),
                           face.voxel, face.face);
  sight.passed *= is_solid ? Vec3(0.0F) : face.passed();
  sight.is_closed |= is_solid;
}

void Tile::fill_in(const Ray& ray, const GlassBody& body, const DVec3& normal, SurfacePoint& point) const {
  point.voxel = body.voxel;
  point.face = body.face;
  point.placed = body.placed;
  point.position = context_->view->grid_from_view(body.placed).point(ray.origin + ray.direction * body.t_enter);
  if (body.in_field) {
    point.in_field = true;
    point.normal = Vec3(normal);
    point.face = nearest_direction(normal);
    point.type = body.type;
  } else if (body.model != nullptr) {
    point.type = body.type;
    if (body.shape_face >= 0) put_on_shape(*body.model, body.shape_face, body.normal, point);
  } else {
    point.position = on_face(point.position, body.voxel, body.face);
  }
  // Seen from inside, it tints and glows but has no surface.
  if (body.starts_inside) point.kind = PointKind::Glow;
}

void Tile::enter_body(const Ray& ray, const GlassBody* from, const GlassBody& to, const DVec3& normal,
                      Sight& sight) const {
  const Surfaces& surfaces = context_->lighting->surfaces();
  const float before = from != nullptr ? surfaces[from->type].ior : 1.0F;
  meet_surface(mirror_at(*context_->view, ray, to.placed, normal, before, surfaces[to.type].ior), from, sight);
}

void Tile::leave_body(const Ray& ray, const GlassBody& from, Sight& sight) const {
  const float ior = context_->lighting->surfaces()[from.type].ior;
  const DVec3 normal = normal_left(*context_->view, ray, from);
  meet_surface(mirror_at(*context_->view, ray, from.exit_placed, normal, ior, 1.0F), &from, sight);
}

void Tile::meet_surface(const Mirror& mirror, const GlassBody* from, Sight& sight) const {
  Vec3 mirrored = sight.passed * mirror.share * context_->lighting->sky(mirror.up);
  // From inside, the reflection passes through the body again.
  if (from != nullptr) mirrored *= look_of(context_->lighting->surfaces()[from->type], *from).passed;
  sight.mirrored += mirrored;
  sight.passed *= 1.0F - mirror.share;
}

SurfacePoint& Tile::add_point(std::size_t pixel, Vec3 weight) {
  QUOIN_ASSERT(pixel < kPixels, "a pixel of the tile");
  targets_.push_back({static_cast<std::uint32_t>(pixel), weight});
  SurfacePoint& added = points_.emplace_back();
  const auto x = static_cast<std::uint32_t>(column_) + static_cast<std::uint32_t>(pixel % kEdge);
  const auto y = static_cast<std::uint32_t>(row_) + static_cast<std::uint32_t>(pixel / kEdge);
  added.pixel = hash_of(x, y) ^ sample_seed_;
  return added;
}

void Tile::light_points() {
  const BlockVector<PlacedGrid>& placed = placed_in(context_->view->tracer());
  const VoxelRegistry& types = context_->view->tracer().scene().types;
  const bool has_turned = types.has_turned_by_state();
  std::optional<GridReader> reader;
  std::int32_t known = -1;
  for (SurfacePoint& point : points_) {
    if (point.in_field) continue;
    if (point.placed != known) {
      known = point.placed;
      QUOIN_ASSERT(known >= 0 && static_cast<std::size_t>(known) < placed.size(), "one of the placed grids");
      reader.emplace(*placed[static_cast<std::size_t>(known)].voxels);
    }
    if (point.type == kAir) point.type = reader->get(point.voxel);
    if (has_turned && types.is_turned_by_state(point.type)) {
      turn_by_state(placed[static_cast<std::size_t>(known)], types, point);
    }
  }
  QUOIN_ASSERT(targets_.size() == points_.size(), "one target per point");
  lit_.resize(points_.size());
  rays_ += context_->lighting->light(points_, lit_, sample_number_);
  for (std::size_t i = 0; i < points_.size(); ++i) sample_[targets_[i].pixel] += targets_[i].weight * lit_[i];
}

void Tile::write_to(RenderedImage& image) const {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  const int width = image.colour.width;
  QUOIN_ASSERT(column_ < width && row_ < image.colour.height, "a tile of the image");
  QUOIN_ASSERT(
      image.colour.rgb.size() == 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(image.colour.height),
      "three bytes per pixel");
  const int columns = std::min(kEdge, width - column_);
  const int rows = std::min(kEdge, image.colour.height - row_);
  const auto samples = static_cast<float>(context_->options->samples);
  for (int y = 0; y < rows; ++y) {
    const std::size_t from = static_cast<std::size_t>(y) * kEdge;
    const std::size_t to =
        static_cast<std::size_t>(row_ + y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column_);
    std::uint8_t* rgb = image.colour.rgb.data() + 3 * to;
    for (int x = 0; x < columns; ++x) {
      const Vec3 mean = sum_[from + static_cast<std::size_t>(x)] / samples;
      for (int channel = 0; channel < 3; ++channel) *rgb++ = encode(mean[channel]);
    }
    if (image.depth.values.empty()) continue;
    std::copy_n(depth_.begin() + static_cast<std::ptrdiff_t>(from), columns,
                image.depth.values.begin() + static_cast<std::ptrdiff_t>(to));
  }
}

}  // namespace

struct CpuRenderer::Impl {
  Impl(const Scene& of_scene, InstanceFilter filter, Threads threads)
      : scene(&of_scene),
        instances(filter),
        tracer(of_scene, filter, threads),
        surfaces(decode_textures(of_scene.types, threads)),
        environment(environment_of(of_scene)),
        detail(threads) {}

  const Scene* scene;
  InstanceFilter instances;
  SceneTracer tracer;
  Surfaces surfaces;
  Environment environment;
  DetailChooser detail;
  LampCache lamps;
  LightCache levels;

  // Returns the light levels of each placed grid of `of`; empty for other light models.
  [[nodiscard]] std::vector<GridLight> levels_of(const SceneTracer& of, const LightOptions& light, Threads threads) {
    std::vector<GridLight> found;
    if (!is_propagated(light)) return found;
    const SceneLight& all = levels.light(*scene, threads);
    for (const PlacedGrid& each : placed_in(of)) found.push_back(all.of(scene->instances()[each.instance].grid));
    return found;
  }
  [[nodiscard]] std::shared_ptr<const LampTable> lamp_table(const LightOptions& light, double brightness,
                                                            Threads threads) {
    return lamps.table(*scene, light, brightness, threads, [this] { return lamp_places(); });
  }
  [[nodiscard]] std::vector<LampPlace> lamp_places() const {
    std::vector<LampPlace> places;
    for (const PlacedGrid& each : placed_in(tracer)) {
      places.push_back(lamp_place(*scene, each, *each.opaque, each.transparent, each.field));
      if (each.shapes != nullptr) places.back().shapes = &each.shapes->touched;
    }
    return places;
  }
};

namespace {

// The content of an image.
struct Subject {
  std::optional<SceneTracer> detailed;
  std::optional<SceneView> view;
  std::optional<ImpostorPass> impostors;

  void leave_to_impostors(std::span<const FarInstance> far, const Camera& camera, const RenderOptions& options) {
    if (far.empty()) return;
    impostors.emplace(view->tracer(), far, camera, options.width, options.height);
    view->leave_to_impostors(placed_of(view->tracer(), far));
  }
};

}  // namespace

CpuRenderer::CpuRenderer(const Scene& scene, InstanceFilter filter, Threads threads)
    : impl_(std::make_unique<Impl>(scene, filter, threads)) {}
CpuRenderer::CpuRenderer(CpuRenderer&&) noexcept = default;
CpuRenderer& CpuRenderer::operator=(CpuRenderer&&) noexcept = default;
CpuRenderer::~CpuRenderer() = default;

const SceneTracer& CpuRenderer::tracer() const {
  return impl_of(impl_).tracer;
}

void CpuRenderer::update(Threads threads) {
  impl_of(impl_).tracer.update(threads);
  impl_of(impl_).surfaces.update(impl_of(impl_).scene->types);
  impl_of(impl_).detail.update_types(impl_of(impl_).scene->types);
  impl_of(impl_).environment = environment_of(*impl_of(impl_).scene);
  impl_of(impl_).lamps.update();
  impl_of(impl_).levels.update();
}

void CpuRenderer::use_light(const SceneLight* light) {
  impl_of(impl_).levels.use(light);
}

Result<RenderedImage> CpuRenderer::render(const Camera& camera, const RenderOptions& asked, Threads threads,
                                          const Progress& progress) const {
  const RenderOptions options = with_environment(asked, impl_of(impl_).environment);
  const Environment& environment = *options.environment;
  if (const Status status = check(camera, options); !status) return status.error();
  QUOIN_ASSERT(std::abs(glm::dot(camera.right, camera.up)) < 1e-3 &&
                   std::abs(glm::dot(camera.right, camera.forward)) < 1e-3 &&
                   std::abs(glm::dot(camera.up, camera.forward)) < 1e-3,
               "the camera's axes are perpendicular");
  ImageDetail detail = impl_of(impl_).detail.choose(*impl_of(impl_).scene, impl_of(impl_).instances, camera, options);
  keep_whole(detail.far.instances, detail.selected);
  Subject subject;
  if (options.detail.policy) subject.detailed.emplace(impl_of(impl_).tracer.with_detail(detail.selected, threads));
  subject.view.emplace(subject.detailed ? *subject.detailed : impl_of(impl_).tracer, camera.position);
  subject.leave_to_impostors(detail.far.instances, camera, options);
  const SceneView& view = *subject.view;
  const CameraRays rays(camera, options.width, options.height);
  const std::shared_ptr<const LampTable> lamps =
      impl_of(impl_).lamp_table(options.light, environment.lamp_brightness, threads);
  Lighting lighting(view, impl_of(impl_).scene->types, impl_of(impl_).surfaces, options.light, environment, lamps.get(),
                    options.detail.colours, impl_of(impl_).levels_of(view.tracer(), options.light, threads));
  const VoxelRegistry& types = impl_of(impl_).scene->types;
  if (types.has_textures() || types.has_shapes()) {
    lighting.show_textures(glm::length(rays.down()) / std::sqrt(options.samples), rays.is_perspective());
  }
  const TileContext context{&view, &rays, &lighting, &options, subject.impostors ? &*subject.impostors : nullptr};
  RenderedImage image = empty_image(options);
  if (Status drawn = draw_tiles<Tile>(context, options, threads, progress, image); !drawn) return drawn.error();
  return image;
}

}  // namespace quoin
