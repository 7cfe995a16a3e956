#include <quoin/trace/ray.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include <quoin/trace/packet.h>

#include "trace/kernel/kernel.h"
#include "trace/tree_view.h"

namespace quoin {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A walk through a tree from one plane crossing to the next. Every crossing's distance is found from the origin,
// (plane - origin) / direction, by the same formula whatever the size of the step, so a walk in large steps crosses the
// same planes at the same distances, in the same order, as one voxel at a time.
class Walk {
 public:
  Walk(const OccupancyTree& tree, const Ray& ray) : nodes_(tree) {
    for (int axis = 0; axis < 3; ++axis) {
      origin_[axis] = ray.origin[axis];
      direction_[axis] = ray.direction[axis];
      inverse_[axis] = direction_[axis] != 0.0 ? 1.0 / direction_[axis] : 0.0;
    }
  }

  // Moves to where the ray enters the bounds; false when it misses them, or enters beyond `max_t`.
  bool enter(const IBox& bounds, double max_t) {
    double enter_t = 0.0;
    double exit_t = max_t;
    int enter_axis = -1;
    int exit_axis = 3;
    for (int axis = 0; axis < 3; ++axis) {
      const double low = bounds.min[axis];
      const double high = bounds.max[axis];
      const double o = origin_[axis];
      if (direction_[axis] == 0.0) {
        if (o < low || o >= high) return false;
        continue;
      }
      const bool is_forward = direction_[axis] > 0.0;
      const bool starts_before = is_forward ? o < low : o >= high;
      if (starts_before) {
        const double t = ((is_forward ? low : high) - o) * inverse_[axis];
        // The last plane to be crossed; at a tie the later axis.
        if (enter_axis < 0 || t >= enter_t) {
          enter_t = t;
          enter_axis = axis;
        }
      }
      const double t = ((is_forward ? high : low) - o) * inverse_[axis];
      if (t < exit_t) {
        exit_t = t;
        exit_axis = axis;
      }
    }
    // Through an edge of the bounds: it has left before it enters if the axis on which it leaves goes first.
    if (!(enter_t <= exit_t) || (enter_t == exit_t && exit_axis < enter_axis)) return false;
    bounds_ = bounds;
    t_ = enter_t;
    axis_ = enter_axis;
    for (int axis = 0; axis < 3; ++axis) voxel_[axis] = coordinate_at_start(axis);
    return true;
  }

  // Steps until the voxel is occupied (true), or the ray leaves the bounds or passes `max_t` (false).
  bool find(double max_t) {
    for (int size = empty_size(); size != 0; size = empty_size()) {
      step(size);
      if (!is_within(max_t)) return false;
    }
    return true;
  }

  // Leaves the voxel it is in.
  void leave_voxel() { step(1); }
  [[nodiscard]] bool is_within(double max_t) const {
    return t_ <= max_t && voxel_[axis_] >= bounds_.min[axis_] && voxel_[axis_] < bounds_.max[axis_];
  }

  [[nodiscard]] IVec3 voxel() const { return {voxel_[0], voxel_[1], voxel_[2]}; }
  [[nodiscard]] double t() const { return t_; }
  /// The axis of the last plane crossed; -1 before the first.
  [[nodiscard]] int axis() const { return axis_; }

 private:
  // Where the ray stands on `axis` when it has entered its bounds, or starts within.
  [[nodiscard]] int coordinate_at_start(int axis) const {
    if (axis_ < 0) return static_cast<int>(std::floor(origin_[axis]));
    const int last = bounds_.max[axis] - 1;
    if (axis == axis_) return direction_[axis] > 0.0 ? bounds_.min[axis] : last;
    return coordinate_after(axis, bounds_.min[axis], last);
  }

  // Where the ray is on `axis` just after the current crossing, between `low` and `high`.
  [[nodiscard]] int coordinate_after(int axis, int low, int high) const {
    const double d = direction_[axis];
    const double o = origin_[axis];
    const double position = o + t_ * d;
    if (!(position > low)) return settled(axis, low, low, high);
    if (!(position < high + 1.0)) return settled(axis, high, low, high);
    const int floor = static_cast<int>(std::floor(position));
    const double fraction = position - floor;
    // Rounding can put a position on the wrong side of a plane only next to it.
    if (fraction > 1e-5 && fraction < 1.0 - 1e-5) return floor;
    return settled(axis, floor, low, high);
  }

  // Corrects a coordinate by comparing crossings: planes whose t is less were crossed before, and at a tie those of
  // axes before this one.
  [[nodiscard]] int settled(int axis, int guess, int low, int high) const {
    if (direction_[axis] == 0.0) return std::clamp(static_cast<int>(std::floor(origin_[axis])), low, high);
    const int forward = direction_[axis] > 0.0 ? 1 : -1;
    const double start = std::floor(origin_[axis]);
    const auto is_crossed = [&](int into) {
      // The voxel it starts in was never entered, even if it starts on that voxel's plane.
      if (forward > 0 ? into <= start : into >= start) return true;
      // The plane through which the ray enters voxel `into`.
      const double plane = forward > 0 ? into : into + 1.0;
      const double t = (plane - origin_[axis]) * inverse_[axis];
      return t < t_ || (t == t_ && axis < axis_);
    };
    int at = guess;
    while (at + forward >= low && at + forward <= high && is_crossed(at + forward)) at += forward;
    while (at - forward >= low && at - forward <= high && !is_crossed(at)) at -= forward;
    return at;
  }

  // Leaves the aligned block of this size around the voxel.
  void step(int size) {
    std::array<double, 3> t{};
    std::array<int, 3> low{};
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      low[a] = voxel_[axis] & ~(size - 1);
      const double plane = direction_[axis] > 0.0 ? static_cast<double>(low[a]) + size : low[a];
      t[a] = direction_[axis] != 0.0 ? (plane - origin_[axis]) * inverse_[axis] : kInfinity;
    }
    int axis = t[0] <= t[1] ? 0 : 1;
    if (t[2] < t[static_cast<std::size_t>(axis)]) axis = 2;
    t_ = t[static_cast<std::size_t>(axis)];
    axis_ = axis;
    for (int other = 0; other < 3; ++other) {
      const auto a = static_cast<std::size_t>(other);
      if (other == axis) {
        voxel_[other] = direction_[other] > 0.0 ? low[a] + size : low[a] - 1;
      } else if (size > 1) {
        // Never back: the ray is at or beyond the voxel it was in.
        const bool is_forward = direction_[other] > 0.0;
        voxel_[other] = coordinate_after(other, is_forward ? voxel_[other] : low[a],
                                         is_forward || direction_[other] == 0.0 ? low[a] + size - 1 : voxel_[other]);
      }
    }
  }

  // The edge of the largest aligned block around the voxel that is known to be empty; 0 when the voxel is occupied.
  int empty_size() {
    const IVec3 v = voxel();
    const IVec3 chunk = v >> 6;
    if (chunk != chunk_ || !knows_chunk_) {
      chunk_ = chunk;
      knows_chunk_ = true;
      const int size = enter_chunk(chunk);
      if (size != 0) {
        knows_chunk_ = false;
        return size;
      }
    }
    const auto brick = static_cast<std::size_t>((v.x >> 4 & 3) + 4 * (v.y >> 4 & 3) + 16 * (v.z >> 4 & 3));
    const std::uint64_t cells = node_->cells[brick];
    if (cells == 0) return 16;
    const auto cell = static_cast<std::size_t>((v.x >> 2 & 3) + 4 * (v.y >> 2 & 3) + 16 * (v.z >> 2 & 3));
    if ((cells >> cell & 1U) == 0) return 4;
    const std::uint64_t voxels = nodes_.brick(node_->bricks[brick])[cell];
    return (voxels >> ((v.x & 3) + 4 * (v.y & 3) + 16 * (v.z & 3)) & 1U) != 0 ? 0 : 1;
  }

  // Looks up a chunk's node; returns the size of the empty block around it where there is none.
  int enter_chunk(IVec3 chunk) {
    const IVec3 region = chunk >> 4;
    if (region != region_coordinates_ || !knows_region_) {
      region_coordinates_ = region;
      knows_region_ = true;
      region_ = nodes_.find_region(region);
    }
    if (region_ == nullptr) return 1'024;
    const IVec3 c = chunk & 15;
    const std::uint64_t word = region_->chunks[static_cast<std::size_t>((c.x >> 2) + 4 * (c.y >> 2) + 16 * (c.z >> 2))];
    if (word == 0) return 256;
    if ((word >> ((c.x & 3) + 4 * (c.y & 3) + 16 * (c.z & 3)) & 1U) == 0) return 64;
    node_ = &nodes_.chunk(region_->nodes[static_cast<std::size_t>(c.x + 16 * c.y + 256 * c.z)]);
    return 0;
  }

  trace::TreeNodes nodes_;
  const trace::RegionNode* region_ = nullptr;
  const trace::ChunkNode* node_ = nullptr;
  IVec3 region_coordinates_{0};
  IVec3 chunk_{0};
  bool knows_region_ = false;
  bool knows_chunk_ = false;
  double origin_[3] = {};
  double direction_[3] = {};
  double inverse_[3] = {};
  IBox bounds_;
  double t_ = 0.0;
  int axis_ = -1;
  int voxel_[3] = {};
};

bool is_usable(const Ray& ray, double max_t) {
  double length = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    if (!std::isfinite(ray.origin[axis]) || !std::isfinite(ray.direction[axis])) return false;
    length += std::abs(ray.direction[axis]);
  }
  return length > 0.0 && max_t >= 0.0;
}

// The face that looks most against a direction.
Direction facing(const DVec3& direction) {
  return nearest_direction(-direction);
}

Direction face_of(const Walk& walk, const Ray& ray) {
  if (walk.axis() < 0) return facing(ray.direction);
  return static_cast<Direction>(2 * walk.axis() + (ray.direction[walk.axis()] > 0.0 ? 1 : 0));
}

// `first_hit` one step at a time, for rays of any length in worlds of any size.
std::optional<RayHit> walk_to_first_hit(const OccupancyTree& tree, const Ray& ray, double max_t) {
  if (!is_usable(ray, max_t)) return std::nullopt;
  Walk walk(tree, ray);
  if (!walk.enter(tree.bounds(), max_t) || !walk.find(max_t)) return std::nullopt;
  return RayHit{walk.voxel(), face_of(walk, ray), walk.t(), walk.axis() < 0};
}

}  // namespace

std::optional<RayHit> first_hit(const OccupancyTree& tree, const Ray& ray, double max_t) {
  const trace::TreeView* view = tree.view();
  if (view == nullptr) return walk_to_first_hit(tree, ray, max_t);
  RayHit hit;
  bool is_unfinished = false;
  if (!trace::kernel().first_hit(*view, ray, max_t, hit, is_unfinished)) {
    if (is_unfinished) [[unlikely]]
      return walk_to_first_hit(tree, ray, max_t);
    return std::nullopt;
  }
  if (hit.starts_inside) hit.face = facing(ray.direction);
  return hit;
}

bool any_hit(const OccupancyTree& tree, const Ray& ray, double max_t) {
  const trace::TreeView* view = tree.view();
  if (view == nullptr) return walk_to_first_hit(tree, ray, max_t).has_value();
  bool is_unfinished = false;
  const bool is_hit = trace::kernel().any_hit(*view, ray, max_t, is_unfinished);
  return is_unfinished ? walk_to_first_hit(tree, ray, max_t).has_value() : is_hit;
}

void first_hits(const OccupancyTree& tree, const RayPacket& rays, PacketHits& hits) {
  hits.hit = hits.starts_inside = 0;
  std::uint32_t unfinished = rays.active;
  if (const trace::TreeView* view = tree.view()) {
    trace::kernel().first_hits(*view, rays, hits, unfinished);
  }
  for (std::uint32_t inside = hits.starts_inside; inside != 0; inside &= inside - 1) {
    const int lane = std::countr_zero(inside);
    hits.face[static_cast<std::size_t>(lane)] = facing(rays.ray(lane).direction);
  }
  for (; unfinished != 0; unfinished &= unfinished - 1) {
    const int lane = std::countr_zero(unfinished);
    const double max_t = rays.max_t[static_cast<std::size_t>(lane)];
    if (const auto hit = walk_to_first_hit(tree, rays.ray(lane), max_t)) hits.set(lane, *hit);
  }
}

std::uint32_t any_hits(const OccupancyTree& tree, const RayPacket& rays) {
  std::uint32_t unfinished = rays.active;
  std::uint32_t blocked = 0;
  if (const trace::TreeView* view = tree.view()) {
    blocked = trace::kernel().any_hits(*view, rays, unfinished);
  }
  for (; unfinished != 0; unfinished &= unfinished - 1) {
    const int lane = std::countr_zero(unfinished);
    const bool is_blocked =
        walk_to_first_hit(tree, rays.ray(lane), rays.max_t[static_cast<std::size_t>(lane)]).has_value();
    blocked |= std::uint32_t{is_blocked} << lane;
  }
  return blocked;
}

void visit_hits(const OccupancyTree& tree, const Ray& ray, double max_t,
                const std::function<bool(const VoxelSpan&)>& visit) {
  if (!is_usable(ray, max_t)) return;
  Walk walk(tree, ray);
  if (!walk.enter(tree.bounds(), max_t)) return;
  while (walk.find(max_t)) {
    VoxelSpan span{walk.voxel(), face_of(walk, ray), walk.t(), 0.0, walk.axis() < 0};
    walk.leave_voxel();
    span.t_exit = walk.t();
    if (!visit(span) || !walk.is_within(max_t)) return;
  }
}

}  // namespace quoin
