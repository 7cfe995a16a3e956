#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include <quoin/core/vec.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/density_grid.h>
#include <quoin/trace/occupancy_tree.h>
#include <quoin/trace/packet.h>
#include <quoin/trace/ray.h>

namespace quoin {

/// A field ready to be traced: the field itself, and which of the cells between its samples touch its solid.
///
/// Lifetime: the field must outlive it, in its place; after an edit of the field `update` comes before anything else.
/// Memory:   of the field's surface and solid what an OccupancyTree takes of blocks.
/// Threads:  any number may read at once; an update needs it to itself.
class DensityTree {
 public:
  /// Cost: 10 to 20 microseconds a chunk that is not uniform.
  explicit DensityTree(const DensityGrid& field) : field_(&field), cells_(OccupancyTree::build(field)) {}
  explicit DensityTree(DensityGrid&&) = delete;  // it must outlive it

  /// Takes over what edits changed, as the field's `changes_since` tells of it.
  /// Requires: `changes` are those since the last update, or since it was made; this is not checked.
  /// Cost: as that of making it, for the chunks that changed, and those below where they changed on their lower faces.
  void update(const DensityChanges& changes) { cells_.update(*field_, changes); }

  [[nodiscard]] const DensityGrid& field() const { return *field_; }
  /// Cell (i, j, k) spans the points from sample (i, j, k) to (i + 1, j + 1, k + 1).
  [[nodiscard]] const OccupancyTree& cells() const { return cells_; }

 private:
  const DensityGrid* field_;
  OccupancyTree cells_;
};

/// Where a ray comes into the solid of a field.
struct DensityHit {
  double t = 0.0;              ///< in lengths of the ray's direction; 0 with `starts_inside`
  bool starts_inside = false;  ///< the field is negative at the origin
  IVec3 cell{0};               ///< the least of the eight samples between which it lies
  VoxelType material = kAir;   ///< of the nearest of their solid samples; of several, the least of (z, y, x)
  /// The gradient of the trilinear field, of unit length: out of the solid; 0 where the gradient is 0. With
  /// `starts_inside` too. It has steps from cell to cell.
  DVec3 normal{0.0};
};

/// The first point along a ray from which on the trilinear field of the tree is negative, up to and including `max_t`;
/// nothing when there is none, or when the ray is not finite, its direction is zero, or `max_t` is negative or not a
/// number. Where the field only comes to 0 is no hit.
///
/// Precision: within a cell the field along the ray is a cubic, whose first root is found in double: t is off by about
///            1e-9 cells and the rounding of the ray's own numbers. As with `first_hit` of blocks, a cell that the ray
///            passes for less than 1e-3 may be left out; nothing of solid around it is.
/// Same bits: alone or in a packet.
/// Cost:      that of blocks up to the surface, then some 20 ns for each cell at the surface that it passes; packets of
///            rays that start near each other and point the same way take two thirds of that.
/// Source:    the cubic as in G. Marmitt et al., "Fast and Accurate Ray-Voxel Intersection Techniques for Iso-Surface
///            Ray Tracing" (2004).
[[nodiscard]] std::optional<DensityHit> first_hit(const DensityTree& tree, const Ray& ray,
                                                  double max_t = std::numeric_limits<double>::infinity());

/// Whether the field is negative anywhere along a ray from 0 up to and including `max_t`, as `first_hit` would tell.
[[nodiscard]] bool any_hit(const DensityTree& tree, const Ray& ray,
                           double max_t = std::numeric_limits<double>::infinity());

/// What `first_hits` found; lanes whose bit in `hit` is not set hold nothing of meaning.
struct DensityPacketHits {
  std::uint32_t hit = 0;
  std::array<DensityHit, RayPacket::kSize> lanes{};
};

/// As the function for single rays, for each active ray: equal in every bit, whatever the other rays.
void first_hits(const DensityTree& tree, const RayPacket& rays, DensityPacketHits& hits);

/// Bit i: ray i is active and blocked.
[[nodiscard]] std::uint32_t any_hits(const DensityTree& tree, const RayPacket& rays);

}  // namespace quoin
