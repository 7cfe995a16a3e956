// Cells of a field, eight at a time, in single precision: whether the field in them can become negative along a ray at
// all, which few can. Those are then asked in double (trace/kernel/cell.inl), so that rounding here costs time alone.
//
//   x, y, z      | 0 | 1 | ... | 7 |    the cells, in a chunk
//   corners      | 0 | 1 | ... | 7 |    eight times: gathered from rows of halves, two of a row at once
//   the cubic    | 0 | 1 | ... | 7 |    along the ray, or along a ray for each, in a stretch that is a little too long

#pragma once

#include <limits>

#include <immintrin.h>

#include "grid/density/density_storage.h"
#include "trace/kernel/cell.inl"
#include "trace/kernel/kernel.h"

namespace quoin::trace {
namespace {

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

}  // namespace
}  // namespace quoin::trace
