#include "scene/query/field_shapes.h"

namespace quoin {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Of the directions that may part a box from a piece.
constexpr int kFirstEdge = 3;
constexpr int kSlope = 6;
constexpr int kFirstOfGrid = 7;

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

// By turns the nearest point of a shape, and a step from there down the field.
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

// The times during which nothing is known to part a box from the solid of a piece.
struct BoxInField::Course {
  double until;
  double enter = -kInfinity;
  double leave = kInfinity;
  double slack = 0.0;
  int axis = -1;

  // A direction of any length: how far the solid reaches along it from the piece's middle, how far away the box's
  // centre is from there and how far it reaches itself, and how fast it moves. Returns whether they may meet at all.
  bool passes(int which, FieldPiece::Extent solid, double apart, double reach, double rate, double length) {
    if (rate > 0.0) {
      rate = -rate;
      apart = -apart;
      std::swap(solid.ahead, solid.behind);
    }
    const double gap = apart - reach - solid.ahead;
    const double left = apart + reach + solid.behind;
    const double touch = kFieldTouch * length;
    if (left <= touch || gap + rate * until >= -touch) return false;
    if (rate == 0.0) return true;
    leave = std::min(leave, left / -rate);
    if (gap > -touch && gap / -rate > enter + 1e-12) {
      enter = gap / -rate;
      slack = (2.0 * touch - std::min(gap, 0.0)) / -rate;
      axis = which;
    }
    return enter <= leave;
  }
};

bool BoxInField::may_meet(FieldPiece& piece) const {
  Course course{until_};
  const DVec3 apart = box_.centre - DVec3(piece.cell) - piece.middle;
  const DVec3 along = piece.slope * box_.axes;
  const DVec3 reaches = glm::abs(along) * box_.half_size;
  const double square = piece.square_of_slope;
  for (int i = 0; i < 3; ++i) {
    const DVec3& axis = box_.axes[i];
    if (!course.passes(i, piece.extent(axis * piece.half, along[i]), glm::dot(axis, apart), box_.half_size[i],
                       rates_[i], 1.0)) {
      return false;
    }
  }
  for (int i = 0; i < 3; ++i) {
    DVec3 along_half(0.0);
    along_half[i] = piece.half[i];
    if (!course.passes(kFirstOfGrid + i, piece.extent(along_half, piece.slope[i]), apart[i], reach_[i],
                       box_.displacement[i], 1.0)) {
      return false;
    }
  }
  if (square > 0.0) {
    const double reach = reaches.x + reaches.y + reaches.z;
    const double slope_apart = glm::dot(piece.slope, apart);
    const double rate = glm::dot(piece.slope, box_.displacement);
    for (int i = 0; i < 3; ++i) {
      const double rest = square - along[i] * along[i];
      if (rest <= 1e-9 * square) continue;
      const DVec3 direction = piece.slope - along[i] * box_.axes[i];
      if (!course.passes(kFirstEdge + i, piece.extent(direction * piece.half, rest),
                         slope_apart - along[i] * glm::dot(box_.axes[i], apart), reach - reaches[i],
                         rate - along[i] * rates_[i], std::sqrt(rest))) {
        return false;
      }
    }
    if (!course.passes(kSlope, piece.extent(piece.rise, square), slope_apart, reach, rate, std::sqrt(square))) {
      return false;
    }
  }
  piece.axis = course.axis;
  piece.slack = course.slack;
  // What is inside from the start comes before what is met at once.
  piece.enter = course.axis < 0 ? -1.0 : std::max(course.enter, 0.0);
  return true;
}

DVec3 BoxInField::direction(const FieldPiece& piece) const {
  DVec3 along(0.0);
  if (piece.axis < 0 || piece.axis == kSlope) {
    along = piece.slope;
  } else if (piece.axis < kFirstEdge) {
    along = box_.axes[piece.axis];
  } else if (piece.axis < kSlope) {
    const DVec3& edge = box_.axes[piece.axis - kFirstEdge];
    along = piece.slope - glm::dot(piece.slope, edge) * edge;
  } else {
    along[piece.axis - kFirstOfGrid] = 1.0;
  }
  return piece.axis >= 0 && glm::dot(along, box_.displacement) > 0.0 ? -along : along;
}

DVec3 BoxInField::normal(const FieldPiece& piece, const DVec3& point) const {
  // The grid's own directions only tell where the piece ends.
  if (piece.axis >= 0 && piece.axis < kSlope) return unit_or_zero(direction(piece));
  const DVec3 gradient = unit_or_zero(piece.gradient(point));
  if (gradient != DVec3(0.0) && glm::dot(gradient, box_.displacement) <= 0.0) return gradient;
  return unit_or_zero(-box_.displacement);
}

DVec3 BoxInField::nearest(const DVec3& centre, const DVec3& point) const {
  const DVec3 at = glm::clamp((point - centre) * box_.axes, -box_.half_size, box_.half_size);
  return centre + box_.axes * at;
}

// The point of the box that is deepest below what parts the two; where a whole edge or face is, the point of it that is
// nearest to where the plane is highest.
std::optional<DVec3> BoxInField::by_support(const FieldPiece& piece, const DVec3& centre) const {
  const DVec3 up = direction(piece);
  const double square = piece.square_of_slope;
  DVec3 highest = piece.middle;
  if (square > 0.0) {
    const DVec3 rest = (up - glm::dot(up, piece.slope) / square * piece.slope) * piece.half;
    const double least = 1e-9 * (std::abs(rest.x) + std::abs(rest.y) + std::abs(rest.z));
    for (int i = 0; i < 3; ++i) {
      if (std::abs(rest[i]) > least) highest[i] += std::copysign(piece.half[i], rest[i]);
    }
    const double above = piece.density(highest);
    highest = clamped(piece, highest - piece.slope * (above / square));
  }
  const DVec3 along = up * box_.axes;
  DVec3 at = (highest - centre) * box_.axes;
  const double length = glm::length(up);
  for (int i = 0; i < 3; ++i) {
    at[i] = std::abs(along[i]) > 1e-7 * length ? std::copysign(box_.half_size[i], -along[i])
                                               : std::clamp(at[i], -box_.half_size[i], box_.half_size[i]);
  }
  const DVec3 point = centre + box_.axes * at;
  return is_in(piece, point) && piece.density(point) < 0.0 ? std::optional(point) : std::nullopt;
}

std::optional<DVec3> BoxInField::point_in_solid(const FieldPiece& piece, double until) const {
  const DVec3 centre = box_.centre - DVec3(piece.cell) + until * box_.displacement;
  if (piece.axis >= 0) {
    if (const auto point = by_support(piece, centre)) return point;
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

bool BallInField::may_meet(FieldPiece& piece) const {
  const DVec3 centre = centre_ - DVec3(piece.cell);
  piece.enter = -1.0;
  if (glm::length(clamped(piece, centre) - centre) >= radius_ - kFieldTouch) return false;
  const double above = glm::dot(piece.slope, centre - piece.middle) + piece.level;
  return above < (radius_ - kFieldTouch) * std::sqrt(piece.square_of_slope) || piece.square_of_slope == 0.0;
}

std::optional<DVec3> BallInField::point_in_solid(const FieldPiece& piece, double /*until*/) const {
  const DVec3 centre = centre_ - DVec3(piece.cell);
  return by_turns(piece, [&](const DVec3& point) {
    const DVec3 away = point - centre;
    const double length = glm::length(away);
    return length > radius_ ? centre + away * (radius_ / length) : point;
  });
}

DBox BallInField::bounds(IVec3 cell, double /*from*/, double /*to*/) const {
  const DVec3 centre = centre_ - DVec3(cell);
  return {centre - radius_, centre + radius_};
}

DVec3 BallInField::normal(const FieldPiece& piece, const DVec3& point) const {
  const DVec3 gradient = unit_or_zero(piece.gradient(point));
  return gradient != DVec3(0.0) ? gradient : unit_or_zero(centre_ - DVec3(piece.cell) - point);
}

}  // namespace quoin
