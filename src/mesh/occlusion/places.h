#pragma once

// Occlusion at arbitrary positions: their cells, and the samples of one chunk in the order of slices.

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/mesh/smooth_occlusion.h>

#include "mesh/smooth/smooth_cell.h"
#include "mesh/smooth/smooth_mesher.h"

namespace quoin::smooth {

/// A position in the form of a vertex: a cell, and a multiple of 1/65,536 within it.
struct CellSample {
  IVec3 cell;    ///< in the whole field, at the level
  Vec3 snapped;  ///< 0 to 1 within it
};

/// Returns the largest integer that is not above `at`. Requires: it is in the range of int64. Avoids the library
/// call of std::floor.
inline std::int64_t whole_below(double at) {
  QUOIN_ASSERT(at >= -0x1p63 && at < 0x1p63, "in the range of int64");
  const auto whole = static_cast<std::int64_t>(at);
  return whole - (static_cast<double>(whole) > at ? 1 : 0);
}

/// Returns true if all components are in the int32 range; false for NaN.
inline bool is_in_int32(DVec3 position) {
  constexpr double kLimit = 2'147'483'648.0;
  const auto is_in = [](double at) { return at >= -kLimit && at < kLimit; };
  return is_in(position.x) && is_in(position.y) && is_in(position.z);
}

/// Returns the cell of a position in samples of level 0; empty if the position is NaN or outside the int32 range.
inline std::optional<CellSample> place_at(DVec3 position, int level) {
  if (!is_in_int32(position)) return std::nullopt;
  const DVec3 at = position * double{depth_unit(level)};
  CellSample place{};
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t whole = whole_below(at[axis]);
    place.cell[axis] = static_cast<int>(whole);
    place.snapped[axis] = snap(static_cast<float>(at[axis] - static_cast<double>(whole)));
  }
  return place;
}

[[nodiscard]] Vec3 unit_or_up(Vec3 normal);

/// Returns the unit normal for occlusion: other lengths are normalized, invalid normals become +y.
inline Vec3 sound_normal(Vec3 normal) {
  constexpr float kTolerance = 1e-3F;
  const float square = (normal.x * normal.x + normal.y * normal.y) + normal.z * normal.z;
  return std::abs(square - 1.0F) <= kTolerance ? normal : unit_or_up(normal);
}

/// Returns the occlusion of a position in far air.
[[nodiscard]] float open_occlusion(const SmoothOcclusionOptions& options);

/// The effective settings and level, within their limits.
struct Sampling {
  SmoothOcclusionOptions occlusion;
  int level = 0;

  Sampling(const SmoothOcclusionOptions& wanted, int wanted_level);
};

/// Returns the occlusion of one sample position, without kernels. `place.cell` is relative to the centre chunk's first
/// cell.
[[nodiscard]] float occlusion_of_place(const DensityNeighbourhood& chunks, const CellSample& place, Vec3 normal,
                                       const Sampling& sampling);

/// The sample positions of one chunk.
struct ChunkSamples {
  const SmoothSamples& places;
  IVec3 chunk{0};                          ///< its coordinates, if `places` is relative to the field
  std::span<const std::uint32_t> numbers;  ///< samples in the chunk or a cell around it; other samples are far air
};

/// Computes occlusion with the mesher's kernels, including the rows that the samples of a chunk read.
class SampleKernel {
 public:
  SampleKernel();

  void occlude(const DensityNeighbourhood& chunks, const ChunkSamples& places, const Sampling& sampling,
               std::span<float> out);

 private:
  using Kernel = void (*)(Work&, int z, std::size_t count, float* occlusion);

  void sort_by_slice(const ChunkSamples& places, const Sampling& sampling, std::span<float> out);
  void occlude_some(const SmoothSamples& places, int z, std::size_t first, std::size_t count, std::span<float> out);

  struct Entry {
    std::uint32_t number;
    std::uint16_t place;
    std::int16_t z;
    Vec3 snapped;
  };

  Kernel kernel_;
  Work work_;
  std::vector<Entry> entries_;                                  // samples within reach, in input order
  std::vector<Entry> sorted_;                                   // by slice
  std::array<std::uint32_t, kChunkEdge + 3> first_of_slice_{};  // [z + 1], starting at cell -1
  std::array<float, kPlacesAtOnce + 64> occlusion_{};
};

}  // namespace quoin::smooth
