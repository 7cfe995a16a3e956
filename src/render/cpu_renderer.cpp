#include <quoin/render/cpu_renderer.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/light/scene_light.h>

#include "core/moved_from.h"
#include "light/light_model.h"
#include "light/surface/light_bricks.h"
#include "render/draw_tiles.h"
#include "render/image_detail.h"
#include "render/image_request.h"
#include "render/impostor/pass.h"
#include "render/tile.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {

struct CpuRenderer::Impl {
  Impl(const Scene& of_scene, InstanceFilter filter, Threads threads)
      : scene(&of_scene),
        instances(filter),
        tracer(of_scene, filter, threads),
        surfaces(of_scene.types),
        detail(threads) {}

  const Scene* scene;
  InstanceFilter instances;
  SceneTracer tracer;
  Surfaces surfaces;
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
  [[nodiscard]] std::shared_ptr<const LampTable> lamp_table(const LightOptions& light, Threads threads) {
    return lamps.table(*scene, light, threads, [this] { return lamp_places(); });
  }
  [[nodiscard]] std::vector<LampPlace> lamp_places() const {
    std::vector<LampPlace> places;
    for (const PlacedGrid& each : placed_in(tracer)) {
      places.push_back(lamp_place(*scene, each, *each.opaque, each.transparent, each.field));
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
  impl_of(impl_).lamps.update();
  impl_of(impl_).levels.update();
}

void CpuRenderer::use_light(const SceneLight* light) {
  impl_of(impl_).levels.use(light);
}

Result<RenderedImage> CpuRenderer::render(const Camera& camera, const RenderOptions& options, Threads threads,
                                          const Progress& progress) const {
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
  const std::shared_ptr<const LampTable> lamps = impl_of(impl_).lamp_table(options.light, threads);
  const Lighting lighting(view, impl_of(impl_).scene->types, impl_of(impl_).surfaces, options.light, lamps.get(),
                          options.detail.colours, impl_of(impl_).levels_of(view.tracer(), options.light, threads));
  const TileContext context{&view, &rays, &lighting, &options, subject.impostors ? &*subject.impostors : nullptr};
  RenderedImage image = empty_image(options);
  if (Status drawn = draw_tiles<Tile>(context, options, threads, progress, image); !drawn) return drawn.error();
  return image;
}

}  // namespace quoin
