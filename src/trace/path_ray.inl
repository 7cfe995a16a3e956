// Setting up one ray for the walk in trace/path_walk.inl: mirrored so that it goes forward along every axis. The same
// arithmetic as in trace/single.inl, after which it is included: a plane and an origin that both change their sign are
// as far apart as before, to the bit.

// The edge of a chunk, and what an axis that stands still has for 1 / direction.
constexpr float kChunkSize = 64.0F;
constexpr float kStillInverse = 1e37F;

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

inline F4 mirrored_planes(F4 planes, I4 backward) {
  constexpr std::int32_t kSign = std::numeric_limits<std::int32_t>::min();
  return reinterpret_cast<F4>(reinterpret_cast<I4>(planes) ^ (backward & kSign));
}

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

// Moves the start of a ray that is far away to where it enters the bounds; false when it misses them.
inline bool bring_near(const TreeView& tree, const Ray& ray, double max_t, D4& position, float& limit, int& moved) {
  const double direction[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
  Move move{{position[0], position[1], position[2]}, max_t, -1};
  if (!move_to_bounds(tree, direction, move)) return false;
  position = D4{move.position[0], move.position[1], move.position[2], move.position[2]};
  limit = static_cast<float>(move.max_t);
  moved = move.entered;
  return true;
}

inline SetUp set_up_path(const TreeView& tree, const Ray& ray, double max_t, PathRay& out) {
  static_assert(sizeof(Ray) == 6 * sizeof(double));
  D4 p;
  D4 direction64;
  D4 corner;
  F4 low;
  F4 high;
  std::memcpy(&p, &ray.origin.x, sizeof p);
  std::memcpy(&direction64, &ray.origin.z, sizeof direction64);
  std::memcpy(&corner, tree.corner, sizeof corner);
  std::memcpy(&low, tree.low, sizeof low);
  std::memcpy(&high, tree.high, sizeof high);
  p -= corner;
  const F4 d = __builtin_convertvector(__builtin_shufflevector(direction64, direction64, 1, 2, 3, 3), F4);
  const F4 size = max4(d, -d);
  const float greatest = greatest3(size);
  auto limit = static_cast<float>(max_t);
  if (mask3(size <= all4(0x1p20F)) != 7 || !(greatest >= 0x1p-20F) || !(limit >= 0.0F)) return SetUp::Unusual;
  const F4 rough = __builtin_convertvector(p, F4);
  const I4 leaves = ((high < rough) & (d >= 0.0F)) | ((rough < low) & (d <= 0.0F));
  if (mask3(leaves) != 0) return SetUp::Misses;
  int moved = -1;
  if (mask3((low - kNearby <= rough) & (rough <= high + kNearby)) != 7) {
    if (!bring_near(tree, ray, max_t, p, limit, moved)) return SetUp::Misses;
  }
  const D4 base = floor_of(p * (1.0 / 64.0)) * 64.0;
  const F4 whole = __builtin_convertvector(floor_of(p) - base, F4);
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
