#pragma once

#include <span>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>

#include "render/path/environment_light.h"
#include "render/path/path_math.h"

namespace quoin::path {

/// Light from all directions, looked up without computing angles: the sphere as an octahedron, unfolded to a square.
///
/// Source: T. Engelhardt, C. Dachsbacher, "Octahedron environment maps" (2008).
class SkyMap {
 public:
  explicit SkyMap(const EnvironmentLight& light) : pixels_(static_cast<std::size_t>(kEdge + 1) * (kEdge + 1)) {
    for (int y = 0; y <= kEdge; ++y) {
      for (int x = 0; x <= kEdge; ++x) pixels_[index(x, y)] = light.at(direction_of(x, y));
    }
  }

  [[nodiscard]] Vec3 at(Vec3 direction) const {
    const float size = std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z);
    float u = direction.x / size;
    float v = direction.z / size;
    if (direction.y < 0.0F) {
      const float folded = (1.0F - std::abs(v)) * (u < 0.0F ? -1.0F : 1.0F);
      v = (1.0F - std::abs(u)) * (v < 0.0F ? -1.0F : 1.0F);
      u = folded;
    }
    const float x = std::clamp(u * 0.5F + 0.5F, 0.0F, 1.0F) * kEdge;
    const float y = std::clamp(v * 0.5F + 0.5F, 0.0F, 1.0F) * kEdge;
    const int i = std::min(static_cast<int>(x), kEdge - 1);
    const int j = std::min(static_cast<int>(y), kEdge - 1);
    const float fx = x - static_cast<float>(i);
    const float fy = y - static_cast<float>(j);
    const Vec3* const row = &pixels_[index(i, j)];
    const Vec3* const next = row + kEdge + 1;
    return (row[0] * (1.0F - fx) + row[1] * fx) * (1.0F - fy) + (next[0] * (1.0F - fx) + next[1] * fx) * fy;
  }

  static constexpr int kEdge = 256;  ///< steps between two corners of the square
  /// [y][x] of the square's corners, kEdge + 1 per row.
  [[nodiscard]] std::span<const Vec3> pixels() const { return pixels_; }

 private:
  static std::size_t index(int x, int y) {
    QUOIN_ASSERT(x >= 0 && x <= kEdge && y >= 0 && y <= kEdge, "a corner of the map");
    return static_cast<std::size_t>(y * (kEdge + 1) + x);
  }
  static Vec3 direction_of(int x, int y) {
    const float u = static_cast<float>(x) / (kEdge / 2.0F) - 1.0F;
    const float v = static_cast<float>(y) / (kEdge / 2.0F) - 1.0F;
    Vec3 direction{u, 1.0F - std::abs(u) - std::abs(v), v};
    if (direction.y < 0.0F) {
      direction.x = (1.0F - std::abs(v)) * (u < 0.0F ? -1.0F : 1.0F);
      direction.z = (1.0F - std::abs(u)) * (v < 0.0F ? -1.0F : 1.0F);
    }
    const float length = std::sqrt(direction.x * direction.x + direction.y * direction.y + direction.z * direction.z);
    return direction / length;
  }

  std::vector<Vec3> pixels_;
};

}  // namespace quoin::path
