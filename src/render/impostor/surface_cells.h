#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/memory.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>

#include "render/impostor/raster/impostor_faces.h"
#include "render/impostor/seen_faces.h"

namespace quoin {

/// The surface of a grid, its shapes and its field in cells of 2^k voxels: 4^3 bits for each, and a box around the
/// faces in it.
///
///   +-+-+-+-+-+-+-+-+       # bits: set where a voxel with a face lies
///   | | | | | |#|#|#|
///   +-+-+-+-+-+-+-+-+       The box of the left cell reaches from the first to the last face in it. Rays enter cells
///   | | |#|#|#| | | |       through the sides of these boxes, so that most rays that meet nothing never come to the
///   +-+-+-+-+-+-+-+-+       bits.
///   |#|#| | | | | | |
///   +-+-+-+-+-+-+-+-+
class SurfaceCells {
 public:
  /// Groups `faces` into cells of 2^`log2_width` voxels, 1 to 10. Cost: about 50 ns per face, 1 us per surfel. `edge`:
  /// texels per side of the snapshots that saw them.
  SurfaceCells(const BlockVector<SeenFace>& faces, const ContentSphere& content, int edge, int log2_width);

  /// Returns cells of 2 voxels that show through the gaps between surfels: the faces that no view saw, and for each
  /// surfel the nearest lattice cells below it whose corners are all solid. No cell reaches the field's surface, so
  /// outlines stay. Cost: about 2 us per surfel.
  [[nodiscard]] static SurfaceCells behind(const BlockVector<SeenFace>& faces, const DensityGrid& field,
                                           const ContentSphere& content, int edge);

  /// Joins each 2x2x2 cells to one. Cost: about 20 ns per cell.
  void halve();
  /// Gives the cells the bits and boxes of all faces that `tree` has in them. Requires: no surfels of a field; the
  /// width is at least 4.
  void fill_from(const OccupancyTree& tree);

  /// Returns the box sides that a ray may reach from outside. `is_solid(box)` returns true if all voxels of a box are
  /// solid, and must accept voxels of the content's box and their neighbours. Order: direction, then cells along a
  /// Morton curve.
  [[nodiscard]] ImpostorFaces::Level level(FunctionRef<bool(const IBox&)> is_solid) const;

 private:
  // For each view, a face that it saw, and its rank: the lowest of all faces in the cell. Ranks are random numbers
  // divided by the face's visible size, so faces are chosen at random in proportion to the texels that show them, and
  // the choice for eight joined cells is one of their eight choices.
  struct Cell {
    std::uint64_t code = 0;  // the position along a Morton curve
    std::uint64_t bits = 0;
    Vec3 low{0.0F};  // of the box, from the content's centre
    Vec3 high{0.0F};
    std::array<std::uint32_t, kImpostorViews> face{};
    std::array<std::uint32_t, kImpostorViews> rank{};
    bool has_pieces = false;  // surfels of a field or of shapes
  };
  class Collector;

  SurfaceCells(const ContentSphere& content, IVec3 least, int log2_width);
  void sort();
  [[nodiscard]] IVec3 corner_of(const Cell& cell) const;
  [[nodiscard]] ImpostorFaces::Cell finished(const Cell& cell) const;

  ContentSphere content_;
  IVec3 origin_{0};  // of the Morton curve, voxels
  int log2_width_ = 0;
  BlockVector<Cell> cells_;  // in the order of their codes
};

}  // namespace quoin
