#pragma once

#include <cstdint>
#include <limits>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/mesh/smooth.h>
#include <quoin/scene/look.h>

namespace quoin {

/// Method that computes ambient occlusion.
enum class OcclusionMode : std::uint8_t {
  Off,
  Rays,  ///< short rays over the face's hemisphere
  /// Occlusion of the face's four corners, interpolated over its triangles, as in blocky meshes. Considers only the
  /// face's own grid. Fields use Rays.
  Vertex,
  /// Occlusion of smooth meshes (smooth_occlusion), evaluated at every visible point of a field. Considers only the
  /// field itself and costs half as much as rays. Blocks use Vertex. Only CpuRenderer supports it when ray marching:
  /// VulkanRenderer returns Unsupported, and VulkanMeshRenderer treats it as Vertex.
  Smooth,
};

/// Selects the light that ambient occlusion darkens.
enum class OcclusionAffects : std::uint8_t {
  Ambient,  ///< the ambient term only, down to 0
  All,      ///< all light, times 1 - 0.75 * occlusion
};

/// Selects the quantity that a surface's colour shows.
enum class Shading : std::uint8_t {
  Lit,                 ///< sun, ambient light and emission: the reference model
  Unlit,               ///< the voxels' own colours only
  UnlitWithOcclusion,  ///< own colours times 1 - 0.75 * occlusion: the classic block look, without light
  Occlusion,           ///< occlusion only, in grey: a pixel's byte is 255 (1 - occlusion)
  Normals,             ///< world-space face normals as colours: bytes are 255 (0.5 + 0.5 n)
};

/// Selects the light model of lit surfaces.
enum class LightModel : std::uint8_t {
  /// The reference model: a sun with shadows, ambient light with occlusion, lamps.
  Rays,
  /// Real-time light (PropagatedLight): light levels that spread through each grid separately, from the sky along the
  /// grid's y and from emissive voxels. Levels are smoothed over faces and surfaces (SurfaceLight), converted to
  /// colours by light_colour and multiplied by 1 - 0.75 * occlusion. Scene::lamps, `shadows` and the sun's direction
  /// have no effect, and grids cast no shadows on each other. Only OcclusionMode::Rays needs rays.
  Propagated,
};

/// Lighting of surfaces, the same for every renderer. Occlusion and Normals shading draws transparent voxels as opaque
/// and shows black from inside voxels. Only Lit shading applies the exposure.
struct LightOptions {
  DVec3 sun{0.371, 0.743, 0.223};  ///< direction towards the sun; any length except 0
  Shading shading = Shading::Lit;
  LightModel model = LightModel::Rays;  ///< of Shading::Lit
  bool shadows = true;
  OcclusionMode occlusion_mode = OcclusionMode::Rays;
  OcclusionAffects occlusion_affects = OcclusionAffects::Ambient;
  int occlusion_rays = 9;  ///< 6: the reference's set; 9: the symmetric set; other counts are spread per pixel
  double occlusion_distance_voxels = 6.0;
  /// Scales occlusion_distance_voxels at surfaces of fields, 0 to 1,024. Caves are wider than rooms made of blocks and
  /// need longer rays to show their shape.
  double field_occlusion_reach = 1.0;
  SmoothOcclusionOptions smooth_occlusion{};                                ///< of OcclusionMode::Smooth
  double shadow_distance_voxels = std::numeric_limits<double>::infinity();  ///< occluders farther away cast no shadow
  double exposure = 1.0;        ///< scales all light of a surface before it is clamped to 0..1
  double sun_brightness = 1.0;  ///< scales the sun's light; 0: night
  double sky_brightness = 1.0;  ///< scales the ambient light and the sky in the background
  /// Derives the colours of sky, ambient light and sun from the sun's height in the world (+Y is up): day, golden hour,
  /// dusk, night. A sun below the horizon gives no light. If false, it is always day.
  bool sky_follows_sun = false;
  /// Maximum number of light sources that light a surface, each with shadows. Light sources are Scene::lamps and
  /// emissive voxels, grouped in cells of 4^3. Chosen per brick of 16^3 voxels: the sources within reach that can
  /// contribute most. 0: none; emissive voxels only show their own emission. 64 is enough for most scenes. A source
  /// fades out where it contributes less than 1/4096.
  int max_lamps = 0;
  /// Scales the light that lamps and emissive voxels cast; their own appearance does not change.
  double lamp_brightness = 1.0;
  /// Minimum light everywhere, for LightModel::Propagated. With 0, closed rooms are black.
  double least_light = 0.0;
  /// Draws reflections on glass and water. Where a ray enters, leaves or crosses between transparent bodies, the
  /// surface reflects the sky, weighted by the Fresnel term of the types' `ior`. Rays are not refracted. Requires
  /// Shading::Lit; for rasterised meshes see MeshImageOptions::glass_by_rays.
  bool glass_surfaces = false;

  bool operator==(const LightOptions&) const = default;
};

/// Returns the default light of the command-line tool and the viewer: a sun to the side of the View::Iso camera,
/// so that shadows are visible, a sky that follows the sun, lamps, and reflecting glass. LightOptions{} is the
/// reference model, whose images never change.
[[nodiscard]] LightOptions natural_light();

/// The counterpart of `natural_light` for path-traced images.
struct NaturalLook {
  Look look;
  DevelopOptions develop;
  Vec3 ground_colour{0.5F};  ///< default GroundPlane::colour for a requested ground; linear
};

/// Returns the environment, exposure and tone curve of the command-line tool and the viewer under `sky`, for scenes
/// whose file has no render settings. `sun` points towards the sun; any length except 0. The library defaults, Look{}
/// and DevelopOptions{}, differ.
///
/// Gradient:    the default: a pale background and bright shadows. While the sun sinks from 4 to 14 degrees below the
///              horizon, the exposure rises to four times the daytime exposure; otherwise the tone curve would leave
///              the night black.
/// Physical:    twice the light, because shadows under a clear, dark blue sky need it.
/// Uniform:     unchanged colours and a white ground: a white surface is as white as the background.
/// Environment: only the light of the environment image.
[[nodiscard]] NaturalLook natural_look(SkyModel sky = SkyModel::Gradient, DVec3 sun = natural_light().sun);

/// Checks that all options are valid.
/// Errors: InvalidArgument, with the option's name, if a number is not finite (except shadow_distance_voxels, which can
///         be infinite) or out of range: a sun of length 0, fewer than 1 or more than 4,096 occlusion rays, a negative
///         distance or exposure, a field occlusion reach outside 0 to 1,024, a brightness or least light outside 0 to
///         1e9, or a lamp count outside 0 to 1,024.
[[nodiscard]] Status check(const LightOptions& options);

}  // namespace quoin
