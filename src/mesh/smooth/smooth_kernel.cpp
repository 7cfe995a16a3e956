// The Surface Nets kernel: one register of lanes at a time, or cell by cell.

#include "mesh/smooth/smooth_mesher.h"

#ifdef QUOIN_KERNEL_AVX2
#include "mesh/smooth/occlusion_lanes.inl"
#include "mesh/smooth/slices.inl"
#include "mesh/smooth/vectors.inl"
#else

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>

#include "mesh/smooth/listed.inl"
#include "mesh/smooth/slices.inl"
#include "mesh/smooth/smooth_cell.h"

namespace quoin::smooth {
namespace {

// The column and the row of a place, starting at -1.
int column_of(int place) {
  return (place & (kPlaceStride - 1)) - 1;
}
int row_of(int place) {
  return (place >> kPlaceShift) - 1;
}

// Converts a stored density. It is never infinite or NaN, so moving the bits and correcting the exponent is enough.
float density_of(Half half) {
  const auto bits = static_cast<std::uint32_t>(std::int32_t{static_cast<std::int16_t>(half)}) << 13 & 0x8FFF'E000U;
  return std::bit_cast<float>(bits) * 0x1p112F;
}

// Reads corners by x + 2 y + 4 z, from rows at a distance of `stride`.
Corners corners_at(const Half* low, const Half* high, std::ptrdiff_t stride) {
  return {density_of(low[0]),  density_of(low[1]),  density_of(low[stride]),  density_of(low[stride + 1]),
          density_of(high[0]), density_of(high[1]), density_of(high[stride]), density_of(high[stride + 1])};
}

// Packs a vertex in the form stored per place.
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
    const CellVertex vertex =
        cell_vertex(corners_at(work.row(y, slice.z) + x, work.row(y, slice.z + 1) + x, kPlaceStride));
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

template <int kSpread>
void find_batch(const Work& work, const Slice& slice, std::size_t first, std::size_t count, Batch& batch) {
  for (std::size_t v = 0; v < count; ++v) {
    const std::size_t from = first + v;
    const Vec3 snapped(work.fractions[0][from], work.fractions[1][from], work.fractions[2][from]);
    const Vec3 normal(work.normals[0][from], work.normals[1][from], work.normals[2][from]);
    const Vec3 centre = occlusion_centre(snapped, normal, work.occlusion.spread);
    IVec3 lowest{0};
    for (int axis = 0; axis < 3; ++axis) {
      const SampleAxis samples = sample_axis(centre[axis], work.occlusion.spread);
      lowest[axis] = samples.base[0];
      for (std::size_t i = 0; i < 3; ++i) {
        batch.steps[axis][i][v] = samples.base[i] - samples.base[0];
        batch.fraction[axis][i][v] = samples.fraction[i];
      }
    }
    const int place = work.places[from] & kPlaceMask;
    batch.column[v] = column_of(place) + lowest.x + kPointX;
    batch.row[v] = row_of(place) + lowest.y + kPointX;
    batch.slice[v] = slice.z + lowest.z + kSliceBias;
  }
}

template <int kSpread, bool kCounted>
bool find_values(const Work& work, std::size_t count, Batch& batch) {
  const float unit = depth_unit(work.level);
  const float deep = whole_depth(work.occlusion.spread);
  bool is_any = false;
  std::fill_n(batch.solid, count / 8 + 1, std::uint8_t{0});
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t v = batch.codes[i] >> kCodeShift;
    const std::size_t sample = batch.codes[i] & ((1U << kCodeShift) - 1);
    const std::array<std::size_t, 3> number = {sample % 3, sample / 3 % 3, sample / 9};
    IVec3 step{0};
    Vec3 fraction{0.0F};
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t n = number.at(static_cast<std::size_t>(axis));
      step[axis] = batch.steps[axis][n][v];
      fraction[axis] = batch.fraction[axis][n][v];
    }
    const int x = batch.column[v] - kPointX + step.x;
    const int y = batch.row[v] - kPointX + step.y;
    const int z = batch.slice[v] - kSliceBias + step.z;
    Corners corners = corners_at(work.sampled_row(y, z) + x, work.sampled_row(y, z + 1) + x, kSampledStride);
    const float density = interpolated(corners, fraction) * unit;
    const bool is_solid = density < 0.0F;
    is_any |= is_solid;
    batch.solid[i / 8] |= static_cast<std::uint8_t>(unsigned{is_solid} << (i % 8));
    if constexpr (kCounted) continue;
    batch.values[i] = std::min(density, 0.0F);
    if (is_solid && work.occlusion.method == SmoothOcclusion::SoftShare) {
      for (float& d : corners) d = std::min(d, 0.0F);
      batch.values[i] = solidity(density, interpolated(corners, fraction) * unit, deep);
    }
  }
  return is_any;
}

template <int kSpread, bool kCounted>
std::size_t list_samples(const Work& work, std::size_t count, Batch& batch) {
  return list_one_by_one<kSpread, kCounted>(work, count, batch);
}

void add_up(const Work& work, const Batch& batch, std::span<const std::uint32_t> which, float* occlusion) {
  for (const std::uint32_t v : which) occlusion[v] = occlusion_of_sum(sum_of(batch, v), work.occlusion);
}

void add_occlusion(Work& work, const Slice& slice, std::size_t count, float* occlusion) {
  if (count != 0) occlude_by_lists(work, slice, count, occlusion);
}

// Returns the squared length of a diagonal, in units of 1/64 cell.
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
    const bool from_second = squared_length(corners[3], corners[1], along_diagonal<kAxis>(-1)) <
                             squared_length(corners[0], corners[2], along_diagonal<kAxis>(1));
    const bool starts_solid = (work.places[i] & kStartsSolid) != 0;
    const auto [a, b, c, d] = split_quad(q[0], q[1], q[2], q[3], starts_solid, from_second);
    for (const std::uint32_t vertex : {a, b, c, a, c, d}) *out++ = vertex;
  }
}

}  // namespace
}  // namespace quoin::smooth

#endif

namespace quoin::smooth {
namespace {

void mesh(Work& work, SmoothChunkMesh& out) {
  mesh_slices(work, out);
}

void occlude(Work& work, int z, std::size_t count, float* occlusion) {
  Slice slice;
  slice.z = z;
  add_occlusion(work, slice, count, occlusion);
}

}  // namespace

constinit const Kernel QUOIN_KERNEL(Kernel) = {&mesh, &occlude};

#ifndef QUOIN_KERNEL_AVX2
constinit const KernelTable<Kernel> kKernels = QUOIN_KERNEL_TABLE(Kernel, Avx2);
#endif

}  // namespace quoin::smooth
