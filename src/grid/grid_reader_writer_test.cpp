#include <quoin/grid/grid.h>

#include <array>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "grid/change_follower_for_tests.h"

namespace quoin {
namespace {

TEST(GridReader, MatchesGrid) {
  Grid grid;
  grid.fill_sphere({0, 0, 0}, 20.0, 3);
  GridReader reader(grid);
  for (int x = -70; x < 70; ++x) EXPECT_EQ(reader.get({x, 0, 0}), grid.get({x, 0, 0}));
  std::mt19937 random(8);
  for (int i = 0; i < 20'000; ++i) {  // runs along x between jumps; some jumps stay in the row
    const auto place = [&] { return static_cast<int>(random() % 90) - 45; };
    const IVec3 first{place(), place() / 9, place() / 9};
    for (int x = 0; x < static_cast<int>(random() % 12); ++x) {
      const IVec3 at = first + IVec3{x, 0, 0};
      ASSERT_EQ(reader.get(at), grid.get(at));
    }
  }
}

// Covers uniform chunks of air and of solid, and mixed chunks of few and of many types; reads rows forwards and
// backwards.
TEST(GridReader, MatchesGridInAnyOrder) {
  std::mt19937 random(4);
  const auto below = [&random](int limit) { return static_cast<int>(random() % static_cast<unsigned>(limit)); };
  Grid grid;
  for (int i = 0; i < 27; ++i) {
    const IVec3 corner = Neighbourhood::offset(i) * kChunkEdge;
    const int kinds = i % 5 == 0 ? 700 : 3;
    if (i % 3 != 0) grid.fill_box({corner, corner + 64}, static_cast<VoxelType>(i));
    if (i % 2 == 0) continue;
    grid.edit({corner, corner + kChunkEdge}, [&](IVec3, VoxelType) { return static_cast<VoxelType>(below(kinds)); });
  }
  GridReader reader(grid);
  for (int round = 0; round < 3'000; ++round) {
    IVec3 at{below(3) * 64 - 64 - below(2), below(200) - 100, below(200) - 100};
    const int rows = 1 + below(3);
    const IVec3 step{0, below(3) - 1, below(2)};
    for (int row = 0; row < rows; ++row) {
      for (int x = 0; x < 64 + below(70); ++x)
        ASSERT_EQ(reader.get(at + IVec3{x, 0, 0}), grid.get(at + IVec3{x, 0, 0}));
      at = below(4) == 0 ? at - step : at + step;
    }
    ASSERT_EQ(reader.get({at.x, 0, at.z}), grid.get({at.x, 0, at.z}));
  }
}

TEST(Grid, WritesRowWhereMaskIsSet) {
  std::mt19937_64 random(11);
  Grid grid;
  Grid plain;
  ChangeFollower follower(grid);
  ChangeFollower plain_follower(plain);
  for (int round = 0; round < 400; ++round) {
    const auto place = [&] { return static_cast<int>(random() % 140) - 70; };
    const IVec3 row{place(), place() / 20, place() / 20};
    const std::uint64_t mask = round % 5 == 0 ? ~std::uint64_t{0} : random() & random();
    const unsigned kinds = round % 3 == 0 ? 2 : round % 3 == 1 ? 5 : 40;
    std::array<VoxelType, kChunkEdge> types{};
    std::int64_t changed = 0;
    for (int x = 0; x < kChunkEdge; ++x) {
      VoxelType& type = types[static_cast<std::size_t>(x)];
      type = static_cast<VoxelType>(random() % kinds);
      if ((mask >> x & 1U) != 0) changed += plain.set({(row.x & ~63) + x, row.y, row.z}, type) ? 1 : 0;
    }
    ASSERT_EQ(grid.write_row(row, mask, types), changed);
    ASSERT_EQ(follower.take(grid), plain_follower.take(plain));
    ASSERT_EQ(grid.chunks(), plain.chunks());
  }
  ASSERT_EQ(grid.voxel_count(), plain.voxel_count());
  plain.for_each([&](IVec3 voxel, VoxelType type) { ASSERT_EQ(grid.get(voxel), type); });
  EXPECT_EQ(grid.write_row({std::numeric_limits<int>::max(), 0, 0}, 1, std::array<VoxelType, kChunkEdge>{1}), 0)
      << "the outermost chunks stay air";
}

TEST(GridWriter, MatchesSingleSets) {
  std::mt19937 random(5);
  Grid grid;
  Grid plain;
  {
    GridWriter writer(grid);
    for (int i = 0; i < 30'000; ++i) {
      const bool is_run = i % 3 != 0;
      const IVec3 at = is_run ? IVec3{i % 130 - 65, i / 1'000, 3}
                              : IVec3{static_cast<int>(random() % 90) - 45, static_cast<int>(random() % 9), -1};
      const auto type = static_cast<VoxelType>(random() % 7);
      writer.set(at, type);
      plain.set(at, type);
    }
  }
  EXPECT_EQ(grid.chunks(), plain.chunks());
  EXPECT_EQ(grid.voxel_count(), plain.voxel_count());
  plain.for_each([&](IVec3 voxel, VoxelType type) { ASSERT_EQ(grid.get(voxel), type); });
}

TEST(GridWriter, WritesNothingBeforeFlush) {
  Grid grid;
  GridWriter writer(grid);
  writer.set({1, 2, 3}, 4);
  EXPECT_EQ(grid.chunk_count(), 0U);
  ChangeFollower follower(grid);
  writer.flush();
  EXPECT_EQ(grid.get({1, 2, 3}), 4);
  EXPECT_EQ(follower.take(grid).size(), 1U);
  writer.flush();
  EXPECT_FALSE(follower.is_behind(grid));
}

}  // namespace
}  // namespace quoin
