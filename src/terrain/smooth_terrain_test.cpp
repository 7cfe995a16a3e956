#include <quoin/terrain/terrain.h>

#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"
#include "core/work/nightly_for_tests.h"
#include "terrain/landform.h"

namespace quoin {
namespace {

struct SmoothWorld {
  VoxelRegistry registry;
  TerrainTypes types = add_terrain_types(registry).value();
};

SmoothTerrainOptions smooth_options_of(std::uint64_t seed, IVec3 size, int first_x = 0, int first_z = 0) {
  SmoothTerrainOptions options;
  options.seed = seed;
  options.size = size;
  options.first_x = first_x;
  options.first_z = first_z;
  return options;
}

DensityGrid make(const SmoothTerrainOptions& options, Threads threads = {1}) {
  return generate_smooth_terrain(options, SmoothWorld().types, threads).value();
}

std::uint64_t hash_of_chunk(const DensityChunk& chunk, std::uint64_t hash) {
  std::array<Half, kChunkEdge> row;
  std::array<VoxelType, kChunkEdge> types;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      chunk.read_row(y, z, row);
      chunk.materials().read_row(y, z, types);
      for (std::size_t x = 0; x < kChunkEdge; ++x) {
        hash = (hash ^ (std::uint32_t{row[x]} << 16 | types[x])) * 0x100'0000'01B3U;
      }
    }
  }
  return hash;
}

std::uint64_t hash_of(const DensityGrid& field) {
  std::uint64_t hash = 0xCBF2'9CE4'8422'2325U;
  for (const IVec3 at : field.chunks()) {
    for (const int part : {at.x, at.y, at.z}) hash = (hash ^ static_cast<std::uint32_t>(part)) * 0x100'0000'01B3U;
    hash = hash_of_chunk(*field.find_chunk(at), hash);
  }
  return hash;
}

bool is_solid(const DensityGrid& field, IVec3 p) {
  return field.density(p) < 0.0F;
}

// Worlds must be reproducible from a saved seed. A change here changes every world.
TEST(SmoothTerrain, IsReproducible) {
  EXPECT_EQ(hash_of(make(smooth_options_of(42, {2, 2, 2}))), 16'385'689'152'749'590'625U);
  EXPECT_EQ(hash_of(make(smooth_options_of(7, {1, 4, 1}, -3, 5))), 12'034'568'528'284'950'785U);
  EXPECT_EQ(hash_of(make(smooth_options_of(0x1234'5678'9ABC'DEF0U, {2, 1, 1}, -524'288, 524'287))),
            7'607'016'377'544'171'522U);
}

TEST(SmoothTerrain, IsTheSameByThreadsAndByChunk) {
  const SmoothTerrainOptions options = smooth_options_of(5, {3, 2, 2}, -2, -1);
  const DensityGrid one = make(options);
  const DensityGrid many = make(options, {4});
  EXPECT_EQ(hash_of(one), hash_of(many));
  EXPECT_EQ(one.bytes(), many.bytes());
  const SmoothWorld world;
  for (int z = -2; z < 2; ++z) {
    for (int y = -1; y < 3; ++y) {
      for (int x = -3; x < 2; ++x) {
        const DensityChunk alone = generate_smooth_terrain_chunk(options, world.types, {x, y, z});
        const DensityChunk* found = one.find_chunk({x, y, z});
        if (found == nullptr) {
          EXPECT_EQ(alone.uniform(), std::optional(stored_density(8.0F, 8.0F)));
        } else {
          EXPECT_EQ(hash_of_chunk(alone, 0), hash_of_chunk(*found, 0));
        }
      }
    }
  }
}

TEST(SmoothTerrain, PiecesMatchAwayFromTheirSides) {
  const DensityGrid left = make(smooth_options_of(11, {2, 2, 1}, 0, 0));
  const DensityGrid right = make(smooth_options_of(11, {2, 2, 1}, 1, 0));
  for (int z = 10; z < 54; ++z) {
    for (int y = 0; y < 128; ++y) {
      for (int x = 74; x < 118; ++x) {
        ASSERT_EQ(left.density({x, y, z}), right.density({x, y, z}));
        ASSERT_EQ(left.material({x, y, z}), right.material({x, y, z}));
      }
    }
  }
}

TEST(SmoothTerrain, IsClosedBlockWithFlatSides) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const DensityGrid field = make(smooth_options_of(seed, {2, 2, 1}));
    const IBox solid = field.solid_bounds();
    EXPECT_EQ(solid.min, IVec3(1));
    EXPECT_EQ(solid.max.x, 127);
    EXPECT_EQ(solid.max.z, 63);
    EXPECT_LT(solid.max.y, 127);
    for (int x = 0; x < 128; ++x) {
      for (int z = 0; z < 64; ++z) EXPECT_EQ(is_solid(field, {x, 1, z}), x > 0 && x < 127 && z > 0 && z < 63);
    }
    EXPECT_EQ(field.density({60, 0, 30}), 0.5F);
    EXPECT_EQ(field.density({60, 1, 30}), -0.5F);
  }
}

TEST(SmoothTerrain, MatchesBlockyGroundWithoutOverhangs) {
  SmoothTerrainOptions options = smooth_options_of(42, {2, 2, 2});
  options.overhangs = false;
  options.caves = false;
  const DensityGrid field = make(options);
  TerrainOptions blocky;
  blocky.size = {4, 4, 4};
  const terrain::Landform land(blocky);
  for (int z = 1; z < 127; ++z) {
    for (int x = 1; x < 127; ++x) {
      int y = 127;
      while (!is_solid(field, {x, y, z})) --y;
      const double height = land.exact_height(x, z);
      EXPECT_LT(std::abs(y + 0.5 - height), 0.51);
      for (; y > 0; --y) ASSERT_TRUE(is_solid(field, {x, y, z}));
    }
  }
}

// Counts columns with solid ground above air, which a height map cannot represent.
int overhung_columns(const DensityGrid& field, IVec3 size) {
  int count = 0;
  for (int z = 2; z < size.z - 2; ++z) {
    for (int x = 2; x < size.x - 2; ++x) {
      int turns = 0;
      for (int y = 2; y < size.y - 2; ++y)
        turns += is_solid(field, {x, y, z}) != is_solid(field, {x, y + 1, z}) ? 1 : 0;
      count += turns > 1 ? 1 : 0;
    }
  }
  return count;
}

// Returns the sizes of the pieces connected over the six sides.
std::vector<std::int64_t> pieces(const DensityGrid& field, IVec3 size) {
  std::vector<bool> seen(static_cast<std::size_t>(size.x * size.y * size.z));
  const IBox box{IVec3{0}, size};
  const auto index = [&](IVec3 p) { return static_cast<std::size_t>((p.z * size.y + p.y) * size.x + p.x); };
  std::vector<std::int64_t> sizes;
  std::vector<IVec3> open;
  const auto reach = [&](IVec3 p) {
    if (!box.contains(p) || seen[index(p)] || !is_solid(field, p)) return;
    seen[index(p)] = true;
    open.push_back(p);
  };
  for (int i = 0; i < size.x * size.y * size.z; ++i) {
    reach({i % size.x, i / size.x % size.y, i / (size.x * size.y)});
    if (open.empty()) continue;
    sizes.push_back(0);
    while (!open.empty()) {
      const IVec3 p = open.back();
      open.pop_back();
      ++sizes.back();
      for (int axis = 0; axis < 3; ++axis) {
        IVec3 step{0};
        step[axis] = 1;
        reach(p + step);
        reach(p - step);
      }
    }
  }
  return sizes;
}

TEST(SmoothTerrain, HasOverhangsAndCavesButHardlyFloats) {
  int overhung = 0;
  int caved = 0;
  const int seeds = cases(1, 3);
  for (int seed = 1; seed <= seeds; ++seed) {
    SCOPED_TRACE(seed);
    const IVec3 size = IVec3(3, 2, 3) * 64;
    SmoothTerrainOptions options = smooth_options_of(static_cast<std::uint64_t>(seed), {3, 2, 3});
    options.caves = false;
    const DensityGrid solid = make(options);
    overhung += overhung_columns(solid, size);
    options.caves = true;
    const DensityGrid hollow = make(options);
    caved += overhung_columns(hollow, size);
    const std::vector<std::int64_t> sizes = pieces(hollow, size);
    const std::int64_t largest = *std::max_element(sizes.begin(), sizes.end());
    EXPECT_GT(static_cast<double>(largest), 0.99 * static_cast<double>(hollow.solid_count()));
    options.overhangs = false;
    options.caves = false;
    EXPECT_EQ(overhung_columns(make(options), size), 0);
  }
  EXPECT_GT(overhung, seeds * 188 * 188 / 50);
  EXPECT_GT(caved, overhung + seeds * 188 * 188 / 50);
}

TEST(SmoothTerrain, DensitiesChangeLikeDistances) {
  const DensityGrid field = make(smooth_options_of(9, {2, 2, 2}));
  int near = 0;
  int steep = 0;
  double sum = 0.0;
  for (int z = 3; z < 124; ++z) {
    for (int y = 3; y < 124; ++y) {
      for (int x = 3; x < 124; ++x) {
        const float here = field.density({x, y, z});
        if (std::abs(here) > 2.0F) continue;
        const float dx = field.density({x + 1, y, z}) - field.density({x - 1, y, z});
        const float dy = field.density({x, y + 1, z}) - field.density({x, y - 1, z});
        const float dz = field.density({x, y, z + 1}) - field.density({x, y, z - 1});
        const double slope = 0.5 * std::sqrt(dx * dx + dy * dy + dz * dz);
        ++near;
        sum += slope;
        if (slope > 2.0) ++steep;
      }
    }
  }
  ASSERT_GT(near, 10'000);
  EXPECT_GT(sum / near, 0.8);
  EXPECT_LT(sum / near, 1.2);
  EXPECT_LT(steep, near / 50);
}

TEST(SmoothTerrain, HasLandscapeTypesWithGrassOnTop) {
  const SmoothWorld world;
  SmoothTerrainOptions options = smooth_options_of(42, {3, 2, 3});
  options.caves = false;
  options.overhangs = false;
  const DensityGrid field = make(options);
  int tops = 0;
  int green = 0;
  for (int z = 2; z < 190; ++z) {
    for (int x = 2; x < 190; ++x) {
      int y = 126;
      while (!is_solid(field, {x, y, z})) --y;
      ++tops;
      const VoxelType top = field.material({x, y, z});
      EXPECT_TRUE(top != kAir && top <= world.types.dark_stone);
      if (top == world.types.grass || top == world.types.meadow) ++green;
      EXPECT_NE(top, world.types.earth);
    }
  }
  EXPECT_GT(green, tops / 4);
}

TEST(SmoothTerrain, RejectsInvalidOptionsAndStopsWhenCancelled) {
  const SmoothWorld world;
  for (const IVec3 size : {IVec3(0, 1, 1), IVec3(1, 17, 1), IVec3(513, 1, 1), IVec3(1, 1, -1)}) {
    EXPECT_EQ(generate_smooth_terrain(smooth_options_of(1, size), world.types).error().code,
              ErrorCode::InvalidArgument);
  }
  EXPECT_EQ(generate_smooth_terrain(smooth_options_of(1, {1, 1, 1}, 524'289), world.types).error().code,
            ErrorCode::InvalidArgument);
  const auto cancelled =
      generate_smooth_terrain(smooth_options_of(1, {1, 1, 1}), world.types, {}, [](double) { return false; });
  EXPECT_EQ(cancelled.error().code, ErrorCode::Cancelled);
}

TEST(SmoothTerrainDeathTest, AssertsOnInvalidOptionsOrTypes) {
  const SmoothWorld world;
  QUOIN_EXPECT_MISTAKE((void)generate_smooth_terrain_chunk(smooth_options_of(1, {0, 1, 1}), world.types, {0, 0, 0}),
                       "ranges");
  QUOIN_EXPECT_MISTAKE((void)generate_smooth_terrain_chunk(smooth_options_of(1, {1, 1, 1}), {}, {0, 0, 0}),
                       "add_terrain_types");
  QUOIN_EXPECT_MISTAKE((void)generate_smooth_terrain(smooth_options_of(1, {1, 1, 1}), {}), "add_terrain_types");
}

}  // namespace
}  // namespace quoin
