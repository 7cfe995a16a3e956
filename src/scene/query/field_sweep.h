#pragma once

#include <quoin/trace/density_ray.h>

#include "scene/query/field_search.h"
#include "scene/query/moving_box.h"

namespace quoin {

/// The first contact of a moving shape (MovingBox or MovingCapsule) with a field; for `follow_way`.
template <class Moving>
class FieldSweep {
 public:
  FieldSweep(const DensityTree& tree, const TypesMet& types, const Moving& shape, double most)
      : cells_(tree, types), shape_(shape), most_(most) {}

  [[nodiscard]] IBox bounds() const { return cells_.bounds(); }
  [[nodiscard]] double fraction() const { return best_.fraction; }
  void check(const IBox& near, double from, double to);

  [[nodiscard]] const FieldContact& best() const { return best_; }
  [[nodiscard]] VoxelType material() { return cells_.material(best_.piece.cell, best_.point); }
  [[nodiscard]] DVec3 normal() const;

 private:
  using Shape = typename InField<Moving>::Shape;

  FieldCells cells_;
  const Moving& shape_;
  double most_;
  FieldContact best_;
};

/// The way out of a field's solid.
struct WayOut {
  DVec3 normal{0.0};  ///< in the grid, unit
  double depth = 0.0;
};

/// Returns the way out for a shape that starts inside: along the gradient at the deepest point or, without a gradient,
/// along the grid axis with the shortest way. If neither leads out within twice the shape's size, the way is a voxel
/// long along the first.
///
/// Cost: some sweeps about as long as the shape.
template <class Moving>
[[nodiscard]] WayOut way_out(const DensityTree& tree, const TypesMet& types, const Moving& shape,
                             const FieldContact& contact);

}  // namespace quoin
