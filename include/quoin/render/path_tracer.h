#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <quoin/core/image.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/environment.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>

namespace [[gnu::visibility("default")]] quoin {

/// Settings of a path-traced image.
struct PathOptions {
  int width = 1280;
  int height = 720;
  int samples = 64;          ///< per pixel, 1 to 65,536
  int max_bounces = 8;       ///< 0 to 1,024: maximum number of bounces between surfaces on a path
  int max_scatterings = 64;  ///< 0 to 1,024: maximum number of additional scattering events in fog and clouds on a path
  std::uint32_t seed = 0;
  std::optional<Environment> environment{};  ///< replaces the scene's environment
  Lens lens{};
  bool layers = false;   ///< fill PathImage's layers
  bool denoise = false;  ///< remove noise within surfaces; keeps edges of objects, shadows and colours

  bool operator==(const PathOptions&) const = default;
};

/// A path-traced image in linear light, with data for compositing. Each array has one value per pixel, rows from the
/// top.
struct PathImage {
  int width = 0;
  int height = 0;
  std::vector<Vec3> radiance;  ///< means of the samples, including the background
  std::vector<Vec3> scene;     ///< as radiance, without the visible background: radiance over black
  std::vector<float> alpha;    ///< share of samples that show the scene or its shadow; 0 to 1
  // Layers: the first surface in each pixel that is not glass; empty unless PathOptions::layers is set.
  std::vector<Vec3> albedo;      ///< means; black where there is no surface
  std::vector<Vec3> normal;      ///< means, in world space; not of unit length
  FloatImage depth;              ///< of the first sample, as RenderedImage::depth
  std::vector<VoxelType> types;  ///< of the first sample; kAir: no surface
  /// Instance in the first sample: 1 + InstanceHandle::index (see SlotMap::handle_at); 0: no instance.
  std::vector<std::uint32_t> instances;
  std::int64_t rays = 0;        ///< of every kind
  std::int64_t pixels_hit = 0;  ///< pixels with at least one sample that shows the scene
};

/// Renders images by path tracing: the sun as a disc, a sky, emissive voxels, up to `max_bounces` bounces, gloss, metal
/// and refractive glass. Images converge to the exact result for that number of bounces; until then they have noise.
///
/// Light:       of `environment_of`: a sun of 1 shows a white surface that faces it as 1. A voxel of emission
///              1 shows its own colour and lights others as such a surface does.
/// Surfaces:    glTF's metallic-roughness model, energy-conserving: white stays white. A non-metal of roughness 1 is
///              matte, without gloss.
/// Glass:       glass that the camera sees, directly or by reflection, refracts by the types' `ior` and absorbs by path
///              length. Light between surfaces passes glass straight and tinted: no caustics. The part that alpha
///              covers is matte.
/// Textures:    as in CpuRenderer, always with the texels of mipmap level 0. Types with VoxelProperties::scattering
///              have their mean colour.
/// Fog, clouds: light scatters any number of times in Environment::fog and in transparent types with
///              VoxelProperties::scattering.
/// Lamps:       emissive faces and Scene::lamps are sampled with a light tree. Emissive fields and glass are hit only
///              by chance. The emissive sides of a shape together light other surfaces as a whole voxel does.
///
/// Lifetime: as CpuRenderer.
class PathTracer {
 public:
  /// Builds the acceleration structures of the instances that `filter` accepts. Copies only the voxel data that
  /// traversal and shading need.
  explicit PathTracer(const Scene& scene, InstanceFilter filter = InstanceFilter::Visible, Threads threads = {});
  /// Deleted because the scene must outlive the tracer.
  explicit PathTracer(Scene&&, InstanceFilter = InstanceFilter::Visible, Threads = {}) = delete;
  PathTracer(PathTracer&&) noexcept;
  PathTracer& operator=(PathTracer&&) noexcept;
  ~PathTracer();

  /// Applies all changes of the scene, as CpuRenderer::update.
  void update(Threads threads = {});

  /// Renders one image. The bits are the same for any number of threads and any instruction set.
  ///
  /// Requires: the camera's axes are perpendicular.
  /// Errors:   InvalidArgument, with the option's name, if an option is out of range or not finite, `check` rejects the
  ///           environment, SkyModel::Image has an image without pixels, there are more than 2^28
  ///           pixels, or CpuRenderer rejects the camera. Cancelled if `progress` returns false; it is called after
  ///           every few samples of a tile.
  /// Memory:   28 bytes per pixel, 62 with layers, about 300 more during `denoise`; 2 MB per thread. The tracer keeps
  ///           the sky between calls.
  [[nodiscard]] Result<PathImage> render(const Camera& camera, const PathOptions& options = {}, Threads threads = {},
                                         const Progress& progress = {}) const;

 private:
  struct [[gnu::visibility("hidden")]] Impl;
  std::unique_ptr<Impl> impl_;
};

/// Returns the exposure that maps an image to middle tones; 1 for a black image.
///
/// Neutral: the log-average luminance becomes 0.18, and the brightest 1 % stays within 4 times white. Pixels with an
///          alpha above 0.5 count without the background, others with it; black pixels do not count.
/// Others:  the developed image, including the background, has the same mean byte as under the neutral curve.
[[nodiscard]] double find_exposure(const PathImage& image, ToneCurve tone = ToneCurve::Neutral);

/// Converts the image to sRGB bytes, including the background.
/// Errors: InvalidArgument, with the option's name, if a DevelopOptions value is out of range.
/// Memory: with bloom, two additional copies of the light.
[[nodiscard]] Result<Image> develop(const PathImage& image, const DevelopOptions& options = {});

/// Converts the scene without the background to sRGB bytes, with the coverage of each pixel as alpha.
/// Errors: as `develop`.
[[nodiscard]] Result<AlphaImage> develop_with_alpha(const PathImage& image, const DevelopOptions& options = {});

}  // namespace quoin
