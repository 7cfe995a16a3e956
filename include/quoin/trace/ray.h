#pragma once

#include <functional>
#include <limits>
#include <optional>

#include <quoin/core/direction.h>
#include <quoin/core/instruction_set.h>
#include <quoin/core/vec.h>
#include <quoin/trace/occupancy_tree.h>

namespace quoin {

/// A ray in grid space (voxels). `direction` is not zero and finite; distances are in multiples of its length.
struct Ray {
  DVec3 origin{0.0};
  DVec3 direction{0.0, 0.0, 1.0};
};

struct RayHit {
  IVec3 voxel{0};
  /// The face through which the ray enters; with `starts_inside`, the one that looks most against the ray.
  Direction face = Direction::PosX;
  double t = 0.0;              ///< 0 with `starts_inside`
  bool starts_inside = false;  ///< the origin lies in an occupied voxel
};

/// The first occupied voxel along a ray, up to and including `max_t`; nothing when there is none, or when the ray is
/// not finite or its direction is zero.
///
/// Voxels are half-open: a point on the face between two belongs to the one on its greater side. Where a ray crosses
/// several planes at once, x goes before y before z.
/// Precision: a ray is moved, in double, next to its start, and followed in single precision as far as that is exact
///            enough; beyond, and in worlds so sparse that they have no flat tables, in double. Every crossing is found
///            anew from the origin, so errors do not add up: t is right to 1e-4 of itself (of 1, when it is less). Far
///            from the grid's origin a ray is as exact as its own coordinates.
/// Cost:      a few steps through empty space, whatever its size; never more than the planes crossed inside the bounds.
/// Source:    A. Williams et al., "An efficient and robust ray-box intersection algorithm" (2005), for the clip.
[[nodiscard]] std::optional<RayHit> first_hit(const OccupancyTree& tree, const Ray& ray,
                                              double max_t = std::numeric_limits<double>::infinity(),
                                              InstructionSet instructions = InstructionSet::Best);

/// Whether any occupied voxel touches the ray from 0 up to and including `max_t`. As `first_hit`, without asking where.
[[nodiscard]] bool any_hit(const OccupancyTree& tree, const Ray& ray,
                           double max_t = std::numeric_limits<double>::infinity(),
                           InstructionSet instructions = InstructionSet::Best);

/// A voxel that a ray passes through, from `t_enter` to `t_exit`.
struct VoxelSpan {
  IVec3 voxel{0};
  Direction face = Direction::PosX;  ///< as in RayHit
  double t_enter = 0.0;
  double t_exit = 0.0;
  bool starts_inside = false;
};

/// Calls `visit` for every occupied voxel along a ray that is entered up to and including `max_t`, in the order in
/// which the ray passes them, until it answers false. `t_exit` is not cut at `max_t`.
void visit_hits(const OccupancyTree& tree, const Ray& ray, double max_t,
                const std::function<bool(const VoxelSpan&)>& visit);

}  // namespace quoin
