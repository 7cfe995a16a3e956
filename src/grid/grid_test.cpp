#include <quoin/grid/grid.h>

#include <limits>
#include <map>
#include <random>
#include <tuple>

#include <gtest/gtest.h>

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

TEST(Grid, SettingAirErasesAndDropsTheChunk) {
  Grid grid;
  grid.set({3, 3, 3}, 1);
  EXPECT_EQ(grid.chunk_count(), 1U);
  EXPECT_TRUE(grid.set({3, 3, 3}, kAir));
  EXPECT_EQ(grid.chunk_count(), 0U);
  EXPECT_TRUE(grid.bounds().empty());
}

TEST(Grid, AgreesWithAMapUnderRandomEdits) {
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
        EXPECT_EQ(grid.fill_box(b, a, type), changed);
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
  const Grid copy = grid.clone();
  EXPECT_EQ(copy.voxel_count(), count);
}

TEST(Grid, EditOfACornerDirtiesSevenNeighboursThatExist) {
  Grid grid;
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) grid.set(IVec3{x, y, z} * 64 + 32, 1);
    }
  }
  grid.take_dirty();
  const std::uint64_t before = grid.neighbourhood_version({1, 1, 1});
  grid.set({32, 32, 33}, 2);
  EXPECT_EQ(grid.take_dirty(), std::vector<IVec3>({{0, 0, 0}}));
  EXPECT_EQ(grid.neighbourhood_version({1, 1, 1}), before);
  grid.set({63, 63, 63}, 2);
  EXPECT_EQ(grid.take_dirty().size(), 8U);
  EXPECT_GT(grid.neighbourhood_version({1, 1, 1}), before);
  EXPECT_EQ(grid.version({1, 1, 1}), before);
  grid.set({0, 63, 32}, 2);
  EXPECT_EQ(grid.take_dirty(), std::vector<IVec3>({{-1, 0, 0}, {0, 0, 0}, {-1, 1, 0}, {0, 1, 0}}));
  grid.set({0, 63, 32}, 2);
  EXPECT_TRUE(grid.take_dirty().empty());
}

TEST(Grid, SphereThatTouchesTwoSidesButNotTheirEdgeSparesTheDiagonalNeighbour) {
  Grid grid;
  for (int y = 0; y <= 1; ++y) {
    for (int x = 0; x <= 1; ++x) grid.set(IVec3{x * 64 + 32, y * 64 + 32, 5}, 1);
  }
  grid.take_dirty();
  grid.fill_sphere({54.0, 54.0, 32.0}, 10.0, 2);
  EXPECT_EQ(grid.take_dirty(), std::vector<IVec3>({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
}

TEST(Grid, HugeFillsOfAirCostOnlyWhatIsThere) {
  Grid grid;
  grid.set({5, 5, 5}, 1);
  constexpr int kLow = std::numeric_limits<int>::min();
  constexpr int kHigh = std::numeric_limits<int>::max();
  EXPECT_EQ(grid.fill_box({kLow, kLow, kLow}, {kHigh, kHigh, kHigh}, kAir), 1);
  EXPECT_EQ(grid.chunk_count(), 0U);
}

TEST(Grid, TheOutermostChunksStayAir) {
  Grid grid;
  constexpr int kHigh = std::numeric_limits<int>::max();
  EXPECT_FALSE(grid.set({kHigh, 0, 0}, 1));
  EXPECT_FALSE(grid.set({0, std::numeric_limits<int>::min(), 0}, 1));
  EXPECT_EQ(grid.fill_box({kHigh - 100, 0, 0}, {kHigh, 0, 0}, 1), 37);
  EXPECT_EQ(grid.neighbourhood(chunk_of({kHigh - 64, 0, 0})).at(1, 0, 0), nullptr);
}

TEST(Grid, BadSpheresChangeNothing) {
  Grid grid;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(grid.fill_sphere({nan, 0, 0}, 3.0, 1), 0);
  EXPECT_EQ(grid.fill_sphere({0, 0, 0}, nan, 1), 0);
  EXPECT_EQ(grid.fill_sphere({0, 0, 0}, -1.0, 1), 0);
  EXPECT_EQ(grid.fill_sphere({1e300, 0, 0}, 3.0, 1), 0);
}

TEST(Grid, PuttingAChunkBooksOnlyWhatDiffers) {
  Grid grid;
  Chunk first;
  first.set(0, 0, 0, 1);
  grid.put_chunk({2, 0, 0}, first);
  const std::uint64_t version = grid.version({2, 0, 0});
  grid.take_dirty();
  grid.put_chunk({2, 0, 0}, first);
  EXPECT_EQ(grid.version({2, 0, 0}), version);
  EXPECT_TRUE(grid.take_dirty().empty());
  grid.put_chunk({2, 0, 0}, Chunk());
  EXPECT_EQ(grid.chunk_count(), 0U);
  EXPECT_EQ(grid.take_dirty().size(), 1U);
}

TEST(GridReader, ReadsAsTheGridDoes) {
  Grid grid;
  grid.fill_sphere({0, 0, 0}, 20.0, 3);
  GridReader reader(grid);
  for (int x = -70; x < 70; ++x) EXPECT_EQ(reader.get({x, 0, 0}), grid.get({x, 0, 0}));
}

}  // namespace
}  // namespace quoin
