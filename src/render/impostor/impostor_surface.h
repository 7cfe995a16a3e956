#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/trace/occupancy_tree.h>

#include "render/impostor/raster/impostor_faces.h"

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

/// The surface of a field in pieces: a face for each surfel, and a material.
struct FieldSurfels {
  BlockVector<ShellFace> faces;
  BlockVector<ImpostorFaces::Surfel> surfels;
  std::vector<VoxelType> types;
};

/// Returns all surfels of a field, sorted by `comes_before`. Returns nullopt if there would be more than `max_count`,
/// or if more than a quarter of them lie on parts at most three samples thick.
///
/// Edges:  lattice edges that the surface crosses, if the normal's component along the edge is at least 0.8 of its
///         largest component or more than 0.55. So the surfels of both sides overlap where the largest axis changes,
///         and there is no gap.
/// Normal: the normal of the traced surface.
/// Cost:   about a microsecond per surfel.
[[nodiscard]] std::optional<FieldSurfels> surfels_of(const DensityGrid& field, std::size_t max_count);

}  // namespace quoin
