// Vertices and quads, one register of lanes at a time, with the arithmetic of smooth_cell.h.
//
//   lanes       | cell 0 | cell 1 | cell 2 | ...       by the list of their places
//   d[8]        the densities of their corners, x first, then y, then z; a pair of halves along x is one gather
//   vertices    | index: 13 bits | x, y, z in 64ths: 6 bits each |      stored per cell of a slice

#pragma once

// Included first: the slices use the append functions of these lanes.
#include "mesh/smooth/smooth_lanes.inl"

#include "mesh/smooth/slices.inl"

namespace quoin::smooth {
namespace {

// The densities of a cell's corners, and the solid corners as bits.
struct CornerLanes {
  F d[8];
  I solid;
};

inline F low_half(I pair) {
  return as_float(shift_right_signed<3>(shift_left<16>(pair)) & all(static_cast<int>(0x8FFFE000U))) * all(0x1p112F);
}
inline F high_half(I pair) {
  return as_float(shift_right_signed<3>(pair) & all(static_cast<int>(0x8FFFE000U))) * all(0x1p112F);
}

inline CornerLanes load_corners(const Half* low, const Half* high, I place) {
  const I pairs[4] = {gather_pairs(low, place), gather_pairs(low + kPlaceStride, place), gather_pairs(high, place),
                      gather_pairs(high + kPlaceStride, place)};
  CornerLanes corners;
  for (int i = 0; i < 4; ++i) {
    corners.d[2 * i] = low_half(pairs[i]);
    corners.d[2 * i + 1] = high_half(pairs[i]);
  }
  const I signs = all(static_cast<int>(0x80008000U));
  const I bits = shift_right<6>(pairs[0] & signs) | shift_right<4>(pairs[1] & signs) |
                 shift_right<2>(pairs[2] & signs) | (pairs[3] & signs);
  corners.solid = (shift_right<9>(bits) & all(0x55)) | (shift_right<24>(bits) & all(0xAA));
  return corners;
}

// Returns SmoothCell::bits of cells of slice z; x and y are one more than the cell's.
inline I cell_codes(I x, I y, int z, int n) {
  const std::uint32_t z_bits = cell_code(0, 0, z, n).bits;
  const I mask = all(n - 1);
  const auto previous = [](I c, int axis) {
    return select(equals(c, 0), all(1 << (SmoothCell::kPreviousShift + axis)), all(0));
  };
  const I x_bits = ((x + mask) & mask) | previous(x, 0);
  const I y_bits = shift_left<6>((y + mask) & mask) | previous(y, 1);
  return x_bits | y_bits | all(static_cast<int>(z_bits));
}

inline I in_64ths(F f) {
  return min_unsigned(to_int(f * all(64.0F)), all(63));
}

inline I lane_numbers() {
  alignas(64) constexpr std::int32_t kNumbers[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  return as_int(load(reinterpret_cast<const float*>(kNumbers)));
}

// Stores the vertices of the current slice for the quads of this and the next slice.
inline void remember(Work& work, const Slice& slice, std::size_t first, std::size_t count, I place, Lanes3<F> at) {
  const I index = lane_numbers() + all(static_cast<int>(first));
  const I fractions = shift_left<kVertexBits>(in_64ths(at.x)) | shift_left<kVertexBits + 6>(in_64ths(at.y)) |
                      shift_left<kVertexBits + 12>(in_64ths(at.z));
  scatter(work.vertices[slice.z & 1], place, index | fractions, count - first);
}

inline void keep_for_occlusion(Work& work, std::size_t first, Lanes3<F> at, Lanes3<F> normal) {
  const F parts[6] = {at.x, at.y, at.z, normal.x, normal.y, normal.z};
  for (int i = 0; i < 3; ++i) {
    store(work.fractions[i] + first, parts[i]);
    store(work.normals[i] + first, parts[3 + i]);
  }
}

void make_vertices(Work& work, const Slice& slice, std::size_t count, SmoothChunkMesh& out) {
  const F scale = all(static_cast<float>(1 << work.level));
  const Half* const low = work.row(0, slice.z) - place_of(0, 0);
  const Half* const high = work.row(0, slice.z + 1) - place_of(0, 0);
  const bool has_occlusion = work.occlusion.method != SmoothOcclusion::None;
  for (std::size_t first = 0; first < count; first += kWidth) {
    const I place = load(work.places + first) & all(kPlaceMask);
    const CornerLanes corners = load_corners(low, high, place);
    const auto [fraction, at, normal] = cell_vertex(HalfField{}, corners.d, corners.solid);
    const I x = place & all(kPlaceStride - 1);
    const I y = shift_right<kPlaceShift>(place);
    const std::size_t vertex = slice.first_vertex + first;
    store_vectors(out.positions.data() + vertex, (to_float(x - all(1)) + at.x) * scale,
                  (to_float(y - all(1)) + at.y) * scale, (all(static_cast<float>(slice.z)) + at.z) * scale);
    store_vectors(out.normals.data() + vertex, normal.x, normal.y, normal.z);
    store(reinterpret_cast<std::uint32_t*>(out.cells.data() + vertex), cell_codes(x, y, slice.z, work.n));
    remember(work, slice, first, count, place, at);
    if (has_occlusion) keep_for_occlusion(work, first, at, normal);
  }
}

// Returns the squared lengths of diagonals, in units of 1/64 cell.
template <int kShift>
inline I squared_part(I from, I to, int cells) {
  const I d = (shift_right<kShift>(to) & all(63)) - (shift_right<kShift>(from) & all(63)) + all(64 * cells);
  return d * d;
}

template <Axis kAxis, int kSign>
inline I squared_length(I from, I to) {
  constexpr std::array<int, 3> kCells = along_diagonal<kAxis>(kSign);
  return squared_part<kVertexBits>(from, to, kCells[0]) + squared_part<kVertexBits + 6>(from, to, kCells[1]) +
         squared_part<kVertexBits + 12>(from, to, kCells[2]);
}

template <Axis kAxis>
void make_quads(const Work& work, const Slice& slice, std::size_t count, std::uint32_t* out) {
  using Cells = Around<kAxis>;
  const I firsts[2] = {all(static_cast<int>(slice.first_vertex)), all(static_cast<int>(slice.first_vertex_of_last))};
  for (std::size_t i = 0; i < count; i += kWidth) {
    const I edge = load(work.places + i);
    const I place = edge & all(kPlaceMask);
    I corners[4];
    I q[4];
    for (int c = 0; c < 4; ++c) {
      const int is_last = Cells::is_last[static_cast<std::size_t>(c)] ? 1 : 0;
      const int back = static_cast<int>(Cells::back[static_cast<std::size_t>(c)]);
      corners[c] = gather(work.vertices[(slice.z ^ is_last) & 1], place - all(back));
      q[c] = (corners[c] & all(static_cast<int>(kVertexMask))) + firsts[is_last];
    }
    const Mask from_second =
        squared_length<kAxis, -1>(corners[3], corners[1]) < squared_length<kAxis, 1>(corners[0], corners[2]);
    const Mask starts_solid = all(kStartsSolid - 1) < edge;
    const auto [a, b, c, d] = split_quad(q[0], q[1], q[2], q[3], starts_solid, from_second);
    store_triangles(out + 6 * i, a, b, c, d);
  }
}

}  // namespace
}  // namespace quoin::smooth
