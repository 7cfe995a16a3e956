#pragma once

#include <algorithm>
#include <vector>

#include <quoin/core/vec.h>

#include "light/surfaces.h"
#include "scene/tracer/scene_view.h"

namespace quoin {

/// A run of transparent voxels, or of what is transparent of a field, of one type along a ray: one piece of glass,
/// whatever grids and chunks it lies in.
struct GlassBody {
  std::int32_t placed = 0;  ///< the grid in which the ray enters it
  IVec3 voxel{0};           ///< where it enters; the cell of a field
  Direction face = Direction::PosX;
  VoxelType type = kAir;
  bool starts_inside = false;
  double t_enter = 0.0;
  double t_exit = 0.0;
  double voxels = 0.0;                    ///< length inside, in voxels of the grids
  std::int32_t exit_placed = 0;           ///< the grid in which the ray leaves it
  Direction exit_face = Direction::PosX;  ///< and the face through which
  bool in_field = false;                  ///< it enters through a field's surface: `face` means nothing
  bool exit_in_field = false;             ///< likewise where it leaves
  VoxelType before = kAir;  ///< of a field: another transparent material of it that ends where this one begins
};

/// The bodies that a ray passes before `max_t`, nearest first. `out` is cleared first. Deep inside a body that lets
/// nothing through any more the list ends.
void find_glass(const SceneView& view, const Surfaces& surfaces, const Ray& ray_in_view, double max_t,
                std::vector<GlassBody>& out);

/// How a body looks to whoever looks through it.
struct GlassLook {
  Vec3 passed{1.0F};  ///< what of each channel comes through
  float own = 0.0F;   ///< the share of the body's own colour; `passed` and `own` together are at most 1
};

/// A length of a material lets through what Beer and Lambert say, and shows its own colour in place of what it does not
/// let see past. A body of voxels that a ray enters counts as one voxel long at least, so that its edges are crisp; one
/// of a field has no edges, and is as thin at its shores as it is.
[[nodiscard]] GlassLook look_of(const Surface& surface, const GlassBody& body);

/// Whether the ray is in the body still, or just out of it, at `t`: so another body that begins there, or a surface,
/// touches it.
[[nodiscard]] inline bool reaches(const GlassBody& body, double t) {
  constexpr double kTouching = 1e-6;  // the rounding of placed grids
  return t <= body.t_exit + kTouching * std::max(1.0, body.t_exit);
}

/// Whether something opaque at `t` leaves no air behind the body: a hundredth of a voxel is none, so that it does not
/// matter how grids that stand on each other are rounded.
[[nodiscard]] bool lies_on_opaque(const SceneView& view, const Ray& ray_in_view, const GlassBody& body, double t);

/// What a surface between two media does to a ray.
struct Mirror {
  float share = 0.0F;  ///< of what is seen: it comes from the mirrored direction
  float up = 0.0F;     ///< the y of that direction, a unit vector
};

/// The normal of a body's surface where a ray enters it, and where it leaves it into air: out of it, in the grid in
/// which that is (`placed`, `exit_placed`), of unit length, or 0. Cost: of fields a microsecond.
[[nodiscard]] DVec3 normal_entered(const SceneView& view, const Ray& ray_in_view, const GlassBody& body);
[[nodiscard]] DVec3 normal_left(const SceneView& view, const Ray& ray_in_view, const GlassBody& body);

/// Of a surface in a placed grid with that normal, between media of these indices of refraction: Fresnel's equations
/// without polarisation. Since rays go straight on, their angle is taken for that in the thinner medium, on whichever
/// side they come from: through both faces of a pane the same share is mirrored, as with refraction, and never all.
[[nodiscard]] Mirror mirror_at(const SceneView& view, const Ray& ray_in_view, std::int32_t placed,
                               const DVec3& normal_in_grid, float ior, float other_ior);

/// What of each channel passes through everything transparent on a ray.
[[nodiscard]] Vec3 transmittance_along(const SceneView& view, const Surfaces& surfaces, const Ray& ray_in_view,
                                       double max_t);

}  // namespace quoin
