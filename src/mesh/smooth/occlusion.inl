// Occlusion for slices with many active cells and integer spreads, as many vertices at a time as a register has
// groups of eight lanes. All 27 samples of a vertex then share one fraction: six rows of points along x in each of six
// slices, interpolated along z, y and x in turn.
//
//   slices z, z + 1 -> one; rows y, y + 1 -> one: nine rows of eight points     | . . . . . . . . |
//   points 0, s, 2 s of two rows each, s is the spread                           | a a a b b b - - |

#pragma once

#include "mesh/smooth/listed_lanes.inl"

namespace quoin::smooth {
namespace {

void decode_row(const Half* from, float* to, int count) {
  for (int i = 0; i < count; i += kWidth) store(to + i, load_halves(from + i));
}

void decode_part(const RowPart& part, int first, int count, float* to) {
  if (part.samples != nullptr) return decode_row(part.samples + first, to, count);
  alignas(64) Half same[kChunkEdge];
  std::fill_n(same, count, part.value);
  decode_row(same, to, count);
}

// Decodes the row of points (y, z), with sixteen points before and after; `to` points to x = 0.
void decode_points(const Work& work, int y, int z, float* to) {
  if (work.level == 0) {
    const std::array<RowPart, 3> parts = row_parts(work, y, z);
    decode_part(parts[0], kChunkEdge - kPointX, kPointX, to - kPointX);
    decode_part(parts[1], 0, kChunkEdge, to);
    decode_part(parts[2], 0, kPointX, to + kChunkEdge);
    return;
  }
  alignas(64) Half halves[kPlaceStride] = {};
  gather_row(work, y, z, halves + kPointX);
  const int count = work.n + 2 * kPointX;
  decode_row(halves, to - kPointX, count);
  // Exact: the unit is a power of two.
  const float unit = depth_unit(work.level);
  for (int i = 0; i < count; ++i) to[i - kPointX] *= unit;
}

void decode_slice(Work& work, int z) {
  const RowSet& needed = work.occlusion_rows[static_cast<std::size_t>(z + kWidestApron)];
  if (needed.empty()) return;
  const int slices = work.ring_mask + 1;
  const bool is_repeated = (z & work.ring_mask) < kRepeatedSlices;
  for (int y = work.cells.first - work.apron; y <= work.cells.last + work.apron; ++y) {
    if (!needed.has(y)) continue;
    float* const row = work.decoded_row(y, z);
    decode_points(work, y, z, row);
    if (!is_repeated) continue;
    std::memcpy(row - kPointX + std::ptrdiff_t{slices} * kDecodedSlice, row - kPointX, sizeof(float) * kDecodedStride);
  }
}

// Decodes all samples that the occlusion of vertices in slice z of cells reads.
void decode_around(Work& work, int z) {
  const int last = z + work.apron + 1;
  for (int next = std::max(work.next_slice, z - work.apron); next <= last; ++next) decode_slice(work, next);
  work.next_slice = last + 1;
}

// The sample grid of each vertex of a slice: the lowest point that it reads, and the fractions that its samples share.
struct Centres {
  alignas(64) std::int32_t offset[kWidth];
  alignas(64) std::int32_t z[kWidth];
  alignas(64) float fx[kWidth];
  alignas(64) float fy[kWidth];
  alignas(64) float fz[kWidth];
};

inline Centres find_centres(const Work& work, const Slice& slice, std::size_t first) {
  const F spread = all(work.occlusion.spread);
  const int whole = static_cast<int>(work.occlusion.spread);
  F n[3];
  for (int i = 0; i < 3; ++i) n[i] = load(work.normals[i] + first);
  const F lift = spread * ((abs(n[0]) + abs(n[1])) + abs(n[2])) + all(kLift);
  I base[3];
  F fraction[3];
  for (int i = 0; i < 3; ++i) {
    const F centre = load(work.fractions[i] + first) + ((n[i] * lift + all(kSnapOffset)) - all(kSnapOffset));
    const F below = floor(centre);
    fraction[i] = centre - below;
    base[i] = to_int(below) - all(whole);
  }
  const I place = load_words(work.places + first) & all(kPlaceMask);
  const I x = (place & all(kPlaceStride - 1)) + base[0];
  const I y = shift_right<kPlaceShift>(place) + base[1];
  Centres centres;
  store(centres.offset, (y + all(kWidestApron - 1)) * all(kDecodedStride) + x + all(kPointX - 1));
  store(centres.z, base[2] + all(slice.z));
  store(centres.fx, fraction[0]);
  store(centres.fy, fraction[1]);
  store(centres.fz, fraction[2]);
  return centres;
}

// The part of the points' densities to interpolate.
enum class Part { All, Solid };

template <Part kPart>
inline F part_of(F density) {
  return kPart == Part::All ? density : min(density, all(0.0F));
}

// The nine rows along x after interpolation along z and y, and one row of zeros.
struct NineRows {
  F v[10];
};

template <int kSpread, Part kPart>
inline NineRows rows_around(const Work& work, const Centres& centres, std::size_t lane) {
  const float* lowest[kVerticesAtOnce];
  for (std::size_t i = 0; i < kVerticesAtOnce; ++i) {
    lowest[i] = work.decoded.data() + (centres.z[lane + i] & work.ring_mask) * kDecodedSlice + centres.offset[lane + i];
  }
  const F fy = spread_out(centres.fy + lane);
  const F fz = spread_out(centres.fz + lane);
  NineRows rows;
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) {
      F along_z[2];
      for (int i = 0; i < 2; ++i) {
        const int at = k * kSpread * kDecodedSlice + (j * kSpread + i) * kDecodedStride;
        const F low = part_of<kPart>(load_rows(lowest, at));
        const F high = part_of<kPart>(load_rows(lowest, at + kDecodedSlice));
        along_z[i] = low + fz * (high - low);
      }
      rows.v[3 * k + j] = along_z[0] + fy * (along_z[1] - along_z[0]);
    }
  }
  rows.v[9] = all(0.0F);
  return rows;
}

// The samples of two rows, in the lowest six lanes of each vertex.
struct Samples {
  F v[5];
};

inline Samples samples_of(const NineRows& rows, F fx, const Thirds& low_lanes, const Thirds& high_lanes) {
  Samples samples;
  for (int i = 0; i < 5; ++i) {
    const F low = low_lanes(rows.v[2 * i], rows.v[2 * i + 1]);
    samples.v[i] = low + fx * (high_lanes(rows.v[2 * i], rows.v[2 * i + 1]) - low);
  }
  return samples;
}

inline void store_counted(const Samples& samples, float* out) {
  std::uint64_t open = 0;
  for (int i = 0; i < 4; ++i) open |= std::uint64_t{open_bits(samples.v[i])} << (16 * i);
  const std::uint32_t last = open_bits(samples.v[4]);
  for (int i = 0; i < kVerticesAtOnce; ++i) {
    const int count = std::popcount(open >> (8 * i) & 0x003F'003F'003F'003FU) + std::popcount(last >> (8 * i) & 0x07U);
    out[i] = solid_share(count);
  }
}

// Returns the sum of a vertex' six lanes, in the order of occlusion_of.
inline float sum_of_lanes(const float* s) {
  return ((s[0] + s[3]) + (s[1] + s[4])) + (s[2] + s[5]);
}

inline void store_soft(const Samples& samples, const Samples& solid, float spread, float* out) {
  const float deep = whole_depth(spread);
  F sum = all(0.0F);
  for (int i = 0; i < 5; ++i) sum = sum + solidity(samples.v[i], solid.v[i], deep);
  alignas(64) float sums[kWidth];
  store(sums, sum);
  for (int i = 0; i < kVerticesAtOnce; ++i) out[i] = soft_share(sum_of_lanes(sums + 8 * i));
}

inline void store_weighted(const Samples& samples, const SmoothOcclusionOptions& options, float* out) {
  const F zero = all(0.0F);
  F sum = zero;
  F least = zero;
  for (int i = 0; i < 5; ++i) {
    const F depth = min(samples.v[i], zero);
    sum = sum + depth;
    least = min(least, depth);
  }
  alignas(64) float sums[kWidth];
  alignas(64) float leasts[kWidth];
  store(sums, sum);
  store(leasts, least);
  for (int i = 0; i < kVerticesAtOnce; ++i) {
    const float* const s = sums + 8 * i;
    const float* const l = leasts + 8 * i;
    const float deepest = std::min({l[0], l[1], l[2], l[3], l[4], l[5]});
    out[i] = weighted_occlusion(sum_of_lanes(s), deepest, options);
  }
}

template <int kSpread>
void add_occlusion_of_spread(const Work& work, const Slice& slice, std::size_t count, float* occlusion) {
  const Thirds low_lanes(kSpread, 0);
  const Thirds high_lanes(kSpread, 1);
  const SmoothOcclusion method = work.occlusion.method;
  for (std::size_t first = 0; first < count; first += kWidth) {
    const Centres centres = find_centres(work, slice, first);
    const std::size_t lanes = std::min<std::size_t>(kWidth, count - first);
    for (std::size_t lane = 0; lane < lanes; lane += kVerticesAtOnce) {
      const F fx = spread_out(centres.fx + lane);
      const Samples samples =
          samples_of(rows_around<kSpread, Part::All>(work, centres, lane), fx, low_lanes, high_lanes);
      if (method == SmoothOcclusion::SolidShare) {
        store_counted(samples, occlusion + first + lane);
      } else if (method == SmoothOcclusion::SoftShare) {
        const NineRows solid = rows_around<kSpread, Part::Solid>(work, centres, lane);
        store_soft(samples, samples_of(solid, fx, low_lanes, high_lanes), work.occlusion.spread,
                   occlusion + first + lane);
      } else {
        store_weighted(samples, work.occlusion, occlusion + first + lane);
      }
    }
  }
}

void add_occlusion(Work& work, const Slice& slice, std::size_t count, float* occlusion) {
  if (count == 0) return;
  if (!work.is_dense) return occlude_by_lists(work, slice, count, occlusion);
  decode_around(work, slice.z);
  if (work.occlusion.spread == 1.0F) {
    add_occlusion_of_spread<1>(work, slice, count, occlusion);
  } else {
    add_occlusion_of_spread<2>(work, slice, count, occlusion);
  }
}

}  // namespace
}  // namespace quoin::smooth
