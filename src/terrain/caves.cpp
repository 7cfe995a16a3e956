#include "terrain/terrain_parts.h"

#include <algorithm>
#include <memory>

#include <quoin/core/assert.h>
#include <quoin/terrain/noise.h>

namespace quoin::terrain {
namespace {

constexpr int kStep = 4;
constexpr int kPoints = kChunkEdge / kStep + 1;
constexpr double kAcross = 1.0 / 34.0;  // tunnels lie flatter than they are wide
constexpr double kUp = 1.0 / 21.0;
constexpr double kReach = 0.115;  // maximum absolute value in a cave

struct Samples {
  std::array<std::array<double, 2>, static_cast<std::size_t>(kPoints) * kPoints * kPoints> at;

  [[nodiscard]] static std::size_t index(int x, int y, int z) {
    QUOIN_ASSERT(std::min({x, y, z}) >= 0 && std::max({x, y, z}) < kPoints, "a point of the chunk");
    return static_cast<std::size_t>((z * kPoints + y) * kPoints + x);
  }
};

void sample(std::uint32_t seed, IVec3 chunk, int layers, Samples& samples) {
  const IVec3 origin = chunk * kChunkEdge;
  for (int z = 0; z < kPoints; ++z) {
    for (int y = 0; y < layers; ++y) {
      for (int x = 0; x < kPoints; ++x) {
        const IVec3 voxel = origin + IVec3{x, y, z} * kStep;
        const double px = kAcross * voxel.x;
        const double py = kUp * voxel.y;
        const double pz = kAcross * voxel.z;
        samples.at[Samples::index(x, y, z)] = {noise3(seed + 0xA00, px, py, pz), noise3(seed + 0xB00, px, py, pz)};
      }
    }
  }
}

using Corners = std::array<std::array<double, 8>, 2>;

// Gets the eight samples around a cell. Returns false if the two interpolations cannot both be near zero.
bool corners_of(const Samples& samples, IVec3 cell, Corners& corners) {
  for (std::size_t i = 0; i < 8; ++i) {
    const int corner = static_cast<int>(i);
    const auto& value =
        samples.at[Samples::index(cell.x + (corner & 1), cell.y + (corner >> 1 & 1), cell.z + (corner >> 2))];
    corners[0][i] = value[0];
    corners[1][i] = value[1];
  }
  return std::all_of(corners.begin(), corners.end(), [](const std::array<double, 8>& values) {
    const auto [least, greatest] = std::minmax_element(values.begin(), values.end());
    return -kReach < *greatest && *least < kReach;
  });
}

double between(double a, double b, double t) {
  return a + t * (b - a);
}

// Adds the voxels of one row of a cell.
std::uint64_t row_of_cell(const Corners& corners, int y, int z) {
  const double ty = (y + 0.5) * (1.0 / kStep);
  const double tz = (z + 0.5) * (1.0 / kStep);
  double ends[2][2];
  for (std::size_t n = 0; n < 2; ++n) {
    for (std::size_t x = 0; x < 2; ++x) {
      const auto& c = corners[n];
      ends[n][x] = between(between(c[x], c[x + 2], ty), between(c[x + 4], c[x + 6], ty), tz);
    }
  }
  std::uint64_t bits = 0;
  for (int x = 0; x < kStep; ++x) {
    const double tx = (x + 0.5) * (1.0 / kStep);
    const double a = between(ends[0][0], ends[0][1], tx);
    const double b = between(ends[1][0], ends[1][1], tx);
    bits |= std::uint64_t{a * a + b * b < kReach * kReach} << x;
  }
  return bits;
}

}  // namespace

void find_caves(std::uint32_t seed, IVec3 chunk, int height, CaveMasks& out) {
  out.rows.fill(0);
  const int cells = std::clamp((height + kStep - 1) / kStep, 0, kPoints - 1);
  if (cells == 0) return;
  const auto samples = std::make_unique<Samples>();
  sample(seed, chunk, cells + 1, *samples);
  Corners corners{};
  for (int z = 0; z < kPoints - 1; ++z) {
    for (int y = 0; y < cells; ++y) {
      for (int x = 0; x < kPoints - 1; ++x) {
        if (!corners_of(*samples, {x, y, z}, corners)) continue;
        for (int i = 0; i < kStep * kStep; ++i) {
          const std::uint64_t bits = row_of_cell(corners, i % kStep, i / kStep);
          out.rows[static_cast<std::size_t>((z * kStep + i / kStep) * kChunkEdge + y * kStep + i % kStep)] |=
              bits << (x * kStep);
        }
      }
    }
  }
}

}  // namespace quoin::terrain
