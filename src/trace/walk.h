#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <quoin/core/assert.h>
#include <quoin/trace/ray.h>

#include "trace/tree_view.h"

namespace quoin::trace {

/// A walk through a tree from one plane crossing to the next, in double precision. The distance of every crossing is
/// (plane - origin) / direction, computed by the same formula for any step size. A walk in large steps therefore
/// crosses the same planes at the same distances, in the same order, as a walk over single voxels.
class Walk {
 public:
  Walk(const OccupancyTree& tree, const Ray& ray) : nodes_(tree) {
    for (int axis = 0; axis < 3; ++axis) {
      origin_[axis] = ray.origin[axis];
      direction_[axis] = ray.direction[axis];
      inverse_[axis] = direction_[axis] != 0.0 ? 1.0 / direction_[axis] : 0.0;
    }
  }

  /// Walks of several rays, one after the other, remember the part of the tree that they read last. Call `set_ray`
  /// first.
  explicit Walk(const OccupancyTree& tree) : nodes_(tree) {}
  /// `inverse`: of the direction's components; unused where they are 0.
  void set_ray(const Ray& ray, const DVec3& inverse) {
    for (int axis = 0; axis < 3; ++axis) {
      origin_[axis] = ray.origin[axis];
      direction_[axis] = ray.direction[axis];
      inverse_[axis] = inverse[axis];
    }
  }
  /// Begins in a voxel of the bounds that the ray enters at `t` through a plane of `axis`; -1: it starts there.
  void begin(const IBox& bounds, IVec3 voxel, double t, int axis) {
    bounds_ = bounds;
    t_ = t;
    axis_ = axis;
    for (int each = 0; each < 3; ++each) {
      voxel_[each] = voxel[each];
      find_next(each);
    }
  }

  /// Moves to where the ray enters the bounds; false when it misses them, or enters beyond `max_t`.
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
    // The ray passes an edge of the bounds. It leaves before it enters if the axis of its exit comes first.
    if (!(enter_t <= exit_t) || (enter_t == exit_t && exit_axis < enter_axis)) return false;
    bounds_ = bounds;
    t_ = enter_t;
    axis_ = enter_axis;
    for (int axis = 0; axis < 3; ++axis) {
      voxel_[axis] = coordinate_at_start(axis);
      find_next(axis);
    }
    return true;
  }

  /// Steps until the voxel is occupied (true), or the ray leaves the bounds or passes `max_t` (false).
  bool find(double max_t) {
    for (int size = empty_size(); size != 0; size = empty_size()) {
      step(size);
      if (!is_within(max_t)) return false;
    }
    return true;
  }

  /// Leaves the voxel it is in.
  void leave_voxel() { step_voxel(); }
  /// Leaves the largest aligned block around the voxel that is known to be full of one type and has an edge of no more
  /// than `largest()`; else the voxel. After `find` was true, in a tree of transparent voxels.
  template <class Largest>
  void leave_block(const Largest& largest) {
    leave_block(block_size(), largest);
  }
  /// As above, with the result of `block_size`.
  template <class Largest>
  void leave_block(int size, const Largest& largest) {
    if (size == 1) return step_voxel();
    const double most = largest();
    while (size > 1 && size > most) size /= 4;
    step(size);
  }
  /// Returns the edge length of the largest aligned block around the voxel that is known to be full of one type. After
  /// `find` was true, in a tree of transparent voxels.
  [[nodiscard]] int block_size() const { return uniform_size(); }
  [[nodiscard]] bool is_within(double max_t) const {
    return t_ <= max_t && voxel_[axis_] >= bounds_.min[axis_] && voxel_[axis_] < bounds_.max[axis_];
  }

  [[nodiscard]] IVec3 voxel() const { return {voxel_[0], voxel_[1], voxel_[2]}; }
  [[nodiscard]] double t() const { return t_; }
  /// The axis of the last plane crossed; -1 before the first.
  [[nodiscard]] int axis() const { return axis_; }

 private:
  // Returns the ray's coordinate on `axis` at its entry into the bounds, or at its start within them.
  [[nodiscard]] int coordinate_at_start(int axis) const {
    if (axis_ < 0) return static_cast<int>(std::floor(origin_[axis]));
    const int last = bounds_.max[axis] - 1;
    if (axis == axis_) return direction_[axis] > 0.0 ? bounds_.min[axis] : last;
    return coordinate_after(axis, bounds_.min[axis], last);
  }

  // Returns the ray's coordinate on `axis` just after the current crossing, between `low` and `high`.
  [[nodiscard]] int coordinate_after(int axis, int low, int high) const {
    const double d = direction_[axis];
    const double o = origin_[axis];
    const double position = o + t_ * d;
    if (!(position > low)) return settled(axis, low, low, high);
    if (!(position < high + 1.0)) return settled(axis, high, low, high);
    const int floor = static_cast<int>(std::floor(position));
    const double fraction = position - floor;
    // Rounding can put a position on the wrong side of a plane only near that plane.
    if (fraction > 1e-5 && fraction < 1.0 - 1e-5) return floor;
    return settled(axis, floor, low, high);
  }

  // Corrects a coordinate by comparing crossings: planes with a smaller t were crossed before. At a tie, planes of
  // earlier axes were crossed before.
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

  // Leaves the voxel.
  void step_voxel() {
    int axis = next_[0] <= next_[1] ? 0 : 1;
    if (next_[2] < next_[axis]) axis = 2;
    t_ = next_[axis];
    axis_ = axis;
    voxel_[axis] += direction_[axis] > 0.0 ? 1 : -1;
    find_next(axis);
  }

  // Leaves the aligned block of this size around the voxel.
  void step(int size) {
    QUOIN_ASSERT(size > 0 && (size & (size - 1)) == 0, "a power of two");
    if (size == 1) return step_voxel();
    std::array<double, 3> t{};
    std::array<int, 3> low{};
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      low[a] = voxel_[axis] & ~(size - 1);
      const double plane = direction_[axis] > 0.0 ? static_cast<double>(low[a]) + size : low[a];
      t[a] = crossing(axis, plane);
    }
    int axis = t[0] <= t[1] ? 0 : 1;
    if (t[2] < t[static_cast<std::size_t>(axis)]) axis = 2;
    t_ = t[static_cast<std::size_t>(axis)];
    axis_ = axis;
    for (int other = 0; other < 3; ++other) {
      const auto a = static_cast<std::size_t>(other);
      if (other == axis) {
        voxel_[other] = direction_[other] > 0.0 ? low[a] + size : low[a] - 1;
      } else {
        // Never back: the ray is at or beyond the voxel it was in.
        const bool is_forward = direction_[other] > 0.0;
        voxel_[other] = coordinate_after(other, is_forward ? voxel_[other] : low[a],
                                         is_forward || direction_[other] == 0.0 ? low[a] + size - 1 : voxel_[other]);
      }
      find_next(other);
    }
  }

  [[nodiscard]] double crossing(int axis, double plane) const {
    return direction_[axis] != 0.0 ? (plane - origin_[axis]) * inverse_[axis] : std::numeric_limits<double>::infinity();
  }
  // Computes t where the ray leaves its voxel along an axis.
  void find_next(int axis) {
    next_[axis] = crossing(axis, direction_[axis] > 0.0 ? static_cast<double>(voxel_[axis]) + 1.0 : voxel_[axis]);
  }

  // The edge of the largest aligned block around the voxel that is known to be empty; 0 when the voxel is occupied.
  int empty_size() {
    const IVec3 v = voxel();
    if ((v >> 2) != cell_) {
      const int size = enter_cell(v);
      if (size != 0) return size;
    }
    return (word_ >> ((v.x & 3) + 4 * (v.y & 3) + 16 * (v.z & 3)) & 1U) != 0 ? 0 : 1;
  }

  // Looks up the cell of a voxel. Returns the edge length of the empty block around it, or 0 if the cell is occupied.
  int enter_cell(IVec3 v) {
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
    const std::size_t brick = brick_of(v);
    const std::uint64_t cells = node_->cells[brick];
    if (cells == 0) return 16;
    const std::size_t cell = cell_of(v);
    if ((cells >> cell & 1U) == 0) return 4;
    cell_ = v >> 2;
    word_ = nodes_.brick(node_->bricks[brick])[cell];
    return 0;
  }

  // Returns the edge length of the largest aligned block of one type around an occupied voxel.
  [[nodiscard]] int uniform_size() const {
    QUOIN_ASSERT(node_ != nullptr, "an occupied voxel, found before");
    const UniformBlocks& blocks = nodes_.uniform_blocks(*node_);
    const std::size_t brick = brick_of(voxel());
    if ((blocks.cells[brick] >> cell_of(voxel()) & 1U) == 0) return 1;
    if (blocks.is_whole) return 64;
    return (blocks.bricks >> brick & 1U) != 0 ? 16 : 4;
  }

  // Returns the index of a brick within its chunk. The next function returns that of a cell within its brick.
  static std::size_t brick_of(IVec3 v) {
    return static_cast<std::size_t>((v.x >> 4 & 3) + 4 * (v.y >> 4 & 3) + 16 * (v.z >> 4 & 3));
  }
  static std::size_t cell_of(IVec3 v) {
    return static_cast<std::size_t>((v.x >> 2 & 3) + 4 * (v.y >> 2 & 3) + 16 * (v.z >> 2 & 3));
  }

  // Looks up a chunk's node. Returns the edge length of the empty block around it, or 0 if the chunk has a node.
  int enter_chunk(IVec3 chunk) {
    const IVec3 region = chunk >> 4;
    if (region != region_coordinates_ || !knows_region_) {
      region_coordinates_ = region;
      knows_region_ = true;
      region_ = nodes_.find_region(region);
    }
    if (region_ == nullptr) return 1'024;
    const IVec3 c = chunk & 15;
    const auto word = static_cast<std::size_t>((c.x >> 2) + 4 * (c.y >> 2) + 16 * (c.z >> 2));
    if (region_->chunks[word] == 0) return 256;
    const std::uint32_t index = region_->node(word, static_cast<unsigned>((c.x & 3) + 4 * (c.y & 3) + 16 * (c.z & 3)));
    if (index == 0) return 64;
    node_ = &nodes_.chunk(index);
    return 0;
  }

  TreeNodes nodes_;
  const RegionNode* region_ = nullptr;
  const ChunkNode* node_ = nullptr;
  IVec3 region_coordinates_{0};
  IVec3 chunk_{0};
  bool knows_region_ = false;
  bool knows_chunk_ = false;
  IVec3 cell_{std::numeric_limits<int>::min()};  // initially no cell
  std::uint64_t word_ = 0;                       // its voxels
  double origin_[3] = {};
  double direction_[3] = {};
  double inverse_[3] = {};
  IBox bounds_;
  double t_ = 0.0;
  int axis_ = -1;
  int voxel_[3] = {};
  double next_[3] = {};  // t where the ray leaves the voxel along each axis
};

/// Returns true if the ray is finite and has a direction, and max_t is not negative.
inline bool is_usable(const Ray& ray, double max_t) {
  double length = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    if (!std::isfinite(ray.origin[axis]) || !std::isfinite(ray.direction[axis])) return false;
    length += std::abs(ray.direction[axis]);
  }
  return length > 0.0 && max_t >= 0.0;
}

/// The face that looks most against a direction.
inline Direction facing(const DVec3& direction) {
  return nearest_direction(-direction);
}

/// The face through which a walk came into its voxel.
inline Direction face_of(const Walk& walk, const Ray& ray) {
  if (walk.axis() < 0) return facing(ray.direction);
  return static_cast<Direction>(2 * walk.axis() + (ray.direction[walk.axis()] > 0.0 ? 1 : 0));
}

/// A span, the face through which the ray leaves it, and the voxel behind that face.
struct WalkSpan : VoxelSpan {
  Direction exit_face = Direction::PosX;
  IVec3 behind{0};
};

/// Calls `visit` with a WalkSpan for each block that `leave` crosses, starting at an occupied voxel, until it returns
/// false. `leave` gets the walk and the beginning of its span. `walk`: of the ray, where it begins.
template <class Leave, class Visit>
void visit_spans(Walk& walk, const Ray& ray, double max_t, const Leave& leave, const Visit& visit) {
  while (walk.find(max_t)) {
    WalkSpan span{{walk.voxel(), face_of(walk, ray), walk.t(), 0.0, walk.axis() < 0}};
    leave(walk, span);
    span.t_exit = walk.t();
    span.behind = walk.voxel();
    span.exit_face = static_cast<Direction>(static_cast<int>(face_of(walk, ray)) ^ 1);
    if (!visit(span) || !walk.is_within(max_t)) return;
  }
}
/// As above, from where the ray enters the tree.
template <class Leave, class Visit>
void visit_spans(const OccupancyTree& tree, const Ray& ray, double max_t, const Leave& leave, const Visit& visit) {
  if (!is_usable(ray, max_t)) return;
  Walk walk(tree, ray);
  if (walk.enter(tree.bounds(), max_t)) visit_spans(walk, ray, max_t, leave, visit);
}

/// Like `visit_hits`, for a tree of transparent voxels, but visits whole blocks of voxels of one type: a span covers a
/// block, and its voxel is the entry voxel. Together the spans cover the same intervals as the spans of single voxels.
/// `enter` is called first, with the beginning of the span. `largest` returns the maximum edge length of a block, where
/// there is one.
template <class Enter, class Largest, class Visit>
void visit_blocks(const OccupancyTree& tree, const Ray& ray, double max_t, const Enter& enter, const Largest& largest,
                  const Visit& visit) {
  visit_spans(
      tree, ray, max_t,
      [&](Walk& walk, const WalkSpan& begun) {
        enter(begun);
        walk.leave_block(largest);
      },
      visit);
}

}  // namespace quoin::trace
