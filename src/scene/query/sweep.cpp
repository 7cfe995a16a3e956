#include <quoin/scene/sweep.h>

#include <array>
#include <limits>

#include <glm/vector_relational.hpp>

#include <quoin/core/assert.h>

#include "scene/query/field_search.h"
#include "scene/query/moving_shapes.h"
#include "scene/query/query_in_grid.h"
#include "scene/query/unloaded_chunks.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {
namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();
// Voxels whose fractions differ by less are hit simultaneously.
constexpr double kAtOnce = 1e-9;

// A moving shape's contact with a voxel.
struct Contact {
  double fraction = kEndless;
  DVec3 normal{0.0};  // in the grid
  double depth = 0.0;
  int axis = -1;  // grid axis of the normal; 3 and more: other axes; -1: no contact
};

// A moving box and the axes that can offset it from voxels, and from boxes of the grid.
class BoxAmongVoxels {
 public:
  explicit BoxAmongVoxels(const MovingBox& box)
      : box_(box), centre_(box.centre), axes_(separating_axes(box.half_axes)) {
    for (std::size_t i = 0; i < axes_.size(); ++i) {
      reach_[i] = reach_along(axes_[i], box.half_axes);
      speed_[i] = glm::dot(box.displacement, axes_[i]);
    }
  }
  [[nodiscard]] Contact meet(IVec3 voxel, double most) const {
    return meet(DVec3(voxel) + 0.5 - centre_, most, [this](std::size_t i) { return reach_[i]; });
  }
  [[nodiscard]] Contact meet(const DBox& box, double most) const {
    const DVec3 half = 0.5 * (box.max - box.min);
    return meet(0.5 * (box.min + box.max) - centre_, most,
                [&](std::size_t i) { return reach_along(axes_[i], box_.half_axes, half); });
  }
  [[nodiscard]] DVec3 centre_at(double fraction) const { return centre_ + fraction * box_.displacement; }

 private:
  template <class ReachOf>
  [[nodiscard]] Contact meet(DVec3 between, double most, const ReachOf& reach_of) const;
  template <class ReachOf>
  [[nodiscard]] Contact inside_contact(DVec3 between, const ReachOf& reach_of) const;

  const MovingBox& box_;
  DVec3 centre_{0.0};
  SeparatingAxes axes_{};
  std::array<double, 15> reach_{};
  std::array<double, 15> speed_{};
};

// Returns the contact of a box that overlaps the obstacle at the start: the direction of the shortest way out.
template <class ReachOf>
Contact BoxAmongVoxels::inside_contact(DVec3 between, const ReachOf& reach_of) const {
  Contact contact;
  contact.fraction = 0.0;
  contact.depth = kEndless;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (axes_[i] == DVec3(0.0)) continue;
    const double offset = glm::dot(between, axes_[i]);
    const double depth = reach_of(i) - std::abs(offset);
    if (depth >= contact.depth - 1e-12) continue;
    contact.depth = depth;
    contact.normal = offset > 0.0 ? -axes_[i] : axes_[i];
    contact.axis = static_cast<int>(i);
  }
  return contact;
}

// `between`: from the box's centre to that of the obstacle. `reach_of(i)`: of both together along axis i.
template <class ReachOf>
Contact BoxAmongVoxels::meet(DVec3 between, double most, const ReachOf& reach_of) const {
  Contact contact;
  double enter = -kEndless;
  double leave = kEndless;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    if (axes_[i] == DVec3(0.0)) continue;
    const double offset = glm::dot(between, axes_[i]);
    const double reach = reach_of(i) - kTouch;
    const double speed = speed_[i];
    if (speed == 0.0) {
      if (std::abs(offset) >= reach) return {};
      continue;
    }
    const double begin = (speed > 0.0 ? offset - reach : offset + reach) / speed;
    leave = std::min(leave, (speed > 0.0 ? offset + reach : offset - reach) / speed);
    // The voxel's own axes come first, and are preferred.
    if (begin > enter + 1e-12 || contact.axis < 0) {
      enter = begin;
      contact.normal = speed > 0.0 ? -axes_[i] : axes_[i];
      contact.axis = static_cast<int>(i);
    }
    if (enter >= leave || leave <= 0.0) return {};
  }
  if (enter > most) return {};
  if (enter < 0.0) return inside_contact(between, reach_of);
  contact.fraction = enter;
  return contact;
}

// As above, for a moving capsule.
class CapsuleAmongVoxels {
 public:
  explicit CapsuleAmongVoxels(const MovingCapsule& capsule) : capsule_(capsule) {}
  [[nodiscard]] Contact meet(IVec3 voxel, double most) const {
    return meet(capsule_.centre - (DVec3(voxel) + 0.5), most, HalfVoxel{});
  }
  [[nodiscard]] Contact meet(const DBox& box, double most) const {
    return meet(capsule_.centre - 0.5 * (box.min + box.max), most, 0.5 * (box.max - box.min));
  }
  [[nodiscard]] DVec3 centre_at(double fraction) const { return capsule_.centre + fraction * capsule_.displacement; }

 private:
  template <class Half>
  [[nodiscard]] Contact meet(DVec3 offset, double most, const Half& half) const;
  [[nodiscard]] Contact contact_at(double fraction, const LineGap& gap) const;

  const MovingCapsule& capsule_;
};

Contact CapsuleAmongVoxels::contact_at(double fraction, const LineGap& gap) const {
  Contact contact{fraction, gap.away, 0.0, 3};
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(gap.away[axis]) >= 1.0 - 1e-12) contact.axis = axis;
  }
  return contact;
}

// `offset`: from the obstacle's centre to that of the capsule.
template <class Half>
Contact CapsuleAmongVoxels::meet(DVec3 offset, double most, const Half& half) const {
  constexpr int kMostSteps = 64;  // enough to halve a distance to nothing, as for grazing contacts
  constexpr double kMet = 1e-12;
  const double radius = capsule_.radius - kTouch;
  double fraction = 0.0;
  for (int step = 0; step < kMostSteps; ++step) {
    LineGap gap = gap_of_line(offset + fraction * capsule_.displacement, capsule_.half_axis, half);
    const double left = gap.distance - radius;
    if (step == 0 && left < 0.0) {
      // A smaller gap is a rounding error of a line through the voxel.
      if (gap.distance < kTouch) gap = way_out_of_line(offset, capsule_.half_axis, half);
      Contact contact = contact_at(0.0, gap);
      contact.depth = capsule_.radius - gap.distance;
      return contact;
    }
    const double speed = -glm::dot(gap.away, capsule_.displacement);
    if (!(speed > 0.0)) return {};
    if (left <= kMet) return contact_at(fraction, gap);
    fraction += left / speed;
    if (!(fraction <= most)) return {};
  }
  return {};
}

// The voxels of one grid, and the best contact with them so far; an argument of `follow_way`.
template <class Shape, class Reader>
class BlockSweep {
 public:
  // `source`: the grid to read. `shapes`: null if all voxels are cubes.
  template <class Source>
  BlockSweep(const Source& source, const IBox& bounds, const TypesMet& types, const Shape& shape,
             const ShapeObstacles* shapes)
      : reader_(source), types_(types), shape_(shape), bounds_(bounds), shapes_(shapes) {}

  [[nodiscard]] const IBox& bounds() const { return bounds_; }
  [[nodiscard]] double fraction() const { return best_.fraction; }
  void check(const IBox& near, double /*from*/, double /*to*/) {
    if (shapes_ != nullptr) return check_cells(near);
    for (int z = near.min.z; z < near.max.z; ++z) {
      for (int y = near.min.y; y < near.max.y; ++y) {
        for (int x = near.min.x; x < near.max.x; ++x) check_voxel({x, y, z});
      }
    }
  }

  [[nodiscard]] const Contact& best() const { return best_; }
  [[nodiscard]] IVec3 voxel() const { return voxel_; }
  [[nodiscard]] VoxelType type() { return reader_.get(voxel_); }

 private:
  void check_voxel(IVec3 voxel) {
    if (!types_.holds(reader_.get(voxel))) return;
    const Contact contact = shape_.meet(voxel, std::min(best_.fraction + kAtOnce, 1.0));
    if (contact.axis < 0) return;
    take(voxel, contact, faces_air(voxel, contact));
  }

  // As `check`, among cubes and shapes.
  void check_cells(const IBox& near) {
    for (int z = near.min.z; z < near.max.z; ++z) {
      for (int y = near.min.y; y < near.max.y; ++y) {
        for (int x = near.min.x; x < near.max.x; ++x) {
          const IVec3 cell{x, y, z};
          if (shapes_->is_cube_met(cell, reader_.get(cell))) check_box(cell, DBox{DVec3(cell), DVec3(cell) + 1.0});
          shapes_->visit(cell, [&](IVec3 voxel, const DBox& box) { check_box(voxel, box); });
        }
      }
    }
  }
  void check_box(IVec3 voxel, const DBox& box) {
    const Contact contact = shape_.meet(box, std::min(best_.fraction + kAtOnce, 1.0));
    if (contact.axis >= 0) take(voxel, contact, faces_air(box, contact));
  }

  void take(IVec3 voxel, const Contact& contact, bool is_exposed) {
    const bool is_earlier = contact.fraction < best_.fraction - kAtOnce;
    const bool is_deeper = contact.depth > best_.depth;
    if (!is_earlier && !(is_exposed && !best_is_exposed_) && !(is_exposed == best_is_exposed_ && is_deeper)) return;
    best_ = contact;
    voxel_ = voxel;
    best_is_exposed_ = is_exposed;
  }

  // Returns true if no matching voxel covers the face that was hit. Always true for edge contacts, which have no face.
  [[nodiscard]] bool faces_air(IVec3 voxel, const Contact& contact) {
    QUOIN_ASSERT(contact.axis >= 0, "a contact");
    if (contact.axis >= 3) return true;
    IVec3 before = voxel;
    before[contact.axis] += contact.normal[contact.axis] > 0.0 ? 1 : -1;
    return !types_.holds(reader_.get(before));
  }
  // As above, for a box: at the point of the hit face that is nearest to the shape's centre.
  [[nodiscard]] bool faces_air(const DBox& box, const Contact& contact) {
    constexpr double kInside = 1e-4;  // from the face's edges, so that the point is in front of this face only
    if (contact.axis >= 3) return true;
    const DVec3 room = glm::min(DVec3(kInside), 0.5 * (box.max - box.min));
    DVec3 point = glm::clamp(shape_.centre_at(contact.fraction), box.min + room, box.max - room);
    const bool is_upper = contact.normal[contact.axis] > 0.0;
    point[contact.axis] = is_upper ? box.max[contact.axis] + 1e-6 : box.min[contact.axis] - 1e-6;
    const IVec3 cell(glm::floor(point));
    bool is_covered = shapes_->is_cube_met(cell, reader_.get(cell));
    shapes_->visit(cell, [&](IVec3 /*voxel*/, const DBox& other) {
      is_covered |= glm::all(glm::greaterThan(point, other.min)) && glm::all(glm::lessThan(point, other.max));
    });
    return !is_covered;
  }

  Reader reader_;
  const TypesMet& types_;
  const Shape& shape_;
  IBox bounds_;
  const ShapeObstacles* shapes_;
  Contact best_;
  IVec3 voxel_{0};
  bool best_is_exposed_ = false;
};

template <class Shape, class Reader>
SweepHit hit_of(const PlacedGrid& placed, BlockSweep<Shape, Reader>& sweep) {
  const Contact& best = sweep.best();
  QUOIN_ASSERT(best.axis >= 0, "a contact");
  const DVec3 normal = glm::normalize(placed.world_axes * best.normal);
  return {best.fraction, normal, placed.instance, sweep.voxel(), best.depth * placed.voxel_size, sweep.type()};
}

bool is_sooner(const SweepHit& hit, const std::optional<SweepHit>& first) {
  return !first || hit.fraction < first->fraction || (hit.fraction == first->fraction && hit.depth > first->depth);
}

// The first contact with voxels, up to the fraction `most`.
template <class Reader, class Source>
std::optional<SweepHit> first_of(const PlacedGrid& placed, const TypesMet& types, const MovingBox& box, double most,
                                 const Source& source, const IBox& bounds, const ShapeObstacles* shapes) {
  std::optional<SweepHit> last;
  visit_sides(box, [&](const MovingBox& side) {
    const BoxAmongVoxels shape(side);
    BlockSweep<BoxAmongVoxels, Reader> sweep(source, bounds, types, shape, shapes);
    follow_way(side, most, sweep);
    const Contact& best = sweep.best();
    const bool is_met = best.axis >= 0;
    if (!is_met) {
      last.reset();
    } else if (!last || best.fraction > last->fraction) {
      last = hit_of(placed, sweep);
    }
    return is_met;
  });
  return last;
}

template <class Reader, class Source>
std::optional<SweepHit> first_of(const PlacedGrid& placed, const TypesMet& types, const MovingCapsule& capsule,
                                 double most, const Source& source, const IBox& bounds, const ShapeObstacles* shapes) {
  const CapsuleAmongVoxels shape(capsule);
  BlockSweep<CapsuleAmongVoxels, Reader> sweep(source, bounds, types, shape, shapes);
  follow_way(capsule, most, sweep);
  if (sweep.best().axis < 0) return std::nullopt;
  return hit_of(placed, sweep);
}

// Returns the first contact with the voxels of an instance.
template <class Moving>
std::optional<SweepHit> first_of_voxels(const PlacedGrid& placed, const TypesMet& types, const Moving& shape,
                                        double most) {
  const IBox bounds = placed.voxels->bounds();
  if (placed.shapes == nullptr) {
    return first_of<GridReader>(placed, types, shape, most, *placed.voxels, bounds, nullptr);
  }
  const ShapeObstacles shapes(placed, types);
  return first_of<GridReader>(placed, types, shape, most, *placed.voxels, shapes.bounds(bounds), &shapes);
}

// Returns the first contact with an unloaded chunk, for a shape in chunk units.
template <class Moving>
std::optional<SweepHit> first_of_unloaded(const PlacedGrid& chunks, const Moving& shape, double most) {
  if (is_surely_loaded(*chunks.grid, bounds_between(shape, reach_of(shape), 0.0, most))) return std::nullopt;
  const VoxelRegistry none;
  const TypesMet all(none, QueryTypes::All);
  std::optional<SweepHit> first;
  for_each_corner(*chunks.grid, [&](DVec3 offset, const UnloadedReader& reader) {
    Moving moved = shape;
    moved.centre += offset;
    const double until = first ? first->fraction : most;
    const auto hit = first_of<UnloadedReader>(chunks, all, moved, until, reader, extent_of(*chunks.grid), nullptr);
    if (hit && is_sooner(*hit, first)) first = hit;
  });
  if (!first) return std::nullopt;
  first->voxel *= kChunkEdge;
  first->type = kAir;
  first->is_unloaded = true;
  return first;
}

template <class Moving>
std::optional<SweepHit> first_of_field(const PlacedGrid& placed, const TypesMet& types, const Moving& shape,
                                       double most) {
  FieldSweep<Moving> sweep(*placed.field, types, shape, most);
  follow_way(shape, most, sweep);
  const FieldContact& best = sweep.best();
  if (!(best.fraction <= most)) return std::nullopt;
  SweepHit hit{best.fraction, sweep.normal(), placed.instance, best.piece.cell, 0.0, sweep.material(), true};
  if (best.starts_inside) {
    const WayOut out = way_out(*placed.field, types, shape, best);
    hit.normal = out.normal;
    hit.depth = out.depth * placed.voxel_size;
  }
  hit.normal = glm::normalize(placed.world_axes * hit.normal);
  return hit;
}

// `moving_in(placed)` is the shape in that grid's space; `reach`: from its centre along the world's axes.
template <class MovingIn>
std::optional<SweepHit> first_of_scene(const SceneTracer& tracer, DVec3 centre, DVec3 reach, DVec3 displacement,
                                       const QueryFilter& filter, const MovingIn& moving_in) {
  const DVec3 end = centre + displacement;
  const Seen seen(tracer, filter, QueryTypes::Colliding);
  std::optional<SweepHit> first;
  seen.visit_near({glm::min(centre, end) - reach, glm::max(centre, end) + reach}, [&](const PlacedGrid& placed) {
    const auto moving = moving_in(placed);
    if (!placed.voxels->bounds().empty()) {
      const auto of_voxels = first_of_voxels(placed, seen.types, moving, first ? first->fraction : 1.0);
      if (of_voxels && is_sooner(*of_voxels, first)) first = of_voxels;
    }
    if (placed.field == nullptr) return;
    const auto of_field = first_of_field(placed, seen.types, moving, first ? first->fraction : 1.0);
    if (of_field && is_sooner(*of_field, first)) first = of_field;
  });
  if (!seen.meets_unloaded) return first;
  seen.visit_partial([&](const PlacedGrid& chunks) {
    const auto of_unloaded = first_of_unloaded(chunks, moving_in(chunks), first ? first->fraction : 1.0);
    if (of_unloaded && is_sooner(*of_unloaded, first)) first = of_unloaded;
  });
  return first;
}

}  // namespace

std::optional<SweepHit> sweep_box(const SceneTracer& tracer, const OrientedBox& box, DVec3 displacement,
                                  const QueryFilter& filter) {
  if (!is_box(box) || !is_finite(displacement)) return std::nullopt;
  const glm::dmat3 half_axes = half_axes_of(box);
  return first_of_scene(tracer, box.centre, reach_of_axes(half_axes), displacement, filter,
                        [&](const PlacedGrid& placed) { return moving_in_grid(placed, box, half_axes, displacement); });
}

std::optional<SweepHit> sweep_capsule(const SceneTracer& tracer, const Capsule& capsule, DVec3 displacement,
                                      const QueryFilter& filter) {
  if (!is_capsule(capsule) || !is_finite(displacement)) return std::nullopt;
  return first_of_scene(tracer, capsule.centre, reach_of(capsule), displacement, filter,
                        [&](const PlacedGrid& placed) { return moving_in_grid(placed, capsule, displacement); });
}

}  // namespace quoin
