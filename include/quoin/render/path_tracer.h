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
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>

namespace quoin {

/// Where light comes from that comes from infinitely far away.
enum class SkyModel : std::uint8_t {
  Physical,     ///< a clear sky of the Earth by the sun's height, from noon to night; see AirOptions
  Gradient,     ///< the backdrop of LightOptions::sky_follows_sun
  Uniform,      ///< PathOptions::sky_colour from everywhere
  Environment,  ///< PathOptions::environment
};

/// The air of SkyModel::Physical, as multiples of the Earth's. Of at least 0 and at most 100.
struct AirOptions {
  double rayleigh = 1.0;  ///< what makes the sky blue and the sunset red
  double mie = 1.0;       ///< haze
  double ozone = 1.0;     ///< what keeps the sky blue at dusk
  bool operator==(const AirOptions&) const = default;
};

/// A plane below a scene, level in the world.
struct GroundPlane {
  double height = 0.0;  ///< its y in the world
  Vec3 colour{0.5F};    ///< linear, 0 to 1 each; matte
  /// What is seen of it is the background, darker where less light comes than on open ground, and the scene's shadow
  /// in the alpha of a picture without a background. It throws light back at the scene like any ground.
  bool only_shadows = false;
  bool operator==(const GroundPlane&) const = default;
};

struct PathOptions {
  int width = 1280;
  int height = 720;
  int samples = 64;     ///< a pixel, 1 to 65,536
  int max_bounces = 8;  ///< 0 to 1,024: how often light is scattered at most on its way to the camera, less one
  std::uint32_t seed = 0;

  DVec3 sun{-0.48, 0.72, 0.5};        ///< from the scene towards the sun; any length but 0
  double sun_angle_radians = 0.0093;  ///< of its disc, across; 0: a point, which is not seen itself; at most 3
  double sun_brightness = 1.0;        ///< 1: a white surface that faces it shows 1, before the air; 0: no sun
  SkyModel sky = SkyModel::Physical;
  double sky_brightness = 1.0;                       ///< times the sky's light
  Vec3 sky_colour{1.0F};                             ///< of SkyModel::Uniform, linear
  AirOptions air;                                    ///< of SkyModel::Physical
  std::shared_ptr<const RadianceImage> environment;  ///< of SkyModel::Environment: longitude and latitude, +y up; its
                                                     ///< middle is -z, its right half +x
  double environment_turn_radians = 0.0;             ///< about the vertical, from -z towards +x

  double lamp_brightness = 1.0;  ///< times what lamps and glowing voxels give to others
  std::optional<GroundPlane> ground;

  double lens_radius = 0.0;     ///< world units; more than 0: what is not in focus is blurred. Perspective cameras only
  double focus_distance = 1.0;  ///< world units along the camera's forward axis; more than 0

  bool layers = false;  ///< whether PathPicture's layers are filled

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
  std::vector<Vec3> albedo;              ///< means; black where nothing is
  std::vector<Vec3> normal;              ///< means, in the world; not of unit length
  FloatImage depth;                      ///< of the first sample, as Picture::depth
  std::vector<VoxelType> types;          ///< of the first sample; kAir: nothing
  std::vector<std::uint32_t> instances;  ///< likewise: 1 + the number of the instance among those traced; 0: nothing
  std::int64_t rays = 0;                 ///< of every kind
  std::int64_t pixels_hit = 0;           ///< of which some sample shows the scene
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
  /// Memory:   28 bytes a pixel, 62 with layers.
  [[nodiscard]] Result<PathPicture> render(const Camera& camera, const PathOptions& options = {}, Threads threads = {},
                                           const Progress& progress = {}) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// How linear light becomes the colours of a screen.
enum class ToneCurve : std::uint8_t {
  Clamp,    ///< 0 to 1 as it is: what LightModel::Rays shows
  Neutral,  ///< Khronos PBR Neutral: colours up to 0.8 as they are, what is brighter rolled off, paler
  Agx,      ///< AgX: as film, soft and pale in what is bright
  Aces,     ///< ACES, in the fit of S. Hill: contrast, as MagicaVoxel's pictures have
};

struct DevelopOptions {
  double exposure = 1.0;  ///< times all light
  ToneCurve tone = ToneCurve::Neutral;
};

/// The exposure that shows a picture in the middle of the tones: its scene's mean logarithm of light becomes 0.18, but
/// what is brightest stays within four times white. 1 of a black one.
[[nodiscard]] double find_exposure(const PathPicture& picture);

/// The picture as bytes, sRGB, the background included.
/// Errors: InvalidArgument for an exposure that is not finite or less than 0.
[[nodiscard]] Result<Image> develop(const PathPicture& picture, const DevelopOptions& options = {});

/// The scene alone, and how much of each pixel it covers. Errors: as `develop`.
[[nodiscard]] Result<AlphaImage> develop_with_alpha(const PathPicture& picture, const DevelopOptions& options = {});

}  // namespace quoin
