#include <quoin/grid/density_grid.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "core/work/nightly_for_tests.h"
#include "grid/change_follower_for_tests.h"
#include "grid/density/density_oracle.h"

namespace quoin {
namespace {

constexpr int kLowest = std::numeric_limits<int>::min();
constexpr int kHighest = std::numeric_limits<int>::max();

DensityChunk chunk_of_plane(double height, VoxelType material) {
  DensityChunk chunk(stored_density(8.0F, 8.0F), material);
  std::array<Half, kChunkEdge> row;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      row.fill(stored_density(static_cast<float>(y - height), 8.0F));
      chunk.write_row(y, z, row);
    }
  }
  return chunk;
}

TEST(DensityGrid, UnsetSamplesAreFarAir) {
  const DensityGrid grid(3.0F);
  EXPECT_EQ(grid.density({5, -900, kHighest}), 3.0F);
  EXPECT_EQ(grid.material({5, 6, 7}), kAir);
  EXPECT_EQ(grid.band(), 3.0F);
  EXPECT_EQ(grid.find_chunk({0, 0, 0}), nullptr);
  EXPECT_EQ(grid.neighbourhood({0, 0, 0}).get({70, -5, 0}), stored_density(3.0F, 3.0F));
  EXPECT_EQ(DensityGrid(3.0001F).band(), 3.0F);
}

/// Applies a random set, edit or whole chunk to both fields. Returns the changed samples.
std::vector<IVec3> change_both(std::mt19937& random, int round, DensityGrid& grid, PlainField& plain) {
  const IVec3 at = IVec3(random() % 128, random() % 128, random() % 128) - 64;
  const DensitySample value{static_cast<float>(random() % 21) - 10.0F, static_cast<VoxelType>(random() % 3)};
  std::vector<IVec3> changed;
  std::int64_t answered = 0;
  if (round % 4 == 0) {
    const IVec3 chunk = chunk_of(at);
    const double height = static_cast<double>(random() % 120) - 25.0;
    changed = plain.edit([&](IVec3 p, DensitySample old) {
      const auto density = static_cast<float>(local_of(p).y - height);
      return chunk_of(p) == chunk ? DensitySample{density, value.material} : old;
    });
    grid.put_chunk(chunk, chunk_of_plane(height, value.material));
    answered = static_cast<std::int64_t>(changed.size());
  } else if (round % 4 == 1) {
    changed = plain.edit([&](IVec3 p, DensitySample old) { return p == at ? value : old; });
    answered = grid.set(at, value) ? 1 : 0;
  } else {
    const IBox box = intersect({at, at + IVec3(1 + random() % 70, 1 + random() % 30, 1 + random() % 9)}, plain.box());
    const auto pick = [&](IVec3 p, DensitySample old) {
      return (p.x + p.y) % 5 == 0 ? old : DensitySample{value.density, static_cast<VoxelType>((p.z & 1) + 1)};
    };
    changed = plain.edit([&](IVec3 p, DensitySample old) { return box.contains(p) ? pick(p, old) : old; });
    answered = grid.edit(box, pick);
  }
  EXPECT_EQ(answered, static_cast<std::int64_t>(changed.size()));
  return changed;
}

void expect_that_of(const DensityGrid& grid, PlainField& plain) {
  IBox bounds;
  std::int64_t count = 0;
  int differing = 0;
  plain.for_each([&](IVec3 p, const DensitySample& expected) {
    if (grid.density(p) != expected.density || grid.material(p) != expected.material) ++differing;
    if (expected.density >= 0.0F) return;
    bounds = unite(bounds, {p, p + 1});
    ++count;
  });
  ASSERT_EQ(differing, 0);
  EXPECT_EQ(grid.solid_bounds(), bounds);
  EXPECT_EQ(grid.solid_count(), count);
}

TEST(DensityGrid, MatchesPlainFieldUnderRandomEdits) {
  constexpr unsigned kSeed = 23;
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  DensityGrid grid;
  ChangeFollower follower(grid);
  PlainField plain({IVec3(-64), IVec3(64)}, 8.0F);
  for (int round = 0; round < 24; ++round) {
    SCOPED_TRACE(round);
    const std::vector<IVec3> changed = change_both(random, round, grid, plain);
    const int reach = static_cast<int>(random() % 65);
    EXPECT_EQ(follower.take(grid, reach), chunks_reached(changed, reach));
    if (round == 11) grid.compact();
    // By day every second round compares all samples.
    if (is_nightly() || round % 2 == 1) {
      ASSERT_NO_FATAL_FAILURE(expect_that_of(grid, plain));
    }
  }
}

TEST(DensityGrid, IgnoresWritesOfEqualStoredValue) {
  DensityGrid grid;
  EXPECT_TRUE(grid.set({1, 2, 3}, {-0.5F, 2}));
  ChangeFollower follower(grid);
  EXPECT_FALSE(grid.set({1, 2, 3}, {-0.50001F, 2}));
  EXPECT_FALSE(grid.set({1, 2, 4}, {std::nanf(""), 7}));
  EXPECT_FALSE(grid.set({1, 2, 4}, {900.0F, 7}));
  EXPECT_EQ(grid.material({1, 2, 4}), kAir);
  EXPECT_FALSE(follower.is_behind(grid));
  EXPECT_TRUE(follower.take(grid, 9).empty());
  EXPECT_TRUE(grid.set({1, 2, 3}, {-0.5F, 4}));
  EXPECT_EQ(follower.take(grid, 1).size(), 1U);
}

TEST(DensityGrid, DropsMaterialOfFarAir) {
  DensityGrid grid;
  grid.set({0, 0, 0}, {-1.0F, 5});
  grid.set({0, 0, 0}, {9.0F, 5});
  EXPECT_EQ(grid.chunk_count(), 0U);
  grid.set({1, 0, 0}, {-1.0F, 5});
  EXPECT_EQ(grid.material({0, 0, 0}), kAir);
  grid.set({2, 0, 0}, {2.0F, 6});
  EXPECT_EQ(grid.material({2, 0, 0}), 6);
}

TEST(DensityGrid, ReportsDroppedChunkWithNeighbours) {
  DensityGrid grid;
  grid.set({63, 10, 0}, {-1.0F, 1});
  ChangeFollower follower(grid);
  grid.set({63, 10, 0}, {8.0F, 1});
  EXPECT_EQ(grid.chunk_count(), 0U);
  EXPECT_EQ(follower.take(grid, 1), std::vector<IVec3>({{0, 0, -1}, {1, 0, -1}, {0, 0, 0}, {1, 0, 0}}));
  EXPECT_TRUE(follower.take(grid, 1).empty());
}

TEST(DensityGrid, BoundsMemoryOfUnreadChanges) {
  DensityGrid grid;
  for (int i = 0; i < 20; ++i) grid.set({i, 0, 0}, {i % 2 == 0 ? -1.0F : 1.0F, 1});
  const std::size_t bytes = grid.bytes();
  for (int i = 0; i < 20'000; ++i) grid.set({i % 20, 0, 0}, {static_cast<float>(i % 7) - 3.0F, 1});
  EXPECT_EQ(grid.bytes(), bytes);
}

TEST(DensityGrid, ClearReportsAllChunks) {
  DensityGrid grid;
  grid.add_sphere({0, 0, 0}, 70.0, 3);
  grid.set({300, 0, 0}, {1.0F, 0});
  std::vector<IVec3> chunks = grid.chunks();
  ChangeFollower follower(grid);
  grid.clear();
  EXPECT_EQ(grid.chunk_count(), 0U);
  EXPECT_EQ(follower.take(grid, 0), chunks);
  grid.clear();
  EXPECT_FALSE(follower.is_behind(grid));
}

TEST(DensityGrid, SnapshotStaysUnchanged) {
  DensityGrid grid(5.0F);
  grid.add_sphere({10, 10, 10}, 12.0, 2);
  DensityGrid copy = grid.snapshot();
  grid.remove_sphere({10, 10, 10}, 40.0);
  EXPECT_EQ(copy.band(), 5.0F);
  EXPECT_LT(copy.density({10, 10, 10}), 0.0F);
  EXPECT_EQ(copy.material({10, 10, 10}), 2);
  EXPECT_GT(copy.solid_count(), 0);
  EXPECT_EQ(grid.solid_count(), 0);
}

TEST(DensityGrid, KeepsAirAtEndsOfWorld) {
  DensityGrid grid;
  ChangeFollower follower(grid);
  for (const int edge : {kLowest, kHighest}) {
    EXPECT_FALSE(grid.set({edge, 0, 0}, {-1.0F, 1}));
    EXPECT_FALSE(grid.set({0, 0, edge}, {-1.0F, 1}));
    EXPECT_EQ(grid.density({edge, edge, edge}), 8.0F);
  }
  grid.put_chunk(chunk_of({kLowest, 0, 0}), chunk_of_plane(5.0, 1));
  EXPECT_EQ(grid.chunk_count(), 0U);
  EXPECT_TRUE(grid.set({kLowest + 64, 0, 0}, {-1.0F, 1}));
  EXPECT_EQ(follower.take(grid, 1).size(), 8U);
  EXPECT_EQ(grid.neighbourhood(chunk_of({kLowest, 0, 0})).get({64, 0, 0}), stored_density(-1.0F, 8.0F));
}

TEST(DensityGrid, RecordsEditsMadeBeforeAnException) {
  DensityGrid grid;
  ChangeFollower follower(grid);
  const auto pick = [](IVec3 p, DensitySample) -> DensitySample {
    if (p.y == 7) throw std::runtime_error("stop");
    return {-1.0F, 1};
  };
  EXPECT_THROW(grid.edit({{0, 0, 0}, {9, 9, 9}}, pick), std::runtime_error);
  EXPECT_EQ(grid.density({0, 0, 0}), -1.0F);
  EXPECT_EQ(follower.take(grid, 0), std::vector<IVec3>({{0, 0, 0}}));
}

TEST(DensityGrid, EditVisitsEverySampleOnceInOrder) {
  DensityGrid grid;
  std::vector<IVec3> visited;
  grid.edit({{62, -1, 0}, {66, 1, 2}}, [&](IVec3 p, DensitySample current) {
    visited.push_back(p);
    return current;
  });
  EXPECT_EQ(visited.size(), 16U);
  EXPECT_EQ(visited[0], IVec3(62, -1, 0));
  EXPECT_EQ(visited[1], IVec3(63, -1, 0));
  EXPECT_EQ(visited[2], IVec3(62, -1, 1));
  EXPECT_EQ(visited[4], IVec3(64, -1, 0));
  EXPECT_EQ(visited[8], IVec3(62, 0, 0));
  EXPECT_EQ(grid.chunk_count(), 0U);
}

TEST(DensityGrid, PutChunkCountsChangedSamples) {
  DensityGrid grid;
  DensityChunk chunk(stored_density(grid.band(), grid.band()));
  EXPECT_EQ(grid.put_chunk(IVec3(0), chunk), 0) << "far air";
  std::array<Half, kChunkEdge> row;
  row.fill(stored_density(grid.band(), grid.band()));
  row[9] = row[10] = stored_density(-1.0F, grid.band());
  chunk.write_row(3, 4, row);
  EXPECT_EQ(grid.put_chunk(IVec3(0), chunk), 2);
  EXPECT_EQ(grid.put_chunk(IVec3(0), chunk), 0);
  chunk.materials().set(9, 3, 4, 7);
  EXPECT_EQ(grid.put_chunk(IVec3(0), chunk), 1);
  EXPECT_EQ(grid.put_chunk(IVec3(1 << 30, 0, 0), chunk), 0) << "beyond the world";
}

}  // namespace
}  // namespace quoin
