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
#include <quoin/scene/look.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>

namespace quoin {

/// How a picture by paths is taken; Look says of what light.
struct PathOptions : Look {
  int width = 1280;
  int height = 720;
  int samples = 64;          ///< a pixel, 1 to 65,536
  int max_bounces = 8;       ///< 0 to 1,024: how often light is scattered at most on its way to the camera
  int max_scatterings = 64;  ///< 0 to 1,024: how often light is scattered at most in fog and clouds besides
  std::uint32_t seed = 0;
  bool layers = false;   ///< whether PathPicture's layers are filled
  bool denoise = false;  ///< whether noise is taken out within surfaces; edges stay, also those of shadows and colours

  bool operator==(const PathOptions&) const = default;
};

/// Linear light, and what compositing wants to know besides. Each image has a value a pixel, rows from the top.
struct PathPicture {
  int width = 0;
  int height = 0;
  std::vector<Vec3> radiance;  ///< means of the samples, the background included
  std::vector<Vec3> scene;     ///< the same without what is seen of the background: radiance over black
  std::vector<float> alpha;    ///< the share of samples that show the scene, or its shadow; 0 to 1
  // Layers, of what pixels show first that is no glass; empty unless asked for.
  std::vector<Vec3> albedo;      ///< means; black where nothing is
  std::vector<Vec3> normal;      ///< means, in the world; not of unit length
  FloatImage depth;              ///< of the first sample, as Picture::depth
  std::vector<VoxelType> types;  ///< of the first sample; kAir: nothing
  /// Likewise: 1 + InstanceHandle::index (see SlotMap::handle_at); 0: nothing.
  std::vector<std::uint32_t> instances;
  std::int64_t rays = 0;        ///< of every kind
  std::int64_t pixels_hit = 0;  ///< of which some sample shows the scene
};

/// Light by paths: the sun as a disc, a sky, what voxels emit, any number of bounces, gloss, metal and refracting
/// glass. What pictures converge to is right to the last bounce; until then they have noise.
///
/// Light:    in the units of LightOptions: a sun of 1 shows a white surface that faces it as 1, and a voxel of emission
///           1 shows its own colour and lights others as such a surface does.
/// Surfaces: glTF's metallic-roughness model, lossless: white stays white. A roughness of 1 of what is no metal is
///           matte, without gloss.
/// Glass:    what the camera sees of it, also by its reflections, refracts by the types' `ior` and absorbs by length.
///           Light that goes from surface to surface passes it straight, tinted: no caustics. What alpha covers of it
///           is matte.
/// Fog, clouds: light is scattered in Look::fog, and in transparent types that have VoxelProperties::scattering, any
///           number of times.
/// Lamps:    faces that glow and Scene::lamps are sampled by a light tree. Fields and glass that glow are found by
///           chance.
///
/// Lifetime: as CpuRenderer.
class PathTracer {
 public:
  /// Copies nothing of the voxels but what traversal and shading need. Draws the instances that `filter` lets pass.
  explicit PathTracer(const Scene& scene, InstanceFilter filter = InstanceFilter::Visible, Threads threads = {});
  explicit PathTracer(Scene&&, InstanceFilter = InstanceFilter::Visible, Threads = {}) = delete;  // it must outlive it
  PathTracer(PathTracer&&) noexcept;
  PathTracer& operator=(PathTracer&&) noexcept;
  ~PathTracer();

  /// As CpuRenderer::update.
  void update(Threads threads = {});

  /// One picture. The same bits for any number of threads and any instruction set.
  ///
  /// Requires: the camera's axes are perpendicular.
  /// Errors:   InvalidArgument, with the option's name, for what the options do not allow, numbers that are not finite,
  ///           brightnesses of less than 0 or more than 1e9, SkyModel::Environment without an environment of at least
  ///           a pixel, more than 2^28 pixels, and cameras that CpuRenderer refuses; Cancelled when `progress` returns
  ///           false, which is asked after every few samples of a tile.
  /// Memory:   28 bytes a pixel, 62 with layers, some 300 more while `denoise` runs; 2 MB a thread. It keeps the sky.
  [[nodiscard]] Result<PathPicture> render(const Camera& camera, const PathOptions& options = {}, Threads threads = {},
                                           const Progress& progress = {}) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Returns the exposure that brings an image to middle tones; 1 for a black image.
///
/// Neutral: the scene's mean logarithm of light becomes 0.18, and the brightest 1 % stays within 4 times white.
/// Others:  the developed image, background included, has the same mean byte as under the neutral curve.
[[nodiscard]] double find_exposure(const PathPicture& picture, ToneCurve tone = ToneCurve::Neutral);

/// The picture as bytes, sRGB, the background included.
/// Errors: InvalidArgument, with the option's name, for what DevelopOptions do not allow. Memory: with bloom the light
/// twice more.
[[nodiscard]] Result<Image> develop(const PathPicture& picture, const DevelopOptions& options = {});

/// The scene alone, and how much of each pixel it covers. Errors: as `develop`.
[[nodiscard]] Result<AlphaImage> develop_with_alpha(const PathPicture& picture, const DevelopOptions& options = {});

}  // namespace quoin
