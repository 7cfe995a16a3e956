#pragma once

// What a search in a field asks of a shape: when it can first meet the solid of a piece at all, a point in which it
// does, and which part of the piece it passes.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <quoin/grid/density_grid.h>

#include "scene/query/field_piece.h"
#include "scene/query/moving_box.h"
#include "scene/query/moving_capsule.h"

namespace quoin {

/// How deep a shape may be in a field's solid and count as touching it, in voxels.
inline constexpr double kFieldTouch = 1e-6;

/// Where a shape meets a field.
struct FieldContact {
  double fraction = std::numeric_limits<double>::infinity();
  bool starts_inside = false;
  FieldPiece piece;
  DVec3 point{0.0};  ///< relative to the piece's cell
};

/// A box on its way, or at rest.
///
/// The directions that can part it from the solid of a piece: its own three; the plane's, less what of it runs along
/// each of the box's edges; the plane's; the grid's three. These ten mostly do: a face of the box comes to lie on the
/// surface, or an edge, or a corner. With the products of the box's edges and those of the solid, where the plane or
/// two sides of the piece meet, nothing else can: what is left is the plane's doubt.
class BoxInField {
 public:
  /// `until`: the fraction of the way at which it ends.
  BoxInField(const MovingBox& box, double until)
      : box_(box),
        until_(until),
        at_once_(1e-9 / std::max(length_of(box.displacement), 1e-6)),
        half_size_(glm::max(box.half_size, DVec3(2.0 * kFieldTouch))),
        reach_(glm::max(reach_of_axes(box.half_axes), DVec3(2.0 * kFieldTouch))),
        is_upright_(is_along_grid(box.axes)) {}

  /// Whether the piece's solid can be met; then `enter`, `slack` and `axis` are set.
  [[nodiscard]] bool may_meet(FieldPiece& piece) const;
  /// The same by all directions.
  [[nodiscard]] bool may_meet_exactly(FieldPiece& piece) const;
  /// Whether it is surely met by the time `until`.
  [[nodiscard]] std::optional<DVec3> point_in_solid(const FieldPiece& piece, double until) const;
  /// When to ask that for a piece that it does meet: once it is in it deeper than the plane's doubt.
  [[nodiscard]] double time_beyond_doubt(const FieldPiece& piece) const;
  /// What it passes between two fractions, relative to a cell.
  [[nodiscard]] DBox bounds(IVec3 cell, double from, double to) const;
  /// Leaves of a box relative to a cell about what it passes between two fractions.
  void shrink(DBox& part, IVec3 cell, double from, double to) const;
  /// From the solid towards the box, of unit length, in the grid; 0 where nothing is known.
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
  DVec3 half_size_;  // thick enough to be more than touched, also where it has no thickness
  DVec3 reach_;
  bool is_upright_;  // its axes are the grid's
};

/// A capsule on its way, or at rest. What parts it from a piece's solid is the direction between the points of both
/// that are nearest to each other, found by turns; any direction's word is good, until they meet along it.
class CapsuleInField {
 public:
  /// `until`: the fraction of the way at which it ends.
  CapsuleInField(const MovingCapsule& capsule, double until) : capsule_(capsule), until_(until) {}

  [[nodiscard]] bool may_meet(FieldPiece& piece) const;
  [[nodiscard]] bool may_meet_exactly(FieldPiece& piece) const { return may_meet(piece); }
  [[nodiscard]] std::optional<DVec3> point_in_solid(const FieldPiece& piece, double until) const;
  [[nodiscard]] double time_beyond_doubt(const FieldPiece& piece) const;
  [[nodiscard]] DBox bounds(IVec3 cell, double from, double to) const;
  static void shrink(DBox& /*part*/, IVec3 /*cell*/, double /*from*/, double /*to*/) {}
  [[nodiscard]] DVec3 normal(const FieldContact& contact, const DensityGrid& field) const;

 private:
  [[nodiscard]] DVec3 parting(const FieldPiece& piece, const DVec3& centre) const;

  const MovingCapsule& capsule_;
  double until_;
};

/// The shape in a field of one that moves.
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

}  // namespace quoin
