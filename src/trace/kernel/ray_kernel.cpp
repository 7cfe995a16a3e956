// The ray kernel. Without lanes, it walks rays one by one in portable code, over cells and, in occupied cells, over
// voxels. trace/kernel/lockstep.inl, with the same walk, explains the arithmetic.
//
//   Steps   the next plane of each axis, and the time of its crossing     | plane0 t0 | plane1 t1 | plane2 t2 |
//   index   of cells: a bit of the flat table; of voxels: as in trace/kernel/ray_numbers.inl

#include "trace/kernel/ray_kernel.h"

#if defined(QUOIN_KERNEL_AVX512)
#include "trace/kernel/packet.inl"
#include "trace/kernel/short_ray.inl"
#elif defined(QUOIN_KERNEL_AVX2)
#include "trace/kernel/packet.inl"
#else

#include "trace/kernel/ray_numbers.inl"

namespace quoin::trace {
namespace {

// A ray's numbers by axis; masks are all ones or zeros. The fourth component is unused.
struct SingleRay {
  F4 origin;
  F4 direction;
  F4 inverse;  // 1 where it is still
  F4 sign;
  F4 low;
  F4 high;
  F4 far_t;
  I4 forward;
  I4 still;
  I4 base;
  float exit_t;
  float enter_t;
  int enter_axis;
  bool is_cut;
  bool is_moved;  // it was moved to `origin` from its start
};

// Limits a ray's box to the voxels that it can reach.
inline void limit_reach(SingleRay& ray, float max_t, float furthest) {
  const F4 end = ray.origin + std::min(max_t, furthest) * ray.direction;
  ray.low = max4(ray.low, floor4(min4(ray.origin, end) - kSlack));
  ray.high = min4(ray.high, floor4(max4(ray.origin, end) + kSlack) + 1.0F);
  ray.is_cut = furthest < max_t;
}

// Computes the ray's box, and the times of its entry and exit.
inline SetUp clip_single(const TreeView& tree, SingleRay& ray, float max_t, float greatest, int moved) {
  const F4 f = ray.origin;
  const IVec3& lo = tree.box.min;
  const IVec3& hi = tree.box.max;
  const F4 low_bound = __builtin_convertvector((I4{lo.x, lo.y, lo.z, 0} - ray.base), F4);
  const F4 high_bound = __builtin_convertvector((I4{hi.x, hi.y, hi.z, 0} - ray.base), F4);
  ray.low = low_bound;
  ray.high = high_bound;
  ray.is_cut = false;
  // Infinite rays leave a small world before they exceed their range.
  if (!(tree.is_small && max_t > kReach / 0x1p-20F)) limit_reach(ray, max_t, kReach / greatest);
  const F4 far = ray.forward ? ray.high : ray.low;
  const I4 is_low = f < ray.low;
  const I4 is_high = ray.high <= f;
  const I4 axes = {0, 1, 2, 3};
  const I4 entered = axes == moved;
  const I4 before = (((ray.forward & is_low) | (~ray.forward & is_high)) & ~ray.still) | entered;
  const I4 past = ((ray.forward & is_high) | (~ray.forward & is_low)) & ~entered;
  if (mask3(past | (ray.still & is_high)) != 0) return SetUp::Misses;
  const F4 near_t = before ? ((ray.forward ? ray.low : ray.high) - f) * ray.inverse : all4(-1.0F);
  ray.far_t = ray.still ? all4(kNever) : (far - f) * ray.inverse;
  ray.enter_t = greatest3(near_t);
  ray.enter_axis = -1;
  if (ray.enter_t >= 0.0F) {
    ray.enter_axis = 31 - std::countl_zero(static_cast<std::uint32_t>(mask3(near_t == all4(ray.enter_t))));
  } else {
    ray.enter_t = 0.0F;
  }
  ray.exit_t = least3(ray.far_t);
  if (ray.is_cut) {
    const F4 bound = ray.forward ? high_bound : low_bound;
    const F4 bound_t = ray.still ? all4(kNever) : (bound - f) * ray.inverse;
    ray.is_cut = kReach / greatest < least3(bound_t);
  }
  ray.is_moved = moved >= 0;
  if (ray.enter_axis < 0) return SetUp::Ready;
  const F4 t = all4(ray.enter_t);
  const I4 left = (ray.far_t < t) | ((ray.far_t == t) & (axes < ray.enter_axis));
  return mask3(left) != 0 ? SetUp::Misses : SetUp::Ready;
}

inline SetUp set_up_single(const TreeView& tree, const Ray& ray, double max_t, SingleRay& out) {
  RayNumbers numbers = read_ray(tree, ray);
  D4& p = numbers.position;
  const F4 d = numbers.direction;
  const F4 size = numbers.size;
  const float greatest = numbers.greatest;
  auto limit = static_cast<float>(max_t);
  if (mask3(size <= all4(0x1p20F)) != 7 || !(greatest >= 0x1p-20F) || !(limit >= 0.0F)) return SetUp::Unusual;
  const F4 rough = __builtin_convertvector(p, F4);
  const F4 low_bound = {tree.low[0], tree.low[1], tree.low[2], 0.0F};
  const F4 high_bound = {tree.high[0], tree.high[1], tree.high[2], 0.0F};
  const I4 leaves = ((high_bound < rough) & (d >= 0.0F)) | ((rough < low_bound) & (d <= 0.0F));
  if (mask3(leaves) != 0) return SetUp::Misses;
  int moved = -1;
  if (mask3((low_bound - kNearby <= rough) & (rough <= high_bound + kNearby)) != 7) {
    if (!bring_near(tree, ray, max_t, p, limit, moved)) return SetUp::Misses;
  }
  const I4 trunc = __builtin_convertvector(p, I4);
  const I4 floor = trunc + __builtin_convertvector(__builtin_convertvector(trunc, D4) > p, I4);
  out.base = floor & ~63;
  const F4 inside = __builtin_convertvector(p - __builtin_convertvector(out.base, D4), F4);
  out.origin = min4(inside, __builtin_convertvector(floor - out.base, F4) + (1.0F - 0x1p-17F));
  out.still = size < all4(0x1p-100F);
  out.direction = out.still ? all4(0.0F) : d;
  out.forward = out.direction > 0.0F;
  out.sign = out.forward ? all4(1.0F) : all4(-1.0F);
  out.inverse = 1.0F / (out.still ? all4(1.0F) : d);
  return clip_single(tree, out, limit, greatest, moved);
}

// Like `coordinate_after` of the lockstep kernel, for all axes except `axis`, the axis of the last crossing, whose
// result is unspecified.
inline F4 single_coordinates_after(const SingleRay& ray, float t, F4 low, F4 high, int axis) {
  const F4 position = ray.origin + t * ray.direction;
  const F4 at = max4(min4(floor4(position), high), low);
  // Rounding can put a position on the wrong side of a plane only near that plane.
  const F4 past = position - at;
  if ((mask3((past < 0.01F) | (past > 0.99F)) & ~(1 << (axis & 3))) == 0) return at;
  const F4 ahead = ray.forward ? at + 1.0F : at;
  const F4 behind = ray.forward ? at : at + 1.0F;
  const F4 ahead_t = (ahead - ray.origin) * ray.inverse;
  const F4 behind_t = (behind - ray.origin) * ray.inverse;
  const F4 now = all4(t);
  const I4 axes = {0, 1, 2, 3};
  const I4 is_short = ((ahead_t < now) | ((ahead_t == now) & (axes < axis))) & ~ray.still;
  const I4 was_inside =
      ray.forward & ((behind < ray.origin) | ((behind == ray.origin) & (ray.is_moved ? I4{} : ~I4{})));
  const I4 comes_later = axis < 0 ? I4{} : axes > axis;
  const I4 is_far = ((now < behind_t) | ((behind_t == now) & comes_later)) & ~ray.still & ~was_inside & ~is_short;
  return at + (is_short ? ray.sign : all4(0.0F)) - (is_far ? ray.sign : all4(0.0F));
}

// The position of a ray: a unit on each axis, by its lower plane, and the time of the ray's entry.
struct Stand {
  F4 lower;
  float t;
  int axis;  // axis of the last crossing; -1 before the first
};

// Finds the voxel in a box that the ray has just entered, given by its lower and upper voxels.
inline void enter(const SingleRay& ray, F4 low, F4 high, Stand& stand) {
  const F4 others = single_coordinates_after(ray, stand.t, low, high, stand.axis);
  const I4 axes = {0, 1, 2, 3};
  stand.lower = axes == stand.axis ? (ray.forward ? low : high) : others;
}

// Returns the unit in which a ray starts within its box, or through which it enters the box.
inline Stand first_stand(const SingleRay& ray) {
  Stand stand{floor4(ray.origin), ray.enter_t, ray.enter_axis};
  if (stand.axis >= 0) enter(ray, ray.low, ray.high - 1.0F, stand);
  return stand;
}

// Returns the planes through which a ray leaves units of this size.
inline F4 exit_planes(const SingleRay& ray, F4 lower, float size) {
  const F4 moving = ray.forward ? lower + size : lower;
  return ray.still ? all4(kNever) : moving;
}

// The next planes of a walk and their crossing times, each in a separate variable so that it can be in a register.
struct Steps {
  float plane0, plane1, plane2;
  float t0, t1, t2;
  float step0, step1, step2;
  int stride0, stride1, stride2;
  int index;
};

inline Steps make_steps(const SingleRay& ray, F4 planes, float size, int index, I4 strides) {
  const F4 t = (planes - ray.origin) * ray.inverse;
  const F4 step = ray.sign * size;
  const I4 signed_strides = ray.forward ? strides : -strides;
  return {planes[0],         planes[1],         planes[2],         t[0], t[1], t[2], step[0], step[1], step[2],
          signed_strides[0], signed_strides[1], signed_strides[2], index};
}

// Crosses the next plane; returns its axis.
inline int advance(const SingleRay& ray, Steps& s, float& now) {
  if (s.t0 <= s.t1 && s.t0 <= s.t2) {
    now = s.t0;
    s.plane0 += s.step0;
    s.t0 = (s.plane0 - ray.origin[0]) * ray.inverse[0];
    s.index += s.stride0;
    return 0;
  }
  if (s.t1 <= s.t2) {
    now = s.t1;
    s.plane1 += s.step1;
    s.t1 = (s.plane1 - ray.origin[1]) * ray.inverse[1];
    s.index += s.stride1;
    return 1;
  }
  now = s.t2;
  s.plane2 += s.step2;
  s.t2 = (s.plane2 - ray.origin[2]) * ray.inverse[2];
  s.index += s.stride2;
  return 2;
}

// Returns the voxel of a cell that a ray has just entered, relative to the cell's lower corner.
inline I4 voxel_entered(const SingleRay& ray, F4 cell, const Stand& stand) {
  const F4 position = ray.origin + stand.t * ray.direction - cell;
  const I4 trunc = __builtin_convertvector(position, I4);
  const I4 not_negative = trunc > 0 ? trunc : I4{};
  const I4 at = not_negative < 3 ? not_negative : I4{3, 3, 3, 3};
  const F4 past = position - __builtin_convertvector(at, F4);
  const I4 axes = {0, 1, 2, 3};
  const I4 entered = axes == stand.axis;
  // Rounding can put a position on the wrong side of a plane only near that plane.
  if (mask3(((past < 0.01F) | (past > 0.99F)) & ~entered) != 0) {
    Stand exact = stand;
    enter(ray, cell, cell + 3.0F, exact);
    return __builtin_convertvector(exact.lower - cell, I4);
  }
  return entered ? (~ray.forward & 3) : at;
}

// Walks through the 64 voxels of a cell. Returns the index of the voxel hit, or -1.
inline int walk_cell(const SingleRay& ray, std::uint64_t word, F4 cell, I4 within, int& axis) {
  const F4 lower = cell + __builtin_convertvector(within, F4);
  const int index = within[0] * kCodeX + within[1] * kCodeY + within[2] * kCodeZ;
  if ((word >> (index & 63) & 1U) != 0) return index & 63;
  Steps steps = make_steps(ray, exit_planes(ray, lower, 1.0F), 1.0F, index, I4{kCodeX, kCodeY, kCodeZ, 0});
  float t = 0.0F;
  for (;;) {
    axis = advance(ray, steps, t);
    if ((steps.index & kLeft) != 0) return -1;
    if ((word >> (steps.index & 63) & 1U) != 0) return steps.index & 63;
  }
}

inline std::uint64_t cell_word(const TreeView& tree, const SingleRay& ray, F4 lower) {
  const I4 cell = (__builtin_convertvector(lower, I4) + ray.base) >> 2;
  const I4 brick = cell >> 2;
  const I4 within = cell & 3;
  const int index = brick[0] + brick[1] * tree.brick_strides.y + brick[2] * tree.brick_strides.z;
  return BrickWords(tree.lines,
                    tree.bricks[index])[static_cast<std::size_t>(within[0] + 4 * within[1] + 16 * within[2])];
}

inline SingleHit trace_single(const TreeView& tree, const Ray& world_ray, double max_t) {
  SingleRay ray;
  SingleHit hit;
  const SetUp ready = set_up_single(tree, world_ray, max_t, ray);
  hit.is_unfinished = ready == SetUp::Unusual;
  if (ready != SetUp::Ready) return hit;
  Stand stand = first_stand(ray);
  const I4 place = (__builtin_convertvector(stand.lower, I4) + ray.base) >> 2;
  F4 cell = __builtin_convertvector(__builtin_convertvector(stand.lower, I4) & ~3, F4);
  Steps steps = make_steps(ray, exit_planes(ray, cell, 4.0F), 4.0F,
                           tree.first_cell + place[0] + place[1] * tree.cell_strides.y + place[2] * tree.cell_strides.z,
                           I4{1, tree.cell_strides.y, tree.cell_strides.z, 0});
  for (bool is_first = true;; is_first = false) {
    const auto bit = static_cast<std::uint32_t>(steps.index);
    QUOIN_ASSERT(bit >> 5 <= tree.last_cell_word, "a cell of the tables, or of their border");
    if ((tree.cells[bit >> 5] >> (bit & 31U) & 1U) != 0) {
      I4 within = __builtin_convertvector(stand.lower - cell, I4);
      if (!is_first) {
        const F4 exits = {steps.plane0, steps.plane1, steps.plane2, 0.0F};
        const F4 moving = ray.forward ? exits - 4.0F : exits;
        cell = ray.still ? floor4(ray.origin * 0.25F) * 4.0F : moving;
        within = voxel_entered(ray, cell, stand);
      }
      int axis = stand.axis;
      const int voxel = walk_cell(ray, cell_word(tree, ray, cell), cell, within, axis);
      if (voxel >= 0) {
        const I4 corner = __builtin_convertvector(cell, I4) + ray.base;
        hit.is_hit = true;
        hit.axis = axis;
        hit.voxel = IVec3{corner[0] + (voxel & 3), corner[1] + (voxel >> 2 & 3), corner[2] + (voxel >> 4)};
        return hit;
      }
    }
    stand.axis = advance(ray, steps, stand.t);
    if (!(stand.t <= ray.exit_t)) {
      hit.is_unfinished = ray.is_cut;
      return hit;
    }
  }
}

struct PlainTracer {
  template <Ask>
  static SingleHit trace(const TreeView& tree, const Ray& ray, double max_t) {
    return trace_single(tree, ray, max_t);
  }
};

void first_one_by_one(const TreeView& tree, const RayPacket& rays, PacketHits& hits, std::uint32_t& unfinished) {
  hits.hit = hits.starts_inside = unfinished = 0;
  for (std::uint32_t left = rays.active; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    RayHit hit;
    bool is_unfinished = false;
    const double max_t = rays.max_t[static_cast<std::size_t>(lane)];
    if (first_single<PlainTracer>(tree, rays.ray(lane), max_t, hit, is_unfinished)) hits.set(lane, hit);
    unfinished |= std::uint32_t{is_unfinished} << lane;
  }
}

std::uint32_t any_of_packet(const TreeView& tree, const RayPacket& rays, std::uint32_t& unfinished) {
  std::uint32_t blocked = unfinished = 0;
  for (std::uint32_t left = rays.active; left != 0; left &= left - 1) {
    const int lane = std::countr_zero(left);
    bool is_unfinished = false;
    const bool is_blocked =
        any_single<PlainTracer>(tree, rays.ray(lane), rays.max_t[static_cast<std::size_t>(lane)], is_unfinished);
    unfinished |= std::uint32_t{is_unfinished} << lane;
    blocked |= std::uint32_t{is_blocked} << lane;
  }
  return blocked;
}

void any_one_by_one(const TreeView& tree, const RayPacket* packets, std::size_t size, std::uint32_t* blocked,
                    std::uint32_t* unfinished) {
  for (std::size_t i = 0; i < size; ++i) blocked[i] = any_of_packet(tree, packets[i], unfinished[i]);
}

}  // namespace
}  // namespace quoin::trace

#endif

namespace quoin::trace {

#if defined(QUOIN_KERNEL_AVX512)
constinit const Kernel QUOIN_KERNEL(Kernel) = {first_single<PathTracer>, any_short_single, trace_first, trace_any};
#elif defined(QUOIN_KERNEL_AVX2)
constinit const Kernel QUOIN_KERNEL(Kernel) = {first_single<PathTracer>, any_single<PathTracer>, trace_first,
                                               trace_any};
#else
constinit const Kernel QUOIN_KERNEL(Kernel) = {first_single<PlainTracer>, any_single<PlainTracer>, first_one_by_one,
                                               any_one_by_one};

constinit const KernelTable<Kernel> kKernels = QUOIN_KERNEL_TABLE(Kernel, Avx512);
#endif

}  // namespace quoin::trace
