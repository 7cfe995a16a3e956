// One ray in sixteen lanes: every crossing of its next few units at once, instead of one after the other, so that
// nothing waits and hardly anything branches. The same answers as trace_single in trace/single.inl. Included once for
// each instruction set of sixteen lanes, after trace/single.inl.
//
// A window holds the next crossings of the x planes in the first lanes, then those of y, then z; how many of each is an
// estimate, and the first crossing that found no lane ends the window. Where a lane stands is the sum of the steps of
// all crossings that come before it or are its own.

// Units along |x| + |y| + |z| that a window covers: with one crossing more on each axis they are at most fifteen.
constexpr float kWindowUnits = 11.0F;
// The lane that holds where the window starts.
constexpr int kStartLane = 15;
// Later than any crossing.
constexpr float kAfterAll = 2e37F;

struct WindowTables {
  alignas(64) std::int32_t lane[kWidth];
  // -1 in lanes from j on: at a tie the crossing in lane j comes before theirs, and is itself among them.
  alignas(64) std::int32_t order[kWidth][kWidth];
  // The spread bits, as in trace/short.inl but for five bits an axis, of x, y and z.
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
      tables.spread[axis][c] = (c & 3) << (2 * axis) | (c >> 2 & 3) << (6 + 2 * axis) | (c >> 4) << (12 + axis);
    }
  }
  return tables;
}

constexpr WindowTables kTables = make_window_tables();

struct CrossingWindow {
  F t;
  I axis;
  Mask valid;
  float end_t;  // of the first crossing beyond
};

// What stays the same along a ray.
struct WindowRay {
  SingleRay ray;
  F4 limit_t;     // crossings of an axis before it are within the box
  float units_t;  // that a window of voxels covers
};

inline void make_window_ray(WindowRay& out) {
  const SingleRay& ray = out.ray;
  const F4 size = max4(ray.direction, -ray.direction);
  out.units_t = kWindowUnits / (size[0] + size[1] + size[2]);
  const int exit_axis = std::countr_zero(static_cast<std::uint32_t>(mask3(ray.far_t == all4(ray.exit_t))));
  const float after = std::bit_cast<float>(std::bit_cast<std::int32_t>(ray.exit_t + 0.0F) + 1);
  out.limit_t = I4{0, 1, 2, 3} < exit_axis ? all4(after) : all4(ray.exit_t);
}

// Each lane's own axis of four numbers.
inline F of_axis(F4 numbers, I axis) {
  return from_16(F{_mm512_castps128_ps512(reinterpret_cast<__m128>(numbers))}, axis);
}

// The crossings after `stand`, whose units have this size.
template <int kSize>
inline CrossingWindow next_crossings(const WindowRay& way, const Stand& stand) {
  const SingleRay& ray = way.ray;
  constexpr auto kEdge = static_cast<float>(kSize);
  const float until = stand.t + way.units_t * kEdge;
  const F4 first = ray.forward ? stand.lower + kEdge : stand.lower;
  const F4 units = (ray.origin + until * ray.direction - first) * ray.sign * (1.0F / kEdge);
  const I4 whole = __builtin_convertvector(min4(units, all4(11.0F)), I4) + 1;
  const I4 count = (units >= 0.0F) & ~ray.still & whole;
  const F4 beyond = first + ray.sign * kEdge * __builtin_convertvector(count, F4);
  const F4 beyond_t = ray.still ? all4(kAfterAll) : (beyond - ray.origin) * ray.inverse;
  CrossingWindow window;
  window.end_t = least3(beyond_t);
  const int x = count[0];
  const int xy = x + count[1];
  const I lane = load(kTables.lane);
  const Mask from_y = all(x - 1) < lane;
  const Mask from_z = all(xy - 1) < lane;
  window.axis = add_if(from_z, add_if(from_y, all(0), all(1)), all(1));
  const Mask is_crossing = lane < all(std::min(xy + count[2], kStartLane));
  const I number = add_if(from_z, add_if(from_y, lane, all(-x)), all(x - xy));
  const F plane = of_axis(first, window.axis) + to_float(number) * of_axis(ray.sign * kEdge, window.axis);
  const F t = (plane - of_axis(ray.origin, window.axis)) * of_axis(ray.inverse, window.axis);
  // No negative zeros: times are compared as whole numbers.
  const F others = select(lane < all(kStartLane), all(kAfterAll), all(-1.0F));
  window.t = select(is_crossing, t + all(0.0F), others);
  window.valid = is_crossing & (window.t < of_axis(min4(way.limit_t, all4(window.end_t)), window.axis));
  return window;
}

// The sums of the steps up to each lane.
inline I sums(const CrossingWindow& window, int start, I4 step) {
  alignas(64) std::int32_t times[kWidth];
  alignas(64) std::int32_t steps[kWidth];
  const I t = as_bits(window.t);
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

// Lanes whose crossing comes no later than the one in `lane`.
inline std::uint32_t up_to(const CrossingWindow& window, int lane, float t) {
  const std::uint32_t before = bits(window.t < all(t));
  const std::uint32_t same = bits(window.t == all(t)) & ((2U << lane) - 1U);
  return (before | same) & bits(window.valid);
}

inline void stand_after(const CrossingWindow& window, const WindowRay& way, std::uint32_t passed, float size,
                        Stand& stand) {
  const auto crossed = [&](int axis) { return __builtin_popcount(passed & bits(equals(window.axis, axis))); };
  const I4 counts = {crossed(0), crossed(1), crossed(2), 0};
  stand.lower += way.ray.sign * size * __builtin_convertvector(counts, F4);
}

// The first of the lanes in `which`.
inline int first_lane(const CrossingWindow& window, Mask which, float& t) {
  t = least_of(which, window.t);
  return std::countr_zero(bits(which & (window.t == all(t))));
}

enum class Found : std::uint8_t { Hit, Nothing, Left };

// To where the first of the lanes in `found` stands.
inline void stand_at(const CrossingWindow& window, const WindowRay& way, Mask found, float size, Stand& stand) {
  const int lane = first_lane(window, found, stand.t);
  stand_after(window, way, up_to(window, lane, stand.t), size, stand);
  alignas(64) std::int32_t axes[kWidth];
  store(axes, window.axis);
  stand.axis = axes[lane];
}

// Steps to the first occupied cell; or to the end of the window, or tells that the ray has left.
inline Found cell_window(const TreeView& tree, const WindowRay& way, Stand& stand) {
  const CrossingWindow window = next_crossings<4>(way, stand);
  const I4 cell = (__builtin_convertvector(stand.lower, I4) + way.ray.base) >> 2;
  const int start = tree.first_cell + cell[0] + cell[1] * tree.cell_strides.y + cell[2] * tree.cell_strides.z;
  const I4 strides = {1, tree.cell_strides.y, tree.cell_strides.z, 0};
  const I index = sums(window, start, way.ray.forward ? strides : -strides);
  const Mask found = is_occupied(tree, index) & window.valid;
  if (any(found)) {
    stand_at(window, way, found, 4.0F, stand);
    return Found::Hit;
  }
  if (!(window.end_t <= way.ray.exit_t)) return Found::Left;
  stand_after(window, way, bits(window.valid), 4.0F, stand);
  stand.t = window.end_t;
  return Found::Nothing;
}

// The eight bricks about a window, times 128.
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

// Steps to the first occupied voxel, that at which it stands included.
inline Found voxel_window(const TreeView& tree, const WindowRay& way, Stand& stand) {
  const CrossingWindow window = next_crossings<1>(way, stand);
  const I4 at = __builtin_convertvector(stand.lower, I4) + way.ray.base;
  const I4 brick = (way.ray.forward ? at : at - 15) >> 4;
  const I4 within = at - (brick << 4);
  const I4 step = I4{1, 1 << 5, 1 << 10, 0};
  const I code = sums(window, within[0] | within[1] << 5 | within[2] << 10, way.ray.forward ? step : -step);
  const I spread_code = or_of(or_of(from_32(kTables.spread[0], code), from_32(kTables.spread[1], shift_right<5>(code))),
                              from_32(kTables.spread[2], shift_right<10>(code)));
  const I half =
      from_16(bricks_about(tree, brick), shift_right<12>(spread_code)) + (shift_right<5>(spread_code) & all(127));
  const Mask met = test_bit(gather(tree.words, half), spread_code) & (window.valid | mask_of(1U << kStartLane));
  if (any(met)) {
    if ((bits(met) >> kStartLane & 1U) == 0) stand_at(window, way, met, 1.0F, stand);
    return Found::Hit;
  }
  if (!(window.end_t <= way.ray.exit_t)) return Found::Left;
  stand_after(window, way, bits(window.valid), 1.0F, stand);
  stand.t = window.end_t;
  return Found::Nothing;
}

inline bool is_cell_occupied(const TreeView& tree, const WindowRay& way, const Stand& stand) {
  const I4 cell = (__builtin_convertvector(stand.lower, I4) + way.ray.base) >> 2;
  const auto index = static_cast<std::uint32_t>(tree.first_cell + cell[0] + cell[1] * tree.cell_strides.y +
                                                cell[2] * tree.cell_strides.z);
  return (tree.cells[index >> 5] >> (index & 31U) & 1U) != 0;
}

inline SingleHit trace_windows(const TreeView& tree, const Ray& world_ray, double max_t) {
  WindowRay way;
  SingleHit hit;
  const SetUp ready = set_up_single(tree, world_ray, max_t, way.ray);
  hit.is_unfinished = ready == SetUp::Unusual;
  if (ready != SetUp::Ready) return hit;
  make_window_ray(way);
  Stand stand = first_stand(way.ray);
  for (;;) {
    if (is_cell_occupied(tree, way, stand)) {
      const Found found = voxel_window(tree, way, stand);
      if (found == Found::Hit) break;
      if (found == Found::Left) {
        hit.is_unfinished = way.ray.is_cut;
        return hit;
      }
      continue;
    }
    stand.lower = __builtin_convertvector(__builtin_convertvector(stand.lower, I4) & ~3, F4);
    Found found = Found::Nothing;
    while (found == Found::Nothing) found = cell_window(tree, way, stand);
    if (found == Found::Left) {
      hit.is_unfinished = way.ray.is_cut;
      return hit;
    }
    enter(way.ray, stand.lower, stand.lower + 3.0F, stand);
  }
  hit.is_hit = true;
  hit.axis = stand.axis;
  const I4 voxel = __builtin_convertvector(stand.lower, I4) + way.ray.base;
  hit.voxel = IVec3{voxel[0], voxel[1], voxel[2]};
  return hit;
}
