#pragma once

#include <limits>
#include <optional>

#include <quoin/core/direction.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/vec.h>
#include <quoin/trace/occupancy_tree.h>

namespace quoin {

/// A ray in the space of whatever is asked: of a grid (voxels) for an OccupancyTree, of the world for a scene.
/// Both are finite and `direction` is not zero, or nothing is met; distances are in multiples of its length.
struct Ray {
  DVec3 origin{0.0};
  DVec3 direction{0.0, 0.0, 1.0};
};

struct RayHit {
  IVec3 voxel{0};
  /// The face through which the ray enters; with `starts_inside`, the one that looks most against the ray.
  Direction face = Direction::PosX;
  double t = 0.0;              ///< in lengths of the ray's direction; 0 with `starts_inside`
  bool starts_inside = false;  ///< the origin lies in an occupied voxel
};

/// The first occupied voxel along a ray, up to and including `max_t`; nothing when there is none, or when the ray is
/// not finite, its direction is zero, or `max_t` is negative or not a number.
///
/// Voxels are half-open: a point on the face between two belongs to the one on its greater side. Where a ray crosses
/// several planes at once, x goes before y before z.
/// Precision: the ray is moved, in double, to the 64 voxels about its start, and its crossings are ordered in single
///            precision, each found anew from there, so errors do not add up: only a ray that passes within 1e-3 voxels
///            of an edge may take the voxel beside it. `t` is the distance of the face met, in double. What lies
///            further than 2,048 voxels within the tree's bounds, or in a world too sparse for flat tables, is walked
///            in double. Far from the grid's origin a ray is as exact as its own coordinates.
/// Same bits: on every processor, and alone or in a packet.
/// Cost:      a few steps through empty space; never more than the planes crossed inside the bounds.
/// Source:    the slab test as in A. Williams et al., "An efficient and robust ray-box intersection algorithm" (2005).
[[nodiscard]] std::optional<RayHit> first_hit(const OccupancyTree& tree, const Ray& ray,
                                              double max_t = std::numeric_limits<double>::infinity());

/// Whether any occupied voxel touches the ray from 0 up to and including `max_t`. As `first_hit`, without asking where:
/// false for a `max_t` that is negative or not a number.
[[nodiscard]] bool any_hit(const OccupancyTree& tree, const Ray& ray,
                           double max_t = std::numeric_limits<double>::infinity());

/// A voxel that a ray passes through, from `t_enter` to `t_exit`, in lengths of its direction.
struct VoxelSpan {
  IVec3 voxel{0};
  Direction face = Direction::PosX;  ///< as in RayHit
  double t_enter = 0.0;
  double t_exit = 0.0;
  bool starts_inside = false;
};

/// Calls `visit` for every occupied voxel along a ray that is entered up to and including `max_t`, in the order in
/// which the ray passes them, until it returns false. `t_exit` is not cut at `max_t`; where that is negative or not a
/// number there is none.
void visit_hits(const OccupancyTree& tree, const Ray& ray, double max_t, FunctionRef<bool(const VoxelSpan&)> visit);

}  // namespace quoin
