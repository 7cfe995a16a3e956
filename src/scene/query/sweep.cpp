#include <quoin/scene/sweep.h>

#include <array>
#include <limits>

#include "scene/query/field_sweep.h"
#include "scene/query/moving_box.h"
#include "scene/query/query_in_grid.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Fractions that differ by less are of voxels met at once.
constexpr double kAtOnce = 1e-9;

// A moving box, with what parts it from voxels.
struct Moving {
  DVec3 centre{0.0};
  SeparatingAxes axes{};
  std::array<double, 15> reach{};
  std::array<double, 15> speed{};

  explicit Moving(const MovingBox& box) : centre(box.centre), axes(separating_axes(box.half_axes)) {
    for (std::size_t i = 0; i < axes.size(); ++i) {
      reach[i] = reach_along(axes[i], box.half_axes);
      speed[i] = glm::dot(box.displacement, axes[i]);
    }
  }
};

// When a moving box meets a voxel.
struct Contact {
  double fraction = kInfinity;
  DVec3 normal{0.0};  // in the grid
  double depth = 0.0;
  int axis = -1;
};

// The contact of a box that overlaps the voxel from the start: the direction in which it is out soonest.
Contact inside_contact(const Moving& box, DVec3 between) {
  Contact contact;
  contact.fraction = 0.0;
  contact.depth = kInfinity;
  for (std::size_t i = 0; i < box.axes.size(); ++i) {
    if (box.axes[i] == DVec3(0.0)) continue;
    const double apart = glm::dot(between, box.axes[i]);
    const double depth = box.reach[i] - std::abs(apart);
    if (depth >= contact.depth - 1e-12) continue;
    contact.depth = depth;
    contact.normal = apart > 0.0 ? -box.axes[i] : box.axes[i];
    contact.axis = static_cast<int>(i);
  }
  return contact;
}

Contact meet(const Moving& box, IVec3 voxel) {
  const DVec3 between = DVec3(voxel) + 0.5 - box.centre;
  Contact contact;
  double enter = -kInfinity;
  double leave = kInfinity;
  for (std::size_t i = 0; i < box.axes.size(); ++i) {
    if (box.axes[i] == DVec3(0.0)) continue;
    const double apart = glm::dot(between, box.axes[i]);
    const double reach = box.reach[i] - kTouch;
    const double speed = box.speed[i];
    if (speed == 0.0) {
      if (std::abs(apart) >= reach) return {};
      continue;
    }
    const double begin = (speed > 0.0 ? apart - reach : apart + reach) / speed;
    leave = std::min(leave, (speed > 0.0 ? apart + reach : apart - reach) / speed);
    // The voxel's own axes come first, and are preferred.
    if (begin > enter + 1e-12 || contact.axis < 0) {
      enter = begin;
      contact.normal = speed > 0.0 ? -box.axes[i] : box.axes[i];
      contact.axis = static_cast<int>(i);
    }
    if (enter >= leave || leave <= 0.0) return {};
  }
  if (enter > 1.0) return {};
  if (enter < 0.0) return inside_contact(box, between);
  contact.fraction = enter;
  return contact;
}

// The voxels of one grid, and the best contact with them so far; for `follow_way`.
class BlockSweep {
 public:
  BlockSweep(const Grid& grid, const TypesMet& types, const MovingBox& box)
      : reader_(grid), types_(types), box_(box), bounds_(grid.bounds()) {}

  [[nodiscard]] const IBox& bounds() const { return bounds_; }
  [[nodiscard]] double fraction() const { return best_.fraction; }
  void check(const IBox& near, double /*from*/, double /*to*/) {
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
    const Contact contact = meet(box_, voxel);
    if (contact.fraction > best_.fraction + kAtOnce || contact.axis < 0) return;
    const bool is_exposed = faces_air(voxel, contact);
    const bool is_earlier = contact.fraction < best_.fraction - kAtOnce;
    const bool is_deeper = contact.depth > best_.depth;
    if (!is_earlier && !(is_exposed && !best_is_exposed_) && !(is_exposed == best_is_exposed_ && is_deeper)) return;
    best_ = contact;
    voxel_ = voxel;
    best_is_exposed_ = is_exposed;
  }

  // Whether the face that was met has no voxel that counts before it; of edges that cross it is not known.
  [[nodiscard]] bool faces_air(IVec3 voxel, const Contact& contact) {
    if (contact.axis >= 3) return true;
    IVec3 before = voxel;
    before[contact.axis] += contact.normal[contact.axis] > 0.0 ? 1 : -1;
    return !types_.holds(reader_.get(before));
  }

  GridReader reader_;
  const TypesMet& types_;
  Moving box_;
  IBox bounds_;
  Contact best_;
  IVec3 voxel_{0};
  bool best_is_exposed_ = false;
};

// The first contact with what an instance places, up to the fraction `most`.
std::optional<SweepHit> first_of_voxels(const PlacedGrid& placed, const TypesMet& types, const MovingBox& box,
                                        double most) {
  if (placed.voxels->bounds().empty()) return std::nullopt;
  std::optional<SweepHit> last;
  visit_sides(box, [&](const MovingBox& side) {
    BlockSweep sweep(*placed.voxels, types, side);
    follow_way(side, most, sweep);
    const Contact& best = sweep.best();
    const bool is_met = best.axis >= 0;
    if (!is_met) {
      last.reset();
    } else if (!last || best.fraction > last->fraction) {
      const DVec3 normal = glm::normalize(placed.world_axes * best.normal);
      const double depth = best.depth * placed.voxel_size;
      last = SweepHit{best.fraction, normal, placed.instance, sweep.voxel(), depth, sweep.type()};
    }
    return is_met;
  });
  return last;
}

std::optional<SweepHit> first_of_field(const PlacedGrid& placed, const TypesMet& types, const MovingBox& box,
                                       double most) {
  FieldSweep sweep(*placed.field, types, box, most);
  follow_way(box, most, sweep);
  const FieldContact& best = sweep.best();
  if (!(best.fraction <= most)) return std::nullopt;
  SweepHit hit{best.fraction, sweep.normal(), placed.instance, best.piece.cell, 0.0, sweep.material(), true};
  if (best.starts_inside) {
    const WayOut out = way_out(*placed.field, types, box, best);
    hit.normal = out.normal;
    hit.depth = out.depth * placed.voxel_size;
  }
  hit.normal = glm::normalize(placed.world_axes * hit.normal);
  return hit;
}

bool is_sooner(const SweepHit& hit, const std::optional<SweepHit>& first) {
  return !first || hit.fraction < first->fraction || (hit.fraction == first->fraction && hit.depth > first->depth);
}

}  // namespace

std::optional<SweepHit> sweep_box(const SceneTracer& tracer, const OrientedBox& box, DVec3 displacement,
                                  const QueryFilter& filter) {
  if (!is_box(box) || !is_finite(displacement)) return std::nullopt;
  const glm::dmat3 half_axes = half_axes_of(box);
  const DVec3 reach = reach_of_axes(half_axes);
  const DVec3 end = box.centre + displacement;
  const Seen seen(tracer, filter, QueryTypes::Colliding);
  std::optional<SweepHit> first;
  const DBox way{glm::min(box.centre, end) - reach, glm::max(box.centre, end) + reach};
  seen.visit_near(way, [&](const PlacedGrid& placed) {
    const MovingBox moving = moving_in_grid(placed, box, half_axes, displacement);
    const auto of_voxels = first_of_voxels(placed, seen.types, moving, first ? first->fraction : 1.0);
    if (of_voxels && is_sooner(*of_voxels, first)) first = of_voxels;
    if (placed.field == nullptr) return;
    const auto of_field = first_of_field(placed, seen.types, moving, first ? first->fraction : 1.0);
    if (of_field && is_sooner(*of_field, first)) first = of_field;
  });
  return first;
}

}  // namespace quoin
