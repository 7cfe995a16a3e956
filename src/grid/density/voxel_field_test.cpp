#include <quoin/grid/voxel_field.h>

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "grid/density/density_storage.h"

namespace quoin {
namespace {

// The slow reference: looks at every voxel within 8, then smooths with 125 weights.
class PlainVoxelField {
 public:
  explicit PlainVoxelField(const Grid& grid) : grid_(grid) {}

  [[nodiscard]] double density(IVec3 p) const {
    constexpr std::array<double, 5> kWeights = {1, 4, 6, 4, 1};
    double sum = 0.0;
    for (int z = 0; z < 5; ++z) {
      for (int y = 0; y < 5; ++y) {
        for (int x = 0; x < 5; ++x) {
          const double weight = kWeights[static_cast<std::size_t>(x)] * kWeights[static_cast<std::size_t>(y)] *
                                kWeights[static_cast<std::size_t>(z)];
          sum += weight * distance(p + IVec3{x, y, z} - 2);
        }
      }
    }
    const double smoothed = std::clamp(sum / 4096.0, -8.0, 8.0);
    return grid_.get(p) != kAir ? std::min(smoothed, -0.35) : std::max(smoothed, 0.1);
  }

 private:
  [[nodiscard]] double distance(IVec3 p) const {
    const bool is_solid = grid_.get(p) != kAir;
    int least = 81;
    for (int z = -8; z <= 8; ++z) {
      for (int y = -8; y <= 8; ++y) {
        for (int x = -8; x <= 8; ++x) {
          const int squared = x * x + y * y + z * z;
          if (squared < least && (grid_.get(p + IVec3{x, y, z}) != kAir) != is_solid) least = squared;
        }
      }
    }
    const double length = std::sqrt(static_cast<double>(least)) - 0.5;
    return is_solid ? -length : length;
  }

  const Grid& grid_;
};

Grid random_model(unsigned seed) {
  std::mt19937 random(seed);
  Grid grid;
  const auto place = [&] { return static_cast<int>(random() % 90) - 20; };
  for (int i = 0; i < 6; ++i) {
    grid.fill_sphere({place(), place(), place()}, static_cast<double>(random() % 20), static_cast<VoxelType>(i + 1));
    const IVec3 first{place(), place(), place()};
    grid.fill_box({first, first + IVec3(random() % 40, random() % 3, random() % 40) + 1}, 9);
    grid.set({place(), place(), place()}, 7);
  }
  return grid;
}

TEST(VoxelField, MatchesOracle) {
  for (unsigned seed = 1; seed <= 2; ++seed) {
    SCOPED_TRACE(seed);
    const Grid grid = random_model(seed);
    const DensityGrid field = *field_from_grid(grid, Threads{2});
    const PlainVoxelField plain(grid);
    std::mt19937 random(seed);
    for (int round = 0; round < 40; ++round) {
      IVec3 p;
      do {
        p = IVec3(random() % 110, random() % 110, random() % 110) - 30;
        // Every other sample is next to the surface, where the minimum densities apply.
      } while (round % 2 == 1 && (grid.get(p) == kAir) == (grid.get(p + IVec3{0, 1, 0}) == kAir));
      const double expected = plain.density(p);
      EXPECT_NEAR(field.density(p), expected, std::abs(expected) / 1024.0 + 1e-4);
    }
    for (const IVec3 p : {IVec3(-1, -1, -1), IVec3(0, 0, 0), IVec3(63, 64, 63), IVec3(64, 10, 0)}) {
      EXPECT_NEAR(field.density(p), plain.density(p), std::abs(plain.density(p)) / 1024.0 + 1e-4);
    }
  }
}

TEST(VoxelField, KeepsSolidityAndTypeOfVoxels) {
  const Grid grid = random_model(5);
  const DensityGrid field = *field_from_grid(grid);
  EXPECT_EQ(field.solid_count(), grid.voxel_count());
  EXPECT_EQ(field.solid_bounds(), grid.bounds());
  grid.for_each([&](IVec3 p, VoxelType type) {
    ASSERT_LT(field.density(p), -0.099F);
    ASSERT_EQ(field.material(p), type);
  });
  for (int z = -30; z < 90; ++z) {
    for (int y = -30; y < 90; ++y) {
      for (int x = -30; x < 90; ++x) {
        const bool is_air = grid.get({x, y, z}) == kAir;
        ASSERT_EQ(is_air, field.density({x, y, z}) > 0.099F);
      }
    }
  }
}

TEST(VoxelField, EqualsDistanceFromFlatWall) {
  Grid grid;
  grid.fill_box({{-100, -100, -40}, {101, 10, 41}}, 3);
  const DensityGrid field = *field_from_grid(grid);
  for (int y = 0; y < 30; ++y) {
    // Smoothing reads distances of at most 8.5, which bends the last values slightly.
    const double distance = y - 9.5;
    EXPECT_NEAR(field.density({0, y, 0}), std::clamp(distance, -8.0, 8.0), std::abs(distance) < 6.6 ? 0.01 : 0.07) << y;
  }
}

TEST(VoxelField, IsTheSameAtAnyThreadCount) {
  const Grid grid = random_model(8);
  const DensityGrid one = *field_from_grid(grid, Threads{1});
  const DensityGrid four = *field_from_grid(grid, Threads{4});
  ASSERT_EQ(one.chunks(), four.chunks());
  for (const IVec3 at : one.chunks()) {
    for (int i = 0; i < kChunkEdge * kChunkEdge; ++i) {
      std::array<Half, kChunkEdge> a;
      std::array<Half, kChunkEdge> b;
      one.find_chunk(at)->read_row(i % 64, i / 64, a);
      four.find_chunk(at)->read_row(i % 64, i / 64, b);
      ASSERT_EQ(a, b);
    }
  }
  EXPECT_EQ(field_from_grid(Grid())->chunk_count(), 0U);
}

TEST(VoxelField, UpdateMatchesFreshChunk) {
  std::mt19937 random(11);
  const auto below = [&](int end) { return static_cast<int>(random() % static_cast<unsigned>(end)); };
  Grid grid;
  grid.fill_box({{-64, -64, -64}, {128, 20, 128}}, 1);
  for (int i = 0; i < 40; ++i) grid.fill_sphere({below(120) - 30, 15 + below(20), below(120) - 30}, below(9), 1);
  DensityChunk kept = density_of_voxels(grid.neighbourhood({0, 0, 0}));
  for (int i = 0; i < 60; ++i) {
    // Covers positions in the chunk, at its borders, beyond them, and out of its reach.
    const IVec3 at{below(100) - 18, below(100) - 18, below(100) - 18};
    const IBox box{at, at + IVec3{1 + below(4), 1 + below(4), 1 + below(9)}};
    grid.fill_box(box, static_cast<VoxelType>(i % 3));
    update_density_of_voxels(grid.neighbourhood({0, 0, 0}), box, kept);
    ASSERT_EQ(kept.content_hash(), density_of_voxels(grid.neighbourhood({0, 0, 0})).content_hash()) << i;
  }
  for (VoxelType type : {VoxelType{1}, kAir}) {
    grid.fill_box({{-64, -64, -64}, {128, 128, 128}}, type);
    update_density_of_voxels(grid.neighbourhood({0, 0, 0}), {{-64, -64, -64}, {128, 128, 128}}, kept);
    EXPECT_TRUE(kept.uniform().has_value()) << "all of one kind takes no room";
    EXPECT_EQ(kept.content_hash(), density_of_voxels(grid.neighbourhood({0, 0, 0})).content_hash());
  }
}

// Chunks compute only the rows near solid voxels; an update of the whole chunk computes all rows.
TEST(VoxelField, SmallModelsEqualUpdateOfWholeChunk) {
  std::mt19937 random(12);
  const auto below = [&](int end) { return static_cast<int>(random() % static_cast<unsigned>(end)); };
  const IBox whole{{0, 0, 0}, IVec3(kChunkEdge)};
  for (int i = 0; i < 40; ++i) {
    Grid grid;
    const IVec3 at{below(88) - 12, below(88) - 12, below(88) - 12};
    grid.fill_box({at, at + IVec3{1 + below(4), 1 + below(9), 1 + below(3)}}, 2);
    if (i % 2 == 0) grid.set({below(64), below(64), below(64)}, 1);
    DensityChunk updated(largest_within(8.0F));
    updated.fill(0x3C00);  // every row must be written
    update_density_of_voxels(grid.neighbourhood({0, 0, 0}), whole, updated);
    const DensityChunk made = density_of_voxels(grid.neighbourhood({0, 0, 0}));
    ASSERT_EQ(made.content_hash(), updated.content_hash()) << at.x << ' ' << at.y << ' ' << at.z;
    ASSERT_EQ(made.uniform(), updated.uniform());
  }
}

TEST(VoxelField, StoresInsideOfLargeModelUniformly) {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {64 * 5, 64 * 5, 64 * 5}}, 3);
  const DensityGrid field = *field_from_grid(grid);
  EXPECT_TRUE(field.find_chunk({2, 2, 2})->uniform().has_value());
  EXPECT_TRUE(field.find_chunk({1, 1, 1})->uniform().has_value());
  EXPECT_FALSE(field.find_chunk({0, 2, 2})->uniform().has_value());
}

TEST(VoxelField, StopsWhenCancelled) {
  Grid grid;
  grid.fill_box({IVec3(-70), IVec3(200)}, 1);
  double last = 0.0;
  EXPECT_TRUE(field_from_grid(grid, {2}, [&](double fraction) { return (last = fraction) <= 1.0; }).has_value());
  EXPECT_EQ(last, 1.0);
  const auto cancelled = field_from_grid(grid, {2}, [](double) { return false; });
  ASSERT_FALSE(cancelled.has_value());
  EXPECT_EQ(cancelled.error().code, ErrorCode::Cancelled);
}

}  // namespace
}  // namespace quoin
