#include <quoin/render/path_tracer.h>

#include <mutex>

#include "core/moved_from.h"
#include "render/path/denoise.h"
#include "render/path/path_lamps.h"
#include "render/path/path_request.h"
#include "render/path/path_tile.h"
#include "render/path/sky_light.h"
#include "render/shared/image_request.h"
#include "scene/surfaces.h"
#include "scene/tracer/scene_view.h"

namespace quoin {

struct PathTracer::Impl {
  Impl(const Scene& of_scene, InstanceFilter filter, Threads threads)
      : scene(&of_scene),
        tracer(of_scene, filter, threads),
        surfaces(decode_textures(of_scene.types, threads), Clouds::Scatter),
        environment(environment_of(of_scene)) {}

  const Scene* scene;
  SceneTracer tracer;
  Surfaces surfaces;
  Environment environment;

  [[nodiscard]] std::shared_ptr<const path::PathLamps> lamps(double brightness) {
    const std::lock_guard lock(mutex_);
    if (made_ == nullptr || made_of_ != brightness) {
      made_ = cache_.lamps(*scene, placed_in(tracer), surfaces, brightness);
      made_of_ = brightness;
    }
    return made_;
  }
  void forget_lamps() {
    const std::lock_guard lock(mutex_);
    made_ = nullptr;
  }
  // Returns the sky light; reuses the last image's if the sky is the same.
  [[nodiscard]] std::shared_ptr<const path::SkyLight> sky(const Environment& wanted) {
    const std::lock_guard lock(mutex_);
    if (sky_ == nullptr || !path::is_same_sky(sky_of_, wanted)) {
      sky_ = std::make_shared<const path::SkyLight>(wanted);
      sky_of_ = wanted;
    }
    return sky_;
  }

 private:
  std::mutex mutex_;
  path::PathLampCache cache_;
  std::shared_ptr<const path::PathLamps> made_;  // null: out of date
  double made_of_ = 0.0;
  std::shared_ptr<const path::SkyLight> sky_;
  Environment sky_of_;
};

PathTracer::PathTracer(const Scene& scene, InstanceFilter filter, Threads threads)
    : impl_(std::make_unique<Impl>(scene, filter, threads)) {}
PathTracer::PathTracer(PathTracer&&) noexcept = default;
PathTracer& PathTracer::operator=(PathTracer&&) noexcept = default;
PathTracer::~PathTracer() = default;

void PathTracer::update(Threads threads) {
  Impl& impl = impl_of(impl_);
  impl.tracer.update(threads);
  impl.surfaces.update(impl.scene->types);
  impl.environment = environment_of(*impl.scene);
  impl.forget_lamps();
}

Result<PathImage> PathTracer::render(const Camera& camera, const PathOptions& asked, Threads threads,
                                     const Progress& progress) const {
  Impl& impl = impl_of(impl_);
  const PathOptions options = with_environment(asked, impl.environment);
  const Environment& environment = *options.environment;
  if (const Status status = path::check(camera, options); !status) return status.error();
  const SceneView view(impl.tracer, camera.position);
  const std::shared_ptr<const path::PathLamps> lamps = impl.lamps(environment.lamp_brightness);
  const std::shared_ptr<const path::SkyLight> sky = impl.sky(environment);
  const CameraRays rays(camera, options.width, options.height);
  std::optional<path::SurfaceParts> parts;
  if (options.denoise) parts.emplace(options.width, options.height);
  const std::span<const PlacedGrid> placed = placed_in(impl.tracer);
  const path::FaceNormals face_normals = path::face_normals(placed);
  const path::TileContext context{&view,
                                  placed,
                                  &face_normals,
                                  &impl.surfaces,
                                  lamps.get(),
                                  sky.get(),
                                  &rays,
                                  &camera,
                                  &options,
                                  &environment,
                                  parts ? &*parts : nullptr,
                                  environment.fog.has_value() || impl.surfaces.has_clouds()};
  PathImage image = path::empty_image(options);
  if (Status drawn = draw_tiles<path::PathTile>(context, options, threads, progress, image); !drawn)
    return drawn.error();
  if (parts) path::denoise(*parts, options.samples, threads, image);
  return image;
}

}  // namespace quoin
