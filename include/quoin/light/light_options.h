#pragma once

#include <cstdint>
#include <limits>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/mesh/smooth.h>
#include <quoin/scene/look.h>

namespace quoin {

/// Where ambient occlusion comes from.
enum class OcclusionMode : std::uint8_t {
  Off,
  Rays,    ///< short rays over the face's hemisphere
  Vertex,  ///< the occlusion of the face's four corners, interpolated over its triangles, as blocky meshes carry it:
           ///< it knows of the face's own grid only. Fields, which have no such corners, have Rays
  Smooth,  ///< of fields as their smooth meshes carry it (smooth_occlusion), at every point: it knows of the own field
           ///< only, and costs half of what rays do. Blocks have Vertex. CpuRenderer alone marches it; VulkanRenderer
           ///< refuses it, VulkanMeshRenderer takes it as Vertex
};

/// What ambient occlusion darkens.
enum class OcclusionAffects : std::uint8_t {
  Ambient,  ///< the ambient term only; lowest 0
  All,      ///< everything, times 1 - 0.75 * occlusion
};

/// What the colour of a surface says.
enum class Shading : std::uint8_t {
  Lit,                 ///< the sun, ambient light and emission: the reference model
  Unlit,               ///< the voxels' own colours, nothing else
  UnlitWithOcclusion,  ///< own colours times 1 - 0.75 * occlusion: the classic block look, without any light
  Occlusion,           ///< occlusion alone, in grey: a pixel's byte is 255 (1 - occlusion)
  Normals,             ///< of faces, in the world, as colours: bytes are 255 (0.5 + 0.5 n)
};

/// Where the light of a surface comes from.
enum class LightModel : std::uint8_t {
  /// The reference model: a sun with shadows, ambient light with occlusion, lamps.
  Rays,
  /// Light in game time (PropagatedLight): levels that spread through each grid by itself, from the sky along its own y
  /// and from voxels that emit, smooth over faces and surfaces (SurfaceLight), as colours by light_colour; times
  /// 1 - 0.75 * occlusion. Scene::lamps, shadows and the sun's direction mean nothing, other grids throw no shadow. It
  /// needs no rays but those of OcclusionMode::Rays.
  Propagated,
};

/// How surfaces are lit; the same for every renderer. Where values are shown instead of colours (Occlusion, Normals)
/// what is transparent is drawn as if it were not, and what is seen from inside is black. Only Lit knows an exposure.
struct LightOptions {
  DVec3 sun{0.371, 0.743, 0.223};  ///< from the surface towards the sun; any length but 0
  Shading shading = Shading::Lit;
  LightModel model = LightModel::Rays;  ///< of Shading::Lit
  bool shadows = true;
  OcclusionMode occlusion_mode = OcclusionMode::Rays;
  OcclusionAffects occlusion_affects = OcclusionAffects::Ambient;
  int occlusion_rays = 9;  ///< 6: the reference's set; 9: the symmetric one; others are spread per pixel
  double occlusion_distance_voxels = 6.0;
  double field_occlusion_reach = 1.0;  ///< times occlusion_distance_voxels at surfaces of fields, 0 to 1,024: caves,
                                       ///< which are wider than rooms of blocks, get their shape from longer rays
  SmoothOcclusionOptions smooth_occlusion{};                                ///< of OcclusionMode::Smooth
  double shadow_distance_voxels = std::numeric_limits<double>::infinity();  ///< beyond it nothing casts a shadow
  double exposure = 1.0;        ///< times all light of a surface, before it is clamped to 0..1
  double sun_brightness = 1.0;  ///< times the sun's light; 0: night
  double sky_brightness = 1.0;  ///< times the ambient light, and the sky behind everything
  /// Whether the colours of the sky, of the ambient light and of the sun follow how high the sun stands in the world
  /// (+Y is up): day, golden hour, dusk, night. A sun below the horizon lights nothing. Without, it is always day.
  bool sky_follows_sun = false;
  /// How many lamps (Scene::lamps, and voxels that emit light, by cells of 4^3) light a surface at most, each with its
  /// shadow: of those that reach a brick of 16^3 voxels, those that can add most to it. 0: none, and what emits light
  /// only shows it. 64 is plenty. A lamp fades out where it adds less than 1/4096.
  int max_lamps = 0;
  double lamp_brightness = 1.0;  ///< times what lamps add to others; what they show of themselves stays as it is
  double least_light = 0.0;      ///< of LightModel::Propagated: what shines everywhere; with 0 closed rooms are black
  /// Whether glass and water have surfaces: where a ray goes from air into a body, out of it again or from one body
  /// into another, it shows the sky of the mirrored direction by Fresnel's share, of the types' `ior`. Rays go straight
  /// on. Shading::Lit; what is rasterised from meshes has them as MeshPictureOptions::glass_by_rays says.
  bool glass_surfaces = false;

  bool operator==(const LightOptions&) const = default;
};

/// What the command-line tool and the viewer draw in until they are told otherwise: a sun beside the camera of
/// View::Iso, so that one sees shadows, a sky that follows it, lamps, and surfaces of glass. LightOptions{} is the
/// reference model, whose pictures stay what they are.
[[nodiscard]] LightOptions natural_light();

/// The counterpart of `natural_light` for path-traced images.
struct NaturalLook {
  Look look;
  DevelopOptions develop;
  Vec3 ground_colour{0.5F};  ///< GroundPlane::colour where the user asks for a ground; linear
};

/// Returns the environment, exposure and tone curve of the command-line tool and the viewer under `sky`, for scenes
/// whose file has no render settings. `sun` points towards the sun; any length but 0. Look{} and DevelopOptions{} are
/// the library's defaults and differ.
///
/// Gradient:    the default: a pale background and bright shadows. While the sun sinks from 4 to 14 degrees below the
///              horizon the exposure rises to four times that of the day; the tone curve would leave the night black.
/// Physical:    twice the light, which a clear sky's dark blue shadows need.
/// Uniform:     colours as they are and a white ground: a white surface is as white as the background.
/// Environment: the image's own light.
[[nodiscard]] NaturalLook natural_look(SkyModel sky = SkyModel::Gradient, DVec3 sun = natural_light().sun);

/// Errors: InvalidArgument, with the option's name, when a number is not finite (but for shadow_distance_voxels) or out
///         of range: a sun of length 0, fewer than 1 or more than 4,096 occlusion rays, negative distances or exposure,
///         brightness or least light of less than 0 or more than 1e9, fewer than 0 or more than 1,024 lamps.
[[nodiscard]] Status check(const LightOptions& options);

}  // namespace quoin
