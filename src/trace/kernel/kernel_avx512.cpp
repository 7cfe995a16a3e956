// The kernel for x86-64 processors with AVX-512 F, BW, DQ and VL; called only where all were found.

#include "trace/kernel/kernel.h"

#ifdef QUOIN_X86_KERNELS

#include "trace/kernel/lanes_avx512.h"
#include "trace/kernel/packet.inl"
#include "trace/kernel/single.inl"

namespace quoin::trace {
namespace {

// Whether one short ray is blocked, in sixteen lanes: all its crossings at once instead of one after the other, so that
// nothing waits and the answer decides no branch. The same results as the walk in trace/kernel/kernel_plain.cpp.
//
//   lane       | 0 | 1 | 2 | 3 | 4 | 5 | 6 | 7 | 8 | 9 |10 |11 |12 |13 |14 |15 |
//   crossing   | planes of x   | planes of y       | planes of z   | none  |start|
//   t          by the formula of every walk                          after all  -1
//   place      where the ray starts, plus the steps of all lanes whose t is not later: x + 32 y + 1,024 z, which three
//              tables spread into brick (of the eight about the ray), half word and bit

// Voxels along |x| + |y| + |z| that a ray may reach: with one crossing more on each axis they are at most fourteen, and
// the last lane is left for where it starts.
constexpr float kWindowReach = 11.0F;
// How far from the tables' ends it starts, in voxels, so that it does not come to them.
constexpr std::int32_t kWindowMargin = 12;
// How much longer than any other a component of its direction may be: rounding then moves no crossing of one axis
// beyond one of another by more than the slack.
constexpr float kWindowRatio = 2048.0F;
// Later than any crossing.
constexpr float kAfterAll = 2e37F;
// The lane that holds where the ray starts.
constexpr int kStartLane = 15;

struct WindowTables {
  alignas(64) std::int32_t lane[kWidth];
  // -1 in lanes from j on: at a tie the crossing in lane j comes before theirs, and is itself among them.
  alignas(64) std::int32_t order[kWidth][kWidth];
  // The spread bits, as in trace/kernel/packet.inl but for five bits an axis, of x, y and z.
  alignas(64) std::int32_t spread[3][2 * kWidth];
};

constexpr WindowTables make_window_tables() {
  WindowTables tables{};
  for (int i = 0; i < kWidth; ++i) {
    tables.lane[i] = i;
    for (int j = 0; j < kWidth; ++j) tables.order[j][i] = i >= j ? -1 : 0;
  }
  for (int c = 0; c < 2 * kWidth; ++c) {
    for (int axis = 0; axis < 3; ++axis) {
      const int cell = axis == 0 ? 6 : axis == 1 ? 10 : 8;
      tables.spread[axis][c] = (c & 3) << (2 * axis) | (c >> 2 & 3) << cell | (c >> 4) << (12 + axis);
    }
  }
  return tables;
}

constexpr WindowTables kTables = make_window_tables();

// Each lane's own axis of four numbers.
inline F of_axis(F4 numbers, I axis) {
  return from_16(F{_mm512_castps128_ps512(reinterpret_cast<__m128>(numbers))}, axis);
}

// A short ray that stays within the tables.
struct WindowRay {
  F4 origin;
  F4 inverse;  // 1 where it is still
  F4 sign;
  I4 forward;
  I4 base;
  I4 own;      // the voxel in which it starts, from `base`
  I4 crossed;  // planes that it may cross; none where it is still
  float max_t;
};

// False where another way is to be taken.
inline bool set_up_in_window(const TreeView& tree, const Ray& ray, double max_t, WindowRay& out) {
  const RayNumbers numbers = read_ray(tree, ray);
  const D4 p = numbers.position;
  const F4 d = numbers.direction;
  const I4 still = numbers.size < all4(0x1p-100F);
  const F4 size = still ? all4(0.0F) : numbers.size;  // products of subnormal numbers are slow
  const float greatest = numbers.greatest;
  out.max_t = static_cast<float>(max_t);
  const F4 reach = size * out.max_t;
  if (!(out.max_t >= 0.0F && greatest >= 0x1p-20F && greatest <= 0x1p20F)) return false;
  const I4 own = __builtin_convertvector(floor4(p), I4);
  const I4 last = I4{tree.brick_sizes.x, tree.brick_sizes.y, tree.brick_sizes.z, 0} * 16 - kWindowMargin;
  const I4 is_outside = (own < kWindowMargin) | (own >= last) | ((size * kWindowRatio < greatest) & ~still);
  if (mask3(is_outside) != 0) return false;
  out.base = own & ~63;
  out.own = own & 63;
  const F4 inside = __builtin_convertvector(p - __builtin_convertvector(out.base, D4), F4);
  out.origin = min4(inside, __builtin_convertvector(out.own, F4) + (1.0F - 0x1p-17F));
  out.forward = (d > 0.0F) & ~still;
  out.sign = out.forward ? all4(1.0F) : all4(-1.0F);
  out.inverse = 1.0F / (still ? all4(1.0F) : d);
  out.crossed = (__builtin_convertvector(reach + kSlack, I4) + 1) & ~still;
  return true;
}

struct CrossingWindow {
  F t;
  I axis;
  Mask valid;  // perhaps within reach, or where the ray starts
  Mask sure;   // surely
};

// All crossings of a ray.
inline CrossingWindow all_crossings(const WindowRay& ray) {
  const F4 first = __builtin_convertvector(ray.own - ray.forward, F4);
  const int x = ray.crossed[0];
  const int xy = x + ray.crossed[1];
  const I lane = load(kTables.lane);
  const Mask from_y = all(x - 1) < lane;
  const Mask from_z = all(xy - 1) < lane;
  CrossingWindow window;
  window.axis = add_if(from_z, add_if(from_y, all(0), all(1)), all(1));
  const Mask is_crossing = lane < all(xy + ray.crossed[2]);
  const I number = add_if(from_z, add_if(from_y, lane, all(-x)), all(x - xy));
  const F plane = of_axis(first, window.axis) + to_float(number) * of_axis(ray.sign, window.axis);
  const F t = (plane - of_axis(ray.origin, window.axis)) * of_axis(ray.inverse, window.axis);
  // No negative zeros: times are compared as whole numbers.
  const Mask is_start = ~(lane < all(kStartLane));
  window.t = select(is_crossing, t + all(0.0F), select(is_start, all(-1.0F), all(kAfterAll)));
  // More than rounding can move a crossing.
  const F doubt = of_axis(kDoubt * max4(ray.inverse, -ray.inverse), window.axis);
  window.valid = (is_crossing & (window.t <= all(ray.max_t) + doubt)) | is_start;
  window.sure = (is_crossing & (window.t < all(ray.max_t) - doubt)) | is_start;
  return window;
}

// The sums of the steps up to each lane.
inline I sums(const CrossingWindow& window, int start, I4 step) {
  alignas(64) std::int32_t times[kWidth];
  alignas(64) std::int32_t steps[kWidth];
  const I t = as_int(window.t);
  store(times, t);
  store(steps, from_16(I{_mm512_castsi128_si512(reinterpret_cast<__m128i>(step))}, window.axis));
  // Broadcasts straight from memory: as shuffles they would all want the same port.
  asm volatile("" : "+m"(times), "+m"(steps));
  I sum = all(start);
#pragma GCC unroll 15
  for (int j = 0; j < kStartLane; ++j) {
    const Mask is_later = all(times[j]) + load(kTables.order[j]) < t;
    sum = add_if(is_later, sum, all(steps[j]));
  }
  return sum;
}

// The eight bricks about a window.
inline I bricks_about(const TreeView& tree, I4 brick) {
  const I4 last = I4{tree.brick_sizes.x, tree.brick_sizes.y, tree.brick_sizes.z, 1} - 1;
  const auto clamped = [last](I4 at) {
    const I4 low = at < 0 ? I4{} : at;
    return low < last ? low : last;
  };
  const I4 strides = {1, tree.brick_strides.y, tree.brick_strides.z, 0};
  const I4 near = clamped(brick) * strides;
  const I4 step = clamped(brick + 1) * strides - near;
  return eight_of(tree.bricks + near[0] + near[1] + near[2], step[0], step[1], step[2]);
}

struct Blocked {
  bool is_sure;
  bool is_doubtful;
};

inline Blocked any_in_window(const TreeView& tree, const WindowRay& ray) {
  const CrossingWindow window = all_crossings(ray);
  const I4 at = ray.own + ray.base;
  const I4 brick = (ray.forward ? at : at - 15) >> 4;
  const I4 within = at - (brick << 4);
  const I4 step = I4{1, 1 << 5, 1 << 10, 0};
  const I code = sums(window, within[0] | within[1] << 5 | within[2] << 10, ray.forward ? step : -step);
  const I spread_code = from_32(kTables.spread[0], code) | from_32(kTables.spread[1], shift_right<5>(code)) |
                        from_32(kTables.spread[2], shift_right<10>(code));
  const I half = half_of(from_16(bricks_about(tree, brick), shift_right<12>(spread_code)), shift_left<20>(spread_code));
  const Mask met = test_bit(gather(tree.words, half), spread_code) & window.valid;
  // By sums instead of a branch on whether it met anything, which no processor foresees.
  const auto none_is_sure = static_cast<std::int32_t>(bits(met & window.sure) - 1) >> 31;
  return {none_is_sure == 0, (bits(met) & static_cast<std::uint32_t>(none_is_sure)) != 0};
}

inline bool any_short_single(const TreeView& tree, const Ray& ray, double max_t, bool& unfinished) {
  // Before all else, as most rays go further.
  const double reach = max_t * (std::abs(ray.direction.x) + std::abs(ray.direction.y) + std::abs(ray.direction.z));
  if (!(reach <= kWindowReach && max_t >= 0.0)) return any_single<PathTracer>(tree, ray, max_t, unfinished);
  WindowRay single;
  if (!set_up_in_window(tree, ray, max_t, single)) return any_single<PathTracer>(tree, ray, max_t, unfinished);
  const Blocked blocked = any_in_window(tree, single);
  unfinished = false;
  return blocked.is_doubtful ? any_single<PathTracer>(tree, ray, max_t, unfinished) : blocked.is_sure;
}

}  // namespace

const Kernel kAvx512Kernel = {first_single<PathTracer>, any_short_single, trace_first, trace_any};

}  // namespace quoin::trace

#endif
