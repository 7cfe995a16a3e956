#include <quoin/grid/grid.h>

#include <array>
#include <limits>
#include <map>
#include <new>
#include <random>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "grid/change_follower_for_tests.h"

namespace quoin {
namespace {

TEST(Grid, VoxelMinusOneLiesInChunkMinusOne) {
  EXPECT_EQ(chunk_of({-1, 0, 64}), IVec3(-1, 0, 1));
  EXPECT_EQ(local_of({-1, 0, 64}), IVec3(63, 0, 0));
  Grid grid;
  EXPECT_TRUE(grid.set({-1, -65, 63}, 4));
  EXPECT_EQ(grid.get({-1, -65, 63}), 4);
  EXPECT_NE(grid.find_chunk({-1, -2, 0}), nullptr);
  EXPECT_EQ(grid.voxel_count(), 1);
  EXPECT_EQ(grid.bounds(), (IBox{{-1, -65, 63}, {0, -64, 64}}));
}

// A point is not a voxel: its coordinates would be truncated towards 0.
template <class Place>
constexpr bool takes_any_of(Place) {
  return requires(Grid& grid, Place at) { grid.get(at); } || requires(Grid& grid, Place at) { grid.set(at, 1); } ||
         requires(Grid& grid, Place at) { grid.data(at); } ||
         requires(Grid& grid, Place at) { grid.set_data(at, {}); } ||
         requires(Grid& grid, Place at) { grid.set(at, 1, {}); } ||
         requires(Grid& grid, Place at) { grid.find_chunk(at); } ||
         requires(Grid& grid, Place at) { grid.neighbourhood(at); } ||
         requires(Grid& grid, Place at) { grid.is_loaded(at); } || requires(Place at) { chunk_of(at); };
}
static_assert(takes_any_of(IVec3{}));
static_assert(!takes_any_of(DVec3{}) && !takes_any_of(Vec3{}));

TEST(Grid, DropsChunkWhenLastVoxelIsErased) {
  Grid grid;
  grid.set({3, 3, 3}, 1);
  EXPECT_EQ(grid.chunk_count(), 1U);
  EXPECT_TRUE(grid.set({3, 3, 3}, kAir));
  EXPECT_EQ(grid.chunk_count(), 0U);
  EXPECT_TRUE(grid.bounds().empty());
}

TEST(Grid, MatchesMapUnderRandomEdits) {
  std::mt19937 random(7);
  Grid grid;
  std::map<std::tuple<int, int, int>, VoxelType> plain;
  const auto near = [&] { return static_cast<int>(random() % 200) - 100; };
  const auto put = [&](IVec3 v, VoxelType type) {
    VoxelType& voxel = plain[{v.x, v.y, v.z}];
    const bool changed = voxel != type;
    voxel = type;
    return changed;
  };
  for (int round = 0; round < 60; ++round) {
    const auto type = static_cast<VoxelType>(random() % 5);
    const IVec3 a{near(), near(), near()};
    std::int64_t changed = 0;
    switch (round % 3) {
      case 0: {
        const IVec3 b = a + IVec3{static_cast<int>(random() % 30), static_cast<int>(random() % 30), 70};
        for (int z = a.z; z <= b.z; ++z) {
          for (int y = a.y; y <= b.y; ++y) {
            for (int x = a.x; x <= b.x; ++x) changed += put({x, y, z}, type);
          }
        }
        EXPECT_EQ(grid.fill_box({a, b + 1}, type), changed);
        EXPECT_EQ(grid.fill_box({b + 1, a}, type == 0 ? VoxelType{1} : kAir), 0);
        break;
      }
      case 1: {
        const DVec3 centre = DVec3(a) + 0.3;
        const double radius = static_cast<double>(random() % 120) / 10.0;
        for (int z = a.z - 14; z <= a.z + 14; ++z) {
          for (int y = a.y - 14; y <= a.y + 14; ++y) {
            for (int x = a.x - 14; x <= a.x + 14; ++x) {
              const DVec3 d = DVec3(x, y, z) + 0.5 - centre;
              if (d.x * d.x + d.y * d.y + d.z * d.z <= radius * radius) changed += put({x, y, z}, type);
            }
          }
        }
        EXPECT_EQ(grid.fill_sphere(centre, radius, type), changed);
        break;
      }
      default: {
        const auto pick = [&](IVec3 v, VoxelType current) {
          return static_cast<VoxelType>((static_cast<unsigned>(v.x * 7 + v.y * 3 + v.z) + current + type) % 4);
        };
        const IBox box{a, a + IVec3{20, 5, 9}};
        for (int z = box.min.z; z < box.max.z; ++z) {
          for (int y = box.min.y; y < box.max.y; ++y) {
            for (int x = box.min.x; x < box.max.x; ++x) changed += put({x, y, z}, pick({x, y, z}, plain[{x, y, z}]));
          }
        }
        EXPECT_EQ(grid.edit(box, pick), changed);
      }
    }
  }
  std::int64_t count = 0;
  IBox bounds;
  for (const auto& [at, type] : plain) {
    const auto [x, y, z] = at;
    ASSERT_EQ(grid.get({x, y, z}), type);
    if (type == kAir) continue;
    ++count;
    bounds = unite(bounds, {{x, y, z}, {x + 1, y + 1, z + 1}});
  }
  EXPECT_EQ(grid.voxel_count(), count);
  EXPECT_EQ(grid.bounds(), bounds);
  std::int64_t visited = 0;
  grid.for_each([&](IVec3 v, VoxelType type) {
    ++visited;
    EXPECT_EQ((plain[{v.x, v.y, v.z}]), type);
  });
  EXPECT_EQ(visited, count);
  const Grid copy = grid.snapshot();
  EXPECT_EQ(copy.voxel_count(), count);
}

TEST(Grid, CornerEditReportsSevenNeighbours) {
  Grid grid;
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) grid.set(IVec3{x, y, z} * 64 + 32, 1);
    }
  }
  ChangeFollower follower(grid);
  grid.set({32, 32, 33}, 2);
  EXPECT_EQ(follower.take(grid), std::vector<IVec3>({{0, 0, 0}}));
  grid.set({63, 63, 63}, 2);
  EXPECT_EQ(follower.take(grid).size(), 8U);
  grid.set({0, 63, 32}, 2);
  EXPECT_EQ(follower.take(grid), std::vector<IVec3>({{-1, 0, 0}, {0, 0, 0}, {-1, 1, 0}, {0, 1, 0}}));
  grid.set({0, 63, 32}, 2);
  EXPECT_TRUE(follower.take(grid).empty());
}

TEST(Grid, SphereSparesUntouchedDiagonalNeighbour) {
  Grid grid;
  for (int y = 0; y <= 1; ++y) {
    for (int x = 0; x <= 1; ++x) grid.set(IVec3{x * 64 + 32, y * 64 + 32, 5}, 1);
  }
  ChangeFollower follower(grid);
  grid.fill_sphere({54.0, 54.0, 32.0}, 10.0, 2);
  EXPECT_EQ(follower.take(grid), std::vector<IVec3>({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
}

TEST(Grid, HugeAirFillVisitsOnlyExistingChunks) {
  Grid grid;
  grid.set({5, 5, 5}, 1);
  constexpr int kLow = std::numeric_limits<int>::min();
  constexpr int kHigh = std::numeric_limits<int>::max();
  EXPECT_EQ(grid.fill_box({IVec3(kLow), IVec3(kHigh)}, kAir), 1);
  EXPECT_EQ(grid.chunk_count(), 0U);
}

TEST(Grid, KeepsOutermostChunksAir) {
  Grid grid;
  constexpr int kHigh = std::numeric_limits<int>::max();
  EXPECT_FALSE(grid.set({kHigh, 0, 0}, 1));
  EXPECT_FALSE(grid.set({0, std::numeric_limits<int>::min(), 0}, 1));
  EXPECT_EQ(grid.fill_box({{kHigh - 100, 0, 0}, {kHigh, 1, 1}}, 1), 37);
  EXPECT_EQ(grid.neighbourhood(chunk_of({kHigh - 64, 0, 0})).at(1, 0, 0), nullptr);
}

TEST(Grid, IgnoresInvalidSpheres) {
  Grid grid;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(grid.fill_sphere({nan, 0, 0}, 3.0, 1), 0);
  EXPECT_EQ(grid.fill_sphere({0, 0, 0}, nan, 1), 0);
  EXPECT_EQ(grid.fill_sphere({0, 0, 0}, -1.0, 1), 0);
  EXPECT_EQ(grid.fill_sphere({1e300, 0, 0}, 3.0, 1), 0);
}

TEST(Grid, PutChunkReportsOnlyDifferences) {
  Grid grid;
  Chunk first;
  first.set(0, 0, 0, 1);
  grid.put_chunk({2, 0, 0}, first);
  ChangeFollower follower(grid);
  grid.put_chunk({2, 0, 0}, first);
  EXPECT_FALSE(follower.is_behind(grid));
  EXPECT_TRUE(follower.take(grid).empty());
  grid.put_chunk({2, 0, 0}, Chunk());
  EXPECT_EQ(grid.chunk_count(), 0U);
  EXPECT_EQ(follower.take(grid).size(), 1U);
}

TEST(Grid, NewChunkReportsOnlyReachedNeighbours) {
  Grid grid;
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        if (IVec3{x, y, z} != IVec3{0}) grid.set(IVec3{x, y, z} * 64 + 32, 1);
      }
    }
  }
  ChangeFollower follower(grid);
  Chunk inner;
  inner.set(30, 30, 30, 1);
  grid.put_chunk({0, 0, 0}, inner);
  EXPECT_EQ(follower.take(grid), std::vector<IVec3>({{0, 0, 0}}));
  Chunk with_side = inner;
  with_side.set(63, 20, 20, 1);
  grid.put_chunk({0, 0, 0}, with_side);
  EXPECT_EQ(follower.take(grid), std::vector<IVec3>({{0, 0, 0}, {1, 0, 0}}));
}

/// Returns the chunks that contain a changed voxel of the box or one of its 26 neighbours.
std::vector<IVec3> reached_chunks(const Grid& before, const Grid& after, const IBox& box) {
  std::set<std::tuple<int, int, int>> found;  // z, y, x: the order of chunks_to_mesh
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      for (int x = box.min.x; x < box.max.x; ++x) {
        if (before.get({x, y, z}) == after.get({x, y, z})) continue;
        for (int i = 0; i < 27; ++i) {
          const IVec3 chunk = chunk_of(IVec3{x, y, z} + Neighbourhood::offset(i));
          if (before.find_chunk(chunk) != nullptr) found.insert({chunk.z, chunk.y, chunk.x});
        }
      }
    }
  }
  std::vector<IVec3> chunks;
  for (const auto& [z, y, x] : found) chunks.emplace_back(x, y, z);
  return chunks;
}

TEST(Grid, EditsReportExactlyTheReachedNeighbours) {
  std::mt19937 random(3);
  Grid grid;
  grid.fill_box({{-100, -100, -100}, {101, 101, 101}}, 1);
  ChangeFollower follower(grid);
  const auto near = [&] { return static_cast<int>(random() % 5) * 32 - 66 + static_cast<int>(random() % 5); };
  for (int round = 0; round < 60; ++round) {
    const Grid before = grid.snapshot();
    const IVec3 a{near(), near(), near()};
    const auto type = static_cast<VoxelType>(random() % 3);
    const int extent = static_cast<int>(random() % 6);
    switch (round % 4) {
      case 0:
        grid.fill_box({a, a + extent + 1}, type);
        break;
      case 1:
        grid.fill_sphere(DVec3(a), extent, type);
        break;
      case 2:
        grid.edit({a, a + extent}, [&](IVec3 v, VoxelType t) { return (v.x + v.y) % 3 == 0 ? type : t; });
        break;
      default: {
        Chunk copy = *grid.find_chunk(chunk_of(a));
        copy.set(local_of(a), type);
        grid.put_chunk(chunk_of(a), std::move(copy));
      }
    }
    EXPECT_EQ(follower.take(grid), reached_chunks(before, grid, {a - 7, a + 8})) << "round " << round;
  }
}

TEST(Grid, ReportsEditThatThrows) {
  Grid grid;
  grid.set({1, 1, 1}, 1);
  grid.set({64, 1, 1}, 1);
  ChangeFollower follower(grid);
  const auto pick = [](IVec3 v, VoxelType) {
    if (v.y == 5) throw std::bad_alloc();
    return VoxelType{2};
  };
  EXPECT_THROW(grid.edit({{0, 0, 0}, {64, 64, 64}}, pick), std::bad_alloc);
  EXPECT_EQ(grid.get({63, 4, 0}), 2);
  EXPECT_EQ(follower.take(grid), std::vector<IVec3>({{0, 0, 0}, {1, 0, 0}}));
}

// An edit creates and frees the storage of a chunk.
TEST(Grid, EditCallbackMayReadGrid) {
  Grid grid;
  const IBox box{{0, 0, 0}, {64, 64, 64}};
  const auto below = [&grid](IVec3 v) { return grid.get(v - IVec3{0, 1, 0}); };
  for (const VoxelType seed : {VoxelType{7}, VoxelType{9}, kAir}) {
    grid.fill_box({{0, -1, 0}, {64, 0, 64}}, seed);
    // Starts mixed and ends uniform, and the reverse.
    if (seed != kAir) grid.set({5, 6, 7}, 3);
    grid.edit(box, [&](IVec3 v, VoxelType) { return below(v); });
    EXPECT_EQ(grid.get({63, 63, 63}), seed);
    EXPECT_EQ(grid.get({5, 6, 7}), seed);
    EXPECT_EQ(grid.find_chunk({0, 0, 0}) == nullptr, seed == kAir);
  }
}

TEST(Grid, BoundsJournalOfRecurringChunks) {
  Grid grid;
  for (int i = 0; i < 100'000; ++i) grid.set({i % 3 * 64, 0, 0}, static_cast<VoxelType>(i / 3 % 2));
  EXPECT_LT(grid.bytes(), 32'768U) << "nobody follows";
  ChangeCursor late = grid.cursor();
  for (int i = 0; i < 100'000; ++i) grid.set({i % 3 * 64, 0, 0}, static_cast<VoxelType>(i / 3 % 2));
  EXPECT_LT(grid.bytes(), 600'000U);
  EXPECT_TRUE(grid.changes_since(late).all) << "so far behind";
  grid.set({0, 0, 0}, 5);
  EXPECT_EQ(grid.changes_since(late).items_unless_all().size(), 1U);
}

TEST(Grid, EditsCornersOfWorld) {
  constexpr int kLow = std::numeric_limits<int>::min() + 64;
  constexpr int kHigh = std::numeric_limits<int>::max() - 64;
  for (const int x : {kLow, kHigh}) {
    for (const int z : {kLow, kHigh}) {
      Grid grid;
      EXPECT_TRUE(grid.set({x, 0, z}, 1));
      EXPECT_EQ(grid.get({x, 0, z}), 1);
      EXPECT_EQ(grid.bounds(), (IBox{{x, 0, z}, {x + 1, 1, z + 1}}));
      EXPECT_EQ(grid.fill_sphere({x + 0.5, 0.5, z + 0.5}, 1.0, 2), 5);
      EXPECT_EQ(grid.edit({{x, 0, z}, {x + 1, 1, z + 1}}, [](IVec3, VoxelType) { return VoxelType{3}; }), 1);
      int visited = 0;
      grid.for_each([&](IVec3, VoxelType) { ++visited; });
      EXPECT_EQ(visited, 5);
    }
  }
}

TEST(Grid, MovesJournalWithVoxels) {
  Grid grid;
  ChangeCursor cursor = grid.cursor();
  grid.set({1, 2, 3}, 1);
  Grid other = std::move(grid);
  EXPECT_EQ(other.changes_since(cursor).items_unless_all().size(), 1U);
  EXPECT_TRUE(other.changes_since(cursor).empty());
  other = Grid();
  EXPECT_TRUE(other.changes_since(cursor).all);
}

}  // namespace
}  // namespace quoin
