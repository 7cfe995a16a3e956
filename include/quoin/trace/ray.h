#pragma once

#include <limits>
#include <optional>

#include <quoin/core/direction.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/vec.h>
#include <quoin/trace/occupancy_tree.h>

namespace [[gnu::visibility("default")]] quoin {

/// A ray in the space of the queried object: grid space (voxels) for an OccupancyTree, world space for a scene.
/// Distances are in multiples of the length of `direction`. A ray with a non-finite component or a zero direction hits
/// nothing.
struct Ray {
  DVec3 origin{0.0};
  DVec3 direction{0.0, 0.0, 1.0};
};

struct RayHit {
  IVec3 voxel{0};
  /// The face through which the ray enters. With `starts_inside`, the face that is most opposed to the ray's direction.
  Direction face = Direction::PosX;
  double t = 0.0;              ///< in lengths of the ray's direction; 0 with `starts_inside`
  bool starts_inside = false;  ///< the origin lies in an occupied voxel
};

/// Returns the first occupied voxel along a ray, up to and including `max_t`. Returns nullopt if there is none, if the
/// ray is not finite, if its direction is zero, or if `max_t` is negative or NaN.
///
/// Voxels are half-open: a point on the face between two voxels belongs to the voxel on the greater side. If a ray
/// crosses several planes at once, x comes before y before z.
/// Precision: the ray is moved, in double, to the 64 voxels around its start. Crossings are ordered in single
///            precision, each computed from there again, so errors do not accumulate: only a ray that passes within
///            1e-3 voxels of an edge can hit the voxel next to it. `t` is the distance to the face hit, in double.
///            Voxels more than 2,048 away within the tree's bounds, and worlds too sparse for flat tables, are
///            traversed in double. Far from the grid's origin, a ray is as precise as its own coordinates.
/// Same bits: on every processor, and alone or in a packet.
/// Cost:      a few steps through empty space; at most the number of planes crossed inside the bounds.
/// Source:    the slab test as in A. Williams et al., "An efficient and robust ray-box intersection algorithm" (2005).
[[nodiscard]] std::optional<RayHit> first_hit(const OccupancyTree& tree, const Ray& ray,
                                              double max_t = std::numeric_limits<double>::infinity());

/// Returns true if the ray hits an occupied voxel from 0 up to and including `max_t`. Agrees with `first_hit`, but does
/// not find the position. Returns false if `max_t` is negative or NaN.
[[nodiscard]] bool any_hit(const OccupancyTree& tree, const Ray& ray,
                           double max_t = std::numeric_limits<double>::infinity());

/// A voxel that a ray crosses, from `t_enter` to `t_exit`, in lengths of the ray's direction.
struct VoxelSpan {
  IVec3 voxel{0};
  Direction face = Direction::PosX;  ///< as in RayHit
  double t_enter = 0.0;
  double t_exit = 0.0;
  bool starts_inside = false;
};

/// Calls `visit` for every occupied voxel that a ray enters up to and including `max_t`, in ray order, until `visit`
/// returns false. `t_exit` is not clamped to `max_t`. A negative or NaN `max_t` visits nothing.
void visit_hits(const OccupancyTree& tree, const Ray& ray, double max_t, FunctionRef<bool(const VoxelSpan&)> visit);

}  // namespace quoin
