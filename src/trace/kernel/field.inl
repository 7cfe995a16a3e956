// One ray in a field of densities: the walk of trace/kernel/single.inl through cells that touch the solid. These are
// gathered, then eight at once are asked whether the field in them may become negative along the ray; of those, in
// order, where it does.
//
//   walk    ..X. .... .XX. X...    words of 4^3 cells, with those that touch the solid and that the ray passes
//   group   | X | X | X | X |      in lanes, see below
//   asked   | . | . | 1 | 1 |      the third: from where on; else the fourth; else the walk goes on

#pragma once

#include <limits>

#include <immintrin.h>

#include "grid/density/density_storage.h"
#include "trace/kernel/cell.inl"
#include "trace/kernel/kernel.h"
#include "trace/kernel/lockstep.inl"
#include "trace/kernel/single.inl"

namespace quoin::trace {
namespace {

// Cells of a field, eight at a time, in single precision: whether the field in them can become negative along a ray at
// all, which few can. Those are then asked in double (trace/kernel/cell.inl), so that rounding here costs time alone.
//
//   x, y, z      | 0 | 1 | ... | 7 |    the cells, in a chunk
//   corners      | 0 | 1 | ... | 7 |    eight times: gathered from rows of halves, two of a row at once
//   the cubic    | 0 | 1 | ... | 7 |    along the ray, or along a ray for each, in a stretch that is a little too long

using F8 = float __attribute__((vector_size(32)));
using I8 = std::int32_t __attribute__((vector_size(32)));

// How much longer a stretch is at each plane, in cells: more than rounding moves it along the ray, up to kReach.
constexpr float kStretch = 1e-3F;
// How far rounding may take a field's numbers, as a share of what the corners differ by: at the ray's start, and for
// each cell that the ray has gone since.
constexpr float kDoubtHere = 1e-4F;
constexpr float kDoubtFurther = 2e-6F;

inline std::uint32_t bits8(I8 mask) {
  return static_cast<std::uint32_t>(_mm256_movemask_ps(reinterpret_cast<__m256>(mask)));
}

// Entries of a table, `kBytes` apart, in the lanes where the mask is set, else 0.
template <int kBytes>
inline I8 gather8(const void* table, I8 at, I8 mask) {
  return reinterpret_cast<I8>(_mm256_mask_i32gather_epi32(_mm256_setzero_si256(), static_cast<const int*>(table),
                                                          reinterpret_cast<__m256i>(at),
                                                          reinterpret_cast<__m256i>(mask), kBytes));
}

// Halves in bits 16 to 31 that are neither infinite nor NaN. As float_from_half: the product moves the exponent, and
// makes subnormals normal.
inline F8 floats_from_halves(I8 high) {
  const I8 magnitude = reinterpret_cast<I8>(reinterpret_cast<F8>((high & 0x7FFF'0000) >> 3) * 0x1p+112F);
  return reinterpret_cast<F8>(magnitude | (high & std::numeric_limits<std::int32_t>::min()));
}

// The densities of samples x and x + 1 of rows of a chunk, as halves, the first in the lower bits; `x` below 63.
inline I8 pairs_of(const DensityStorage& chunk, I8 x, I8 y, I8 z, I8 mask) {
  const I8 slab = gather8<4>(chunk.slabs.data(), (z >> 2) * 16 + (y >> 2), mask);
  const I8 is_uniform = slab < 0;
  const I8 row = (slab << 4) + (z & 3) * 4 + (y & 3);  // a uniform slab has its sign bit set, which goes
  const I8 pairs = gather8<sizeof(Half)>(chunk.values.data(), row * kChunkEdge + x, mask & ~is_uniform);
  return is_uniform ? slab << 16 | (slab & 0xFFFF) : pairs;
}

/// The densities of a cell's corners, by x + 2 y + 4 z, all of one chunk: `x`, `y` and `z` below 63.
inline void read_within(const DensityStorage& chunk, int x, int y, int z, float (&corners)[8]) {
  for (int row = 0; row < 4; ++row) {
    const int its_y = y + (row & 1);
    const int its_z = z + (row >> 1);
    const std::uint32_t slab = chunk.slabs[ChunkStorage::slab_index(its_y, its_z)];
    std::uint32_t pair = (slab & 0xFFFFU) * 0x1'0001U;
    if ((slab & ChunkStorage::kUniformSlab) == 0) {
      std::memcpy(&pair, chunk.row(slab, ChunkStorage::row_in_slab(its_y, its_z)) + x, sizeof pair);
    }
    corners[2 * row] = float_from_half(static_cast<Half>(pair & 0xFFFFU));
    corners[2 * row + 1] = float_from_half(static_cast<Half>(pair >> 16));
  }
}

/// Whether, and where, the field becomes negative along the ray in a cell. `chunk`: that of the cell; null where it is
/// uniform.
template <bool kAsksWhere>
inline bool meet_at(const FieldView& field, const DensityStorage* chunk, const CellRay& ray, int x, int y, int z,
                    FieldHit& hit) {
  hit.x = x, hit.y = y, hit.z = z;
  const int lx = x & 63;
  const int ly = y & 63;
  const int lz = z & 63;
  if (chunk != nullptr && lx < 63 && ly < 63 && lz < 63) {
    read_within(*chunk, lx, ly, lz, hit.corners);
  } else {
    field.read(*field.grid, x, y, z, hit.corners);
  }
  const double cell[3] = {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
  hit.t = meet_cell<kAsksWhere>(ray, cell, span_in(ray, cell), hit.corners);
  return hit.t >= 0.0;
}

/// A ray in single precision, or eight side by side, from a place near its start; by axis.
template <class Number>
struct NearRay {
  Number origin[3];
  Number direction[3];
  Number inverse[3];  // huge where it stands still
  Number entry[3];    // of a cell's two planes the one that it passes first, and the other, each beyond the cell
  Number exit[3];
  Number size;  // the direction's greatest component
};

/// Of eight cells of a chunk: those in which the field may become negative along the ray. `cell` in the chunk, each
/// coordinate below 63; `place` from where the ray counts.
template <class Number>
inline I8 may_be_negative(const NearRay<Number>& ray, const DensityStorage& chunk, const I8 (&cell)[3],
                          const I8 (&place)[3], I8 mask) {
  F8 corners[8];
  for (int row = 0; row < 4; ++row) {
    const I8 pairs = pairs_of(chunk, cell[0], cell[1] + (row & 1), cell[2] + (row >> 1), mask);
    corners[2 * row] = floats_from_halves(pairs << 16);
    corners[2 * row + 1] = floats_from_halves(pairs);
  }
  F8 t_in = {};
  F8 t_out = F8{} + std::numeric_limits<float>::max();
  F8 start[3];
  for (int axis = 0; axis < 3; ++axis) {
    const F8 lower = __builtin_convertvector(place[axis], F8);
    start[axis] = ray.origin[axis] - lower;
    t_in = greatest(t_in, (ray.entry[axis] - start[axis]) * ray.inverse[axis]);
    t_out = least(t_out, (ray.exit[axis] - start[axis]) * ray.inverse[axis]);
  }
  const F8 length = greatest(t_out - t_in, F8{});
  F8 entry[3];
  F8 way[3];
  for (int axis = 0; axis < 3; ++axis) {
    entry[axis] = start[axis] + ray.direction[axis] * t_in;
    way[axis] = ray.direction[axis] * length;
  }
  F8 low = corners[0];
  F8 high = corners[0];
  for (int i = 1; i < 8; ++i) low = least(low, corners[i]), high = greatest(high, corners[i]);
  const CellCubic<F8> field = cubic_of(corners, entry, way);
  const F8 doubt = (high - low) * (t_in * ray.size * kDoubtFurther + kDoubtHere);
  // Numbers that are none are in doubt, too.
  return ~(least(curve_of<float>(field).low(), field.c0) > doubt) & mask;
}

/// Of eight cells those of `lanes` that are to be asked in double: in which the field may become negative along the
/// ray, and those with corners in other chunks. `chunk`: that of the cells; null where it is uniform. `at` in the
/// field, as is `base`, from where the ray counts.
template <class Number, class Base>
inline std::uint32_t lanes_to_ask(const NearRay<Number>& ray, const DensityStorage* chunk, const I8 (&at)[3],
                                  const Base (&base)[3], I8 lanes) {
  if (chunk == nullptr) return bits8(lanes);
  I8 cell[3];
  I8 place[3];
  I8 within = lanes;
  for (int axis = 0; axis < 3; ++axis) {
    cell[axis] = at[axis] & 63;
    place[axis] = at[axis] - base[axis];
    within = within & (cell[axis] < 63);
  }
  std::uint32_t asked = bits8(lanes & ~within);
  if (bits8(within) != 0) asked |= bits8(may_be_negative(ray, *chunk, cell, place, within));
  return asked;
}

// One ray.

constexpr int kGroup = 8;

inline I8 permute8(const std::int32_t* table, I8 at) {
  const __m256i from = _mm256_load_si256(reinterpret_cast<const __m256i*>(table));
  return reinterpret_cast<I8>(_mm256_permutevar8x32_epi32(from, reinterpret_cast<__m256i>(at)));
}

// `base`: from where the walk counts, in the field.
inline NearRay<float> near_ray(const PathRay& path, const Ray& ray, I4 base) {
  NearRay<float> out;
  out.size = 0.0F;
  for (int axis = 0; axis < 3; ++axis) {
    const bool is_back = path.backward[axis] != 0;
    const bool is_still = path.inverse[axis] == kStillInverse;
    // The walk has them in the middle of a voxel where they stand still.
    out.origin[axis] = is_still  ? static_cast<float>(ray.origin[axis] - base[axis])
                       : is_back ? -path.origin[axis]
                                 : path.origin[axis];
    out.direction[axis] = is_still ? 0.0F : static_cast<float>(ray.direction[axis]);
    out.inverse[axis] = is_back ? -path.inverse[axis] : path.inverse[axis];
    out.entry[axis] = is_back ? 1.0F + kStretch : -kStretch;
    out.exit[axis] = is_back ? -kStretch : 1.0F + kStretch;
    out.size = std::max(out.size, std::abs(out.direction[axis]));
  }
  return out;
}

// The next cells of a ray that touch the solid, all of one chunk.
class CellGroup {
 public:
  /// `base`: from where the walk counts, in the field.
  CellGroup(const FieldView& field, const Ray& ray, double max_t, const PathRay& path, I4 base)
      : field_(field), ray_(cell_ray(ray, max_t)), near_(near_ray(path, ray, base)) {
    for (int axis = 0; axis < 3; ++axis) backward_[axis] = path.backward[axis], base_[axis] = base[axis];
  }

  [[nodiscard]] bool is_empty() const { return count_ == 0; }
  [[nodiscard]] bool is_full() const { return count_ >= kGroup; }
  /// That of the cells that are added from now on.
  void set_chunk(I4 chunk) { chunk_ = field_.find(*field_.grid, chunk[0], chunk[1], chunk[2]); }

  /// Cells of a word; `at` is the one of the word that the ray could pass first.
  /// Requires: the group is not full.
  void add(I4 at, std::uint64_t cells) {
    for (int axis = 0; axis < 3; ++axis) words_[axis][word_count_] = at[axis];
    for (; cells != 0; cells &= cells - 1) codes_[count_++] = word_count_ << 6 | std::countr_zero(cells);
    ++word_count_;
  }

  /// Asks all cells, and forgets them.
  template <bool kAsksWhere>
  bool ask(FieldHit& hit) {
    const int count = count_;
    count_ = word_count_ = 0;
    for (int first = 0; first < count; first += kGroup) {
      if (ask_some<kAsksWhere>(first, count - first, hit)) return true;
    }
    return false;
  }

 private:
  // The eight cells from `first` on, of which `count` mean something.
  template <bool kAsksWhere>
  [[gnu::always_inline]] bool ask_some(int first, int count, FieldHit& hit) {
    const I8 lanes = I8{0, 1, 2, 3, 4, 5, 6, 7} < count;
    I8 code;
    std::memcpy(&code, codes_ + first, sizeof code);
    I8 at[3];
    for (int axis = 0; axis < 3; ++axis) {
      at[axis] = permute8(words_[axis], code >> 6) + ((code >> 2 * axis & 3) ^ backward_[axis]) - backward_[axis];
    }
    std::uint32_t asked = lanes_to_ask(near_, chunk_, at, base_, lanes);
    for (; asked != 0; asked &= asked - 1) {
      const int lane = std::countr_zero(asked);
      if (meet_at<kAsksWhere>(field_, chunk_, ray_, at[0][lane], at[1][lane], at[2][lane], hit)) return true;
    }
    return false;
  }

  const FieldView& field_;
  CellRay ray_;
  NearRay<float> near_;
  const DensityStorage* chunk_ = nullptr;  // null where it is uniform
  std::int32_t backward_[3];
  std::int32_t base_[3];
  int count_ = 0;
  int word_count_ = 0;
  alignas(32) std::int32_t words_[3][kGroup];        // where words begin, by axis
  alignas(32) std::int32_t codes_[64 + 2 * kGroup];  // cells: which word, six bits of which of its cells
};

template <bool kAsksWhere>
inline bool first_in_field(const FieldView& field, const Ray& ray, double max_t, FieldHit& hit, bool& unfinished) {
  const TreeView& tree = *field.cells;
  unfinished = false;
  PathRay path;
  const SetUp ready = set_up_path(tree, ray, max_t, path);
  if (ready != SetUp::Ready) {
    unfinished = ready == SetUp::Unusual;
    return false;
  }
  const I4 origin = {static_cast<int>(tree.origin.x), static_cast<int>(tree.origin.y), static_cast<int>(tree.origin.z),
                     0};
  unfinished = path.is_cut;
  CellGroup group(field, ray, max_t, path, path.base + origin);
  I4 chunk = {};
  bool knows = false;
  bool is_hit = false;
  PathWalk walk(tree, path);
  walk.walk([&](int brick, int cell, std::uint64_t met) {
    const F4 in_cell = walk.corner_of_cell(brick, cell);
    if (walk.is_too_far(in_cell)) return unfinished = true;
    const I4 at = walk.native_voxel(in_cell) + origin;
    if (!knows || mask3(at >> 6 != chunk) != 0) {
      if (!group.is_empty() && group.ask<kAsksWhere>(hit)) return is_hit = true;
      knows = true;
      chunk = at >> 6;
      group.set_chunk(chunk);
    }
    group.add(at, met);
    return (kAsksWhere || group.is_full()) && (is_hit = group.ask<kAsksWhere>(hit));
  });
  if (!is_hit && !group.is_empty()) is_hit = group.ask<kAsksWhere>(hit);
  if (is_hit) unfinished = false;
  return is_hit;
}

// Packets of rays in a field of densities: the walk of trace/kernel/lockstep.inl through cells that touch the solid.
// Where lanes have come to such a cell, all are asked at once whether the field in it may become negative along their
// ray, and of those each alone where it does; lanes in which it does not walk on.
//
//   lane         | 0 | 1 | 2 | ... | 15 |
//   stopped      | x |   | x | ... |  x |    in a cell that touches the solid: x, y, z in cell_
//   may          | x |   |   | ... |  x |    in single precision, eight lanes (a half) and one chunk at a time
//   met          | x |   |   | ... |    |    in double, lane by lane: hits[lane] has t, cell and corners
//   walks on     |   |   | x | ... |  x |    to its next cell
//
// Where registers hold eight lanes (AVX2) a packet goes in two rounds of one half, else in one round of two.

// The lanes of a packet from `first_` on, as the cells of a field see them.
class FieldLanes {
 public:
  FieldLanes(const FieldView& field, const RayPacket& rays, int first, const Lanes& lanes)
      : field_(field), rays_(rays), first_(first) {
    const IVec3 origin(field.cells->origin);
    set_axis(lanes.x, 0, origin.x);
    set_axis(lanes.y, 1, origin.y);
    set_axis(lanes.z, 2, origin.z);
    alignas(64) float size[kWidth];
    store(size, lanes.reach_scale);
    for (int half = 0; half < kHalves; ++half) std::memcpy(&near_[half].size, size + 8 * half, sizeof(F8));
  }

  /// Of the lanes of `asked`, each in a cell: those whose field becomes negative there. `hits`: of the packet's lanes.
  template <bool kAsksWhere>
  Mask ask(Mask asked, const Cells& cells, FieldHit* hits) {
    const std::uint32_t lanes = bits(asked);
    store(cell_[0], cells.x + all(origin_[0]));
    store(cell_[1], cells.y + all(origin_[1]));
    store(cell_[2], cells.z + all(origin_[2]));
    std::uint32_t may = 0;
    for (int half = 0; half < kHalves; ++half) may |= may_be(half, lanes >> 8 * half & 0xFFU) << 8 * half;
    std::uint32_t met = 0;
    for (; may != 0; may &= may - 1) {
      const int lane = std::countr_zero(may);
      const int x = cell_[0][lane];
      const int y = cell_[1][lane];
      const int z = cell_[2][lane];
      set_chunk(x >> 6, y >> 6, z >> 6);
      FieldHit unused;
      FieldHit& hit = kAsksWhere ? hits[first_ + lane] : unused;
      if (meet_at<kAsksWhere>(field_, chunk_, ray_of(lane), x, y, z, hit)) met |= 1U << lane;
    }
    return mask_of(met);
  }

 private:
  static constexpr int kHalves = kWidth / 8;

  void set_axis(const Axis& axis, int index, int origin) {
    origin_[index] = origin;
    store(base_[index], axis.base + all(origin));
    put(axis.origin, index, &NearRay<F8>::origin);
    put(axis.direction, index, &NearRay<F8>::direction);
    put(select(axis.still, all(kNever), axis.inverse), index, &NearRay<F8>::inverse);
    const Mask is_back = ~(axis.forward | axis.still);
    put(select(is_back, all(1.0F + kStretch), all(-kStretch)), index, &NearRay<F8>::entry);
    put(select(is_back, all(-kStretch), all(1.0F + kStretch)), index, &NearRay<F8>::exit);
  }
  void put(F from, int axis, F8 (NearRay<F8>::*to)[3]) {
    alignas(64) float lanes[kWidth];
    store(lanes, from);
    for (int half = 0; half < kHalves; ++half) std::memcpy(&(near_[half].*to)[axis], lanes + 8 * half, sizeof(F8));
  }

  void set_chunk(int x, int y, int z) {
    if (knows_ && x == at_[0] && y == at_[1] && z == at_[2]) return;
    at_[0] = x, at_[1] = y, at_[2] = z;
    knows_ = true;
    chunk_ = field_.find(*field_.grid, x, y, z);
  }

  // Of eight lanes those whose field may become negative.
  std::uint32_t may_be(int half, std::uint32_t left) {
    const I8 lane_bits = {1, 2, 4, 8, 16, 32, 64, 128};
    I8 at[3];
    I8 base[3];
    for (int axis = 0; axis < 3; ++axis) {
      std::memcpy(&at[axis], cell_[axis] + 8 * half, sizeof(I8));
      std::memcpy(&base[axis], base_[axis] + 8 * half, sizeof(I8));
    }
    std::uint32_t may = 0;
    // By chunk; mostly there is one.
    while (left != 0) {
      const int lane = std::countr_zero(left);
      const int x = at[0][lane] >> 6;
      const int y = at[1][lane] >> 6;
      const int z = at[2][lane] >> 6;
      set_chunk(x, y, z);
      const I8 wanted = ((I8{} + static_cast<int>(left)) & lane_bits) != 0;
      const I8 here = wanted & (at[0] >> 6 == x) & (at[1] >> 6 == y) & (at[2] >> 6 == z);
      left &= ~bits8(here);
      may |= lanes_to_ask(near_[half], chunk_, at, base, here);
    }
    return may;
  }

  const CellRay& ray_of(int lane) {
    if ((exact_ready_ >> lane & 1U) == 0) {
      exact_ready_ |= 1U << lane;
      const int i = first_ + lane;
      exact_[lane] = cell_ray(rays_.ray(i), rays_.max_t[static_cast<std::size_t>(i)]);
    }
    return exact_[lane];
  }

  const FieldView& field_;
  const RayPacket& rays_;
  int first_;
  int origin_[3];
  alignas(64) std::int32_t base_[3][kWidth];  // from where each lane counts, in the field
  alignas(64) std::int32_t cell_[3][kWidth];
  NearRay<F8> near_[kHalves];
  std::uint32_t exact_ready_ = 0;
  CellRay exact_[kWidth];
  bool knows_ = false;
  int at_[3];
  const DensityStorage* chunk_ = nullptr;  // at `at_`; null where it is uniform
};

// The lanes that come into the solid; `unfinished` are to be traced otherwise.
template <bool kAsksWhere>
inline std::uint32_t packet_in_field(const FieldView& field, const RayPacket& rays, FieldHit* hits,
                                     std::uint32_t& unfinished) {
  const TreeView& tree = *field.cells;
  std::uint32_t hit = 0;
  unfinished = 0;
  for (int first = 0; first < RayPacket::kSize; first += kWidth) {
    const std::uint32_t wanted = rays.active >> first & kAllLanes;
    if (wanted == 0) continue;
    F t;
    Crossing entered;
    Lanes lanes = set_up(tree, rays, first, wanted, t, entered);
    unfinished |= bits(lanes.unfinished) << first;
    if (!any(lanes.live)) continue;
    FieldLanes cells(field, rays, first, lanes);
    const VoxelSteps steps = voxel_steps(lanes);
    const Mask met = walk_apart(tree, lanes, steps, t, entered, [&](const Cells& at, VoxelWalk& voxels, Mask found) {
      Mask done = mask_of(0);
      while (any(found)) {
        const Mask stopped = stop_at_voxels(lanes, steps, voxels, found);
        if (!any(stopped)) break;
        const Mask is_negative = cells.ask<kAsksWhere>(stopped, voxels_at(at, voxels.code), hits);
        done = done | is_negative;
        found = step_on(lanes, steps, stopped & ~is_negative, voxels);
      }
      return done;
    });
    hit |= bits(met) << first;
  }
  unfinished &= ~hit;
  return hit;
}

inline std::uint32_t first_hits_in_field(const FieldView& field, const RayPacket& rays, FieldHit* hits,
                                         std::uint32_t& unfinished) {
  return packet_in_field<true>(field, rays, hits, unfinished);
}

inline std::uint32_t any_hits_in_field(const FieldView& field, const RayPacket& rays, std::uint32_t& unfinished) {
  return packet_in_field<false>(field, rays, nullptr, unfinished);
}

}  // namespace
}  // namespace quoin::trace
