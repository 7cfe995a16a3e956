#include "scene/smooth/marched_density.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>

#include <gtest/gtest.h>

#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_field.h>

#include "mesh/surface/voxel_surface.h"

namespace quoin {
namespace {

VoxelType add(VoxelRegistry& types, Visibility visibility) {
  VoxelProperties properties;
  properties.colour = {10, 20, 30, static_cast<std::uint8_t>(types.size())};
  properties.visibility = visibility;
  return types.add(properties).value();
}

/// The simple slow version: one sample at a time.
class Oracle {
 public:
  Oracle(const Grid& grid, const VoxelRegistry& types) : grid_(grid), types_(types) {}

  [[nodiscard]] Half density(IVec3 voxel, Half blurred) const {
    const bool at_edge = is_at_edge(voxel);
    const bool at_face = is_at_face(voxel) || meets_other_body(voxel);
    if (is_solid(voxel)) return at_edge || at_face ? stored_density(-0.5F, 8.0F) : blurred;
    const Half out = at_face ? stored_density(0.5F, 8.0F) : blurred;
    return at_edge ? std::min(out, stored_density(0.4F, 8.0F)) : out;
  }

 private:
  static IVec3 unit(int axis, int sign = 1) {
    IVec3 step{0};
    step[axis] = sign;
    return step;
  }
  [[nodiscard]] bool is_solid(IVec3 voxel) const { return grid_.get(voxel) != kAir; }

  // Returns true if the face between a voxel and the next must keep its position.
  [[nodiscard]] bool keeps_face(IVec3 from, IVec3 step, int axis) const {
    const bool kind = is_solid(from);
    if (is_solid(from + step) == kind) return false;
    return is_thin(from, axis) || is_slab(from, step, axis);
  }
  [[nodiscard]] bool is_thin(IVec3 voxel, int axis) const {
    const bool kind = is_solid(voxel);
    const IVec3 step = unit(axis);
    if (is_solid(voxel - step) == kind || is_solid(voxel + step) == kind) return false;
    for (int other = 0; other < 3; ++other) {
      for (const int sign : {-1, 1}) {
        const IVec3 side = voxel + unit(other, sign);
        if (other == axis || is_solid(side) == kind) continue;
        if (is_solid(side - step) == kind || is_solid(side + step) == kind) return false;
      }
    }
    return true;
  }
  [[nodiscard]] bool is_slab(IVec3 voxel, IVec3 step, int axis) const {
    const bool kind = is_solid(voxel);
    bool ends = false;
    for (int k = 1; k <= 4; ++k) ends |= is_solid(voxel - step * k) != kind;
    for (int a = -1; a <= 1; ++a) {
      for (int b = -1; b <= 1; ++b) {
        const IVec3 side = voxel + unit((axis + 1) % 3) * a + unit((axis + 2) % 3) * b;
        if (is_solid(side) != kind || is_solid(side + step) == kind) return false;
      }
    }
    return ends;
  }
  [[nodiscard]] bool is_at_face(IVec3 voxel) const {
    for (int axis = 0; axis < 3; ++axis) {
      for (const int sign : {-1, 1}) {
        const IVec3 step = unit(axis, sign);
        if (keeps_face(voxel, step, axis) || keeps_face(voxel + step, -step, axis)) return true;
      }
    }
    return false;
  }
  [[nodiscard]] bool is_at_edge(IVec3 voxel) const {
    for (int axis = 0; axis < 3; ++axis) {
      for (const int a : {-1, 1}) {
        for (const int b : {-1, 1}) {
          const IVec3 first = unit((axis + 1) % 3, a);
          const IVec3 second = unit((axis + 2) % 3, b);
          const bool kind = is_solid(voxel);
          if (is_solid(voxel + first + second) == kind && is_solid(voxel + first) != kind &&
              is_solid(voxel + second) != kind) {
            return true;
          }
        }
      }
    }
    return false;
  }
  [[nodiscard]] bool meets_other_body(IVec3 voxel) const {
    if (!is_solid(voxel)) return false;
    const auto body = [&](IVec3 at) { return smooth::body_of(types_, grid_.get(at)); };
    for (int axis = 0; axis < 3; ++axis) {
      for (const int sign : {-1, 1}) {
        const IVec3 next = voxel + unit(axis, sign);
        if (is_solid(next) && body(next) != body(voxel)) return true;
      }
    }
    return false;
  }

  const Grid& grid_;
  const VoxelRegistry& types_;
};

/// Returns walls, slabs, rails, slanted shapes and noise, across chunk borders.
Grid random_grid(std::uint32_t seed, const std::array<VoxelType, 4>& types) {
  std::mt19937 random(seed);
  const auto below = [&](int most) { return static_cast<int>(random() % static_cast<unsigned>(most)); };
  Grid grid;
  for (int i = 0; i < 24; ++i) {
    const IVec3 from{below(60) + 34, below(60) + 34, below(60) + 34};
    IVec3 size{1 + below(20), 1 + below(20), 1 + below(20)};
    size[below(3)] = 1 + below(5);
    grid.fill_box({from, from + size}, types.at(random() % 4));
  }
  for (int i = 0; i < 30; ++i) grid.set({40 + i, 90 + i % 3, 40 + i}, types[0]);
  for (int i = 0; i < 2000; ++i) grid.set({below(30) + 50, below(12) + 58, below(30) + 50}, types.at(random() % 4));
  return grid;
}

TEST(MarchedDensity, MatchesOracle) {
  VoxelRegistry types;
  const VoxelType stone = add(types, Visibility::Opaque);
  const VoxelType water = add(types, Visibility::Transparent);
  const VoxelType glass = add(types, Visibility::Transparent);
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    SCOPED_TRACE(seed);
    const Grid grid = random_grid(seed, {stone, water, glass, kAir});
    const Oracle oracle(grid, types);
    int different = 0;
    int changed = 0;
    for (const IVec3 chunk : {IVec3{0, 0, 0}, IVec3{1, 0, 0}, IVec3{0, 1, 1}, IVec3{1, 1, 1}}) {
      const DensityChunk blurred = density_of_voxels(grid.neighbourhood(chunk));
      const DensityChunk marched = marched_density(grid.neighbourhood(chunk), types);
      EXPECT_TRUE(marched.materials() == blurred.materials());
      for (int z = 0; z < kChunkEdge; ++z) {
        for (int y = 0; y < kChunkEdge; ++y) {
          for (int x = 0; x < kChunkEdge; ++x) {
            const Half before = blurred.get(x, y, z);
            const Half now = marched.get(x, y, z);
            changed += now != before ? 1 : 0;
            different += now != oracle.density(chunk * kChunkEdge + IVec3{x, y, z}, before) ? 1 : 0;
          }
        }
      }
    }
    EXPECT_EQ(different, 0);
    EXPECT_GT(changed, 3000);
  }
}

TEST(MarchedDensity, KeepsAirAndSolidUniform) {
  VoxelRegistry types;
  const VoxelType stone = add(types, Visibility::Opaque);
  Grid grid;
  EXPECT_EQ(marched_density(grid.neighbourhood({0, 0, 0}), types).uniform(), DensityNeighbourhood{}.outside);
  grid.fill_box({{-64, -64, -64}, {128, 128, 128}}, stone);
  EXPECT_EQ(marched_density(grid.neighbourhood({0, 0, 0}), types).uniform(), stored_density(-8.0F, 8.0F));
}

}  // namespace
}  // namespace quoin
