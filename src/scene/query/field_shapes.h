#pragma once

// The operations that a search in a field needs from a shape: the earliest possible contact with a piece's solid, a
// point of contact, and the part of the piece that the shape passes.

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

/// Maximum penetration depth that counts as touching, in voxels.
inline constexpr double kFieldTouch = 1e-6;

/// A contact of a shape with a field.
struct FieldContact {
  double fraction = std::numeric_limits<double>::infinity();
  bool starts_inside = false;
  FieldPiece piece;
  DVec3 point{0.0};  ///< relative to the piece's cell
};

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

}  // namespace quoin
