#pragma once

// Finds the first contact of a shape with the solid of a field. Processes pieces of cells in the order of their
// earliest possible contact, and halves a piece if its bounds do not decide.
//
//   cell: eight samples   piece: a box within it,     its solid lies below the plane
//   +--------+            with eight corners again     \ |     |   field >= level + slope * (p - middle)
//   |   __/  |            +---+                         \|     |
//   |  /solid|            |  /|                          \ air |   which is `doubt` below the field's best plane:
//   +--------+            +---+                           \----+   a quarter of it when the piece is half as large
//
// Trilinear over any such box, the field is least at a corner: a piece with no corner below 0 has no solid.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/core/assert.h>
#include <quoin/core/half.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/trace/density_ray.h>

#include "core/memory/make_room.h"
#include "core/trilinear.h"
#include "scene/query/moving_shapes.h"
#include "scene/query/query_in_grid.h"

namespace quoin {

/// Maximum penetration depth that counts as touching, in voxels.
inline constexpr double kFieldTouch = 1e-6;

/// A part of a cell of a field. Lengths are in voxels of the grid, positions relative to the cell's least sample.
struct FieldPiece {
  IVec3 cell{0};
  DVec3 middle{0.5};
  DVec3 half{0.5};  ///< size; positive
  CellCorners corners{};
  // Set by `measure`:
  DVec3 slope{0.0};
  DVec3 rise{0.0};  ///< slope * half
  double square_of_slope = 0.0;
  double level = 0.0;
  double doubt = 0.0;
  DVec3 twist{0.0};  ///< each axis's contribution to the doubt
  /// The rest of the field, as multiples of products of the position in halves from the middle: yz, xz, xy; and xyz.
  DVec3 bend{0.0};
  double warp = 0.0;
  // Set by the search:
  double enter = 0.0;       ///< no contact with its solid before this time
  double slack = 0.0;       ///< contact is certain after this additional time, except for the doubt
  int axis = -1;            ///< the shape's direction that separates it until then; -1: none
  bool is_exact = false;    ///< all directions were tested, not only the first few
  DVec3 nearest{0.0};       ///< capsules: the point of the solid nearest to the line at the time `enter`
  bool is_touched = false;  ///< capsules: at the time `enter` the capsule touches the solid at `nearest`
  int split = -1;           ///< capsules: the axis along which smaller pieces have better bounds; -1: any

  [[nodiscard]] bool has_solid() const {
    double least = corners[0];
    for (const double corner : corners) least = std::min(least, corner);
    return least < 0.0;
  }

  /// Returns true if a shape deeper than kFieldTouch below the plane is surely in the solid.
  [[nodiscard]] bool is_flat() const { return doubt <= 2.0 * kFieldTouch * std::sqrt(square_of_slope); }

  [[nodiscard]] double density(const DVec3& point) const {
    return trilinear(corners, (point - middle) / (2.0 * half) + 0.5);
  }
  /// Returns the gradient in density units per voxel.
  [[nodiscard]] DVec3 gradient(const DVec3& point) const {
    return trilinear_gradient(corners, (point - middle) / (2.0 * half) + 0.5) / (2.0 * half);
  }

  /// The plane: the corners as sums of the products of the axes' signs.
  void measure() {
    const CellCorners& d = corners;
    const double a = d[0] + d[3] + d[5] + d[6];
    const double b = d[1] + d[2] + d[4] + d[7];
    rise = DVec3(d[1] + d[3] + d[5] + d[7] - d[0] - d[2] - d[4] - d[6],
                 d[2] + d[3] + d[6] + d[7] - d[0] - d[1] - d[4] - d[5],
                 d[4] + d[5] + d[6] + d[7] - d[0] - d[1] - d[2] - d[3]) *
           0.125;
    bend = DVec3(d[0] + d[1] + d[6] + d[7] - d[2] - d[3] - d[4] - d[5],
                 d[0] + d[2] + d[5] + d[7] - d[1] - d[3] - d[4] - d[6],
                 d[0] + d[3] + d[4] + d[7] - d[1] - d[2] - d[5] - d[6]) *
           0.125;
    warp = (b - a) * 0.125;
    const double xy = std::abs(bend.z);
    const double xz = std::abs(bend.y);
    const double yz = std::abs(bend.x);
    const double xyz = std::abs(warp);
    doubt = xy + xz + yz + xyz;
    twist = {xy + xz + xyz, xy + yz + xyz, xz + yz + xyz};
    level = (a + b) * 0.125 - doubt;
    slope = rise / half;
    square_of_slope = glm::dot(slope, slope);
  }

  /// Leaves the part from `low` to `high`, which lie within it.
  void restrict_to(const DVec3& low, const DVec3& high) {
    QUOIN_ASSERT(low.x <= high.x && low.y <= high.y && low.z <= high.z, "low <= high");
    for (int axis_of_box = 0; axis_of_box < 3; ++axis_of_box) {
      const double first = middle[axis_of_box] - half[axis_of_box];
      const double f = (low[axis_of_box] - first) / (2.0 * half[axis_of_box]);
      const double g = (high[axis_of_box] - first) / (2.0 * half[axis_of_box]);
      const std::size_t bit = std::size_t{1} << axis_of_box;
      for (std::size_t i = 0; i < 8; ++i) {
        if ((i & bit) != 0) continue;
        const double from = corners[i];
        const double by = corners[i | bit] - from;
        corners[i] = from + f * by;
        corners[i | bit] = from + g * by;
      }
    }
    middle = 0.5 * (low + high);
    half = 0.5 * (high - low);
  }

  /// Bounds on the distance from the middle to its solid, along a direction and against it. They are conservative,
  /// since they use only the plane and the sides of the piece. `along_half` is direction * half, `along_slope`
  /// direction * slope.
  struct Extent {
    double ahead = 0.0;
    double behind = 0.0;
  };
  [[nodiscard]] Extent extent(const DVec3& along_half, double along_slope) const {
    const double whole = sum(along_half);
    if (along_slope == 0.0) return {whole, whole};
    const double cut = std::min(whole, below_plane(along_half, along_slope / square_of_slope));
    return along_slope > 0.0 ? Extent{cut, whole} : Extent{whole, cut};
  }
  /// The exact bounds.
  [[nodiscard]] Extent exact_extent(const DVec3& along_half) const {
    const double whole = sum(along_half);
    Extent extent{whole, whole};
    for (int i = 0; i < 3; ++i) {
      if (rise[i] == 0.0) continue;
      const double multiple = along_half[i] / rise[i];
      double& end = multiple > 0.0 ? extent.ahead : extent.behind;
      end = std::min(end, below_plane(along_half, multiple));
    }
    return extent;
  }

 private:
  static double sum(const DVec3& v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); }
  // Subtracting a multiple of the slope from a direction gives the same bound for the solid below the plane, which ends
  // the solid along the slope. The best multiple makes one component 0.
  [[nodiscard]] double below_plane(const DVec3& along_half, double multiple) const {
    return sum(along_half - multiple * rise) - std::abs(multiple) * level;
  }
};

/// A contact of a shape with a field.
struct FieldContact {
  double fraction = std::numeric_limits<double>::infinity();
  bool starts_inside = false;
  FieldPiece piece;
  DVec3 point{0.0};  ///< relative to the piece's cell
};

// A search needs these operations from a shape: the earliest possible contact with a piece's solid, a point of contact,
// and the part of the piece that the shape passes.

/// A box in motion or at rest.
///
/// Separating directions, in the order of tests: the box's three axes; the plane's normal, projected along each of the
/// box's edges; the plane's normal; the grid's three axes. These ten usually suffice, because a face, an edge or a
/// corner of the box touches the surface. The cross products of box edges with edges of the solid (where the plane or
/// two sides of the piece meet) complete the set. The remaining error is the plane's doubt.
class BoxInField {
 public:
  /// `until`: the last fraction of the movement.
  BoxInField(const MovingBox& box, double until)
      : box_(box),
        until_(until),
        at_once_(1e-9 / std::max(length_of(box.displacement), 1e-6)),
        half_size_(glm::max(box.half_size, DVec3(2.0 * kFieldTouch))),
        reach_(glm::max(reach_of_axes(box.half_axes), DVec3(2.0 * kFieldTouch))),
        is_upright_(is_along_grid(box.axes)) {}

  /// Returns true if the box may touch the piece's solid; then sets `enter`, `slack` and `axis`.
  [[nodiscard]] bool may_meet(FieldPiece& piece) const;
  /// As `may_meet`, but tests all directions.
  [[nodiscard]] bool may_meet_exactly(FieldPiece& piece) const;
  /// Returns true if the contact time of a piece is known, apart from `slack`.
  [[nodiscard]] static bool is_decided(const FieldPiece& piece) { return piece.is_flat(); }
  static void end_at(const FieldPiece& /*piece*/) {}
  /// Returns a point of the solid that the box has surely reached by the time `until`, if any.
  [[nodiscard]] std::optional<DVec3> point_in_solid(const FieldPiece& piece, double until) const;
  /// Returns the time for a call of `point_in_solid` for a piece on the path: the box is then deeper than the plane's
  /// doubt.
  [[nodiscard]] double time_beyond_doubt(const FieldPiece& piece) const;
  /// Returns the bounds of the box between two fractions, relative to a cell.
  [[nodiscard]] DBox bounds(IVec3 cell, double from, double to) const;
  /// Shrinks a box relative to a cell to the approximate region that the shape passes between two fractions.
  void shrink(DBox& part, IVec3 cell, double from, double to) const;
  /// Returns the unit normal from the solid towards the box, in the grid's space; 0 if unknown.
  [[nodiscard]] DVec3 normal(const FieldContact& contact, const DensityGrid& field) const;

 private:
  static bool is_along_grid(const glm::dmat3& axes) {
    return std::all_of(&axes[0], &axes[0] + 3, [](const DVec3& axis) {
      return std::max({std::abs(axis.x), std::abs(axis.y), std::abs(axis.z)}) > 1.0 - 1e-15;
    });
  }

  struct Course;
  [[nodiscard]] bool follow(FieldPiece& piece, bool is_exact) const;
  [[nodiscard]] DVec3 direction(const FieldPiece& piece, int which) const;
  [[nodiscard]] DVec3 parting(const FieldPiece& piece) const;
  [[nodiscard]] std::optional<DVec3> by_support(const FieldPiece& piece, const DVec3& centre) const;
  [[nodiscard]] DVec3 of_face(const FieldContact& contact, const DensityGrid& field) const;
  [[nodiscard]] DVec3 across_crease(const FieldContact& contact, const DensityGrid& field) const;
  [[nodiscard]] static std::array<DVec3, 8> gradients_about(const FieldContact& contact, const DensityGrid& field);
  [[nodiscard]] DVec3 nearest(const DVec3& centre, const DVec3& point) const;

  const MovingBox& box_;
  double until_;
  double at_once_;
  DVec3 half_size_;  // at least twice the touch tolerance, even for a box without thickness
  DVec3 reach_;
  bool is_upright_;  // its axes are the grid's
};

/// A capsule in motion or at rest. The separating direction joins the nearest points of the capsule and the piece's
/// solid, found by iteration. Any direction gives a valid bound until the two touch along it.
class CapsuleInField {
 public:
  /// `until`: the last fraction of the movement.
  CapsuleInField(const MovingCapsule& capsule, double until)
      : capsule_(capsule), until_(until), radius_(capsule.radius - kFieldTouch) {}

  [[nodiscard]] bool may_meet(FieldPiece& piece) const;
  [[nodiscard]] bool may_meet_exactly(FieldPiece& piece) const { return may_meet(piece); }
  [[nodiscard]] static bool is_decided(const FieldPiece& piece) { return piece.is_touched || piece.is_flat(); }
  /// Ends the search at the contact with a piece, if that is certain: later pieces are then tested up to there only.
  void end_at(const FieldPiece& piece) {
    if (piece.is_touched && piece.enter < until_ && point_in_solid(piece, piece.enter)) until_ = piece.enter;
  }
  [[nodiscard]] std::optional<DVec3> point_in_solid(const FieldPiece& piece, double until) const;
  [[nodiscard]] double time_beyond_doubt(const FieldPiece& piece) const;
  [[nodiscard]] DBox bounds(IVec3 cell, double from, double to) const;
  static void shrink(DBox& /*part*/, IVec3 /*cell*/, double /*from*/, double /*to*/) {}
  [[nodiscard]] DVec3 normal(const FieldContact& contact, const DensityGrid& field) const;

 private:
  [[nodiscard]] bool is_away(FieldPiece& piece, double& time) const;
  [[nodiscard]] bool follow_planes(FieldPiece& piece, double time) const;
  [[nodiscard]] DVec3 parting(const FieldPiece& piece, const DVec3& centre) const;

  const MovingCapsule& capsule_;
  double until_;
  double radius_;  // less the touch tolerance
};

/// Maps a moving shape to its field shape.
template <class Moving>
struct InField;
template <>
struct InField<MovingBox> {
  using Shape = BoxInField;
};
template <>
struct InField<MovingCapsule> {
  using Shape = CapsuleInField;
};

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
  explicit FieldSearch(Shape& shape) : shape_(shape) {}

  /// Adds the part of a cell that the shape passes between two fractions.
  void add(IVec3 cell, const CellCorners& corners, double from, double to) {
    FieldPiece piece;
    piece.cell = cell;
    piece.corners = corners;
    if (cut(piece, from, to, 1.0) != Cut::Nothing) keep(piece);
  }

  /// Returns the number of cells and parts of cells that were compared with the shape.
  [[nodiscard]] int tested() const { return tested_; }

  /// Returns the first contact with the added cells, up to the fraction `until`.
  [[nodiscard]] std::optional<FieldContact> first(double until) {
    std::optional<FieldContact> known;  // no later than this
    for (int looked_at = 0; !pieces_->empty(); ++looked_at) {
      std::pop_heap(pieces_->begin(), pieces_->end(), later);
      FieldPiece piece = pieces_->back();
      pieces_->pop_back();
      const double before = known ? known->fraction : until;
      if (piece.enter > before) break;
      const bool is_inside = piece.enter < 0.0;
      const double enter = std::max(piece.enter, 0.0);
      if (is_inside || shape_.is_decided(piece)) {
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
    ++tested_;
    if (!shape_.may_meet(piece)) return;
    shape_.end_at(piece);
    push(piece);
  }

  void push(const FieldPiece& piece) {
    pieces_->push_back(piece);
    std::push_heap(pieces_->begin(), pieces_->end(), later);
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
    if (piece.split >= 0 && piece.half[piece.split] > kSmallest) return halve(piece, piece.split);
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

  Shape& shape_;
  int tested_ = 0;
  KeptList<FieldPiece, FieldSearch> pieces_;  // a heap, earliest contact first
};

/// Returns the first cell (by z, y, x) whose solid a resting shape overlaps deeper than kFieldTouch. Only solid
/// with a matching type counts.
template <class Shape>
std::optional<FieldContact> first_overlap_in_field(FieldCells& cells, Shape& shape) {
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
  /// Returns the number of cells and parts of cells that were compared with the shape.
  [[nodiscard]] int tested() const { return tested_; }
  [[nodiscard]] VoxelType material() { return cells_.material(best_.piece.cell, best_.point); }
  [[nodiscard]] DVec3 normal() const;

 private:
  using Shape = typename InField<Moving>::Shape;

  FieldCells cells_;
  const Moving& shape_;
  double most_;
  int tested_ = 0;
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
