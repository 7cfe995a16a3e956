#pragma once

#include <cstdint>
#include <limits>

#include <quoin/core/result.h>
#include <quoin/mesh/smooth.h>

namespace [[gnu::visibility("default")]] quoin {

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

/// The method of lighting surfaces, the same for every renderer; the Environment describes the light itself. Occlusion
/// and Normals shading draws transparent voxels as opaque and shows black from inside voxels. Only Lit shading applies
/// the environment's exposure.
struct LightOptions {
  Shading shading = Shading::Lit;
  LightModel model = LightModel::Rays;  ///< of Shading::Lit
  bool shadows = true;
  OcclusionMode occlusion_mode = OcclusionMode::Rays;
  OcclusionAffects occlusion_affects = OcclusionAffects::Ambient;
  int occlusion_rays = 9;  ///< 6: the reference's set; 9: the symmetric set; other counts are spread per pixel
  double occlusion_distance_voxels = 6.0;
  /// Scales occlusion_distance_voxels at surfaces of fields, 0 to 1,024. Caves are wider than rooms made of blocks and
  /// need longer rays to show their shape. With a reach r > 1, a share of 0.3 (1 - 1 / r) of the rays may be blocked
  /// without darkening: long rays also meet the ground around open slopes. Darker points are brightened in proportion.
  double field_occlusion_reach = 1.0;
  SmoothOcclusionOptions smooth_occlusion{};                                ///< of OcclusionMode::Smooth
  double shadow_distance_voxels = std::numeric_limits<double>::infinity();  ///< occluders farther away cast no shadow
  /// Maximum number of light sources that light a surface, each with shadows. Light sources are Scene::lamps and
  /// emissive voxels, grouped in cells of 4^3. Chosen per brick of 16^3 voxels: the sources within reach that can
  /// contribute most. 0: none; emissive voxels only show their own emission. 64 is enough for most scenes. A source
  /// fades out where it contributes less than 1/4096.
  int max_lamps = 0;
  /// Minimum light everywhere, for LightModel::Propagated. With 0, closed rooms are black.
  double least_light = 0.0;
  /// Draws reflections on glass and water. Where a ray enters, leaves or crosses between transparent bodies, the
  /// surface reflects the sky, weighted by the Fresnel term of the types' `ior`. Rays are not refracted. Requires
  /// Shading::Lit; for rasterised meshes see MeshImageOptions::glass_by_rays.
  bool glass_surfaces = false;

  bool operator==(const LightOptions&) const = default;
};

/// Returns the default options of the command-line tool and the viewer: lamps, reflecting glass, and occlusion that
/// shows the shape of caves. LightOptions{} is the reference model, whose images never change.
[[nodiscard]] LightOptions natural_light();

/// Checks that all options are valid.
/// Errors: InvalidArgument, with the option's name, if a number is not finite (except shadow_distance_voxels, which can
///         be infinite) or out of range: fewer than 1 or more than 4,096 occlusion rays, a negative distance, a field
///         occlusion reach outside 0 to 1,024, a least light outside 0 to 1e9, or a lamp count outside 0 to 1,024.
[[nodiscard]] Status check(const LightOptions& options);

}  // namespace quoin
