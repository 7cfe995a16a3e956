// Packets of rays among voxels: finds the voxels and faces that rays hit, with distances in double precision, or only
// the rays that are blocked. Short rays that start near each other walk in windows (trace/kernel/window.inl).

#pragma once

#include "trace/kernel/lockstep.inl"
#include "trace/kernel/single.inl"
#include "trace/kernel/window.inl"

namespace quoin::trace {
namespace {

#ifndef QUOIN_KERNEL_AVX512

// Traces rays of one packet with similar directions together, in AVX2. The units that any of the rays may pass are
// computed once for all, in an order that is valid for each ray. Each occupied voxel is then tested in all lanes. The
// results equal those of the walk in lockstep.
//
//     start ______                       origin, inverse: minimum and maximum of all lanes, mirrored
//     |  ___/   | \___                    -> chunks, bricks, cells, voxels that any lane may pass (BeamPaths)
//     | /       |     \                   -> for each occupied voxel: the lanes that pass it, which are then finished
//     |/________|______|  end

// Several rays with similar directions.
struct Beam {
  F4 least_origin, greatest_origin;
  F4 least_inverse, greatest_inverse;
  float end;  // no ray goes further
};

// Like Paths, but with the earliest and the latest time when any of the rays crosses a plane. Rounding is monotonic for
// products and differences, so these times bound those of every ray.
class BeamPaths {
 public:
  explicit BeamPaths(const Beam& beam) : end_(_mm256_set1_ps(beam.end)) {
    for (int axis = 0; axis < 3; ++axis) {
      axes_[axis] = {_mm256_set1_ps(beam.least_origin[axis]), _mm256_set1_ps(beam.greatest_origin[axis]),
                     _mm256_set1_ps(beam.least_inverse[axis]), _mm256_set1_ps(beam.greatest_inverse[axis])};
    }
  }
  // Returns the units of 4^kLevel voxels in the block with these lower planes.
  template <int kLevel>
  [[nodiscard]] std::uint64_t units(F4 block) const {
    const Times x = times<kLevel>(block[0], axes_[0]);
    const Times y = times<kLevel>(block[1], axes_[1]);
    const Times z = times<kLevel>(block[2], axes_[2]);
    return units_passed<_CMP_LE_OQ>(x, y, z);
  }

 private:
  struct Bounds {
    __m256 least_origin, greatest_origin, least_inverse, greatest_inverse;
  };
  template <int kLevel>
  [[nodiscard]] Times times(float block, const Bounds& axis) const {
    const __m256 lower = _mm256_add_ps(_mm256_set1_ps(block), _mm256_load_ps(kPlanes.unit[kLevel][0]));
    const __m256 upper = _mm256_add_ps(lower, _mm256_set1_ps(1 << (2 * kLevel)));
    const __m256 to_lower = _mm256_sub_ps(lower, axis.greatest_origin);
    const __m256 to_upper = _mm256_sub_ps(upper, axis.least_origin);
    const __m256 first =
        _mm256_min_ps(_mm256_mul_ps(to_lower, axis.least_inverse), _mm256_mul_ps(to_lower, axis.greatest_inverse));
    const __m256 last =
        _mm256_max_ps(_mm256_mul_ps(to_upper, axis.least_inverse), _mm256_mul_ps(to_upper, axis.greatest_inverse));
    return {_mm256_max_ps(first, _mm256_setzero_ps()), _mm256_min_ps(last, end_)};
  }
  Bounds axes_[3];
  __m256 end_;
};

// A ray passes at most ten of the 64 units of a block. A beam that passes more units than this tests voxels that
// most of its rays miss.
constexpr int kWideBeam = 24;
// The maximum width of a beam at its end, in voxels (measured). Wider beams walk in lockstep.
constexpr float kBeamWidth = 4.0F;

struct BeamAxis {
  F origin;   // mirrored
  F inverse;  // 1e37 where it is still
  F speed;
  F nudge;
};

struct BeamLanes {
  BeamAxis x, y, z;
  I4 base;
  I4 backward;
  int octant = 0;
  bool nudges = false;
  Mask left;  // lanes without a hit yet
};

// Returns false if some rays go forward and some backward, or if their starts are near different multiples of 64.
inline bool mirror_axis(const Axis& axis, Mask live, Mask starts_there, int index, BeamLanes& out, BeamAxis& to) {
  const std::uint32_t is_forward = bits(axis.forward & live);
  const std::uint32_t is_backward = bits(live & ~axis.forward & ~axis.still);
  if (is_forward != 0 && is_backward != 0) return false;
  alignas(64) std::int32_t bases[kWidth];
  store(bases, axis.base);
  const int base = bases[std::countr_zero(bits(live) | 1U << (kWidth - 1))];
  if (any(live & ~equals(axis.base, base))) return false;
  const bool is_mirrored = is_backward != 0;
  const F whole = floor(axis.origin);
  const F own = select(axis.still, whole + all(0.5F), axis.origin);
  to.origin = is_mirrored ? all(0.0F) - own : own;
  to.inverse = select(axis.still, all(kStillInverse), abs(axis.inverse));
  to.speed = abs(axis.direction);
  to.nudge = select(axis.forward & ~axis.moved, all(kNudge), all(0.0F));
  out.nudges = out.nudges || any(live & starts_there & axis.forward & ~axis.moved & (whole == axis.origin));
  out.octant |= (is_mirrored ? 1 : 0) << index;
  out.base[index] = base;
  out.backward[index] = is_mirrored ? -1 : 0;
  return true;
}

struct Span {
  float least, greatest;
};

inline Span span_of(F a, Mask live) {
  return {least_of(select(live, a, all(kNever))), 0.0F - least_of(select(live, all(0.0F) - a, all(kNever)))};
}

inline Beam beam_of(const BeamLanes& lanes, F exit_t) {
  Beam beam{};
  const BeamAxis* axes[] = {&lanes.x, &lanes.y, &lanes.z};
  for (int i = 0; i < 3; ++i) {
    const Span origin = span_of(axes[i]->origin, lanes.left);
    const Span inverse = span_of(axes[i]->inverse, lanes.left);
    beam.least_origin[i] = origin.least;
    beam.greatest_origin[i] = origin.greatest;
    beam.least_inverse[i] = inverse.least;
    beam.greatest_inverse[i] = inverse.greatest;
  }
  beam.end = span_of(exit_t, lanes.left).greatest * 1.001F + 1e-6F;
  return beam;
}

// Returns true if all rays start and end near the first one.
inline bool is_narrow(const Lanes& lanes) {
  const int first = std::countr_zero(bits(lanes.live) | 1U << (kWidth - 1));
  const auto from_first = [first](F a) {
    alignas(64) float each[kWidth];
    store(each, a);
    return abs(a - all(each[first]));
  };
  const auto width = [&](const Axis& axis) {
    return from_first(axis.origin) + from_first(axis.direction) * lanes.exit_t;
  };
  const F widest = max(max(width(lanes.x), width(lanes.y)), width(lanes.z));
  return !any(lanes.live & (all(kBeamWidth) < widest));
}

inline F beam_t(const BeamAxis& axis, float plane, bool nudges) {
  const F t = (all(plane) - axis.origin) * axis.inverse;
  return nudges ? t - axis.nudge : t;
}

// Tests which of the remaining lanes pass the voxel with these lower planes, and records the hits.
inline void meet(BeamLanes& lanes, F4 voxel, Met& met) {
  const F lx = beam_t(lanes.x, voxel[0], lanes.nudges);
  const F ly = beam_t(lanes.y, voxel[1], lanes.nudges);
  const F lz = beam_t(lanes.z, voxel[2], lanes.nudges);
  const F hx = beam_t(lanes.x, voxel[0] + 1.0F, lanes.nudges);
  const F hy = beam_t(lanes.y, voxel[1] + 1.0F, lanes.nudges);
  const F hz = beam_t(lanes.z, voxel[2] + 1.0F, lanes.nudges);
  const F yz = min(hy, hz);
  const F xy = min(hx, hy);
  const Mask pass = lanes.left & (lx <= yz) & (lz < xy) & (ly < hx) & (ly <= hz) & (all(0.0F) <= min(xy, hz));
  if (!any(pass)) return;
  const F last = max(max(lx, ly), lz);
  const I axis = select(lz == last, all(2), select(ly == last, all(1), all(0)));
  const F4 native = mirrored_planes(lanes.backward ? voxel + 1.0F : voxel, lanes.backward);
  const I4 at = __builtin_convertvector(native, I4) + lanes.base;
  met.x = select(pass, all(at[0]), met.x);
  met.y = select(pass, all(at[1]), met.y);
  met.z = select(pass, all(at[2]), met.z);
  met.axis = select(pass, axis, met.axis);
  met.inside = met.inside | (pass & (last < all(0.0F)));
  met.hit = met.hit | pass;
  lanes.left = lanes.left & ~pass;
}

// Traces the lanes through a brick.
inline void trace_brick(const BrickWords& words, std::uint64_t cells, BeamLanes& lanes, const BeamPaths& paths,
                        F4 brick, Met& met) {
  const Mirror mirrored(lanes.octant);
  for (; cells != 0; cells &= cells - 1) {
    const int cell = std::countr_zero(cells);
    const F4 in_cell = brick + corner_of(cell) * 4.0F;
    const std::uint64_t& word = words[static_cast<std::size_t>(cell ^ flip_of(lanes.octant))];
    std::uint64_t voxels = paths.units<0>(in_cell) & mirrored(&word);
    for (; voxels != 0; voxels &= voxels - 1) {
      meet(lanes, in_cell + corner_of(std::countr_zero(voxels)), met);
      if (!any(lanes.left)) return;
    }
  }
}

// Traces the lanes through the 4^3 chunks with these lower planes. Returns false if the beam is too wide to pay off.
inline bool trace_chunks(const TreeView& tree, BeamLanes& lanes, const BeamPaths& paths, F4 block, Met& met) {
  const Mirror mirrored(lanes.octant);
  for (std::uint64_t chunks = paths.units<3>(block); chunks != 0; chunks &= chunks - 1) {
    const F4 chunk = block + corner_of(std::countr_zero(chunks)) * kChunkSize;
    const F4 native = mirrored_planes(lanes.backward ? chunk + kChunkSize : chunk, lanes.backward);
    const I4 place = (__builtin_convertvector(native, I4) + lanes.base) >> 6;
    const I4 sizes = I4{tree.brick_sizes.x, tree.brick_sizes.y, tree.brick_sizes.z, 0} >> 2;
    if (mask3((place < 0) | (place >= sizes)) != 0) continue;
    const FlatChunk& entry =
        tree.chunks[place[0] + place[1] * tree.chunk_strides[1] + place[2] * tree.chunk_strides[2]];
    if (entry.bricks == 0) continue;
    const std::uint64_t passed = paths.units<2>(chunk);
    if (std::popcount(passed) > kWideBeam) return false;
    std::uint64_t bricks = passed & mirrored(&entry.bricks);
    for (; bricks != 0; bricks &= bricks - 1) {
      const int brick = std::countr_zero(bricks);
      const F4 in_brick = chunk + corner_of(brick) * 16.0F;
      const auto at = static_cast<std::size_t>(brick ^ flip_of(lanes.octant));
      const std::uint64_t cells = paths.units<1>(in_brick);
      if (std::popcount(cells) > kWideBeam) return false;
      const BrickWords words(tree.lines, entry.node->bricks[at]);
      trace_brick(words, cells & mirrored(&entry.node->cells[at]), lanes, paths, in_brick, met);
      if (!any(lanes.left)) return true;
    }
  }
  return true;
}

inline F4 chunk_block(const BeamLanes& lanes, F t) {
  const auto first = [&](const BeamAxis& axis) {
    const F position = axis.origin + t * axis.speed - all(kSlack);
    return least_of(select(lanes.left, position, all(kNever)));
  };
  return floor4(F4{first(lanes.x), first(lanes.y), first(lanes.z), 0.0F} * (1.0F / kChunkSize)) * kChunkSize;
}

// Returns the lanes that other code must trace: beams that it does not support, or that stopped early.
inline Mask trace_beam(const TreeView& tree, const Lanes& lanes, F t, const Crossing& entered, Met& met) {
  if (!is_narrow(lanes)) return lanes.live;
  BeamLanes beam;
  beam.left = lanes.live;
  const Mask starts_there = ~(entered.x | entered.y | entered.z) | (t == all(0.0F));
  if (any(lanes.unfinished) || !mirror_axis(lanes.x, lanes.live, starts_there, 0, beam, beam.x) ||
      !mirror_axis(lanes.y, lanes.live, starts_there, 1, beam, beam.y) ||
      !mirror_axis(lanes.z, lanes.live, starts_there, 2, beam, beam.z)) {
    return lanes.live;
  }
  const BeamPaths paths(beam_of(beam, lanes.exit_t));
  F4 block = chunk_block(beam, t);
  for (;;) {
    if (!trace_chunks(tree, beam, paths, block, met)) return beam.left;
    const F4 far = block + 4.0F * kChunkSize;
    const F out = min(min(beam_t(beam.x, far[0], false), beam_t(beam.y, far[1], false)), beam_t(beam.z, far[2], false));
    beam.left = beam.left & (out <= lanes.exit_t);
    if (!any(beam.left)) return beam.left;
    const F4 next = chunk_block(beam, out);
    if (mask3(next < block) != 0 || mask3(next > block) == 0) return beam.left;
    block = next;
  }
}

#endif

// The results for the requested lanes.
struct LaneHits {
  std::uint32_t hit = 0;
  std::uint32_t starts_inside = 0;
  std::uint32_t unfinished = 0;                  // exceeded the kernel's range: must be traced in double precision
  RayPacket::Lanes<std::int32_t> x{}, y{}, z{};  // voxels, from the tables' origin
  RayPacket::Lanes<std::int32_t> axis{};         // axis of the face
};

template <Ask kAsk>
inline Met trace(const TreeView& tree, Lanes& lanes, F t, const Crossing& entered) {
  Met met{mask_of(0), mask_of(0), all(0), all(0), all(0), all(0)};
#ifndef QUOIN_KERNEL_AVX512  // in AVX-512, lockstep is at least as fast as beams for every kind of packet
  lanes.live = trace_beam(tree, lanes, t, entered, met);
  if (!any(lanes.live)) return met;
#endif
  return trace_apart<kAsk>(tree, lanes, t, entered, met);
}

inline void keep(const Met& met, int first, LaneHits& out) {
  QUOIN_ASSERT(first % kWidth == 0 && first < RayPacket::kSize, "the first lane of a group");
  out.hit |= bits(met.hit) << first;
  out.starts_inside |= bits(met.inside) << first;
  store(out.x.data() + first, met.x);
  store(out.y.data() + first, met.y);
  store(out.z.data() + first, met.z);
  store(out.axis.data() + first, met.axis);
}

inline void trace_packet(const TreeView& tree, const RayPacket& rays, LaneHits& out) {
  for (int first = 0; first < RayPacket::kSize; first += kWidth) {
    const std::uint32_t wanted = rays.active >> first & kAllLanes;
    if (wanted == 0) continue;
    F t;
    Crossing entered;
    Lanes lanes = set_up(tree, rays, first, wanted, t, entered);
    if (any(lanes.live)) keep(trace<Ask::Where>(tree, lanes, t, entered), first, out);
    out.unfinished |= bits(lanes.unfinished) << first;
  }
  out.unfinished &= ~out.hit;
}

template <class Vector, class T>
inline Vector lanes_at(const RayPacket::Lanes<T>& from, std::size_t first) {
  return some<Vector>(from.data() + first);
}

// Computes the distances of the faces hit by the lanes, starting at lane `first`, in double precision, and the
// direction in which rays cross them, 1 for forward. Returns the lanes within reach.
inline std::uint32_t measure_some(const TreeView& tree, const RayPacket& rays, const LaneHits& lanes, std::size_t first,
                                  RayPacket::Lanes<double>& t, RayPacket::Lanes<std::int32_t>& forward) {
  const Longs axis = __builtin_convertvector(lanes_at<Ints>(lanes.axis, first), Longs);
  const Longs is_x = axis == 0;
  const Longs is_y = axis == 1;
  const auto of_axis = [&](const auto& x, const auto& y, const auto& z) {
    const auto y_or_z = is_y ? lanes_at<Doubles>(y, first) : lanes_at<Doubles>(z, first);
    return is_x ? lanes_at<Doubles>(x, first) : y_or_z;
  };
  const auto to_grid = [&](const RayPacket::Lanes<std::int32_t>& at, double origin) {
    return __builtin_convertvector(lanes_at<Ints>(at, first), Doubles) + origin;
  };
  const Doubles y_or_z = is_y ? to_grid(lanes.y, tree.origin.y) : to_grid(lanes.z, tree.origin.z);
  const Doubles lower = is_x ? to_grid(lanes.x, tree.origin.x) : y_or_z;
  const Doubles direction = of_axis(rays.direction_x, rays.direction_y, rays.direction_z);
  const Longs is_forward = direction > 0.0;
  const Doubles plane = lower + (is_forward ? Doubles{} : Doubles{} + 1.0);
  const Longs lane = lane_bits();
  const Longs is_hit = (lane & static_cast<std::int64_t>(lanes.hit >> first)) != 0;
  const Doubles divisor = is_hit ? direction : Doubles{} + 1.0;
  const Doubles distance = (plane - of_axis(rays.origin_x, rays.origin_y, rays.origin_z)) * (1.0 / divisor);
  const Longs inside = (lane & static_cast<std::int64_t>(lanes.starts_inside >> first)) != 0;
  const Doubles result = inside ? Doubles{} : distance;
  std::memcpy(t.data() + first, &result, sizeof result);
  const Ints ones = __builtin_convertvector(-is_forward, Ints);
  std::memcpy(forward.data() + first, &ones, sizeof ones);
  const Longs within = lane & (result <= lanes_at<Doubles>(rays.max_t, first));
  std::int64_t bits = 0;
  for (std::size_t i = 0; i < kDoubles; ++i) bits |= within[i];
  return static_cast<std::uint32_t>(bits) << first;
}

inline std::uint32_t measure(const TreeView& tree, const RayPacket& rays, const LaneHits& lanes,
                             RayPacket::Lanes<double>& t, RayPacket::Lanes<std::int32_t>& forward) {
  std::uint32_t within = 0;
  for (std::size_t first = 0; first < RayPacket::kSize; first += kDoubles) {
    within |= measure_some(tree, rays, lanes, first, t, forward);
  }
  return within & lanes.hit;
}

inline void trace_first_lanes(const TreeView& tree, const RayPacket& rays, PacketHits& hits,
                              std::uint32_t& unfinished) {
  LaneHits lanes;
  trace_packet(tree, rays, lanes);
  unfinished = lanes.unfinished;
  if (lanes.hit == 0) {
    hits.hit = hits.starts_inside = 0;
    return;
  }
  RayPacket::Lanes<std::int32_t> forward;
  hits.hit = measure(tree, rays, lanes, hits.t, forward);
  hits.starts_inside = lanes.starts_inside & hits.hit;
  const IVec3 corner(tree.origin);
  for (std::size_t i = 0; i < RayPacket::kSize; ++i) {
    hits.x[i] = lanes.x[i] + corner.x;
    hits.y[i] = lanes.y[i] + corner.y;
    hits.z[i] = lanes.z[i] + corner.z;
    hits.face[i] = static_cast<Direction>(2 * lanes.axis[i] + forward[i]);
  }
}

inline void trace_first(const TreeView& tree, const RayPacket& rays, PacketHits& hits, std::uint32_t& unfinished) {
  trace_filled(rays, [&](const RayPacket& filled) { trace_first_lanes(tree, filled, hits, unfinished); });
}

// Rays on their way from cell to cell that are asked only if they are blocked.
struct Walkers {
  Lanes lanes;  // `live`, directions and boxes are not kept
  CellWalk cells;
  I ray;  // the number of the ray, above nine flags of its axes
};

constexpr int kAxisFlags = 9;
static_assert(kMostPackets * RayPacket::kSize <= std::size_t{1} << (31 - kAxisFlags), "numbers of rays have room");
alignas(64) constexpr std::int32_t kLaneNumbers[RayPacket::kSize] = {0, 1, 2,  3,  4,  5,  6,  7,
                                                                     8, 9, 10, 11, 12, 13, 14, 15};

// Returns Walkers::ray for rays numbered from `first` on.
inline I rays_from(const Lanes& lanes, int first) {
  I ray = shift_left<kAxisFlags>(load(kLaneNumbers) + all(first));
  int flag = 1;
  for (const Axis* axis : {&lanes.x, &lanes.y, &lanes.z}) {
    for (const Mask mask : {axis->forward, axis->still, axis->moved}) {
      ray = add_if(mask, ray, all(flag));
      flag *= 2;
    }
  }
  return ray;
}

// A pool of rays that left groups with too few of their kind, until they fill a group again:
//
//   origin x     | 0 | 1 | ... |count - 1| - | - |
//   inverse x    | 0 | 1 | ...                        by axis: origin, inverse, base, the plane after the next;
//   ...                                               index, exit_t, ray
class RayPool {
 public:
  [[nodiscard]] int count() const { return count_; }

  void add(const Walkers& from, Mask which) {
    const Packing packing = packing_of(which);
    std::int32_t* to = numbers_[0] + count_;
    const auto put = [&](I numbers) {
      store_packed(to, packing, numbers);
      to += kRoom;
    };
    const auto put_axis = [&](const Axis& axis, F after) {
      put(as_int(axis.origin));
      put(as_int(axis.inverse));
      put(axis.base);
      put(as_int(after));
    };
    put_axis(from.lanes.x, from.cells.after.x);
    put_axis(from.lanes.y, from.cells.after.y);
    put_axis(from.lanes.z, from.cells.after.z);
    put(from.cells.index);
    put(as_int(from.lanes.exit_t));
    put(from.ray);
    count_ += trace::count(which);
    QUOIN_ASSERT(count_ + kWidth <= kRoom, "room for a register after the last ray");
  }

  // Takes out the last rays, up to `kWidth`. Returns their lanes.
  Mask take(Walkers& to) {
    QUOIN_ASSERT(count_ > 0, "rays in the pool");
    const int taken = std::min(count_, kWidth);
    count_ -= taken;
    const Mask lanes = mask_of(kAllLanes >> (kWidth - taken));
    const std::int32_t* from = numbers_[0] + count_;
    // Zeros in other lanes: subnormal numbers would be slow.
    const auto get = [&] {
      const I numbers = select(lanes, load(from), all(0));
      from += kRoom;
      return numbers;
    };
    const auto get_axis = [&](Axis& axis, F& after) {
      axis.origin = as_float(get());
      axis.inverse = as_float(get());
      axis.base = get();
      after = as_float(get());
    };
    get_axis(to.lanes.x, to.cells.after.x);
    get_axis(to.lanes.y, to.cells.after.y);
    get_axis(to.lanes.z, to.cells.after.z);
    to.cells.index = get();
    to.lanes.exit_t = as_float(get());
    to.ray = get();
    int flag = 1;
    for (Axis* axis : {&to.lanes.x, &to.lanes.y, &to.lanes.z}) {
      for (Mask* mask : {&axis->forward, &axis->still, &axis->moved}) {
        *mask = test(to.ray, all(flag));
        flag *= 2;
      }
    }
    return lanes;
  }

 private:
  static constexpr int kKinds = 15;
  // Both pools together hold less than a group each, and a new group. Packing writes whole registers.
  static constexpr int kRoom = 4 * kWidth;
  alignas(64) std::int32_t numbers_[kKinds][kRoom];
  int count_ = 0;
};

// Adds the short rays that are blocked to `blocked`, and doubtful rays to `doubtful`. Returns the rays that are not
// short. Not inlined: its loop would lack registers.
[[gnu::noinline]] inline std::uint32_t trace_windows(const TreeView& tree, const RayPacket& rays, int first,
                                                     std::uint32_t wanted, std::uint32_t& blocked,
                                                     std::uint32_t& doubtful) {
  return trace_short(tree, rays, first, wanted, [&](const IVec3& origin, ShortRays& in_window) {
    blocked |= bits(walk_short(tree, origin, in_window)) << first;
    doubtful |= bits(in_window.doubtful) << first;
  });
}

// Finds the blocked rays of several packets. Short rays walk in windows, and other rays of limited length as in
// `trace_first`. Endless rays leave their packet when few of them remain in it. They then walk on in groups of rays
// from several packets, so that most lanes are in use. Each ray takes the same steps as alone:
//
//   packet --> group --> few in an occupied cell --> arrived_   --> group
//               |  ^ --> few between cells       --> searching_ --> group
//               v  |
//             voxels --> blocked
class BlockedRays {
 public:
  // `blocked` and `unfinished` have an element for each packet, 0 at first.
  BlockedRays(const TreeView& tree, bool is_alone, std::uint32_t* blocked, std::uint32_t* unfinished)
      : tree_(tree), is_alone_(is_alone), blocked_(blocked), unfinished_(unfinished) {}

  // Traces a packet with its inactive lanes filled. Some results are known only after `finish`.
  void trace(const RayPacket& rays, int packet) {
    LaneHits limited;
    std::uint32_t blocked = 0;
    std::uint32_t doubtful = 0;
    for (int first = 0; first < RayPacket::kSize; first += kWidth) {
      const std::uint32_t active = rays.active >> first & kAllLanes;
      const std::uint32_t wanted = trace_windows(tree_, rays, first, active, blocked, doubtful);
      if (wanted == 0) continue;
      F t;
      Crossing entered;
      Walkers group;
      group.lanes = set_up(tree_, rays, first, wanted, t, entered);
      unfinished_[packet] |= bits(group.lanes.unfinished) << first;
      if (!any(group.lanes.live)) continue;
      if (any(group.lanes.live & (narrow(rays.max_t.data() + first) < all(kEndless)))) {
        keep(trace::trace<Ask::Where>(tree_, group.lanes, t, entered), first, limited);
      } else {
        trace_endless(group, t, entered, packet, first);
      }
    }
    unfinished_[packet] &= ~limited.hit;
    if (limited.hit != 0) {
      RayPacket::Lanes<double> t;
      RayPacket::Lanes<std::int32_t> forward;
      blocked |= measure(tree_, rays, limited, t, forward);
    }
    if (doubtful != 0) blocked = decide(rays, doubtful, blocked);
    blocked_[packet] |= blocked;
  }

  // Walks all remaining rays to their ends.
  void finish() {
    while (arrived_.count() + searching_.count() > 0) walk_pool(1, 1);
  }

 private:
  // Groups of fewer rays go to a pool (measured). A group between cells has cheaper steps.
  static constexpr int kFewArrived = 9;
  static constexpr int kFewSearching = 6;

  // Traces the doubtful rays alone. Returns `blocked` with their results. Short rays are never left unfinished.
  [[nodiscard]] std::uint32_t decide(const RayPacket& rays, std::uint32_t doubtful, std::uint32_t blocked) const {
    for (; doubtful != 0; doubtful &= doubtful - 1) {
      const int lane = std::countr_zero(doubtful);
      RayHit hit;
      bool is_unfinished = false;
      const double max_t = rays.max_t[static_cast<std::size_t>(lane)];
      const bool is_blocked = first_single<PathTracer>(tree_, rays.ray(lane), max_t, hit, is_unfinished);
      blocked = (blocked & ~(1U << lane)) | std::uint32_t{is_blocked} << lane;
    }
    return blocked;
  }

  void trace_endless(Walkers& group, F t, const Crossing& entered, int packet, int first) {
    const auto note_hits = [&](Mask hit) {
      blocked_[packet] |= bits(hit) << first;
      unfinished_[packet] &= ~(bits(hit) << first);
    };
#ifndef QUOIN_KERNEL_AVX512
    Met met{mask_of(0), mask_of(0), all(0), all(0), all(0), all(0)};
    group.lanes.live = trace_beam(tree_, group.lanes, t, entered, met);
    note_hits(met.hit);
    if (!any(group.lanes.live)) return;
#endif
    group.cells = enter_box(tree_, group.lanes, t, entered);
    const Mask arrived = group.lanes.live & is_occupied(tree_, group.cells.index);
    const Mask searching = group.lanes.live & ~arrived;
    if (is_alone_) return walk(group, arrived, searching, 1, 1, note_hits);
    group.ray = rays_from(group.lanes, packet * RayPacket::kSize + first);
    walk(group, arrived, searching, kFewArrived, kFewSearching, note_hits);
    while (std::max(arrived_.count(), searching_.count()) >= kWidth) walk_pool(kFewArrived, kFewSearching);
  }

  // Walks a group of rays from the fuller pool.
  void walk_pool(int few_arrived, int few_searching) {
    const bool are_arrived = arrived_.count() >= searching_.count();
    Walkers group;
    const Mask lanes = (are_arrived ? arrived_ : searching_).take(group);
    const Mask none = mask_of(0);
    walk(group, are_arrived ? lanes : none, are_arrived ? none : lanes, few_arrived, few_searching, [&](Mask hit) {
      alignas(64) std::int32_t rays[kWidth];
      store(rays, group.ray);
      for (std::uint32_t left = bits(hit); left != 0; left &= left - 1) {
        const int number = rays[std::countr_zero(left)] >> kAxisFlags;
        const std::uint32_t lane = std::uint32_t{1} << (number % RayPacket::kSize);
        blocked_[number / RayPacket::kSize] |= lane;
        unfinished_[number / RayPacket::kSize] &= ~lane;
      }
    });
  }

  // Walks rays in occupied cells (`arrived`) and between cells, until fewer than these numbers are left, which go to
  // the pools. Calls `note_hits(lanes)` with the lanes that are blocked.
  template <class NoteHits>
  [[gnu::always_inline]] void walk(Walkers& group, Mask arrived, Mask searching, int few_arrived, int few_searching,
                                   NoteHits&& note_hits) {
    const VoxelSteps steps = voxel_steps(group.lanes);
    for (;;) {
      if (count(arrived) >= few_arrived) {
        VoxelWalk voxels;
        enter_voxels(tree_, group.lanes, steps, group.cells.after, arrived, voxels);
        I code = all(0);
        const Mask hit = find_voxels<Ask::Whether>(group.lanes, steps, voxels, arrived, code);
        note_hits(hit);
        searching = searching | (arrived & ~hit);
      } else if (any(arrived)) {
        arrived_.add(group, arrived);
      }
      if (count(searching) < few_searching) {
        if (any(searching)) searching_.add(group, searching);
        return;
      }
      arrived = find_some_cells(tree_, group.lanes, group.cells, searching, few_searching);
    }
  }

  const TreeView& tree_;
  bool is_alone_;  // no other packet follows
  std::uint32_t* blocked_;
  std::uint32_t* unfinished_;
  RayPool arrived_;
  RayPool searching_;
};

inline void trace_any(const TreeView& tree, const RayPacket* packets, std::size_t size, std::uint32_t* blocked,
                      std::uint32_t* unfinished) {
  QUOIN_ASSERT(size <= kMostPackets, "at most kMostPackets");
  BlockedRays rays(tree, size == 1, blocked, unfinished);
  for (std::size_t i = 0; i < size; ++i) {
    blocked[i] = unfinished[i] = 0;
    if (packets[i].active == 0) continue;
    trace_filled(packets[i], [&](const RayPacket& filled) { rays.trace(filled, static_cast<int>(i)); });
  }
  rays.finish();
}

}  // namespace
}  // namespace quoin::trace
