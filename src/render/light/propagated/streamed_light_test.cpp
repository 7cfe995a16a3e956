#include <quoin/render/propagated_light.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/scene/scene.h>

#include "core/work/nightly_for_tests.h"
namespace quoin {
namespace {

constexpr VoxelType kHillStone = 1, kHillLamp = 2, kHillGlass = 3, kHillWater = 4, kHillLeaves = 5, kHillStairs = 6;
constexpr int kWide = 3;                                          // chunks of land along x and z
constexpr int kHigh = 3;                                          // chunks of land along y
constexpr IBox kAround{{-1, -3, -1}, {kWide + 1, 7, kWide + 1}};  // chunks to compare

VoxelRegistry stream_types() {
  VoxelRegistry types;
  VoxelProperties properties;
  EXPECT_TRUE(types.add(properties));
  properties.colour = {255, 200, 40, 255};
  properties.emission = 1.0F;
  EXPECT_TRUE(types.add(properties));
  properties.emission = 0.0F;
  properties.visibility = Visibility::Transparent;
  EXPECT_TRUE(types.add(properties));
  return types;
}

/// As `stream_types`, and water, leaves and stairs; windows cost light.
VoxelRegistry costly_stream_types() {
  VoxelRegistry types = stream_types();
  VoxelProperties properties = types[kHillGlass];
  properties.light_cost = 1;
  types.replace(kHillGlass, properties);
  EXPECT_TRUE(types.add(properties));
  properties.light_cost = 3;
  EXPECT_TRUE(types.add(properties));
  properties.light_cost = 0;
  properties.blocks_light = true;
  EXPECT_TRUE(types.add(properties));
  return types;
}

/// Hills with caves, shafts, windows and lamps. `has_sea`: there is water in the lower caves and shafts; and leaves and
/// stairs on and in the hills.
Chunk land(IVec3 chunk, bool has_sea = false) {
  const IVec3 low = chunk * kChunkEdge;
  const auto wave = [](int at, double length) { return std::sin(at / length); };
  std::vector<VoxelType> dense(kChunkVoxels, kAir);
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const double cave_yz = wave(low.y + y, 9.0) + wave(low.z + z, 13.0);
      for (int x = 0; x < kChunkEdge; ++x) {
        const IVec3 at = low + IVec3(x, y, z);
        const double height = 110.0 + 50.0 * wave(at.x, 37.0) * wave(at.z, 29.0);
        const bool is_shaft = at.x % 50 == 20 && at.z % 40 == 11 && at.y > 8;
        const std::uint32_t dice =
            static_cast<std::uint32_t>(at.x * 7919 + at.y * 104'729 + at.z * 1'299'709) * 2'654'435'761U >> 16;
        VoxelType& type = dense[static_cast<std::size_t>(x + kChunkEdge * (y + kChunkEdge * z))];
        if (at.y >= height || is_shaft || std::abs(wave(at.x, 11.0) + cave_yz) < 0.3) {
          if (has_sea && at.y < 100) type = dice % 53 == 0 ? kHillStairs : kHillWater;
          if (has_sea && at.y >= height && at.y < height + 3.0 && dice % 3 != 0) type = kHillLeaves;
          continue;
        }
        type = dice % 997 == 0 ? kHillLamp : dice % 31 == 0 ? kHillGlass : kHillStone;
        if (has_sea && dice % 37 == 0) type = kHillStairs;
      }
    }
  }
  return Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(dense));
}

using Part = std::pair<IVec3, Chunk>;

/// Land, then air above it up to `high` chunks.
const std::vector<Part>& parts_of_land(bool has_sea = false) {
  const auto make = [](bool with_sea) {
    std::vector<Part> made;
    for (int z = 0; z < kWide; ++z) {
      for (int x = 0; x < kWide; ++x) {
        for (int y = 0; y < kHigh; ++y) made.emplace_back(IVec3(x, y, z), land({x, y, z}, with_sea));
      }
    }
    return made;
  };
  static const std::array<std::vector<Part>, 2> parts{make(false), make(true)};
  return parts[has_sea ? 1 : 0];
}
std::vector<Part> world(int high, bool has_sea = false) {
  std::vector<Part> parts = parts_of_land(has_sea);
  for (int z = 0; z < kWide; ++z) {
    for (int x = 0; x < kWide; ++x) {
      for (int y = kHigh; y < high; ++y) parts.emplace_back(IVec3(x, y, z), Chunk());
    }
  }
  return parts;
}

struct Order {
  std::string name;
  std::function<int(IVec3)> rank;  // empty: random
};
std::vector<Order> orders() {
  const auto distance = [](IVec3 c) {
    const IVec3 d = c - IVec3(1, 1, 2);
    return d.x * d.x + d.y * d.y + d.z * d.z;
  };
  return {{"near to far", distance},
          {"far to near", [distance](IVec3 c) { return -distance(c); }},
          {"bottom-up", [](IVec3 c) { return c.y; }},
          {"top-down", [](IVec3 c) { return -c.y; }},
          {"by columns", [](IVec3 c) { return c.x + kWide * c.z; }},
          {"by columns from above", [](IVec3 c) { return 100 * (c.x + kWide * c.z) - c.y; }},
          {"random", {}}};
}
std::vector<Part> sorted(std::vector<Part> parts, const Order& order) {
  std::mt19937 random(3);
  std::shuffle(parts.begin(), parts.end(), random);
  if (order.rank) {
    std::stable_sort(parts.begin(), parts.end(),
                     [&](const Part& a, const Part& b) { return order.rank(a.first) < order.rank(b.first); });
  }
  return parts;
}

/// Loads the parts into a partial grid, with an update after each `step` of them. Calls `after()` after each update.
template <class After>
void stream(const std::vector<Part>& parts, std::size_t step, Grid& grid, PropagatedLight& light,
            const VoxelRegistry& types, After&& after) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    EXPECT_TRUE(grid.load_chunk(parts[i].first, parts[i].second));
    if ((i + 1) % step != 0 && i + 1 < parts.size()) continue;
    light.update(grid, types, {1});
    after();
  }
}

void expect_equal(const PropagatedLight& light, const PropagatedLight& expected) {
  std::array<std::uint16_t, kChunkEdge> row;
  std::array<std::uint16_t, kChunkEdge> expected_row;
  for (int z = kAround.min.z * kChunkEdge; z < kAround.max.z * kChunkEdge; ++z) {
    for (int y = kAround.min.y * kChunkEdge; y < kAround.max.y * kChunkEdge; ++y) {
      for (int x = kAround.min.x; x < kAround.max.x; ++x) {
        const IVec3 voxel{x * kChunkEdge, y, z};
        light.read_row(voxel, row);
        expected.read_row(voxel, expected_row);
        ASSERT_EQ(row, expected_row) << voxel.x << ' ' << y << ' ' << z;
      }
    }
  }
}

void expect_fresh(const PropagatedLight& light, const Grid& grid, const VoxelRegistry& types) {
  PropagatedLight fresh;
  fresh.update(grid, types, {1});
  expect_equal(light, fresh);
}

// Returns the light of land that is there at once.
PropagatedLight light_at_once(const VoxelRegistry& types, bool has_sea = false) {
  Grid whole;
  for (const Part& part : world(kHigh, has_sea)) whole.put_chunk(part.first, part.second);
  PropagatedLight light;
  light.update(whole, types, {1});
  return light;
}

TEST(StreamedLight, EqualsLightAtOnceInAnyOrder) {
  const VoxelRegistry types = stream_types();
  const PropagatedLight once = light_at_once(types);
  std::size_t tried = 0;
  for (const Order& order : orders()) {
    for (const std::size_t step : {1, 6, 100}) {
      if (tried++ % 2 != 0 && !is_nightly()) continue;
      SCOPED_TRACE(order.name + ", " + std::to_string(step) + " chunks per update");
      Grid grid;
      grid.make_partial();
      PropagatedLight light;
      std::size_t updates = 0;
      stream(sorted(world(6), order), step, grid, light, types, [&] {
        if (++updates == 4) expect_fresh(light, grid, types);
      });
      expect_equal(light, once);
      EXPECT_LE(light.bytes(), once.bytes() + once.bytes() / 50);
      if (::testing::Test::HasFatalFailure()) return;
    }
  }
}

TEST(StreamedLight, EqualsLightAtOnceWithTypesThatCostLight) {
  const VoxelRegistry types = costly_stream_types();
  const PropagatedLight once = light_at_once(types, true);
  std::size_t step = 1;
  for (const Order& order : orders()) {
    SCOPED_TRACE(order.name);
    Grid grid;
    grid.make_partial();
    PropagatedLight light;
    stream(sorted(world(5, true), order), step, grid, light, types, [] {});
    expect_equal(light, once);
    if (::testing::Test::HasFatalFailure()) return;
    step = step % 6 + 2;
  }
}

// Chunks of land, caves open on all sides, plates and air come and go in a box of 3x6x3 chunks. Voxels change between.
TEST(StreamedLight, FollowsChunksThatComeAndGoAndEditsBetween) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE(seed);
    const bool has_sea = seed >= 3;
    const VoxelRegistry types = has_sea ? costly_stream_types() : stream_types();
    std::mt19937 random(seed);
    const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    Grid grid;
    grid.make_partial();
    PropagatedLight light;
    for (int step = 0; step < cases(20, 40); ++step) {
      for (int i = below(seed < 2 ? 2 : 9); i >= 0; --i) {
        const IVec3 chunk{below(kWide), below(6) - 1, below(kWide)};
        const IVec3 low = chunk * kChunkEdge;
        if (below(3) == 0) {
          grid.unload_chunk(chunk);
        } else if (below(4) > 0) {
          const int kind = below(5);
          Chunk voxels = kind == 0  ? Chunk(kHillStone)
                         : kind < 3 ? land({chunk.x, below(kHigh), chunk.z}, has_sea)
                                    : Chunk();
          if (kind == 3) {
            for (int x = 0; x < kChunkEdge; ++x) {
              for (int z = 0; z < kChunkEdge; ++z) voxels.set({x, 30, z}, x % 9 == z % 7 ? kHillGlass : kHillStone);
            }
          }
          grid.load_chunk(chunk, std::move(voxels));
        } else if (below(2) == 0) {
          grid.fill_sphere(DVec3(low + IVec3(below(64), below(64), below(64))), 3.0 + below(20), kAir);
        } else {
          grid.set(low + IVec3(below(64), below(64), below(64)), static_cast<VoxelType>(below(has_sea ? 7 : 4)));
        }
      }
      light.update(grid, types, {1 + seed % 2});
      if (step % 10 == 9) expect_fresh(light, grid, types);
      if (::testing::Test::HasFatalFailure()) return;
    }
    for (const IVec3 chunk : grid.loaded_chunks()) {
      grid.unload_chunk(chunk);
      if (below(9) == 0) light.update(grid, types, {1});
    }
    light.update(grid, types, {1});
    expect_fresh(light, grid, types);
    if (::testing::Test::HasFatalFailure()) return;
  }
}

TEST(StreamedLight, LightsEachGridOfSceneAsIfAtOnce) {
  Scene scene;
  scene.types = stream_types();
  const std::array<GridHandle, 2> grids{scene.add_grid({}), scene.add_grid({})};
  for (const GridHandle grid : grids) scene.edit(grid).grid.make_partial();
  SceneLight light;
  const std::vector<Part> first = sorted(world(4), orders()[0]);
  const std::vector<Part> second = sorted(world(4), orders().back());
  for (std::size_t i = 0; i < first.size(); ++i) {
    scene.edit(grids[0]).grid.load_chunk(first[i].first, first[i].second);
    scene.edit(grids[1]).grid.load_chunk(second[i].first, second[i].second);
    if (i % 5 == 0) light.update(scene, {1});
  }
  light.update(scene, {1});
  for (const GridHandle grid : grids) expect_fresh(*light.of(grid).light, scene.grids()[grid].grid, scene.types);
}

// Each load of air costs nothing, however high it is, next to land and above it.
TEST(StreamedLight, VisitsNothingForAir) {
  const VoxelRegistry types = stream_types();
  Grid grid;
  grid.make_partial();
  PropagatedLight light;
  stream(parts_of_land(), 1, grid, light, types, [] {});
  const std::uint64_t before = light.visited_rows();
  ChangeCursor cursor;
  static_cast<void>(light.changes_since(cursor));
  for (const IVec3 chunk : {IVec3(0, 3, 0), IVec3(1, 9, 1), IVec3(-1, 0, 0), IVec3(2, -1, 2), IVec3(900, 4, 0)}) {
    EXPECT_TRUE(grid.load_chunk(chunk, Chunk()));
    light.update(grid, types, {1});
    EXPECT_TRUE(grid.unload_chunk(chunk));
    light.update(grid, types, {1});
  }
  EXPECT_EQ(light.visited_rows(), before);
  EXPECT_TRUE(light.changes_since(cursor).empty());
}

// Counts rows of voxels, which no other load of the machine changes.
TEST(StreamedLight, VisitsAtMostThreeTimesAsMuchAsAtOnce) {
  const VoxelRegistry types = stream_types();
  const PropagatedLight once = light_at_once(types);
  for (const Order& order : orders()) {
    for (const std::size_t step : {1, 8, 32}) {
      for (const int high : {kHigh, 12}) {
        Grid grid;
        grid.make_partial();
        PropagatedLight light;
        stream(sorted(world(high), order), step, grid, light, types, [] {});
        EXPECT_LE(light.visited_rows(), 3 * once.visited_rows())
            << order.name << ", " << step << " chunks per update, air up to chunk " << high;
      }
    }
  }
}

}  // namespace
}  // namespace quoin
