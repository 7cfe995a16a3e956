#pragma once

#include <vector>

#include <quoin/core/vec.h>

#include "light/surfaces.h"
#include "scene/tracer/scene_view.h"

namespace quoin {

/// A run of transparent voxels of one type along a ray: one piece of glass, whatever grids and chunks it lies in.
struct GlassBody {
  std::int32_t placed = 0;  ///< the grid in which the ray enters it
  IVec3 voxel{0};           ///< where it enters
  Direction face = Direction::PosX;
  VoxelType type = kAir;
  bool starts_inside = false;
  double t_enter = 0.0;
  double t_exit = 0.0;
  double voxels = 0.0;  ///< length inside, in voxels of the grids
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
/// let see past. A body that a ray enters counts as one voxel long at least, so that its edges are crisp.
[[nodiscard]] GlassLook look_of(const Surface& surface, const GlassBody& body);

/// What of each channel passes through everything transparent on a ray.
[[nodiscard]] Vec3 transmittance_along(const SceneView& view, const Surfaces& surfaces, const Ray& ray_in_view,
                                       double max_t);

}  // namespace quoin
