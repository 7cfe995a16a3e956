#include "scene/query/field_search.h"

#include <limits>

#include <quoin/core/assert.h>

namespace quoin {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Indices of the directions that can offset a box from a piece.
constexpr int kFirstEdge = 3;
constexpr int kSlope = 6;
constexpr int kFirstOfGrid = 7;
constexpr int kFirstCrease = 10;  // edges of the plane and the piece's sides, by three of the box
constexpr int kFirstSide = 19;    // edges of the piece, by three of the box
constexpr int kAllDirections = 28;
constexpr std::array<DVec3, 3> kUnits = {DVec3(1.0, 0.0, 0.0), DVec3(0.0, 1.0, 0.0), DVec3(0.0, 0.0, 1.0)};

bool is_in(const FieldPiece& piece, const DVec3& point) {
  const DVec3 away = glm::abs(point - piece.middle) - piece.half;
  return std::max({away.x, away.y, away.z}) <= 1e-9;
}

DVec3 clamped(const FieldPiece& piece, const DVec3& point) {
  return glm::clamp(point, piece.middle - piece.half, piece.middle + piece.half);
}

DVec3 unit_or_zero(const DVec3& v) {
  const double length = glm::length(v);
  return length > 0.0 ? v / length : DVec3(0.0);
}

// Alternates between the nearest point of a shape and a step from there down the field.
template <class Nearest>
std::optional<DVec3> by_turns(const FieldPiece& piece, Nearest&& nearest) {
  DVec3 point = piece.middle;
  for (int turn = 0; turn < 4; ++turn) {
    const double density = piece.density(point);
    if (density >= 0.0 && piece.square_of_slope > 0.0) {
      point = clamped(piece, point - piece.slope * ((density + piece.doubt) / piece.square_of_slope));
    }
    point = nearest(point);
    if (is_in(piece, point) && piece.density(point) < 0.0) return point;
    point = clamped(piece, point);
  }
  return std::nullopt;
}

}  // namespace

// The interval of time in which no tested direction separates a box from a piece's solid.
struct BoxInField::Course {
  double until;
  double at_once;  // times that differ by less are the same
  double enter = -kInfinity;
  double leave = kInfinity;
  double slack = 0.0;
  int axis = -1;

  // Tests a direction of any length. `solid`: the extent of the solid along it from the piece's middle; `apart`: the
  // distance of the box's centre from there; `reach`: the extent of the box; `rate`: its speed. Returns false if they
  // never touch.
  bool passes(int which, FieldPiece::Extent solid, double offset, double reach, double rate, double length) {
    if (rate > 0.0) {
      rate = -rate;
      offset = -offset;
      std::swap(solid.ahead, solid.behind);
    }
    const double gap = offset - reach - solid.ahead;
    const double left = offset + reach + solid.behind;
    const double touch = kFieldTouch * length;
    if (left <= touch || gap + rate * until >= -touch) return false;
    if (rate == 0.0) return true;
    leave = std::min(leave, left / -rate);
    // Among directions that offset them for the same time, the first is chosen.
    const double begin = gap / -rate;
    if (gap > -touch && begin > enter + (which < axis ? -at_once : at_once)) {
      enter = std::max(begin, enter);
      slack = (2.0 * touch - std::min(gap, 0.0)) / -rate;
      axis = which;
    }
    return enter <= leave;
  }
};

bool BoxInField::follow(FieldPiece& piece, bool is_exact) const {
  Course course{until_, at_once_};
  const DVec3 offset = box_.centre - DVec3(piece.cell) - piece.middle;
  // `length`: the unit of the touch tolerance along this direction.
  const auto passes = [&](int which, const DVec3& along, double length) {
    const DVec3 along_half = along * piece.half;
    const auto extent =
        is_exact ? piece.exact_extent(along_half) : piece.extent(along_half, glm::dot(along, piece.slope));
    const DVec3 reaches = glm::abs(along * box_.axes) * half_size_;
    return course.passes(which, extent, glm::dot(along, offset), reaches.x + reaches.y + reaches.z,
                         glm::dot(along, box_.displacement), length);
  };
  // The plane separates most pieces that are not hit, so it is tested first.
  const bool has_slope = piece.square_of_slope > 0.0;
  if (has_slope && !passes(kSlope, piece.slope, std::sqrt(piece.square_of_slope))) return false;
  for (int i = 0; i < 3; ++i) {
    if (!passes(i, box_.axes[i], 1.0)) return false;
    if (!is_upright_ && !passes(kFirstOfGrid + i, kUnits[static_cast<std::size_t>(i)], 1.0)) return false;
  }
  const int last = !is_exact ? kSlope : is_upright_ ? kFirstSide : kAllDirections;
  for (int which = kFirstEdge; which < last && has_slope; ++which) {
    if (which == kSlope) which = kFirstCrease;
    const DVec3 along = direction(piece, which);
    const double square = glm::dot(along, along);
    if (square > 0.0 && !passes(which, along, std::sqrt(square))) return false;
  }
  piece.axis = course.axis;
  piece.slack = course.slack;
  piece.is_exact = is_exact;
  // Overlaps at the start come before contacts at time 0.
  piece.enter = course.axis < 0 ? -1.0 : std::max(course.enter, 0.0);
  return true;
}

bool BoxInField::may_meet(FieldPiece& piece) const {
  return follow(piece, false);
}

bool BoxInField::may_meet_exactly(FieldPiece& piece) const {
  return follow(piece, true);
}

// 0 if two edges are parallel.
DVec3 BoxInField::direction(const FieldPiece& piece, int which) const {
  QUOIN_ASSERT(which >= 0 && which < kAllDirections, "one of the directions");
  const auto across = [](const DVec3& a, const DVec3& b) {
    const DVec3 product = glm::cross(a, b);
    return glm::dot(product, product) > 1e-12 * glm::dot(a, a) * glm::dot(b, b) ? product : DVec3(0.0);
  };
  if (which < kFirstEdge) return box_.axes[which];
  if (which < kSlope) {
    const DVec3& edge = box_.axes[which - kFirstEdge];
    const DVec3 rest = piece.slope - glm::dot(piece.slope, edge) * edge;
    return glm::dot(rest, rest) > 1e-9 * piece.square_of_slope ? rest : DVec3(0.0);
  }
  if (which == kSlope) return piece.slope;
  if (which < kFirstCrease) return kUnits[static_cast<std::size_t>(which - kFirstOfGrid)];
  const int pair = (which - kFirstCrease) % 9;
  const DVec3 side = kUnits[static_cast<std::size_t>(pair / 3)];
  const DVec3 edge = which < kFirstSide ? across(piece.slope, side) : side;
  return across(edge, box_.axes[pair % 3]);
}

// Returns the direction that separates the two until contact, towards the box; for an overlap at the start, the plane's
// normal.
DVec3 BoxInField::parting(const FieldPiece& piece) const {
  const DVec3 along = direction(piece, piece.axis < 0 ? kSlope : piece.axis);
  return piece.axis >= 0 && glm::dot(along, box_.displacement) > 0.0 ? -along : along;
}

DVec3 BoxInField::normal(const FieldContact& contact, const DensityGrid& field) const {
  const FieldPiece& piece = contact.piece;
  if (piece.axis >= kFirstEdge && piece.axis < kFirstOfGrid) return unit_or_zero(parting(piece));
  if (piece.axis >= kFirstCrease && piece.axis < kFirstSide) return across_crease(contact, field);
  if (piece.axis >= 0 && piece.axis < kFirstEdge) return of_face(contact, field);
  // The grid's own axes only bound the piece. In that case returns the gradient nearby that opposes the motion most.
  DVec3 normal = unit_or_zero(contact.piece.gradient(contact.point));
  for (const DVec3& gradient : gradients_about(contact, field)) {
    const DVec3 other = unit_or_zero(gradient);
    if (glm::dot(other, box_.displacement) < glm::dot(normal, box_.displacement)) normal = other;
  }
  if (normal != DVec3(0.0) && glm::dot(normal, box_.displacement) <= 0.0) return normal;
  return unit_or_zero(piece.axis >= 0 ? parting(piece) : -box_.displacement);
}

// The normal of a face that touches a peak. There, the gradient is the face's normal, or gradients point to all
// sides of it. Otherwise an edge or a corner of the face touches the piece at the same time.
DVec3 BoxInField::of_face(const FieldContact& contact, const DensityGrid& field) const {
  const DVec3 normal = unit_or_zero(parting(contact.piece));
  const auto aside = [&](const DVec3& gradient) { return gradient - glm::dot(gradient, normal) * normal; };
  const DVec3 here = contact.piece.gradient(contact.point);
  const double most = 0.02 * glm::length(here);
  if (glm::length(aside(here)) <= most) return normal;
  const std::array<DVec3, 8> gradients = gradients_about(contact, field);
  DVec3 mean(0.0);
  for (const DVec3& gradient : gradients) mean += aside(gradient);
  const bool is_peak =
      std::any_of(gradients.begin(), gradients.end(), [&](const DVec3& g) { return glm::dot(aside(g), mean) <= 0.0; });
  if (is_peak) return normal;
  const DVec3 centre = box_.centre + contact.fraction * box_.displacement;
  const DVec3 at = glm::abs((DVec3(contact.piece.cell) + contact.point - centre) * box_.axes);
  DVec3 along = here;
  for (int i = 0; i < 3; ++i) {
    if (at[i] < half_size_[i] - 1e-3) along -= glm::dot(along, box_.axes[i]) * box_.axes[i];
  }
  along = unit_or_zero(along);
  return glm::dot(along, box_.displacement) < 0.0 ? along : normal;
}

std::array<DVec3, 8> BoxInField::gradients_about(const FieldContact& contact, const DensityGrid& field) {
  constexpr double kNear = 1e-4;
  std::array<DVec3, 8> gradients{};
  for (std::size_t i = 0; i < 8; ++i) {
    const DVec3 away((i & 1) != 0 ? kNear : -kNear, (i & 2) != 0 ? kNear : -kNear, (i & 4) != 0 ? kNear : -kNear);
    gradients[i] = field.gradient_at(DVec3(contact.piece.cell) + contact.point + away);
  }
  return gradients;
}

// If two cells meet in a ridge, the normal between a box edge and the ridge lies between the gradients of both cells.
// If the field continues past a side of the piece there is no ridge, and the gradient is the normal.
DVec3 BoxInField::across_crease(const FieldContact& contact, const DensityGrid& field) const {
  const FieldPiece& piece = contact.piece;
  QUOIN_ASSERT(piece.axis >= kFirstCrease && piece.axis < kFirstSide, "a crease of the plane and a side");
  const DVec3 normal = unit_or_zero(parting(piece));
  const DVec3& edge = box_.axes[(piece.axis - kFirstCrease) % 3];
  const DVec3 side = glm::cross(edge, normal);
  DVec3 nearest(0.0);
  double least = -kInfinity;
  double greatest = kInfinity;
  for (const DVec3& gradient : gradients_about(contact, field)) {
    const double along = glm::dot(gradient, normal);
    if (!(along > 0.0)) continue;
    // The gradient's angle from the normal, about the edge, as its tangent.
    const double angle = glm::dot(gradient, side) / along;
    if (nearest == DVec3(0.0) || std::abs(angle) < std::min(std::abs(least), std::abs(greatest))) {
      nearest = gradient - glm::dot(gradient, edge) * edge;
    }
    if (angle <= 0.0) least = std::max(least, angle);
    if (angle >= 0.0) greatest = std::min(greatest, angle);
  }
  const bool is_between = least > -kInfinity && greatest < kInfinity;
  const bool is_against = glm::dot(nearest, box_.displacement) < 0.0;
  return is_between || !is_against ? normal : unit_or_zero(nearest);
}

DVec3 BoxInField::nearest(const DVec3& centre, const DVec3& point) const {
  const DVec3 at = glm::clamp((point - centre) * box_.axes, -half_size_, half_size_);
  return centre + box_.axes * at;
}

// Returns the point of the box that is deepest along the separating direction. If that is an edge or a face, returns
// its point nearest to the highest point of the plane.
std::optional<DVec3> BoxInField::by_support(const FieldPiece& piece, const DVec3& centre) const {
  const DVec3 up = parting(piece);
  const double square = piece.square_of_slope;
  DVec3 corner = piece.middle;
  DVec3 highest = corner;
  if (square > 0.0) {
    const DVec3 rest = (up - glm::dot(up, piece.slope) / square * piece.slope) * piece.half;
    const double least = 1e-9 * (std::abs(rest.x) + std::abs(rest.y) + std::abs(rest.z));
    for (int i = 0; i < 3; ++i) {
      if (std::abs(rest[i]) > least) corner[i] += std::copysign(piece.half[i], rest[i]);
    }
    const double above = piece.density(corner);
    highest = clamped(piece, corner - piece.slope * (above / square));
  }
  const DVec3 along = up * box_.axes;
  DVec3 at = (highest - centre) * box_.axes;
  const double length = glm::length(up);
  for (int i = 0; i < 3; ++i) {
    at[i] = std::abs(along[i]) > 1e-7 * length ? std::copysign(half_size_[i], -along[i])
                                               : std::clamp(at[i], -half_size_[i], half_size_[i]);
  }
  if (piece.axis >= kFirstCrease && piece.axis < kFirstSide) {
    // The intersection of the box's edge with the side of the piece.
    const int side = (piece.axis - kFirstCrease) / 3;
    const int edge = (piece.axis - kFirstCrease) % 3;
    at[edge] = 0.0;
    const DVec3 from = centre + box_.axes * at;
    at[edge] = std::clamp((corner[side] - from[side]) / box_.axes[edge][side], -half_size_[edge], half_size_[edge]);
  }
  const DVec3 point = centre + box_.axes * at;
  return is_in(piece, point) && piece.density(point) < 0.0 ? std::optional(point) : std::nullopt;
}

std::optional<DVec3> BoxInField::point_in_solid(const FieldPiece& piece, double until) const {
  const DVec3 centre = box_.centre - DVec3(piece.cell) + until * box_.displacement;
  // If a direction gives the point of contact on the surface, only that point is tested.
  if (piece.axis >= 0) {
    const auto point = by_support(piece, centre);
    if (point || !piece.is_exact) return point;
  }
  return by_turns(piece, [&](const DVec3& point) { return nearest(centre, point); });
}

double BoxInField::time_beyond_doubt(const FieldPiece& piece) const {
  const double rate = -glm::dot(piece.slope, box_.displacement);
  return rate > 0.0 ? std::max(piece.enter, 0.0) + piece.slack + 2.01 * piece.doubt / rate : kInfinity;
}

DBox BoxInField::bounds(IVec3 cell, double from, double to) const {
  const DBox within = bounds_between(box_, reach_, from, to);
  return {within.min - DVec3(cell), within.max - DVec3(cell)};
}

namespace {

// The product of the symmetric matrix without a diagonal that has the components yz, xz, xy `m`, and a vector.
DVec3 across(const DVec3& m, const DVec3& v) {
  return {m.z * v.y + m.y * v.z, m.z * v.x + m.x * v.z, m.y * v.x + m.x * v.y};
}

// The nearest point of a piece's solid to the line of a capsule at rest, and a bound on the capsule's later distance.
//
// The square of the distance of a point from the line is convex. Added to a multiple of the density, it is at most the
// square for points of the solid, and still convex if the field bends less than a ball of that radius. Its minimum in
// the piece then is the square of the distance of the solid, and quadratic bounds hold while the capsule moves.
//
// Source: Lagrangian duality with a bound on the second derivatives of a trilinear function.
class CapsuleNearPiece {
 public:
  CapsuleNearPiece(const MovingCapsule& capsule, const FieldPiece& piece)
      : capsule_(capsule),
        piece_(piece),
        per_half_(1.0 / piece.half),
        low_(piece.middle - piece.half),
        high_(piece.middle + piece.half),
        point_(piece.middle) {
    const double square = glm::dot(capsule.half_axis, capsule.half_axis);
    if (square > 0.0) along_ = capsule.half_axis / square;
  }

  /// Moves to the nearest point at a time. Approximate, in a few steps from the previous point.
  void find(double time) {
    centre_ = capsule_.centre - DVec3(piece_.cell) + time * capsule_.displacement;
    for (int turn = 0; turn < 4; ++turn) {
      const DVec3 before = point_;
      step();
      const DVec3 moved = point_ - before;
      if (glm::dot(moved, moved) < 1e-9) break;
    }
    on_line_ = capsule_.nearest_of_line(centre_, point_);
  }
  [[nodiscard]] const DVec3& point() const { return point_; }
  /// Returns the way to there from the nearest point of the line.
  [[nodiscard]] DVec3 away() const { return point_ - on_line_; }

  /// A bound for the square of the distance: at least `at_once` + `rate` * t - `loss` * t^2 after an additional time t.
  struct Bound {
    double at_once = 0.0;
    double rate = 0.0;
    double loss = 0.0;
    double of_line = 0.0;     ///< the part missing from `at_once` because much of the line faces the piece
    bool is_reduced = false;  ///< the field bends too much for a good bound
  };
  /// Returns a bound for an additional time up to `most`.
  [[nodiscard]] Bound bound(double most) const;
  /// Returns the axis along which the piece has the longest part next to the line.
  [[nodiscard]] int axis_beside_line() const {
    const DVec3 lengths = glm::abs(along_) * piece_.half;
    return lengths.x >= lengths.y && lengths.x >= lengths.z ? 0 : lengths.y >= lengths.z ? 1 : 2;
  }

 private:
  static constexpr double kLeastGrowth = 0.05;
  static constexpr double kReducedGrowth = 0.4;

  struct Value {
    double density;
    DVec3 slope;  // density units per voxel
  };
  [[nodiscard]] Value value() const {
    const DVec3 u = (point_ - piece_.middle) * per_half_;
    const DVec3 slope = piece_.rise + across(piece_.bend, u) + piece_.warp * DVec3(u.y * u.z, u.x * u.z, u.x * u.y);
    const double density = piece_.level + piece_.doubt + glm::dot(piece_.rise, u) + piece_.bend.x * u.y * u.z +
                           piece_.bend.y * u.x * u.z + piece_.bend.z * u.x * u.y + piece_.warp * u.x * u.y * u.z;
    return {density, slope * per_half_};
  }

  // Moves to the nearest point of the box below the tangent plane at the current point.
  void step() {
    const DVec3 from = capsule_.nearest_of_line(centre_, point_);
    const auto [density, slope] = value();
    const double above = density - glm::dot(slope, point_);
    DVec3 next = glm::clamp(from, low_, high_);
    weight_ = 0.0;
    double left = above + glm::dot(slope, next);
    if (left > 0.0) {
      // The nearest point is that of the line minus a multiple of the slope, clamped to the box. In each turn
      // a component enters or leaves the box.
      DVec3 enter(kInfinity);
      DVec3 leave(kInfinity);
      for (int i = 0; i < 3; ++i) {
        if (slope[i] == 0.0) continue;
        const double per_slope = 1.0 / slope[i];
        enter[i] = (from[i] - (slope[i] > 0.0 ? high_[i] : low_[i])) * per_slope;
        leave[i] = (from[i] - (slope[i] > 0.0 ? low_[i] : high_[i])) * per_slope;
      }
      double multiple = 0.0;
      for (int turn = 0; turn < 7 && left > 0.0; ++turn) {
        double rate = 0.0;
        double end = kInfinity;
        for (int i = 0; i < 3; ++i) {
          const bool is_ahead = multiple < enter[i];
          if (!is_ahead && multiple < leave[i]) rate += slope[i] * slope[i];
          if (multiple < leave[i]) end = std::min(end, is_ahead ? enter[i] : leave[i]);
        }
        const double whole = rate > 0.0 ? multiple + left / rate : kInfinity;
        if (!(std::min(whole, end) < kInfinity)) break;
        multiple = std::min(whole, end);
        next = glm::clamp(from - multiple * slope, low_, high_);
        if (whole <= end) break;
        left = above + glm::dot(slope, next);
      }
      weight_ = 2.0 * multiple;
    }
    point_ = next;
  }

  // The movement, and the share of the half axis that the line's nearest point moves by itself, at most, for any point
  // in the piece during an additional time. A piece next to the line sees the same line while that moves along itself.
  // The movement along the line may then be left out.
  struct OfLine {
    DVec3 movement;
    double range;
  };
  [[nodiscard]] OfLine of_line(double time) const {
    const double here = std::clamp(glm::dot(on_line_ - centre_, along_), -1.0, 1.0);
    const double middle = glm::dot(piece_.middle - centre_, along_);
    const double spread = glm::dot(piece_.half, glm::abs(along_));
    const double shift = time * glm::dot(capsule_.displacement, along_);
    const double down = std::min(shift, 0.0);
    const double up = std::max(shift, 0.0);
    const auto range = [&](double low, double high) { return std::max({high - here, here - low, 0.0}); };
    const double whole =
        range(std::clamp(middle - spread - up, -1.0, 1.0), std::clamp(middle + spread - down, -1.0, 1.0));
    const double across_line =
        range(std::clamp(middle - spread, -1.0 + down, 1.0 + down), std::clamp(middle + spread, -1.0 + up, 1.0 + up));
    if (whole <= across_line) return {capsule_.displacement, whole};
    return {capsule_.displacement - glm::dot(capsule_.displacement, along_) * capsule_.half_axis, across_line};
  }

  const MovingCapsule& capsule_;
  const FieldPiece& piece_;
  DVec3 per_half_;
  DVec3 low_;
  DVec3 high_;
  DVec3 along_{0.0};
  DVec3 centre_{0.0};
  DVec3 point_;
  DVec3 on_line_{0.0};
  double weight_ = 0.0;  // of the density
};

// The multiplier of the density may depend on the position p if it is nowhere negative in the piece: it is `weight_` +
// tilt * (p - point_), where the tilt cancels the second derivatives of the sum along the slope. Only the bend of the
// surface itself is left, and terms of the third order. With z, the part of p - point_ that the movement does not
// explain, and q, the part that it does, the sum then grows by at least
//
//   |z|^2 + (z + q) * bend * (z + q) - |z + q| * unsure * |z + q| / 2 + error * (z + q)
//
// and the minimum over all z is known.
CapsuleNearPiece::Bound CapsuleNearPiece::bound(double most) const {
  const DVec3 away = this->away();
  const auto [density, slope] = value();
  const double square = glm::dot(slope, slope);
  const double warp = piece_.warp * per_half_.x * per_half_.y * per_half_.z;
  // Derivatives by yz, xz, xy.
  const DVec3 second =
      piece_.bend * DVec3(per_half_.y * per_half_.z, per_half_.x * per_half_.z, per_half_.x * per_half_.y) +
      warp * (point_ - piece_.middle);
  const DVec3 ends = glm::max(point_ - low_, high_ - point_);
  double weight = weight_;
  DVec3 tilt(0.0);
  double most_tilt = 0.0;
  if (square > 0.0 && weight > 0.0) {
    const DVec3 of_slope = across(second, slope);
    tilt = (0.5 * glm::dot(of_slope, slope) / square * slope - of_slope) * (weight / square);
    most_tilt = glm::dot(glm::abs(tilt), ends);
    if (most_tilt > weight) {
      tilt *= weight / most_tilt;
      most_tilt = weight;
    }
  }
  DVec3 diagonal = tilt * slope;
  DVec3 others =
      0.5 * (weight * second + DVec3(tilt.y * slope.z + tilt.z * slope.y, tilt.x * slope.z + tilt.z * slope.x,
                                     tilt.x * slope.y + tilt.y * slope.x));
  DVec3 unsure = most_tilt * glm::abs(second) + (weight + most_tilt) * std::abs(warp) / 3.0 * ends;
  // The least eigenvalue, from the trace and the sum of squares.
  const double trace = diagonal.x + diagonal.y + diagonal.z;
  const double squares = glm::dot(diagonal, diagonal) + 2.0 * glm::dot(others, others);
  const double least = trace / 3.0 - std::sqrt(2.0 / 3.0 * std::max(squares - trace * trace / 3.0, 0.0));
  double growth = 1.0 + std::min(least, 0.0) - std::sqrt(glm::dot(unsure, unsure) / 3.0);
  Bound bound;
  if (!(growth > kLeastGrowth)) {
    // A smaller multiplier gives a worse bound, which may do for a distant piece.
    const double share = (1.0 - kReducedGrowth) / (1.0 - growth);
    weight *= share;
    tilt *= share;
    diagonal *= share;
    others *= share;
    unsure *= share;
    growth = kReducedGrowth;
    bound.is_reduced = true;
  }
  const auto bent = [&](const DVec3& u) { return diagonal * u + across(others, u); };

  DVec3 error = 2.0 * away + weight * slope + density * tilt;
  for (int i = 0; i < 3; ++i) {
    // The sides of the piece hold the point.
    const bool is_held = (point_[i] >= high_[i] && error[i] < 0.0) || (point_[i] <= low_[i] && error[i] > 0.0);
    error[i] = is_held ? 0.0 : std::abs(error[i]);
  }
  const auto [v, range] = of_line(most);
  const DVec3 speed = glm::abs(v);
  const DVec3 unsure_speed = across(unsure, speed);
  const DVec3 a = capsule_.half_axis * range;
  const DVec3 aside = glm::abs(a);
  const DVec3 unsure_aside = across(unsure, aside);
  // Half of the greatest slope by z, of the error, the line and the movement.
  const double of_error = 0.5 * glm::length(error);
  const double of_line = glm::length(bent(a)) + 0.5 * glm::length(unsure_aside);
  const double of_speed = glm::length(bent(v)) + 0.5 * glm::length(unsure_speed);
  bound.of_line =
      std::max(of_line * of_line / growth - glm::dot(a, bent(a)) + 0.5 * glm::dot(aside, unsure_aside), 0.0) +
      2.0 * of_error * of_line / growth + glm::dot(error, aside);
  bound.at_once = glm::dot(away, away) + weight * density - of_error * of_error / growth - bound.of_line;
  bound.rate = -2.0 * (glm::dot(away, capsule_.displacement) + (of_error + of_line) * of_speed / growth +
                       std::abs(glm::dot(v, bent(a)))) -
               glm::dot(speed, unsure_aside + error);
  bound.loss = std::max(of_speed * of_speed / growth - glm::dot(v, bent(v)) + 0.5 * glm::dot(speed, unsure_speed), 0.0);
  return bound;
}

}  // namespace

// Returns the unit vector from the solid of a piece to the line of a capsule at `centre`; 0 if they touch. Relative to
// the cell.
DVec3 CapsuleInField::parting(const FieldPiece& piece, const DVec3& centre) const {
  DVec3 on_line = capsule_.nearest_of_line(centre, piece.middle);
  DVec3 nearest = on_line;
  for (int turn = 0; turn < 6; ++turn) {
    // Alternates between clamping to the piece and projecting below its plane: approximates the nearest point of its
    // solid.
    nearest = clamped(piece, on_line);
    for (int again = 0; again < 4 && piece.square_of_slope > 0.0; ++again) {
      const double above = glm::dot(piece.slope, nearest - piece.middle) + piece.level;
      if (!(above > 0.0)) break;
      nearest = clamped(piece, nearest - piece.slope * (above / piece.square_of_slope));
    }
    const DVec3 next = capsule_.nearest_of_line(centre, nearest);
    if (next == on_line) break;
    on_line = next;
  }
  return unit_or_zero(on_line - nearest);
}

bool CapsuleInField::is_away(FieldPiece& piece, double& time) const {
  if (!(piece.square_of_slope > 0.0)) return false;
  const DVec3 up = piece.slope / std::sqrt(piece.square_of_slope);
  const DVec3 centre = capsule_.centre - DVec3(piece.cell) - piece.middle;
  const double solid = piece.extent(up * piece.half, std::sqrt(piece.square_of_slope)).ahead;
  const double left = glm::dot(up, centre) - std::abs(glm::dot(up, capsule_.half_axis)) - solid - radius_;
  if (!(left > 0.0)) return false;
  const double speed = -glm::dot(up, capsule_.displacement);
  if (!(speed * until_ > left)) return true;
  time = left / speed;
  return false;
}

bool CapsuleInField::may_meet(FieldPiece& piece) const {
  constexpr int kMostTurns = 16;
  constexpr double kNear = 0.05;
  double time = -1.0;
  piece.slack = 0.0;
  piece.is_exact = true;
  piece.is_touched = false;
  piece.split = -1;
  if (is_away(piece, time)) return false;
  piece.enter = time;
  time = std::max(time, 0.0);
  CapsuleNearPiece near(capsule_, piece);
  for (int turn = 0; turn < kMostTurns; ++turn) {
    near.find(time);
    piece.nearest = near.point();
    // The bound is better for a short time: twice that to the contact with the tangent plane.
    const DVec3 away = near.away();
    const double distance = glm::length(away);
    const double speed = glm::dot(away, capsule_.displacement);
    double most = until_ - time;
    if (speed > 0.0) most = std::min(most, 2.0 * std::max(distance - radius_, 0.0) * distance / speed);
    const auto bound = near.bound(most);
    const double left = bound.at_once - radius_ * radius_;
    if (left > 0.0) piece.enter = time;
    if (left < 0.05 * kFieldTouch * radius_) {
      piece.is_touched = left > 0.0 && distance <= radius_ + 0.5 * kFieldTouch;
      if (piece.is_touched) return true;
      if (distance < radius_ + kNear && bound.of_line > 0.5 * std::abs(left)) piece.split = near.axis_beside_line();
      break;
    }
    // The first root of left + rate * t - loss * t^2.
    const double root = std::sqrt(bound.rate * bound.rate + 4.0 * bound.loss * left);
    time += root > bound.rate ? std::min(most, 2.0 * left / (root - bound.rate)) : most;
    if (!(time < until_)) return false;
    piece.enter = time;
  }
  // Planes are better far from the piece, and where the field bends much.
  return follow_planes(piece, time);
}

// As `may_meet`, from a time on, with planes that separate the capsule from the piece's solid.
bool CapsuleInField::follow_planes(FieldPiece& piece, double time) const {
  constexpr int kMostTurns = 16;
  for (int turn = 0; turn < kMostTurns; ++turn) {
    const DVec3 centre = capsule_.centre - DVec3(piece.cell) + time * capsule_.displacement;
    const DVec3 away = parting(piece, centre);
    const double offset = glm::dot(away, centre - piece.middle) - std::abs(glm::dot(away, capsule_.half_axis)) -
                          piece.exact_extent(away * piece.half).ahead;
    const double left = offset - radius_;
    if (!(left > 0.0)) break;
    const double speed = -glm::dot(away, capsule_.displacement);
    if (!(speed > 0.0)) return false;
    time += left / speed;
    if (!(time < until_)) return false;
    piece.enter = time;
    piece.slack = 2.0 * kFieldTouch / speed;
    if (left < 1e-3 * kFieldTouch) break;
  }
  return true;
}

std::optional<DVec3> CapsuleInField::point_in_solid(const FieldPiece& piece, double until) const {
  const DVec3 centre = capsule_.centre - DVec3(piece.cell) + until * capsule_.displacement;
  const auto nearest = [&](const DVec3& point) {
    const DVec3 on_line = capsule_.nearest_of_line(centre, point);
    const DVec3 away = point - on_line;
    const double length = glm::length(away);
    return length > capsule_.radius ? on_line + away * (capsule_.radius / length) : point;
  };
  // Slightly below the surface, at the point that is already known to be the nearest.
  const double square = glm::dot(piece.gradient(piece.nearest), piece.gradient(piece.nearest));
  if (square > 0.0) {
    const double above = std::max(piece.density(piece.nearest) + 0.25 * kFieldTouch * std::sqrt(square), 0.0);
    const DVec3 point = clamped(piece, piece.nearest - piece.gradient(piece.nearest) * (above / square));
    const DVec3 away = point - capsule_.nearest_of_line(centre, point);
    if (piece.density(point) < 0.0 && glm::dot(away, away) <= capsule_.radius * capsule_.radius) return point;
  }
  return by_turns(piece, nearest);
}

double CapsuleInField::time_beyond_doubt(const FieldPiece& piece) const {
  const double rate = -glm::dot(piece.slope, capsule_.displacement);
  return rate > 0.0 ? std::max(piece.enter, 0.0) + piece.slack + 2.01 * piece.doubt / rate : kInfinity;
}

DBox CapsuleInField::bounds(IVec3 cell, double from, double to) const {
  const DBox within = bounds_between(capsule_, reach_of(capsule_), from, to);
  return {within.min - DVec3(cell), within.max - DVec3(cell)};
}

// Returns the normal of a round contact: from the point of contact to the capsule's line. Between cells it is the
// normal of their ridge.
DVec3 CapsuleInField::normal(const FieldContact& contact, const DensityGrid& field) const {
  const DVec3 centre = capsule_.centre - DVec3(contact.piece.cell) + contact.fraction * capsule_.displacement;
  DVec3 normal(0.0);
  if (contact.piece.is_touched) {
    normal = unit_or_zero(capsule_.nearest_of_line(centre, contact.piece.nearest) - contact.piece.nearest);
  } else {
    normal = parting(contact.piece, centre);
  }
  if (normal == DVec3(0.0)) normal = unit_or_zero(capsule_.nearest_of_line(centre, contact.point) - contact.point);
  if (glm::dot(normal, capsule_.displacement) < 0.0) return normal;
  normal = unit_or_zero(field.gradient_at(DVec3(contact.piece.cell) + contact.point));
  return glm::dot(normal, capsule_.displacement) < 0.0 ? normal : unit_or_zero(-capsule_.displacement);
}

void BoxInField::shrink(DBox& part, IVec3 cell, double from, double to) const {
  const DVec3 offset = box_.centre - DVec3(cell);
  for (int i = 0; i < 3 && !is_upright_; ++i) {
    const DVec3& axis = box_.axes[i];
    const double middle = glm::dot(axis, offset);
    const double a = middle + from * glm::dot(axis, box_.displacement);
    const double b = middle + to * glm::dot(axis, box_.displacement);
    const double low = std::min(a, b) - half_size_[i] - kFieldTouch;
    const double high = std::max(a, b) + half_size_[i] + kFieldTouch;
    // For each axis, the range that the slab leaves for any position on the other two axes.
    const DVec3 at_min = axis * part.min;
    const DVec3 at_max = axis * part.max;
    const DVec3 least = glm::min(at_min, at_max);
    const DVec3 most = glm::max(at_min, at_max);
    for (int j = 0; j < 3; ++j) {
      if (std::abs(axis[j]) < 1e-3) continue;
      const double begin = low - (most.x + most.y + most.z - most[j]);
      const double end = high - (least.x + least.y + least.z - least[j]);
      part.min[j] = std::max(part.min[j], (axis[j] > 0.0 ? begin : end) / axis[j]);
      part.max[j] = std::min(part.max[j], (axis[j] > 0.0 ? end : begin) / axis[j]);
    }
  }
}

const DensityChunk* FieldCells::chunk_of_sample(IVec3 sample) {
  const IVec3 at = chunk_of(sample);
  if (!knows_chunk_ || at != chunk_at_) {
    chunk_ = field().find_chunk(at);
    chunk_at_ = at;
    knows_chunk_ = true;
  }
  return chunk_;
}

bool FieldCells::counts_at(IVec3 sample) {
  const DensityChunk* const chunk = chunk_of_sample(sample);
  if (chunk == nullptr) return false;
  const IVec3 local = local_of(sample);
  return types_.are_all() || types_.holds_solid(chunk->materials().get(local.x, local.y, local.z));
}

float FieldCells::density(IVec3 sample) {
  const DensityChunk* const chunk = chunk_of_sample(sample);
  const IVec3 local = local_of(sample);
  return chunk == nullptr ? field().band() : float_from_half(chunk->get(local.x, local.y, local.z));
}

bool FieldCells::read(IVec3 cell, CellCorners& corners) {
  if (!tree_.cells().is_occupied(cell)) return false;
  const IVec3 local = local_of(cell);
  const bool is_in_one_chunk = std::max({local.x, local.y, local.z}) < kChunkEdge - 1;
  for (int row = 0; row < 4; ++row) {
    const IVec3 sample = cell + IVec3{0, row & 1, row >> 1};
    const auto i = static_cast<std::size_t>(2 * row);
    const DensityChunk* const chunk = is_in_one_chunk ? chunk_of_sample(cell) : nullptr;
    const Half* const samples = chunk == nullptr ? nullptr : chunk->row(local_of(sample).y, local_of(sample).z);
    if (samples != nullptr) {
      corners[i] = double{float_from_half(samples[local.x])};
      corners[i + 1] = double{float_from_half(samples[local.x + 1])};
    } else {
      corners[i] = double{density(sample)};
      corners[i + 1] = double{density(sample + IVec3{1, 0, 0})};
    }
  }
  for (int i = 0; i < 8; ++i) {
    if (corners[static_cast<std::size_t>(i)] < 0.0 && counts_at(cell + IVec3{i & 1, i >> 1 & 1, i >> 2})) return true;
  }
  return false;
}

VoxelType FieldCells::material(IVec3 cell, const DVec3& point) {
  double least = std::numeric_limits<double>::infinity();
  IVec3 nearest = cell;
  for (int i = 0; i < 8; ++i) {
    const IVec3 corner{i & 1, i >> 1 & 1, i >> 2};
    const DVec3 away = DVec3(corner) - point;
    const double square = glm::dot(away, away);
    if (!(square < least) || !(field().density(cell + corner) < 0.0F) || !counts_at(cell + corner)) continue;
    least = square;
    nearest = cell + corner;
  }
  return field().material(nearest);
}

template <class Moving>
void FieldSweep<Moving>::check(const IBox& near, double from, double to) {
  const double until = std::min(to, most_);
  Shape shape(shape_, until);
  FieldSearch<Shape> search(shape);
  CellCorners corners;
  for (int z = near.min.z; z < near.max.z; ++z) {
    for (int y = near.min.y; y < near.max.y; ++y) {
      for (int x = near.min.x; x < near.max.x; ++x) {
        if (cells_.read({x, y, z}, corners)) search.add({x, y, z}, corners, from, until);
      }
    }
  }
  const auto contact = search.first(until);
  tested_ += search.tested();
  if (contact && contact->fraction < best_.fraction) best_ = *contact;
}

template <class Moving>
DVec3 FieldSweep<Moving>::normal() const {
  return Shape(shape_, most_).normal(best_, cells_.field());
}

namespace {

DVec3 nearest_within(const MovingBox& box, const DVec3& point) {
  const DVec3 at = glm::clamp((point - box.centre) * box.axes, -box.half_size, box.half_size);
  return box.centre + box.axes * at;
}
DVec3 nearest_within(const MovingCapsule& capsule, const DVec3& point) {
  const DVec3 on_line = capsule.nearest_of_line(capsule.centre, point);
  const DVec3 away = point - on_line;
  const double length = glm::length(away);
  return length > capsule.radius ? on_line + away * (capsule.radius / length) : point;
}

// The point of least density in a shape at rest, among the corners of its intersection with each cell. Exact for a box
// along the grid's axes.
struct Deepest {
  DVec3 point{0.0};
  double density = 0.0;
};

template <class Moving>
Deepest deepest_in(const DensityTree& tree, const TypesMet& types, const Moving& shape) {
  FieldCells cells(tree, types);
  const DBox bounds = bounds_between(shape, reach_of(shape), 0.0, 0.0);
  const IBox near = voxels_within(bounds, cells.bounds());
  Deepest deepest;
  CellCorners corners;
  for (int z = near.min.z; z < near.max.z; ++z) {
    for (int y = near.min.y; y < near.max.y; ++y) {
      for (int x = near.min.x; x < near.max.x; ++x) {
        if (!cells.read({x, y, z}, corners)) continue;
        const DVec3 cell(x, y, z);
        const DVec3 low = glm::clamp(bounds.min, cell, cell + 1.0);
        const DVec3 high = glm::clamp(bounds.max, cell, cell + 1.0);
        for (int i = 0; i < 8; ++i) {
          const DVec3 corner((i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y,
                             (i & 4) != 0 ? high.z : low.z);
          const DVec3 point = nearest_within(shape, corner);
          const double density = tree.field().density_at(point);
          if (density < deepest.density) deepest = {point, density};
        }
      }
    }
  }
  return deepest;
}

// Returns the distance along a direction after which the shape is free; infinity if more than `most`.
template <class Moving>
double depth_along(const DensityTree& tree, const TypesMet& types, const Moving& shape, DVec3 direction, double guess,
                   double most) {
  for (double length = guess;; length *= 2.0) {
    Moving back = shape;
    back.centre += direction * std::min(length, most);
    back.displacement = -direction * std::min(length, most);
    FieldSweep<Moving> sweep(tree, types, back, 1.0);
    follow_way(back, 1.0, sweep);
    // Free at the start of the way back: the first contact on the way back is the last solid that the shape leaves.
    if (!sweep.best().starts_inside) return std::min(length, most) * (1.0 - std::min(sweep.best().fraction, 1.0));
    if (length >= most) return kInfinity;
  }
}

// Returns the unit gradient of the field around a point, from samples beyond its cell; 0 if the field is constant
// there.
DVec3 direction_out(const DensityGrid& field, DVec3 point) {
  DVec3 gradient(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    DVec3 step(0.0);
    step[axis] = 0.5;
    gradient[axis] = double{field.density_at(point + step)} - double{field.density_at(point - step)};
  }
  const double length = glm::length(gradient);
  return length > 0.0 ? gradient / length : DVec3(0.0);
}

}  // namespace

template <class Moving>
WayOut way_out(const DensityTree& tree, const TypesMet& types, const Moving& shape, const FieldContact& contact) {
  const DVec3 reach = reach_of(shape);
  const double most = 2.0 * glm::length(reach) + 2.0;
  Deepest deepest = deepest_in(tree, types, shape);
  if (!(deepest.density < 0.0)) deepest.point = DVec3(contact.piece.cell) + contact.point;
  const DVec3 gradient = direction_out(tree.field(), deepest.point);
  const double guess = std::min(0.25 - 2.0 * deepest.density, most);
  if (gradient != DVec3(0.0)) {
    const double depth = depth_along(tree, types, shape, gradient, guess, most);
    if (depth < kInfinity) return {gradient, std::max(depth, kFieldTouch)};
  }
  WayOut best{gradient, kInfinity};
  for (int i = 0; i < 6; ++i) {
    DVec3 direction(0.0);
    direction[i / 2] = i % 2 == 0 ? 1.0 : -1.0;
    const double depth = depth_along(tree, types, shape, direction, guess, most);
    if (depth < best.depth) best = {direction, std::max(depth, kFieldTouch)};
  }
  if (best.depth < kInfinity) return best;
  return {gradient != DVec3(0.0) ? gradient : DVec3(0.0, 1.0, 0.0), 1.0};
}

template class FieldSweep<MovingBox>;
template class FieldSweep<MovingCapsule>;
template WayOut way_out(const DensityTree&, const TypesMet&, const MovingBox&, const FieldContact&);
template WayOut way_out(const DensityTree&, const TypesMet&, const MovingCapsule&, const FieldContact&);

}  // namespace quoin
