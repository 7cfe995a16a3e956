#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/trace/occupancy_tree.h>

#include "render/impostor/raster/impostor_faces.h"
#include "scene/tracer/tree_cache.h"

namespace quoin {

/// A face of a voxel.
struct ShellFace {
  IVec3 voxel{0};
  Direction direction = Direction::PosX;
  bool operator==(const ShellFace&) const = default;
};

/// The order in which ImpostorShell lists faces: by direction, then by cell of 4^3 voxels, then by voxel; by z, y, x.
[[nodiscard]] bool comes_before(const ShellFace& a, const ShellFace& b);

/// Returns the voxels of a cell of 4^3 that have a face in `direction`: bit x + 4 y + 16 z. `next`: the cell on that
/// side.
[[nodiscard]] std::uint64_t exposed_bits(std::uint64_t own, std::uint64_t next, Direction direction);

/// The faces between a tree's voxels and empty cells, as bits over the box around these voxels.
///
/// Memory: one bit per voxel of the box and of its margin of four voxels.
class ImpostorShell {
 public:
  /// Returns nullopt if the box with its margin has more than `max_voxels`, or if there are more than `max_faces`.
  static std::optional<ImpostorShell> build(const OccupancyTree& tree, std::int64_t max_voxels, std::int64_t max_faces);

  /// Returns all faces in the order of `comes_before`.
  [[nodiscard]] BlockVector<ShellFace> faces() const;
  /// Requires: `voxel` is at most one voxel outside the box.
  [[nodiscard]] bool is_occupied(IVec3 voxel) const {
    const IVec3 local = voxel - origin_;
    QUOIN_ASSERT((IBox{IVec3{0}, size_ * 4}.contains(local)), "a position in the box or next to it");
    return (cells_[cell_of(local)] >> bit_of(local) & 1U) != 0;
  }
  /// Returns true if all voxels of a box are occupied. Requires: `box` is at most one voxel outside the tree's box.
  [[nodiscard]] bool is_full(const IBox& box) const;

 private:
  explicit ImpostorShell(const IBox& box);
  [[nodiscard]] std::size_t cell_of(IVec3 local) const {
    return static_cast<std::size_t>(((local.z >> 2) * size_.y + (local.y >> 2)) * size_.x + (local.x >> 2));
  }
  [[nodiscard]] static int bit_of(IVec3 local) { return (local.x & 3) + 4 * (local.y & 3) + 16 * (local.z & 3); }
  void copy_chunk(const OccupancyTree& tree, IVec3 chunk);
  // Returns the voxels of a cell that have a face in that direction.
  [[nodiscard]] std::uint64_t exposed(Direction direction, std::size_t cell) const;
  [[nodiscard]] std::int64_t count_faces() const;

  IVec3 origin_{0};  // the voxel at the lowest corner, a multiple of 4
  IVec3 size_{0};    // cells; one empty cell around everything
  std::vector<std::uint64_t> cells_;
};

/// The surface of a field and of shapes in pieces: a face for each surfel, a type, and a shape's side if there are any.
/// Order: the axis-aligned ones, then the inclined ones; by `comes_before`.
struct SurfacePieces {
  BlockVector<ShellFace> faces;
  BlockVector<ImpostorFaces::Surfel> surfels;
  std::vector<VoxelType> types;
  BlockVector<ImpostorFaces::ShapeSide> shapes;  ///< empty without shapes

  [[nodiscard]] bool in_shape(std::size_t i) const { return !shapes.empty() && shapes[i].model != nullptr; }
  /// Adds pieces of shapes to those of a field.
  void add(SurfacePieces&& of_shapes);
  void sort();
};

/// Returns all surfels of a field, sorted by `comes_before`. Returns nullopt if there would be more than `max_count`,
/// or if more than a quarter of them lie on parts at most three samples thick.
///
/// Edges:  lattice edges that the surface crosses, if the normal's component along the edge is at least 0.8 of its
///         largest component or more than 0.55. So the surfels of both sides overlap where the largest axis changes,
///         and there is no gap.
/// Normal: the normal of the traced surface.
/// Cost:   about a microsecond per surfel.
[[nodiscard]] std::optional<SurfacePieces> surfels_of(const DensityGrid& field, std::size_t max_count);

/// Returns the sides of all shapes of a grid that hide the background (ShapeParts::Visible), sorted. Sides that
/// neighbours cover are left out.
///
/// Pieces: a rectangle for each side that is one along the axes of its direction. Other sides, and cutout ones, are cut
///         into rectangles of sixteenths of a voxel, whose middles decide. `is_wanted`: selects voxels with shapes.
/// Back:   sides that are seen from behind, through cutouts or missing sides, have pieces for both directions.
/// Cost:   about 100 ns per piece. Memory: pieces of plants with cutouts are 10 to 50 for a voxel.
[[nodiscard]] SurfacePieces pieces_of_shapes(const TracedShapes& shapes, const Grid& grid, const VoxelRegistry& types,
                                             FunctionRef<bool(IVec3 voxel)> is_wanted);

}  // namespace quoin
