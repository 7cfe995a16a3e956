#include <quoin/terrain/terrain.h>

#include <array>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"
#include "terrain/landform.h"
#include "terrain/noise_lattice.h"
#include "terrain/terrain_parts.h"

namespace quoin {
namespace {

struct World {
  VoxelRegistry registry;
  TerrainTypes types = add_terrain_types(registry).value();
};

Grid make(const TerrainOptions& options, Threads threads = {1}) {
  const World world;
  return generate_terrain(options, world.types, threads).value();
}

TerrainOptions options_of(std::uint64_t seed, IVec3 size, int first_x = 0, int first_z = 0) {
  TerrainOptions options;
  options.seed = seed;
  options.size = size;
  options.first_x = first_x;
  options.first_z = first_z;
  return options;
}

std::uint64_t hash_of_voxels(const Grid& grid) {
  std::uint64_t hash = 0xCBF2'9CE4'8422'2325U;
  grid.for_each([&](IVec3 v, VoxelType type) {
    for (const int part : {v.x, v.y, v.z, int{type}}) {
      hash = (hash ^ static_cast<std::uint32_t>(part)) * 0x100'0000'01B3U;
    }
  });
  return hash;
}

// Worlds must be reproducible from a saved seed. A change here changes every world.
TEST(Terrain, IsReproducible) {
  EXPECT_EQ(hash_of_voxels(make(options_of(42, {4, 2, 4}))), 3'554'384'073'062'585'728U);
  EXPECT_EQ(hash_of_voxels(make(options_of(7, {3, 1, 5}))), 14'850'430'397'421'753'799U);
  EXPECT_EQ(hash_of_voxels(make(options_of(1, {3, 4, 3}, -2, -1))), 13'522'174'968'722'041'687U);
  EXPECT_EQ(hash_of_voxels(make(options_of(0x1234'5678'9ABC'DEF0U, {2, 3, 2}, -1'048'576, 1'048'576))),
            874'518'870'833'611'989U);
}

TEST(Terrain, IsTheSameAtAnyThreadCount) {
  const TerrainOptions options = options_of(5, {7, 3, 5}, -3, -2);
  const Grid one = make(options);
  const Grid many = make(options, {4});
  EXPECT_EQ(hash_of_voxels(one), hash_of_voxels(many));
  EXPECT_EQ(one.bytes(), many.bytes());
  EXPECT_EQ(one.chunks(), many.chunks());
}

TEST(Terrain, ChunksFormWholeWorld) {
  const World world;
  const TerrainOptions options = options_of(11, {5, 2, 3}, -3, 1);
  const Grid whole = make(options);
  Grid pieces;
  for (int z = -1; z < 4; ++z) {
    for (int x = -3; x < 3; ++x) {
      for (int y = -1; y < 3; ++y) pieces.put_chunk({x, y, z}, generate_terrain_chunk(options, world.types, {x, y, z}));
    }
  }
  EXPECT_EQ(hash_of_voxels(pieces), hash_of_voxels(whole));
}

TEST(Terrain, StaysInBoxAtAnySize) {
  for (const IVec3 size : {IVec3{1, 1, 1}, IVec3{3, 1, 2}, IVec3{4, 2, 4}, IVec3{1, 8, 3}, IVec3{2, 32, 1}}) {
    const IBox box = make(options_of(42, size, -1, -2)).bounds();
    EXPECT_EQ(box.min, IVec3(-32, 0, -64));
    EXPECT_EQ(box.max.x, (size.x - 1) * 32);
    EXPECT_EQ(box.max.z, (size.z - 2) * 32);
    EXPECT_LE(box.max.y, size.y * 32);
  }
}

// Every column is filled from the floor up, with any plants and rocks; here caves and plants are off.
TEST(Terrain, GroundHasNoHolesWithoutCaves) {
  TerrainOptions options = options_of(42, {4, 2, 4});
  options.caves = options.plants = options.rocks = false;
  const Grid grid = make(options);
  const terrain::Landform land(options);
  for (int z = 0; z < 128; ++z) {
    for (int x = 0; x < 128; ++x) {
      const int top = std::max(land.height(x, z), land.water_level());
      for (int y = 0; y < 64; ++y) ASSERT_EQ(grid.get({x, y, z}) != kAir, y <= top) << x << " " << y << " " << z;
    }
  }
}

TEST(Terrain, PiecesMatchWholeWorld) {
  TerrainOptions options = options_of(9, {4, 2, 2});
  options.plants = options.rocks = false;
  const Grid whole = make(options);
  options.size.x = 1;
  options.first_x = 2;
  const Grid piece = make(options);
  EXPECT_GT(piece.voxel_count(), 10'000);
  piece.for_each([&](IVec3 v, VoxelType type) { ASSERT_EQ(whole.get(v), type); });
}

// Uses seed 42, which also appears in images.
TEST(Terrain, HasRidgesValleysAndEveryMaterial) {
  const World world;
  const TerrainOptions options = options_of(42, {4, 2, 4});
  const Grid grid = make(options);
  EXPECT_EQ(grid.types().size(), world.registry.size() - 1);
  const terrain::Landform land(options);
  int lowest = 64;
  int highest = 0;
  for (int i = 0; i < 128 * 128; ++i) {
    lowest = std::min(lowest, land.height(i % 128, i / 128));
    highest = std::max(highest, land.height(i % 128, i / 128));
  }
  EXPECT_LT(lowest, land.water_level());
  EXPECT_GT(highest - lowest, 36);
}

TEST(Terrain, WaterTouchesAirOnlyAbove) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 42U}) {
    const World world;
    const TerrainOptions options = options_of(seed, {4, 2, 4});
    const Grid grid = make(options);
    const IBox box{{0, 0, 0}, {128, 64, 128}};
    std::int64_t water = 0;
    grid.for_each([&](IVec3 v, VoxelType type) {
      if (type != world.types.water) return;
      ++water;
      for (const IVec3 side : {IVec3{1, 0, 0}, IVec3{-1, 0, 0}, IVec3{0, 0, 1}, IVec3{0, 0, -1}, IVec3{0, -1, 0}}) {
        const IVec3 next = v + side;
        if (!box.contains(next)) continue;
        ASSERT_NE(grid.get(next), kAir) << seed << ": " << v.x << " " << v.y << " " << v.z;
      }
    });
    EXPECT_GT(water, 100);
  }
}

TEST(Terrain, OptionsRemoveFeatures) {
  const World world;
  const auto count = [&](const TerrainOptions& options, VoxelType type) {
    const Grid grid = make(options);
    std::int64_t found = 0;
    grid.for_each([&](IVec3, VoxelType t) { found += t == type; });
    return found;
  };
  TerrainOptions bare = options_of(42, {4, 2, 4});
  EXPECT_GT(count(bare, world.types.trunk), 50);
  EXPECT_GT(count(bare, world.types.rock), 50);
  EXPECT_GT(count(bare, world.types.water), 500);
  const std::int64_t stone_with_caves = count(bare, world.types.stone);
  bare.plants = bare.rocks = bare.water = bare.caves = false;
  for (const VoxelType type : {world.types.trunk, world.types.leaves, world.types.rock, world.types.water}) {
    EXPECT_EQ(count(bare, type), 0);
  }
  EXPECT_GT(count(bare, world.types.stone), stone_with_caves + 2'000);
}

TEST(Terrain, GrassEarthAndStoneComeFirst) {
  World world;
  EXPECT_EQ(world.types.grass, 1);
  EXPECT_EQ(world.types.earth, 2);
  EXPECT_EQ(world.types.stone, 3);
  EXPECT_EQ(world.registry[1].colour, (Rgba8{77, 179, 51, 255}));
  EXPECT_EQ(world.registry[2].colour, (Rgba8{128, 77, 26, 255}));
  EXPECT_EQ(world.registry[3].colour, (Rgba8{128, 128, 128, 255}));
  EXPECT_TRUE(world.registry.is_transparent(world.types.water));
  EXPECT_EQ(add_terrain_types(world.registry).value().rock, world.types.rock) << "found again, not added twice";
}

TEST(Terrain, RejectsInvalidInput) {
  const World world;
  const int least = std::numeric_limits<int>::min();
  const int most = std::numeric_limits<int>::max();
  std::vector<TerrainOptions> wrong;
  for (const IVec3 size : {IVec3{0, 2, 4}, IVec3{4, 0, 4}, IVec3{4, 2, -1}, IVec3{1'025, 1, 1}, IVec3{1, 33, 1},
                           IVec3{1, 1, most}, IVec3{least, 1, 1}}) {
    wrong.push_back(options_of(1, size));
  }
  for (const int first : {least, most, 1'048'577, -1'048'577}) wrong.push_back(options_of(1, {1, 1, 1}, first, 0));
  for (const TerrainOptions& options : wrong) {
    const auto grid = generate_terrain(options, world.types);
    ASSERT_FALSE(grid.has_value());
    EXPECT_EQ(grid.error().code, ErrorCode::InvalidArgument);
  }
}

TEST(Terrain, CanBeCancelled) {
  const World world;
  const auto grid = generate_terrain(options_of(1, {4, 1, 4}), world.types, {}, [](double) { return false; });
  ASSERT_FALSE(grid.has_value());
  EXPECT_EQ(grid.error().code, ErrorCode::Cancelled);
}

TEST(TerrainDeathTest, AssertsOnInvalidOptionsOrTypes) {
  const World world;
  QUOIN_EXPECT_MISTAKE((void)generate_terrain_chunk(options_of(1, {0, 1, 1}), world.types, {0, 0, 0}), "ranges");
  QUOIN_EXPECT_MISTAKE((void)generate_terrain_chunk(options_of(1, {1, 1, 1}), {}, {0, 0, 0}), "add_terrain_types");
  QUOIN_EXPECT_MISTAKE((void)generate_terrain(options_of(1, {1, 1, 1}), {}), "add_terrain_types");
}

TEST(TerrainDeathTest, RejectsRowsBeyondChunkAndLattice) {
  const auto caves = std::make_unique<terrain::CaveMasks>();
  QUOIN_EXPECT_MISTAKE((void)caves->row(64, 0), "0 <= y, z < 64");
  const terrain::Lattice lattice;
  QUOIN_EXPECT_MISTAKE((void)lattice.row(0, terrain::kLatticeEdge), "a row of the lattice");
  QUOIN_EXPECT_MISTAKE((void)terrain::smooth_step(1.0, 1.0, 0.5), "low < high");
}

}  // namespace
}  // namespace quoin
