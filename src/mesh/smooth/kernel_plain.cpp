// The kernel for any processor: cell by cell.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "mesh/smooth/cell.h"
#include "mesh/smooth/scratch.h"
#include "mesh/smooth/slices.inl"

namespace quoin::smooth {
namespace {

void decode_row(const Half* from, float* to, int count) {
  for (int i = 0; i < count; ++i) to[i] = float_from_half(from[i]);
}

Corners corners_at(const Half* low, const Half* high) {
  return {float_from_half(low[0]),
          float_from_half(low[1]),
          float_from_half(low[kPlaceStride]),
          float_from_half(low[kPlaceStride + 1]),
          float_from_half(high[0]),
          float_from_half(high[1]),
          float_from_half(high[kPlaceStride]),
          float_from_half(high[kPlaceStride + 1])};
}

// A vertex as a place remembers it.
std::uint32_t remembered(std::uint32_t index, Vec3 snapped) {
  const auto part = [](float f) { return static_cast<std::uint32_t>(std::min(static_cast<int>(f * 64.0F), 63)); };
  return index | part(snapped.x) << kVertexBits | part(snapped.y) << (kVertexBits + 6) |
         part(snapped.z) << (kVertexBits + 12);
}

void make_vertices(Work& work, const Slice& slice, std::size_t count, SmoothChunkMesh& out) {
  const float scale = static_cast<float>(1 << work.level);
  for (std::size_t i = 0; i < count; ++i) {
    const int place = work.places[i];
    const int x = column_of(place);
    const int y = row_of(place);
    const CellVertex vertex = cell_vertex(corners_at(work.row(y, slice.z) + x, work.row(y, slice.z + 1) + x));
    const std::size_t at = slice.first_vertex + i;
    out.positions.data()[at] = (Vec3(x, y, slice.z) + vertex.snapped) * scale;
    out.normals.data()[at] = vertex.normal;
    out.cells.data()[at] = cell_code(x, y, slice.z, work.n);
    work.vertices[slice.z & 1][place] = remembered(static_cast<std::uint32_t>(i), vertex.snapped);
    for (int axis = 0; axis < 3; ++axis) {
      work.fractions[axis][i] = vertex.snapped[axis];
      work.normals[axis][i] = vertex.normal[axis];
    }
  }
}

void add_occlusion(Work& work, const Slice& slice, std::size_t count, float* occlusion) {
  decode_around(work, slice.z);
  occlusion_one_by_one(work, slice, count, occlusion);
}

// The squared length of a diagonal, in 64ths of a cell.
int squared_length(std::uint32_t from, std::uint32_t to, const std::array<int, 3>& cells) {
  int sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int shift = kVertexBits + 6 * static_cast<int>(axis);
    const int d = static_cast<int>(to >> shift & 63U) - static_cast<int>(from >> shift & 63U) + 64 * cells[axis];
    sum += d * d;
  }
  return sum;
}

template <Axis kAxis>
void make_quads(const Work& work, const Slice& slice, std::size_t count, std::uint32_t* out) {
  using Cells = Around<kAxis>;
  for (std::size_t i = 0; i < count; ++i) {
    std::array<std::uint32_t, 4> corners{};
    std::array<std::uint32_t, 4> q{};
    for (std::size_t c = 0; c < 4; ++c) {
      const bool is_last = Cells::is_last[c];
      corners[c] = work.vertices[(slice.z ^ (is_last ? 1 : 0)) & 1][(work.places[i] & kPlaceMask) - Cells::back[c]];
      q[c] = (corners[c] & kVertexMask) + (is_last ? slice.first_vertex_of_last : slice.first_vertex);
    }
    const bool flip = squared_length(corners[0], corners[2], along_diagonal<kAxis>(1)) >
                      squared_length(corners[3], corners[1], along_diagonal<kAxis>(-1));
    if ((work.places[i] & kStartsSolid) == 0) std::swap(q[1], q[3]);
    const std::size_t first = flip ? 1 : 0;
    for (const std::size_t c : {0, 1, 2, 0, 2, 3}) *out++ = q[(c + first) % 4];
  }
}

}  // namespace

void mesh_plain(Work& work, SmoothChunkMesh& out) {
  mesh_slices(work, out);
}

void occlude_plain(Work& work, int z, std::size_t count, float* occlusion) {
  Slice slice;
  slice.z = z;
  add_occlusion(work, slice, count, occlusion);
}

}  // namespace quoin::smooth
