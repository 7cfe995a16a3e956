#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <quoin/core/vec.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

namespace trace {
class TreeNodes;
struct ChunkBricks;
struct TreeView;
}  // namespace trace

/// Which voxels a tree holds.
enum class Occupancy : std::uint8_t {
  NonAir,       ///< whatever a ray can hit
  Opaque,       ///< what blocks light
  Transparent,  ///< what tints it
};

/// The traversal structure: which voxels of a grid are occupied, as bits, at every level of detail.
///
/// Empty and full bricks of 16^3 voxels are stored once.
///
/// Memory:  about 0.15 bytes a solid voxel of a terrain.
/// Threads: any number may read at once; an update needs the tree to itself.
/// Moving:  a tree that was moved from may only be assigned to or destroyed.
class OccupancyTree {
 public:
  /// Of nothing.
  explicit OccupancyTree(Occupancy which = Occupancy::NonAir);
  OccupancyTree(OccupancyTree&&) noexcept;
  OccupancyTree& operator=(OccupancyTree&&) noexcept;
  ~OccupancyTree();

  /// Of a grid, which need not outlive it. Cost: 5 to 20 microseconds a chunk that is not uniform; of a tree of
  /// transparent voxels as much again for each of their types there, to know which blocks are of one.
  [[nodiscard]] static OccupancyTree build(const Grid& grid, const VoxelRegistry& types,
                                           Occupancy which = Occupancy::NonAir);

  /// Of a field: of the cells between its samples, those with a solid corner, since the trilinear field is below 0
  /// nowhere else. Cell (i, j, k), here a voxel, spans the points from sample (i, j, k) to (i + 1, j + 1, k + 1).
  /// Cost: as that of a grid.
  [[nodiscard]] static OccupancyTree build(const DensityGrid& field);

  /// Of a field, another tree: of those cells only the ones with a solid corner of a transparent material. Cost: 40 to
  /// 100 microseconds a chunk that has such.
  [[nodiscard]] static OccupancyTree build(const DensityGrid& field, const VoxelRegistry& types);

  /// Takes over what edits changed, as `grid.changes_since` tells of it, in place; builds it anew when all has changed.
  ///
  /// Requires: `changes` are those since the last update, or what was built; no type has another visibility since then
  ///           (`has_other_visibility`), or else all has changed. Neither is checked.
  /// Cost: about a microsecond for each row of four bricks (of 16^3 voxels, along x) in which something changed; for
  ///       changes at the sides of what a chunk holds, some microseconds for its box. When the box of chunks around
  ///       everything outgrows the flat tables, these are copied once, with room for more on that side.
  void update(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes);

  /// The same of the field of which it was built. Cost: as that of a grid; for an edit on a chunk's lower faces also
  /// the chunks below.
  void update(const DensityGrid& field, const DensityChanges& changes);
  /// The same of what is transparent of the field. Requires: it was built of that; which of both updates suits a tree
  /// is not checked.
  void update(const DensityGrid& field, const VoxelRegistry& types, const DensityChanges& changes);

  /// The smallest box around the occupied voxels, to the voxel.
  [[nodiscard]] IBox bounds() const;
  [[nodiscard]] bool is_occupied(IVec3 voxel) const;
  template <std::floating_point T>
  bool is_occupied(Point<T> point) const = delete;  // is_occupied(voxel_of(point))
  /// Bytes held.
  [[nodiscard]] std::size_t bytes() const;

 private:
  friend struct trace::TreeView;
  friend class trace::TreeNodes;
  struct Impl;
  void finish_build();
  void finish_update(std::span<const trace::ChunkBricks> changed);

  std::unique_ptr<Impl> impl_;
  const trace::TreeView* view_ = nullptr;  // in `impl_`
};

}  // namespace quoin
