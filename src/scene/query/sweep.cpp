#include <quoin/scene/sweep.h>

#include <array>
#include <limits>

#include "scene/query/query_in_grid.h"

namespace quoin {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Fractions that differ by less are of voxels met at once.
constexpr double kAtOnce = 1e-9;

// Of any finite vector: the square of a large one would be infinite.
double length_of(DVec3 v) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (largest == 0.0) return 0.0;
  return std::min(largest * glm::length(v / largest), std::numeric_limits<double>::max());
}

// A box on its way through a grid's space.
struct Moving {
  DVec3 centre{0.0};
  glm::dmat3 half_axes{1.0};
  DVec3 displacement{0.0};
  SeparatingAxes axes{};
  std::array<double, 15> reach{};
  std::array<double, 15> speed{};
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

// One grid, and the best contact in it so far.
class GridSweep {
 public:
  GridSweep(const Grid& grid, const VoxelRegistry& types, const Moving& box, double most)
      : grid_(grid), reader_(grid), types_(types), box_(box), most_(most) {}

  void run() {
    const DVec3 reach = reach_of_axes(box_.half_axes);
    const double length = length_of(box_.displacement);
    const double step = std::max(1.0, std::min({reach.x, reach.y, reach.z}));
    const auto [first, last] = times_within(reach);
    if (first > last) return;
    // Whole steps from the start, so that what is met does not depend on the grid's bounds.
    const double steps = std::max(1.0, std::ceil(length / step));
    double i = std::floor(first * steps);
    // So far away steps are lost in rounding; what there is within the bounds is looked at in one.
    if (i + 1.0 == i) return check_part(reach, first, std::min(last, most_));
    for (; i / steps <= std::min(last, most_); ++i) {
      check_part(reach, i / steps, std::min((i + 1.0) / steps, 1.0));
      if (best_.fraction <= (i + 1.0) / steps || i + 1.0 >= steps) break;
    }
  }

  [[nodiscard]] const Contact& best() const { return best_; }
  [[nodiscard]] IVec3 voxel() const { return voxel_; }

 private:
  // When the box's bounds are within those of the grid's voxels.
  [[nodiscard]] std::pair<double, double> times_within(DVec3 reach) const {
    const IBox tight = grid_.bounds();
    double first = 0.0;
    double last = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double low = tight.min[axis] - reach[axis] - 1.0 - box_.centre[axis];
      const double high = tight.max[axis] + reach[axis] + 1.0 - box_.centre[axis];
      const double d = box_.displacement[axis];
      if (d == 0.0) {
        if (low > 0.0 || high < 0.0) return {1.0, 0.0};
        continue;
      }
      first = std::max(first, std::min(low / d, high / d));
      last = std::min(last, std::max(low / d, high / d));
    }
    return {first, last};
  }

  void check_part(DVec3 reach, double from, double to) {
    const DVec3 a = box_.centre + from * box_.displacement;
    const DVec3 b = box_.centre + to * box_.displacement;
    const IBox near = voxels_within({glm::min(a, b) - reach - 1e-6, glm::max(a, b) + reach + 1e-6}, grid_.bounds());
    for (int z = near.min.z; z < near.max.z; ++z) {
      for (int y = near.min.y; y < near.max.y; ++y) {
        for (int x = near.min.x; x < near.max.x; ++x) check_voxel({x, y, z});
      }
    }
  }

  void check_voxel(IVec3 voxel) {
    if (!collides(types_, reader_.get(voxel))) return;
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

  // Whether the face that was met has no colliding voxel before it; of edges that cross it is not known.
  [[nodiscard]] bool faces_air(IVec3 voxel, const Contact& contact) {
    if (contact.axis >= 3) return true;
    IVec3 before = voxel;
    before[contact.axis] += contact.normal[contact.axis] > 0.0 ? 1 : -1;
    return !collides(types_, reader_.get(before));
  }

  const Grid& grid_;
  GridReader reader_;
  const VoxelRegistry& types_;
  const Moving& box_;
  double most_;
  Contact best_;
  IVec3 voxel_{0};
  bool best_is_exposed_ = false;
};

Moving moving_in_grid(const PlacedGrid& placed, const OrientedBox& box, const glm::dmat3& half_axes,
                      DVec3 displacement) {
  const ToGrid to_grid(placed);
  Moving moving;
  moving.centre = to_grid.point(box.centre);
  moving.half_axes = to_grid.axes * half_axes;
  moving.displacement = to_grid.axes * displacement;
  moving.axes = separating_axes(moving.half_axes);
  for (std::size_t i = 0; i < moving.axes.size(); ++i) {
    moving.reach[i] = reach_along(moving.axes[i], moving.half_axes);
    moving.speed[i] = glm::dot(moving.displacement, moving.axes[i]);
  }
  return moving;
}

}  // namespace

std::optional<SweepHit> sweep_box(const SceneTracer& tracer, const VoxelRegistry& types, const OrientedBox& box,
                                  DVec3 displacement) {
  if (!is_box(box) || !is_finite(displacement)) return std::nullopt;
  const glm::dmat3 half_axes = half_axes_of(box);
  const DVec3 reach = reach_of_axes(half_axes);
  const DVec3 end = box.centre + displacement;
  std::vector<std::size_t> near;
  SceneQuery::instances(tracer).visit_box({glm::min(box.centre, end) - reach, glm::max(box.centre, end) + reach},
                                          [&](std::size_t i) { near.push_back(i); });
  std::sort(near.begin(), near.end());
  std::optional<SweepHit> first;
  for (const std::size_t i : near) {
    const PlacedGrid& placed = tracer.placed()[i];
    const Moving moving = moving_in_grid(placed, box, half_axes, displacement);
    GridSweep sweep(*placed.voxels, types, moving, first ? first->fraction : 1.0);
    sweep.run();
    const Contact& best = sweep.best();
    if (best.axis < 0) continue;
    const double depth = best.depth * placed.voxel_size;
    if (first && (best.fraction > first->fraction || (best.fraction == first->fraction && depth <= first->depth))) {
      continue;
    }
    first =
        SweepHit{best.fraction, glm::normalize(placed.world_axes * best.normal), placed.instance, sweep.voxel(), depth};
  }
  return first;
}

namespace {

// What is left of a displacement after the contacts so far.
DVec3 along_contacts(DVec3 displacement, const std::vector<DVec3>& normals) {
  const auto goes_into = [&](DVec3 d) {
    return std::any_of(normals.begin(), normals.end(),
                       [&](DVec3 normal) { return glm::dot(d, normal) < -1e-9 * glm::length(d); });
  };
  if (!goes_into(displacement)) return displacement;
  for (const DVec3 normal : normals) {
    const DVec3 slid = displacement - glm::dot(displacement, normal) * normal;
    if (glm::dot(displacement, normal) < 0.0 && !goes_into(slid)) return slid;
  }
  for (std::size_t i = 0; i < normals.size(); ++i) {
    for (std::size_t j = i + 1; j < normals.size(); ++j) {
      const DVec3 crease = glm::cross(normals[i], normals[j]);
      const double squared = glm::dot(crease, crease);
      if (squared < 1e-12) continue;
      const DVec3 slid = crease * (glm::dot(displacement, crease) / squared);
      if (!goes_into(slid)) return slid;
    }
  }
  return DVec3(0.0);
}

}  // namespace

SlideResult move_and_slide(const SceneTracer& tracer, const VoxelRegistry& types, const OrientedBox& box,
                           DVec3 displacement, const SlideOptions& options) {
  SlideResult result{box.centre, displacement, false, DVec3(0.0)};
  OrientedBox moving = box;
  DVec3 left = displacement;
  std::vector<DVec3> normals;
  for (int contact = 0; contact < options.max_contacts; ++contact) {
    const auto hit = sweep_box(tracer, types, moving, left);
    if (!hit) {
      if (is_finite(left)) moving.centre += left;
      break;
    }
    result.is_blocked = true;
    result.normal = hit->normal;
    if (hit->depth > 0.0) {
      if (!options.pushes_out) break;
      moving.centre += hit->normal * (hit->depth + options.skin);
      continue;
    }
    const double speed = -glm::dot(left, hit->normal);
    const double back = speed > 0.0 ? options.skin / speed : 0.0;
    const double fraction = std::max(0.0, hit->fraction - back);
    moving.centre += left * fraction;
    normals.push_back(hit->normal);
    left = along_contacts(left * (1.0 - fraction), normals);
    if (left == DVec3(0.0)) break;
  }
  result.displacement = along_contacts(displacement, normals);
  result.centre = moving.centre;
  return result;
}

}  // namespace quoin
