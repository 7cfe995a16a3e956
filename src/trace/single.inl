// One ray, walked in plain code; the same answers as the lockstep kernel in trace/kernel.inl, whose comments explain
// the arithmetic. Included once for each instruction set, within its namespace, after the kernel.

using F4 = float __attribute__((vector_size(16)));
using I4 = std::int32_t __attribute__((vector_size(16)));

inline F4 floor4(F4 a) {
  const F4 whole = __builtin_convertvector(__builtin_convertvector(a, I4), F4);
  return whole > a ? whole - 1.0F : whole;
}
inline F4 min4(F4 a, F4 b) {
  return a < b ? a : b;
}
inline F4 max4(F4 a, F4 b) {
  return a > b ? a : b;
}

// A ray's numbers by axis.
struct SingleRay {
  float origin[4];
  float direction[4];
  float inverse[4];  // 1 where it is still
  float low[4];
  float high[4];
  bool still[4];
  int base[4];
  float exit_t;
  float enter_t;
  int enter_axis;
  bool is_cut;
  bool is_moved;  // it does not start at `origin`, but came there
};

enum class SetUp : std::uint8_t { Ready, Misses, Unusual };

inline bool is_nearby(const TreeView& tree, const double* p) {
  bool nearby = true;
  for (int a = 0; a < 3; ++a) {
    const auto at = static_cast<float>(p[a]);
    nearby &=
        static_cast<float>(tree.box.min[a]) - kNearby <= at && at <= static_cast<float>(tree.box.max[a]) + kNearby;
  }
  return nearby;
}

// The box of the ray's way, and where it enters and leaves it.
inline SetUp clip_single(const TreeView& tree, SingleRay& ray, float max_t, float greatest, int moved) {
  const auto load4 = [](const float* from) { return F4{from[0], from[1], from[2], from[3]}; };
  const F4 f = load4(ray.origin);
  const F4 d = load4(ray.direction);
  const float furthest = kReach / greatest;
  const float reach = max_t < furthest ? max_t : furthest;
  const F4 end = f + reach * d;
  const IVec3& lo = tree.box.min;
  const IVec3& hi = tree.box.max;
  const F4 low_bound = __builtin_convertvector((I4{lo.x - ray.base[0], lo.y - ray.base[1], lo.z - ray.base[2], 0}), F4);
  const F4 high_bound =
      __builtin_convertvector((I4{hi.x - ray.base[0], hi.y - ray.base[1], hi.z - ray.base[2], 1}), F4);
  const F4 low = max4(low_bound, floor4(min4(f, end) - kSlack));
  const F4 high = min4(high_bound, floor4(max4(f, end) + kSlack) + 1.0F);
  float bounds_exit = kNever;
  ray.is_moved = moved >= 0;
  ray.enter_t = -1.0F;
  ray.enter_axis = -1;
  ray.exit_t = kNever;
  float far_t[3];
  for (int a = 0; a < 3; ++a) {
    ray.low[a] = low[a];
    ray.high[a] = high[a];
    const bool is_low = ray.origin[a] < low[a];
    const bool is_high = high[a] <= ray.origin[a];
    const bool forward = ray.direction[a] > 0.0F;
    const float far = forward ? high[a] : low[a];
    const float bound = forward ? high_bound[a] : low_bound[a];
    if (ray.still[a]) {
      if (is_low || is_high) return SetUp::Misses;
      far_t[a] = kNever;
      continue;
    }
    if ((forward ? is_low : is_high) || moved == a) {
      const float t = ((forward ? low[a] : high[a]) - ray.origin[a]) * ray.inverse[a];
      if (t >= ray.enter_t) {
        ray.enter_t = t;
        ray.enter_axis = a;
      }
    } else if (is_low || is_high) {
      return SetUp::Misses;
    }
    const float bound_t = (bound - ray.origin[a]) * ray.inverse[a];
    bounds_exit = bound_t < bounds_exit ? bound_t : bounds_exit;
    far_t[a] = (far - ray.origin[a]) * ray.inverse[a];
    ray.exit_t = far_t[a] < ray.exit_t ? far_t[a] : ray.exit_t;
  }
  ray.is_cut = furthest < max_t && furthest < bounds_exit;
  if (ray.enter_axis < 0) ray.enter_t = 0.0F;
  for (int a = 0; a < 3; ++a) {
    if (far_t[a] < ray.enter_t || (far_t[a] == ray.enter_t && a < ray.enter_axis)) return SetUp::Misses;
  }
  return SetUp::Ready;
}

inline SetUp set_up_single(const TreeView& tree, const Ray& ray, double max_t, SingleRay& out) {
  double p[3];
  float size[3];
  for (int a = 0; a < 3; ++a) {
    p[a] = ray.origin[a] - tree.origin[a];
    out.direction[a] = static_cast<float>(ray.direction[a]);
    size[a] = std::abs(out.direction[a]);
  }
  const float greatest = std::max(std::max(size[0], size[1]), size[2]);
  auto limit = static_cast<float>(max_t);
  if (!(size[0] <= 0x1p20F && size[1] <= 0x1p20F && size[2] <= 0x1p20F && greatest >= 0x1p-20F && limit >= 0.0F)) {
    return SetUp::Unusual;
  }
  int moved = -1;
  if (!is_nearby(tree, p)) {
    const double direction[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
    Move move{{p[0], p[1], p[2]}, max_t, -1};
    if (!move_to_bounds(tree, direction, move)) return SetUp::Misses;
    for (int a = 0; a < 3; ++a) p[a] = move.position[a];
    limit = static_cast<float>(move.max_t);
    moved = move.entered;
  }
  for (int a = 0; a < 3; ++a) {
    const int trunc = static_cast<int>(p[a]);
    const int floor = trunc - (static_cast<double>(trunc) > p[a] ? 1 : 0);
    out.base[a] = floor & ~63;
    const auto inside = static_cast<float>(p[a] - out.base[a]);
    const float last = static_cast<float>(floor - out.base[a]) + (1.0F - 0x1p-17F);
    out.origin[a] = inside < last ? inside : last;
    out.still[a] = size[a] < 0x1p-100F;
    if (out.still[a]) out.direction[a] = 0.0F;
    out.inverse[a] = 1.0F / (out.still[a] ? 1.0F : out.direction[a]);
  }
  out.origin[3] = out.direction[3] = 0.0F;
  return clip_single(tree, out, limit, greatest, moved);
}

// As `coordinate_after` of the lockstep kernel.
template <int kSize>
inline int single_coordinate_after(const SingleRay& ray, int a, float t, int low, int high, int axis) {
  const float position = ray.origin[a] + t * ray.direction[a];
  const float scaled = position * (1.0F / kSize);
  const int trunc = static_cast<int>(scaled);
  const int floor = trunc - (static_cast<float>(trunc) > scaled ? 1 : 0);
  int at = std::min(std::max(floor, low), high);
  // Rounding can put a position on the wrong side of a plane only next to it.
  const float past = (scaled - static_cast<float>(at)) * kSize;
  if (past > 0.01F && past < kSize - 0.01F) return at;
  if (ray.still[a]) return at;
  const bool forward = ray.direction[a] > 0.0F;
  const auto lower = static_cast<float>(at * kSize);
  const float upper = lower + kSize;
  const float behind = forward ? lower : upper;
  const float ahead_t = ((forward ? upper : lower) - ray.origin[a]) * ray.inverse[a];
  const float behind_t = (behind - ray.origin[a]) * ray.inverse[a];
  if (ahead_t < t || (ahead_t == t && a < axis)) return at + (forward ? 1 : -1);
  const bool was_inside = forward && (ray.is_moved ? behind < ray.origin[a] : behind <= ray.origin[a]);
  if ((t < behind_t || (behind_t == t && axis >= 0 && axis < a)) && !was_inside) return at - (forward ? 1 : -1);
  return at;
}

struct SingleHit {
  bool is_hit = false;
  bool is_unfinished = false;
  int axis = -1;  // of the face; -1 when it starts inside
  int voxel[3] = {};
};

#define QUOIN_STEP(A)                                   \
  {                                                     \
    now = t##A;                                         \
    axis = A;                                           \
    plane##A += step##A;                                \
    t##A = (plane##A - ray.origin[A]) * ray.inverse[A]; \
    index += stride##A;                                 \
  }
#define QUOIN_STEP_FIRST \
  if (t0 <= t1) {        \
    if (t0 <= t2)        \
      QUOIN_STEP(0)      \
    else                 \
      QUOIN_STEP(2)      \
  } else {               \
    if (t1 <= t2)        \
      QUOIN_STEP(1)      \
    else                 \
      QUOIN_STEP(2)      \
  }

// Walks through a cell's 64 voxels from where the ray enters it; answers the index of the voxel met, or -1.
inline int walk_cell(const SingleRay& ray, std::uint64_t word, const int lower[3], float entered_at, int& axis) {
  int v[3];
  float plane[3];
  for (int a = 0; a < 3; ++a) {
    const bool forward = ray.direction[a] > 0.0F;
    v[a] = a == axis ? lower[a] + (forward ? 0 : 3)
                     : single_coordinate_after<1>(ray, a, entered_at, lower[a], lower[a] + 3, axis);
    plane[a] = ray.still[a] ? kNever : static_cast<float>(v[a] + (forward ? 1 : 0));
    v[a] -= lower[a];
  }
  int index = v[0] * kCodeX + v[1] * kCodeY + v[2] * kCodeZ;
  if ((word >> (index & 63) & 1U) != 0) return index & 63;
  const int stride0 = ray.direction[0] > 0.0F ? kCodeX : -kCodeX;
  const int stride1 = ray.direction[1] > 0.0F ? kCodeY : -kCodeY;
  const int stride2 = ray.direction[2] > 0.0F ? kCodeZ : -kCodeZ;
  const float step0 = ray.direction[0] > 0.0F ? 1.0F : -1.0F;
  const float step1 = ray.direction[1] > 0.0F ? 1.0F : -1.0F;
  const float step2 = ray.direction[2] > 0.0F ? 1.0F : -1.0F;
  float plane0 = plane[0];
  float plane1 = plane[1];
  float plane2 = plane[2];
  float t0 = (plane0 - ray.origin[0]) * ray.inverse[0];
  float t1 = (plane1 - ray.origin[1]) * ray.inverse[1];
  float t2 = (plane2 - ray.origin[2]) * ray.inverse[2];
  float now = 0.0F;
  for (;;) {
    QUOIN_STEP_FIRST
    if ((index & kLeft) != 0) return -1;
    if ((word >> (index & 63) & 1U) != 0) {
      static_cast<void>(now);
      return index & 63;
    }
  }
}

inline std::uint64_t cell_word(const TreeView& tree, const SingleRay& ray, const int lower[3]) {
  const int x = (lower[0] + ray.base[0]) >> 2;
  const int y = (lower[1] + ray.base[1]) >> 2;
  const int z = (lower[2] + ray.base[2]) >> 2;
  const int brick = (x >> 2) + (y >> 2) * tree.brick_strides.y + (z >> 2) * tree.brick_strides.z;
  const std::size_t cell = static_cast<std::size_t>((x & 3) + 4 * (y & 3) + 16 * (z & 3));
  std::uint64_t word;
  std::memcpy(&word, tree.words + (std::size_t{tree.bricks[brick]} * 64 + cell) * 2, sizeof word);
  return word;
}

inline SingleHit trace_single(const TreeView& tree, const Ray& world_ray, double max_t) {
  SingleRay ray;
  SingleHit hit;
  const SetUp ready = set_up_single(tree, world_ray, max_t, ray);
  hit.is_unfinished = ready == SetUp::Unusual;
  if (ready != SetUp::Ready) return hit;
  int axis = ray.enter_axis;
  float now = ray.enter_t;
  float plane[3];
  int index = tree.first_cell;
  const int strides[3] = {1, tree.cell_strides.y, tree.cell_strides.z};
  for (int a = 0; a < 3; ++a) {
    const bool forward = ray.direction[a] > 0.0F;
    const int low = static_cast<int>(ray.low[a]) >> 2;
    const int high = (static_cast<int>(ray.high[a]) - 1) >> 2;
    const int cell = a == axis ? (forward ? low : high) : single_coordinate_after<4>(ray, a, now, low, high, axis);
    plane[a] = ray.still[a] ? kNever : static_cast<float>(cell * 4 + (forward ? 4 : 0));
    index += (cell + (ray.base[a] >> 2)) * strides[a];
  }
  const int stride0 = ray.direction[0] > 0.0F ? 1 : -1;
  const int stride1 = ray.direction[1] > 0.0F ? strides[1] : -strides[1];
  const int stride2 = ray.direction[2] > 0.0F ? strides[2] : -strides[2];
  const float step0 = ray.direction[0] > 0.0F ? 4.0F : -4.0F;
  const float step1 = ray.direction[1] > 0.0F ? 4.0F : -4.0F;
  const float step2 = ray.direction[2] > 0.0F ? 4.0F : -4.0F;
  float plane0 = plane[0];
  float plane1 = plane[1];
  float plane2 = plane[2];
  float t0 = (plane0 - ray.origin[0]) * ray.inverse[0];
  float t1 = (plane1 - ray.origin[1]) * ray.inverse[1];
  float t2 = (plane2 - ray.origin[2]) * ray.inverse[2];
  const float planes_back[3] = {step0 > 0 ? 4.0F : 0.0F, step1 > 0 ? 4.0F : 0.0F, step2 > 0 ? 4.0F : 0.0F};
  for (;;) {
    if ((tree.cells[static_cast<std::uint32_t>(index) >> 5] >> (index & 31) & 1U) != 0) {
      const float exits[3] = {plane0, plane1, plane2};
      int lower[3];
      for (int a = 0; a < 3; ++a) {
        lower[a] = ray.still[a] ? static_cast<int>(std::floor(ray.origin[a] * 0.25F)) * 4
                                : static_cast<int>(exits[a] - planes_back[a]);
      }
      hit.axis = axis;
      const int voxel = walk_cell(ray, cell_word(tree, ray, lower), lower, now, hit.axis);
      if (voxel >= 0) {
        hit.is_hit = true;
        hit.voxel[0] = lower[0] + ray.base[0] + (voxel & 3);
        hit.voxel[1] = lower[1] + ray.base[1] + (voxel >> 2 & 3);
        hit.voxel[2] = lower[2] + ray.base[2] + (voxel >> 4);
        return hit;
      }
    }
    QUOIN_STEP_FIRST
    if (!(now <= ray.exit_t)) {
      hit.is_unfinished = ray.is_cut;
      return hit;
    }
  }
}

#undef QUOIN_STEP
#undef QUOIN_STEP_FIRST

inline bool first_single(const TreeView& tree, const Ray& ray, double max_t, RayHit& hit, bool& unfinished) {
  const SingleHit found = trace_single(tree, ray, max_t);
  unfinished = found.is_unfinished;
  if (!found.is_hit) return false;
  hit.voxel = IVec3{found.voxel[0], found.voxel[1], found.voxel[2]} + IVec3(tree.origin);
  hit.starts_inside = found.axis < 0;
  hit.t = 0.0;
  if (hit.starts_inside) return true;
  const double d = ray.direction[found.axis];
  hit.face = static_cast<Direction>(2 * found.axis + (d > 0.0 ? 1 : 0));
  const double plane = hit.voxel[found.axis] + (d > 0.0 ? 0.0 : 1.0);
  hit.t = (plane - ray.origin[found.axis]) * (1.0 / d);
  return hit.t <= max_t;
}
