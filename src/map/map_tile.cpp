#include "map/map_tile.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>

#include "core/srgb.h"

namespace quoin::map {

namespace {

constexpr int kField = kTileEdge + 2 * kReach;
/// The height of columns without a surface, below all others.
constexpr float kNothing = -1e9F;

/// The heights of a tile's columns and of those within kReach, by z, then x.
struct HeightField {
  std::vector<float> y = std::vector<float>(std::size_t{kField} * kField, kNothing);
  [[nodiscard]] float at(int x, int z) const { return y[static_cast<std::size_t>((z + kReach) * kField + x + kReach)]; }
};

const SeenColumn* column_at(const TileSurfaces& surfaces, int x, int z) {
  constexpr int kSquare = ColumnSurface::kEdge;
  const int square = (z + kSquare) / kSquare * (kTileSquares + 2) + (x + kSquare) / kSquare;
  const ColumnSurface* const surface = surfaces[static_cast<std::size_t>(square)].get();
  return surface != nullptr ? &surface->at(x & (kSquare - 1), z & (kSquare - 1)) : nullptr;
}

/// Returns the share of the sky that a column sees, weighted as on a level surface: the mean over eight directions of
/// the squared cosine of the horizon's height.
float sky_seen(const HeightField& heights, int x, int z) {
  constexpr std::array<std::array<int, 2>, 8> kDirections = {
      {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};
  constexpr std::array<int, 6> kSteps = {1, 2, 4, 7, 11, 16};
  const float own = heights.at(x, z);
  float open = 0.0F;
  for (const auto& [dx, dz] : kDirections) {
    const bool is_diagonal = dx != 0 && dz != 0;
    float steepest = 0.0F;
    for (const int step : kSteps) {
      const float rise = heights.at(x + dx * step, z + dz * step) - own;
      if (rise <= 0.0F) continue;
      // From the middle of the column to the face of the other one.
      const float away = (static_cast<float>(step) - 0.5F) * (is_diagonal ? std::numbers::sqrt2_v<float> : 1.0F);
      steepest = std::max(steepest, rise / away);
    }
    open += 1.0F / (1.0F + steepest * steepest);  // the squared cosine of the horizon's height
  }
  return open / static_cast<float>(kDirections.size());
}

/// Returns the light on a slope, 1 on level ground.
float relief(const HeightField& heights, int x, int z) {
  const float own = heights.at(x, z);
  const auto height = [&](int dx, int dz) {
    const float other = heights.at(x + dx, z + dz);
    // Cliffs are not brighter or darker than steep slopes; nothing is level.
    constexpr float kMost = 3.0F;
    return other == kNothing ? 0.0F : std::clamp(other - own, -kMost, kMost);
  };
  const float slope_x = height(1, 0) - height(-1, 0);
  const float slope_z = height(0, 1) - height(0, -1);
  // Light from the north-west and above: the upper left of the map.
  constexpr float kStrength = 0.045F;
  constexpr float kLeast = 0.72F;
  constexpr float kMost = 1.25F;
  return std::clamp(1.0F + kStrength * (slope_x + slope_z), kLeast, kMost);
}

Vec3 light_of(const std::array<std::uint8_t, 3>& roots) {
  constexpr float kScale = 1.0F / (255.0F * 255.0F);
  const auto squared = [](std::uint8_t root) { return kScale * static_cast<float>(root) * static_cast<float>(root); };
  return {squared(roots[0]), squared(roots[1]), squared(roots[2])};
}

void put(AlphaImage& image, int x, int y, const Vec3& light, std::uint8_t alpha) {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  std::uint8_t* const pixel = image.rgba.data() + (std::size_t{4} * static_cast<std::size_t>(y * kTileEdge + x));
  for (int c = 0; c < 3; ++c) pixel[c] = encode(light[c]);
  pixel[3] = alpha;
}

AlphaImage empty_tile() {
  AlphaImage image{kTileEdge, kTileEdge, {}};
  image.rgba.resize(std::size_t{4} * kTileEdge * kTileEdge);
  return image;
}

}  // namespace

std::optional<AlphaImage> draw_tile(const TileSurfaces& surfaces) {
  HeightField surface;
  HeightField floor;
  bool is_empty = true;
  for (int z = -kReach; z < kTileEdge + kReach; ++z) {
    for (int x = -kReach; x < kTileEdge + kReach; ++x) {
      const SeenColumn* const column = column_at(surfaces, x, z);
      if (column == nullptr || column->alpha == 0) continue;
      const auto i = static_cast<std::size_t>((z + kReach) * kField + x + kReach);
      surface.y[i] = static_cast<float>(column->y);
      floor.y[i] = static_cast<float>(column->floor_y);
      is_empty &= x < 0 || z < 0 || x >= kTileEdge || z >= kTileEdge;
    }
  }
  if (is_empty) return std::nullopt;
  AlphaImage image = empty_tile();
  for (int z = 0; z < kTileEdge; ++z) {
    for (int x = 0; x < kTileEdge; ++x) {
      const SeenColumn* const column = column_at(surfaces, x, z);
      if (column == nullptr || column->alpha == 0) continue;
      constexpr float kAmbient = 0.3F;
      const float sky = kAmbient + (1.0F - kAmbient) * sky_seen(surface, x, z);
      const float shade = sky * relief(surface, x, z);
      const float below = column->floor_y == column->y ? shade : sky * relief(floor, x, z);
      const Vec3 light = light_of(column->cover) * shade + light_of(column->floor) * (column->glows ? 1.0F : below);
      put(image, x, z, light, column->alpha);
    }
  }
  return image;
}

std::optional<AlphaImage> draw_parent(const std::array<std::optional<AlphaImage>, 4>& children) {
  const std::array<float, 256>& linear = linear_bytes();
  AlphaImage image = empty_tile();
  bool is_empty = true;
  constexpr int kHalf = kTileEdge / 2;
  for (int i = 0; i < 4; ++i) {
    const std::optional<AlphaImage>& child = children[static_cast<std::size_t>(i)];
    if (!child) continue;
    QUOIN_ASSERT(child->width == kTileEdge && child->height == kTileEdge, "a whole tile");
    const std::uint8_t* const from = child->rgba.data();
    for (int y = 0; y < kHalf; ++y) {
      for (int x = 0; x < kHalf; ++x) {
        Vec3 light{0.0F};
        float alpha = 0.0F;
        for (int k = 0; k < 4; ++k) {
          const int at = ((2 * y + k / 2) * kTileEdge + 2 * x + k % 2) * 4;
          const std::uint8_t* const pixel = from + at;
          const auto weight = static_cast<float>(pixel[3]);
          light += weight * Vec3(linear[pixel[0]], linear[pixel[1]], linear[pixel[2]]);
          alpha += weight;
        }
        if (alpha == 0.0F) continue;
        const auto mean = static_cast<std::uint8_t>(std::lround(alpha / 4.0F));
        is_empty &= mean == 0;
        put(image, x + i % 2 * kHalf, y + i / 2 * kHalf, light / alpha, mean);
      }
    }
  }
  if (is_empty) return std::nullopt;
  return image;
}

}  // namespace quoin::map
