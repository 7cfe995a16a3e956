#pragma once

// Finds the first contact of a shape with the solid of a field. Processes pieces in the order of their earliest
// possible contact, and halves a piece if its bounds do not decide.

#include <algorithm>
#include <optional>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/half.h>
#include <quoin/trace/density_ray.h>

#include "scene/query/field_piece.h"
#include "scene/query/field_shapes.h"
#include "scene/query/query_in_grid.h"

namespace quoin {

/// The cells of a field that contain solid of the types that a query meets.
class FieldCells {
 public:
  FieldCells(const DensityTree& tree, const TypesMet& types) : tree_(tree), types_(types) {}
  [[nodiscard]] IBox bounds() const { return tree_.cells().bounds(); }
  [[nodiscard]] const DensityGrid& field() const { return tree_.field(); }
  /// Reads the densities of the cell's corners. Returns true if the query meets one of its solid corners.
  bool read(IVec3 cell, CellCorners& corners);
  /// Returns the material of the nearest solid corner that the query meets; among equally near ones, the least in (z,
  /// y, x). `point` is relative to the cell.
  [[nodiscard]] VoxelType material(IVec3 cell, const DVec3& point);

 private:
  const DensityChunk* chunk_of_sample(IVec3 sample);
  [[nodiscard]] bool counts_at(IVec3 sample);
  [[nodiscard]] float density(IVec3 sample);

  const DensityTree& tree_;
  const TypesMet& types_;
  const DensityChunk* chunk_ = nullptr;
  IVec3 chunk_at_{0};
  bool knows_chunk_ = false;
};

template <class Shape>
class FieldSearch {
 public:
  explicit FieldSearch(const Shape& shape) : shape_(shape) {}

  /// Adds the part of a cell that the shape passes between two fractions.
  void add(IVec3 cell, const CellCorners& corners, double from, double to) {
    FieldPiece piece;
    piece.cell = cell;
    piece.corners = corners;
    if (cut(piece, from, to, 1.0) != Cut::Nothing) keep(piece);
  }

  /// Returns the first contact with the added cells, up to the fraction `until`.
  [[nodiscard]] std::optional<FieldContact> first(double until) {
    std::optional<FieldContact> known;  // no later than this
    for (int looked_at = 0; !pieces_.empty(); ++looked_at) {
      std::pop_heap(pieces_.begin(), pieces_.end(), later);
      FieldPiece piece = pieces_.back();
      pieces_.pop_back();
      const double before = known ? known->fraction : until;
      if (piece.enter > before) break;
      const bool is_inside = piece.enter < 0.0;
      const double enter = std::max(piece.enter, 0.0);
      const bool is_flat = piece.doubt <= kFlat * std::sqrt(piece.square_of_slope);
      if (is_inside || is_flat) {
        const auto point = shape_.point_in_solid(piece, is_inside ? 0.0 : std::min(enter + piece.slack, until));
        if (point) return FieldContact{enter, is_inside, piece, *point};
      }
      const bool is_tiny = std::max({piece.half.x, piece.half.y, piece.half.z}) <= kSmallest;
      // A tiny piece that is neither inside nor separated by then counts as touched if it is on the path.
      if (is_tiny && is_inside) continue;
      if (is_tiny || looked_at >= kMostPieces) {
        piece.axis = -1;  // arbitrary
        return FieldContact{enter, false, piece, piece.middle};
      }
      learn(piece, until, known);
      refine(piece, enter, known ? known->fraction : until);
    }
    return known;
  }

 private:
  // Pieces no larger than this are not halved.
  static constexpr double kSmallest = 1e-6;
  // Maximum error of a piece's plane, in voxels, such that a box deeper than kFieldTouch is surely in its solid.
  static constexpr double kFlat = 2.0 * kFieldTouch;
  // After this many pieces the search assumes a contact.
  static constexpr int kMostPieces = 4'000;

  static bool later(const FieldPiece& a, const FieldPiece& b) { return a.enter > b.enter; }

  enum class Cut { Nothing, Little, Much };

  // Cuts a piece to the part that the shape passes, unless that is nearly all of it.
  Cut cut(FieldPiece& piece, double from, double to, double share) const {
    DBox passed = shape_.bounds(piece.cell, from, to);
    passed.min = glm::max(passed.min, piece.middle - piece.half);
    passed.max = glm::min(passed.max, piece.middle + piece.half);
    shape_.shrink(passed, piece.cell, from, to);
    return cut_to(piece, passed.min - kSmallest / 2.0, passed.max + kSmallest / 2.0, share);
  }

  static Cut cut_to(FieldPiece& piece, DVec3 low, DVec3 high, double share) {
    low = glm::max(low, piece.middle - piece.half);
    high = glm::min(high, piece.middle + piece.half);
    const DVec3 size = high - low;
    if (!(size.x > 0.0 && size.y > 0.0 && size.z > 0.0)) return Cut::Nothing;
    if (size.x * size.y * size.z >= share * 8.0 * piece.half.x * piece.half.y * piece.half.z) return Cut::Little;
    piece.restrict_to(low, high);
    return Cut::Much;
  }

  // Cuts a piece to the bounding box of the part below its plane.
  static Cut cut_above_plane(FieldPiece& piece) {
    DVec3 low(-1.0);
    DVec3 high(1.0);
    const DVec3 rises = glm::abs(piece.rise);
    for (int axis = 0; axis < 3; ++axis) {
      if (!(rises[axis] > 0.0)) continue;
      const double most = (rises.x + rises.y + rises.z - rises[axis] - piece.level) / rises[axis] + 1e-9;
      if (most < -1.0) return Cut::Nothing;
      if (most >= 1.0) continue;
      (piece.rise[axis] > 0.0 ? high : low)[axis] = piece.rise[axis] > 0.0 ? most : -most;
    }
    const DVec3 room(kSmallest / 2.0);
    return cut_to(piece, piece.middle + piece.half * low - room, piece.middle + piece.half * high + room, 0.7);
  }

  void keep(FieldPiece& piece) {
    if (!piece.has_solid()) return;
    piece.measure();
    if (shape_.may_meet(piece)) push(piece);
  }

  void push(const FieldPiece& piece) {
    pieces_.push_back(piece);
    std::push_heap(pieces_.begin(), pieces_.end(), later);
  }

  void learn(const FieldPiece& piece, double until, std::optional<FieldContact>& known) const {
    const double time = shape_.time_beyond_doubt(piece);
    if (!(time < (known ? known->fraction : until))) return;
    if (const auto point = shape_.point_in_solid(piece, time)) known = FieldContact{time, false, piece, *point};
  }

  void refine(FieldPiece& piece, double from, double to) {
    Cut much = cut(piece, from, to, 0.7);
    if (much == Cut::Nothing) return;
    if (much == Cut::Much) {
      if (!piece.has_solid()) return;
      piece.measure();
    }
    const Cut below = cut_above_plane(piece);
    if (below == Cut::Nothing) return;
    if (much == Cut::Much || below == Cut::Much) return keep(piece);
    // If the doubt is large, splits along the axis that causes it. Then tests all directions, then splits the longest
    // side.
    const int longest = greatest(piece.half);
    if (piece.doubt > 0.01 * std::sqrt(piece.square_of_slope) * piece.half[longest]) {
      const int axis = greatest(piece.twist);
      return halve(piece, piece.half[axis] > kSmallest ? axis : longest);
    }
    if (piece.is_exact) return halve(piece, longest);
    if (shape_.may_meet_exactly(piece)) push(piece);
  }

  static int greatest(const DVec3& v) { return v.x >= v.y && v.x >= v.z ? 0 : v.y >= v.z ? 1 : 2; }

  void halve(const FieldPiece& piece, int axis) {
    QUOIN_ASSERT(axis >= 0 && axis < 3 && piece.half[axis] > 0.0, "an axis along which the piece has a size");
    for (const double side : {-1.0, 1.0}) {
      FieldPiece part = piece;
      DVec3 low = piece.middle - piece.half;
      DVec3 high = piece.middle + piece.half;
      (side < 0.0 ? high : low)[axis] = piece.middle[axis];
      part.restrict_to(low, high);
      keep(part);
    }
  }

  const Shape& shape_;
  std::vector<FieldPiece> pieces_;  // a heap, earliest contact first
};

/// Returns the first cell (by z, y, x) whose solid a resting shape overlaps deeper than kFieldTouch. Only solid
/// with a matching type counts.
template <class Shape>
std::optional<FieldContact> first_overlap_in_field(FieldCells& cells, const Shape& shape) {
  const IBox box = voxels_within(shape.bounds(IVec3{0}, 0.0, 0.0), cells.bounds());
  CellCorners corners;
  FieldSearch<Shape> search(shape);
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      for (int x = box.min.x; x < box.max.x; ++x) {
        if (!cells.read({x, y, z}, corners)) continue;
        search.add({x, y, z}, corners, 0.0, 0.0);
        if (const auto contact = search.first(0.0)) return contact;
      }
    }
  }
  return std::nullopt;
}

}  // namespace quoin
