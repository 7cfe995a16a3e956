#pragma once

#include <quoin/core/function_ref.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/trace/occupancy_tree.h>
#include <quoin/trace/ray.h>

namespace quoin {

/// What of a field is transparent, ready to be traced.
///
/// Where: the trilinear field of the densities is negative in all that is solid. Opaque of it is where the same field
///        is negative once samples of transparent materials count as far out as they are in; the rest is transparent:
///        so there is no gap between the two, and along the lattice's edges they meet where the surfaces of meshes do
///        (mesh/surface/bodies.h). Of several transparent materials a point has the one whose field, made likewise of
///        its own samples, is the least there.
/// Lifetime, threads: as DensityTree.
class DensityGlass {
 public:
  DensityGlass(const DensityGrid& field, const VoxelRegistry& types);

  /// Takes over what edits changed. Requires: `changes` are those since the last update, or since it was made; no type
  /// that was there has another visibility since.
  void update(const VoxelRegistry& types, const DensityChanges& changes);

  [[nodiscard]] const DensityGrid& field() const { return *field_; }
  [[nodiscard]] const VoxelRegistry& types() const { return types_; }
  /// Those with a solid corner of a transparent material: only in them is anything transparent.
  [[nodiscard]] const OccupancyTree& cells() const { return cells_; }

 private:
  const DensityGrid* field_;
  VoxelRegistry types_;
  OccupancyTree cells_;
};

/// A part of a ray that lies in one transparent material.
struct GlassSpan {
  IVec3 cell{0};  ///< in which it begins
  VoxelType type = kAir;
  double t_enter = 0.0;
  double t_exit = 0.0;
  bool starts_inside = false;  ///< at the ray's origin
};

/// Calls `visit` for each part of a ray up to `max_t` that lies in what is transparent, cell by cell or block by block,
/// in the ray's order, until it returns false. One follows on another where their distances are the same. `largest`:
/// how long the edge of a block of a type may be that is passed at once.
///
/// Precision: as first_hit of a DensityTree. Cost: some 100 ns a cell at a surface, 20 ns a block within.
/// Same bits: with any instruction set.
void visit_glass(const DensityGlass& glass, const Ray& ray, double max_t, FunctionRef<double(VoxelType)> largest,
                 FunctionRef<bool(const GlassSpan&)> visit);

/// The normal of a transparent body at a point of its surface, out of it, of unit length: towards air (`other` is
/// kAir), as surfaces of fields are lit, or towards another transparent material in the cell. 0 where there is none.
[[nodiscard]] DVec3 glass_normal(const DensityGlass& glass, IVec3 cell, const DVec3& point, VoxelType type,
                                 VoxelType other);

}  // namespace quoin
