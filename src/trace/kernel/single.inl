// One ray, by sets of units (trace/kernel/paths.inl): it is mirrored so that it goes forward along every axis, then
// goes from chunk to chunk. The same arithmetic and answers as the walk in trace/kernel/kernel_plain.cpp: a plane and
// an origin that both change their sign are as far apart as before, to the bit.
//
//   chunk        bricks passed  &  bricks that hold something   ->  lowest bit: the next brick
//     brick        cells passed   &  cells that hold something    ->  lowest bit: the next cell
//       cell         voxels passed  &  voxels                       ->  lowest bit: what is met
//
// A ray that starts within the bounds begins at the bottom: in its own cell, then its brick, then its chunk.

#pragma once

#include "trace/kernel/paths.inl"

namespace quoin::trace {
namespace {

struct PathRay {
  F4 origin;
  F4 inverse;
  F4 far_t;
  F4 chunk;     // the lower planes of the chunk in which it starts
  I4 backward;  // axes that were mirrored; masks, like the next
  I4 forward;
  I4 base;
  I4 own;  // the voxel in which it starts, from `base`, not mirrored
  float exit_t;
  bool is_inside;  // it starts within the bounds
  bool is_cut;
  bool is_moved;
  bool is_on_plane;  // starts, within the bounds or upon them, on a plane that lies behind it and was never crossed
};

// The box of a ray's way by its mirrored planes.
struct PathBox {
  F4 low;
  F4 high;
};

inline PathBox box_of(const TreeView& tree, PathRay& ray, F4 origin, F4 direction, float max_t, float greatest) {
  I4 low_voxel;
  I4 high_voxel;
  std::memcpy(&low_voxel, tree.low_voxel, sizeof low_voxel);
  std::memcpy(&high_voxel, tree.high_voxel, sizeof high_voxel);
  F4 low = __builtin_convertvector(low_voxel - ray.base, F4);
  F4 high = __builtin_convertvector(high_voxel - ray.base, F4);
  ray.is_cut = false;
  // Endless rays leave a small world before they reach further than they may.
  if (!(tree.is_small && max_t > kReach / 0x1p-20F)) {
    const float furthest = kReach / greatest;
    const F4 bound = mirrored_planes(ray.backward ? low : high, ray.backward);
    ray.is_cut = furthest < max_t && furthest < least3((bound - ray.origin) * ray.inverse);
    const F4 end = origin + std::min(max_t, furthest) * direction;
    low = max4(low, floor4(min4(origin, end) - kSlack));
    high = min4(high, floor4(max4(origin, end) + kSlack) + 1.0F);
  }
  return {mirrored_planes(ray.backward ? high : low, ray.backward),
          mirrored_planes(ray.backward ? low : high, ray.backward)};
}

// The chunk into which a ray comes at `t` through a plane of `axis`: a guess by position, corrected by comparing
// crossings, since rounding can put a position on the wrong side of a plane next to it.
inline F4 chunk_entered(const PathRay& ray, const PathBox& box, F4 speed, float t, int axis) {
  const F4 first = floor4(box.low * (1.0F / kChunkSize)) * kChunkSize;
  const F4 last = floor4((box.high - 1.0F) * (1.0F / kChunkSize)) * kChunkSize;
  const F4 position = ray.origin + t * speed;
  F4 at = max4(min4(floor4(position * (1.0F / kChunkSize)) * kChunkSize, last), first);
  const F4 past = position - at;
  const I4 axes = {0, 1, 2, 3};
  if ((mask3((past < 0.01F) | (past > kChunkSize - 0.01F)) & ~(1 << axis)) != 0) {
    const F4 now = all4(t);
    const F4 ahead_t = (at + kChunkSize - ray.origin) * ray.inverse;
    const F4 behind_t = (at - ray.origin) * ray.inverse;
    const I4 is_short = (ahead_t < now) | ((ahead_t == now) & (axes < axis));
    // It was never out of the chunk in which it started.
    const I4 was_inside = (at == ray.origin) & ray.forward & (ray.is_moved ? I4{} : ~I4{});
    const I4 is_far = ((now < behind_t) | ((behind_t == now) & (axes > axis))) & ~was_inside & ~is_short;
    at = at + (is_short ? all4(kChunkSize) : all4(0.0F)) - (is_far ? all4(kChunkSize) : all4(0.0F));
    at = max4(min4(at, last), first);
  }
  return axes == axis ? first : at;
}

inline bool starts_on_plane(const PathRay& ray) {
  return mask3(ray.forward & (__builtin_convertvector(ray.own, F4) == ray.origin)) != 0;
}

// Where a ray enters its box and leaves it.
inline SetUp clip_path(PathRay& ray, const PathBox& box, F4 speed, int moved) {
  const F4 origin = ray.origin;
  const I4 axes = {0, 1, 2, 3};
  const I4 entered = axes == moved;
  const I4 is_low = origin < box.low;
  const I4 past = (box.high < origin) | (~ray.backward & (box.high == origin));
  const I4 still = ~(ray.forward | ray.backward);
  if (mask3((past & ~entered) | (still & is_low)) != 0) return SetUp::Misses;
  ray.far_t = (box.high - origin) * ray.inverse;
  ray.exit_t = least3(ray.far_t);
  ray.is_moved = moved >= 0;
  const I4 before = is_low | (ray.backward & (origin == box.low)) | entered;
  ray.is_inside = mask3(before) == 0;
  ray.is_on_plane = ray.is_inside && starts_on_plane(ray);
  if (ray.is_inside) {
    ray.chunk = ray.backward ? all4(-kChunkSize) : all4(0.0F);
    return SetUp::Ready;
  }
  // Enters through the last plane; at a tie the later axis.
  const F4 near_t = before ? (box.low - origin) * ray.inverse : all4(-1.0F);
  const float t = greatest3(near_t);
  const int axis = 31 - std::countl_zero(static_cast<std::uint32_t>(mask3(near_t == all4(t))));
  const F4 now = all4(t);
  // Through an edge of its box: it has left before it enters if the axis on which it leaves goes first.
  if (mask3((ray.far_t < now) | ((ray.far_t == now) & (axes < axis))) != 0) return SetUp::Misses;
  ray.is_on_plane = t == 0.0F && !ray.is_moved && starts_on_plane(ray);
  ray.chunk = chunk_entered(ray, box, speed, t, axis);
  return SetUp::Ready;
}

inline SetUp set_up_path(const TreeView& tree, const Ray& ray, double max_t, PathRay& out) {
  RayNumbers numbers = read_ray(tree, ray);
  D4& p = numbers.position;
  const F4 d = numbers.direction;
  const F4 size = numbers.size;
  const float greatest = numbers.greatest;
  F4 low;
  F4 high;
  std::memcpy(&low, tree.low, sizeof low);
  std::memcpy(&high, tree.high, sizeof high);
  auto limit = static_cast<float>(max_t);
  if (mask3(size <= all4(0x1p20F)) != 7 || !(greatest >= 0x1p-20F) || !(limit >= 0.0F)) return SetUp::Unusual;
  const F4 rough = __builtin_convertvector(p, F4);
  const I4 leaves = ((high < rough) & (d >= 0.0F)) | ((rough < low) & (d <= 0.0F));
  if (mask3(leaves) != 0) return SetUp::Misses;
  int moved = -1;
  if (mask3((low - kNearby <= rough) & (rough <= high + kNearby)) != 7) {
    if (!bring_near(tree, ray, max_t, p, limit, moved)) return SetUp::Misses;
  }
  const D4 base = floor4(p * (1.0 / 64.0)) * 64.0;
  const F4 whole = __builtin_convertvector(floor4(p) - base, F4);
  const F4 origin = min4(__builtin_convertvector(p - base, F4), whole + (1.0F - 0x1p-17F));
  const I4 still = size < all4(0x1p-100F);
  out.base = __builtin_convertvector(base, I4);
  out.own = __builtin_convertvector(whole, I4);
  out.backward = (d < 0.0F) & ~still;
  out.forward = (d > 0.0F) & ~still;
  // A still axis never comes to a plane.
  out.origin = still ? whole + 0.5F : mirrored_planes(origin, out.backward);
  out.inverse = still ? all4(kStillInverse) : 1.0F / size;
  const PathBox box = box_of(tree, out, origin, still ? all4(0.0F) : d, limit, greatest);
  return clip_path(out, box, still ? all4(0.0F) : size, moved);
}

class PathWalk {
 public:
  PathWalk(const TreeView& tree, const PathRay& ray)
      : chunk_(Paths::block(ray.chunk)),
        paths_(ray.origin, ray.inverse, ray.exit_t * 1.001F + 1e-6F),
        mirrored_(mask3(ray.backward)),
        tree_(tree),
        ray_(ray),
        flip_(flip_of(mask3(ray.backward))) {
    if (ray.is_on_plane) paths_.nudge(ray.forward);
    const F4 upper = ray.chunk + kChunkSize;
    const F4 t = (upper - ray.origin) * ray.inverse;
    const F4 native = mirrored_planes(ray.backward ? upper : ray.chunk, ray.backward);
    const I4 place = (__builtin_convertvector(native, I4) + ray.base) >> 6;
    I4 strides;
    std::memcpy(&strides, tree.chunk_strides, sizeof strides);
    const I4 steps = (strides ^ ray.backward) - ray.backward;
    plane_[0] = upper[0], plane_[1] = upper[1], plane_[2] = upper[2];
    t_[0] = t[0], t_[1] = t[1], t_[2] = t[2];
    stride_[0] = steps[0], stride_[1] = steps[1], stride_[2] = steps[2];
    index_ = place[0] + place[1] * strides[1] + place[2] * strides[2];
  }

  template <Ask kAsk>
  [[gnu::always_inline]] SingleHit find() {
    SingleHit found{false, ray_.is_cut, -1, IVec3{0}};
    walk([&](int brick, int cell, std::uint64_t met) __attribute__((always_inline)) {
      found = hit<kAsk>(brick, cell, met);
      return true;
    });
    return found;
  }

  /// Calls `meet(brick, cell, voxels)` for the occupied voxels that the ray passes, of one cell after the other, until
  /// it returns true.
  template <class Meet>
  [[gnu::always_inline]] void walk(Meet&& meet) {
    std::uint64_t allowed = ~std::uint64_t{0};
    std::uint64_t bricks = 0;
    std::uint64_t cells = 0;
    int brick = 0;
    auto block = chunk_;
    if (ray_.is_inside) {
      // From the voxel in which it starts: mostly what it meets is near.
      const Own own = own_units();
      brick = own.brick;
      block = Paths::brick_of(chunk_, brick);
      if (is_set(tree_.chunks[index_].bricks, brick)) {
        if (is_set(node().cells[static_cast<std::size_t>(brick ^ flip_)], own.cell)) {
          const std::uint64_t met = voxels_of(block, brick, own.cell) & kUnits.from[own.voxel];
          if (met != 0 && meet(brick, own.cell, met)) return;
        }
        cells = cells_of(brick) & kUnits.from[own.cell] & ~(std::uint64_t{1} << own.cell);
      }
      allowed = kUnits.from[brick] & ~(std::uint64_t{1} << brick);
    }
    for (bool is_known = false;; is_known = true) {
      for (; cells != 0; cells &= cells - 1) {
        const int cell = std::countr_zero(cells);
        const std::uint64_t met = voxels_of(block, brick, cell);
        if (met != 0 && meet(brick, cell, met)) return;
      }
      while (bricks == 0) {
        if (is_known && !advance()) return;
        is_known = true;
        bricks = bricks_of_chunk() & allowed;
        allowed = ~std::uint64_t{0};
      }
      brick = std::countr_zero(bricks);
      bricks &= bricks - 1;
      cells = cells_of(brick);
      block = Paths::brick_of(chunk_, brick);
    }
  }

  /// The mirrored planes below a cell of a brick of the chunk in which the walk is.
  [[nodiscard]] F4 corner_of_cell(int brick, int cell) const {
    const F4 lower = F4{plane_[0], plane_[1], plane_[2], 0.0F} - kChunkSize;
    return lower + corner_of(brick) * 16.0F + corner_of(cell) * 4.0F;
  }
  /// Whether that is further than single precision serves, and left to others.
  [[nodiscard]] bool is_too_far(F4 in_cell) const {
    return ray_.is_cut && greatest3((in_cell - ray_.origin) * ray_.inverse) > ray_.exit_t;
  }
  /// The voxel, from the tables' origin, with these mirrored planes below it.
  [[nodiscard]] I4 native_voxel(F4 voxel) const {
    const F4 native = mirrored_planes(ray_.backward ? voxel + 1.0F : voxel, ray_.backward);
    return __builtin_convertvector(native, I4) + ray_.base;
  }

 private:
  // The units in which a ray starts, mirrored.
  struct Own {
    int brick, cell, voxel;
  };
  [[nodiscard]] Own own_units() const {
    const I4 own = ray_.own ^ (ray_.backward & 63);
    return {(own[0] >> 4) + (own[1] >> 4) * 4 + (own[2] >> 4) * 16,
            (own[0] >> 2 & 3) + (own[1] & 12) + (own[2] & 12) * 4, (own[0] & 3) + (own[1] & 3) * 4 + (own[2] & 3) * 16};
  }
  [[nodiscard]] bool is_set(std::uint64_t word, int unit) const { return (word >> (unit ^ flip_) & 1U) != 0; }
  [[nodiscard, gnu::always_inline]] std::uint64_t bits_of_bricks() const {
    return mirrored_(&tree_.chunks[index_].bricks);
  }
  [[nodiscard]] const ChunkNode& node() const { return *tree_.chunks[index_].node; }
  [[nodiscard, gnu::always_inline]] std::uint64_t bricks_of_chunk() const {
    return tree_.chunks[index_].bricks == 0 ? 0 : paths_.bricks(chunk_) & bits_of_bricks();
  }
  [[nodiscard, gnu::always_inline]] std::uint64_t cells_of(int brick) const {
    return paths_.cells(chunk_, brick) & mirrored_(&node().cells[static_cast<std::size_t>(brick ^ flip_)]);
  }
  [[nodiscard, gnu::always_inline]] std::uint64_t voxels_of(const Paths::Block& block, int brick, int cell) const {
    const Node& words = tree_.nodes[node().bricks[static_cast<std::size_t>(brick ^ flip_)]];
    return paths_.voxels(block, cell) & mirrored_(&words[static_cast<std::size_t>(cell ^ flip_)]);
  }

  // Into the next chunk; false when the ray has left its box.
  [[gnu::always_inline]] bool advance() {
    if (t_[0] <= t_[1] && t_[0] <= t_[2]) return cross<0>();
    return t_[1] <= t_[2] ? cross<1>() : cross<2>();
  }
  template <int kAxis>
  [[gnu::always_inline]] bool cross() {
    const float now = t_[kAxis];
    plane_[kAxis] += kChunkSize;
    t_[kAxis] = (plane_[kAxis] - ray_.origin[kAxis]) * ray_.inverse[kAxis];
    index_ += stride_[kAxis];
    chunk_ = Paths::next_chunk<kAxis>(chunk_);
    if (now < ray_.exit_t) return true;
    // At a tie the axis on which it leaves may come later.
    const int exit_axis = std::countr_zero(static_cast<std::uint32_t>(mask3(ray_.far_t == all4(ray_.exit_t))));
    return now == ray_.exit_t && kAxis < exit_axis;
  }

  template <Ask kAsk>
  [[gnu::always_inline]] SingleHit hit(int brick, int cell, std::uint64_t voxels) const {
    const F4 in_cell = corner_of_cell(brick, cell);
    if (is_too_far(in_cell)) return {false, true, -1, IVec3{0}};
    if (kAsk == Ask::Whether) return {true, false, -1, IVec3{0}};
    const F4 voxel = in_cell + corner_of(std::countr_zero(voxels));
    const F4 nudge = ray_.is_on_plane ? (ray_.forward ? all4(kNudge) : all4(0.0F)) : all4(0.0F);
    // It came in through the last of its lower planes, at a tie that of the later axis.
    const F4 t = (voxel - ray_.origin) * ray_.inverse - nudge;
    const float last = greatest3(t);
    const int axis = last < 0.0F ? -1 : t[2] == last ? 2 : t[1] == last ? 1 : 0;
    const I4 at = native_voxel(voxel);
    return {true, false, axis, IVec3{at[0], at[1], at[2]}};
  }

  Paths::Block chunk_;
  Paths paths_;
  Mirror mirrored_;
  const TreeView& tree_;
  const PathRay& ray_;
  int flip_;  // from a mirrored unit to the unit
  int index_;
  float plane_[3];  // through which it leaves the chunk
  float t_[3];
  int stride_[3];
};

struct PathTracer {
  template <Ask kAsk>
  [[gnu::always_inline]] static SingleHit trace(const TreeView& tree, const Ray& ray, double max_t) {
    PathRay path;
    const SetUp ready = set_up_path(tree, ray, max_t, path);
    if (ready != SetUp::Ready) return {false, ready == SetUp::Unusual, -1, IVec3{0}};
    return PathWalk(tree, path).find<kAsk>();
  }
};

}  // namespace
}  // namespace quoin::trace
