#pragma once

// The density fields of the smooth benchmarks. All mathematics in double, rounded to floats at the end.

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <quoin/grid/density_chunk.h>

#include "bench/workloads.h"

namespace quoin::workloads {

enum class Smooth { S4, S1 };

/// Expected results of `SmoothBorder::Open`. S1 counts only its first chunk.
inline constexpr std::int64_t kSphereTriangles = 29'388;
inline constexpr std::int64_t kSphereVertices = 14'696;
inline constexpr std::int64_t kTerrainTriangles = 20'172;

/// Quoin's storage clamps values to this range; the peers get them unclamped.
inline constexpr float kSmoothBand = 8.0F;

/// 64^3 values, x fastest, then y, then z: a sphere, or a piece of the terrain without steps.
inline std::vector<float> smooth_field(Smooth which, int column_x = 0, int column_z = 0) {
  std::vector<float> field;
  field.reserve(std::size_t{64} * 64 * 64);
  for (int z = 0; z < 64; ++z) {
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        const double wx = x - 1 + 62 * column_x;
        const double wz = z - 1 + 62 * column_z;
        const double h = smooth_height(wx, wz);
        const double sphere = std::hypot(x - 31, y - 31, z - 31) - 28.0;
        field.push_back(static_cast<float>(which == Smooth::S4 ? sphere : y - 1 - h));
      }
    }
  }
  return field;
}

/// Converts a field to Quoin's storage.
inline DensityChunk density_chunk(const std::vector<float>& field) {
  DensityChunk chunk(stored_density(kSmoothBand, kSmoothBand));
  std::array<Half, kChunkEdge> row{};
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const float* const from = field.data() + (z * kChunkEdge + y) * kChunkEdge;
      for (std::size_t x = 0; x < kChunkEdge; ++x) row[x] = stored_density(from[x], kSmoothBand);
      chunk.write_row(y, z, row);
    }
  }
  chunk.compact();
  return chunk;
}

}  // namespace quoin::workloads
