#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <quoin/core/function_ref.h>
#include <quoin/core/vec.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

namespace [[gnu::visibility("default")]] quoin {

namespace trace {
class [[gnu::visibility("hidden")]] TreeNodes;
struct [[gnu::visibility("hidden")]] ChunkBricks;
struct [[gnu::visibility("hidden")]] TreeView;
}  // namespace trace

/// The voxels that a tree contains.
enum class Occupancy : std::uint8_t {
  NonAir,       ///< all voxels that a ray can hit
  Opaque,       ///< voxels that block light
  Transparent,  ///< voxels that tint light
  Glass,        ///< the transparent voxels whose type has no shapes (VoxelRegistry::is_shaped), or that are listed
};

/// The ray-traversal structure: a bit per occupied voxel of a grid, at every level of detail.
///
/// Empty and full bricks of 16^3 voxels are stored once.
///
/// Memory:  about 0.15 bytes per solid voxel of a terrain.
/// Threads: any number may read at once; an update needs exclusive access.
/// Moving:  a moved-from tree can only be assigned to or destroyed.
class OccupancyTree {
 public:
  /// Creates an empty tree.
  explicit OccupancyTree(Occupancy which = Occupancy::NonAir);
  OccupancyTree(OccupancyTree&&) noexcept;
  OccupancyTree& operator=(OccupancyTree&&) noexcept;
  ~OccupancyTree();

  /// Builds the tree of a grid; the grid need not outlive it. Cost: 5 to 20 microseconds per chunk that is not uniform.
  /// A tree of transparent voxels pays the same again per transparent type in the chunk, to find blocks of a single
  /// type.
  [[nodiscard]] static OccupancyTree build(const Grid& grid, const VoxelRegistry& types,
                                           Occupancy which = Occupancy::NonAir);

  /// Builds the tree of a density field. It contains the cells between samples that have a solid corner, because the
  /// trilinear field is not negative anywhere else. Cell (i, j, k), a voxel of the tree, spans the points from sample
  /// (i, j, k) to (i + 1, j + 1, k + 1). Cost: same as for a grid.
  [[nodiscard]] static OccupancyTree build(const DensityGrid& field);

  /// Builds the tree of the transparent cells of a density field: cells with a solid corner of a transparent material.
  /// Cost: 40 to 100 microseconds per chunk with such cells.
  [[nodiscard]] static OccupancyTree build(const DensityGrid& field, const VoxelRegistry& types);

  /// Applies edits of the grid in place. `changes` is the result of `grid.changes_since`. Rebuilds the tree if
  /// everything changed.
  ///
  /// Requires: `changes` start at the last update or at the build. If the visibility of a type has changed since then
  ///           (`has_other_visibility`), `changes.all` must be true. Neither is checked.
  /// Cost: about a microsecond per changed row of four bricks (16^3 voxels each, along x). Changes at the border of a
  ///       chunk's bounds cost some microseconds for its bounds. While the box of all chunks grows, updates copy the
  ///       flat tables to larger ones in steps of about 256 chunks, ahead of need. A box that grows by more than the
  ///       spare room at once, an eighth, costs a copy of all tables.
  void update(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes);

  /// Applies edits of the field. Requires: the tree was built from this field. Cost: same as for a grid. An edit on the
  /// lower faces of a chunk also updates the chunks below.
  void update(const DensityGrid& field, const DensityChanges& changes);
  /// Applies edits to a tree of the transparent cells of a field. Requires: the tree was built from these cells.
  /// Neither field update checks the kind of tree.
  void update(const DensityGrid& field, const VoxelRegistry& types, const DensityChanges& changes);

  /// Returns the smallest box around the occupied voxels, exact to the voxel.
  [[nodiscard]] IBox bounds() const;
  [[nodiscard]] bool is_occupied(IVec3 voxel) const;
  template <std::floating_point T>
  bool is_occupied(Point<T> point) const = delete;  // is_occupied(voxel_of(point))
  /// Returns the memory in use, in bytes.
  [[nodiscard]] std::size_t bytes() const;

  // For Quoin's own sources.
  struct [[gnu::visibility("hidden")]] Impl;
  // Rows of voxels: returns the 64 voxels along x of a chunk's row, whose first voxel is given, as bits.
  using RowsOfVoxels = FunctionRef<std::uint64_t(IVec3 first)>;
  // Builds a tree of the voxels that `rows` lists in some chunks.
  [[nodiscard, gnu::visibility("hidden")]] static OccupancyTree build(std::span<const IVec3> chunks,
                                                                      const RowsOfVoxels& rows);
  // Replaces all voxels of some chunks of a tree of glass: cubes of glass types, and the voxels of shaped types that
  // `cubes_in(chunk)` lists, as rows along x by y + 64 z; no rows: none.
  using CubesOfChunk = FunctionRef<std::span<const std::uint64_t>(IVec3 chunk)>;
  [[gnu::visibility("hidden")]] void update(const Grid& grid, const VoxelRegistry& types, std::span<const IVec3> chunks,
                                            const CubesOfChunk& cubes_in);
  // As above, of a tree of the voxels in which rays meet glass: cubes of the types that `counts` accepts, cubes of
  // shaped types (`cubes`), and the voxels that shapes with glass `touch`. Blocks of one type contain no touched
  // voxels. Both are rows along x by y + 64 z; no rows: none.
  struct GlassOfChunk {
    std::span<const std::uint64_t> cubes;
    std::span<const std::uint64_t> touched;
  };
  [[gnu::visibility("hidden")]] void update(const Grid& grid, const VoxelRegistry& types, std::span<const IVec3> chunks,
                                            const FunctionRef<bool(VoxelType)>& counts,
                                            const FunctionRef<GlassOfChunk(IVec3 chunk)>& glass_in);
  // Replaces all voxels of some chunks of a tree of listed voxels.
  [[gnu::visibility("hidden")]] void update(std::span<const IVec3> chunks, const RowsOfVoxels& rows);
  [[nodiscard]] const Impl& impl() const;
  /// Returns the tables that kernels read; null if the world is so sparse (distant islands) that they would be larger
  /// than the rest of the tree.
  [[nodiscard]] const trace::TreeView* view() const { return view_; }

 private:
  void finish_build();
  void finish_update(std::span<const trace::ChunkBricks> changed);

  std::unique_ptr<Impl> impl_;
  const trace::TreeView* view_ = nullptr;  // points into `impl_`
};

}  // namespace quoin
