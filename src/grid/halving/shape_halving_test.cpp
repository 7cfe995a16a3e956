// Halved grids of voxels with shapes and states.

#include <quoin/grid/downsample.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/core/hash.h>
#include <quoin/grid/texture.h>

#include "core/work/nightly_for_tests.h"
#include "grid/shapes/shape_index.h"
#include "grid/shapes/shape_types_for_tests.h"

namespace quoin {
namespace {

std::int64_t count(const Grid& grid, VoxelType type) {
  std::int64_t found = 0;
  grid.for_each([&](IVec3, VoxelType each) { found += each == type; });
  return found;
}

bool have_equal_states(const Grid& a, const Grid& b) {
  bool is_equal = a.voxel_count() == b.voxel_count() && a.data_count() == b.data_count();
  a.for_each([&](IVec3 voxel, VoxelType type) {
    is_equal = is_equal && b.get(voxel) == type && b.data(voxel).state == a.data(voxel).state;
  });
  return is_equal;
}

TEST(ShapeHalving, CoverageIsAreaAlongAxes) {
  VoxelRegistry types;
  const ShapeTypes t(types);
  const auto coverage = [&](VoxelType type) {
    return coverage_of(types[type].shapes.model(0, {}, {}), types[type].faces);
  };
  EXPECT_EQ(coverage(t.slab), Vec3(0.5F, 1.0F, 0.5F));
  EXPECT_EQ(coverage(t.fence), Vec3(0.25F, 0.0625F, 0.25F));
  EXPECT_EQ(coverage(t.door), Vec3(1.0F, 3.0F / 16.0F, 3.0F / 16.0F));
  // Both plates are seen along x and z, each 1 / sqrt(2) wide: together more than the side.
  EXPECT_LT(glm::length(coverage(t.flower) - Vec3(1.0F, 0.0F, 1.0F)), 1e-3F);
}

// Lone posts: enough cells stay to hide as much as before, and no more.
TEST(ShapeHalving, ThinShapesKeepTheirCoverage) {
  VoxelRegistry types;
  const ShapeTypes t(types);
  Grid posts;
  for (int i = 0; i < 64 * 64; ++i) posts.set({4 * (i % 64), 2, 4 * (i / 64)}, t.fence);
  const Grid coarse = *downsample(posts, types);
  const double coverage = (0.0625 + 0.25 + 0.25) / 3.0;
  EXPECT_NEAR(static_cast<double>(coarse.voxel_count()), 64 * 64 * coverage / 4.0, 40.0);
  EXPECT_EQ(count(coarse, t.fence), coarse.voxel_count());
  // As cubes, 64 * 64 lone voxels would all vanish, and pairs all grow into full cells.
  Grid cubes;
  posts.for_each([&](IVec3 voxel, VoxelType) { cubes.set(voxel, t.stone); });
  EXPECT_EQ(downsample(cubes, types)->voxel_count(), 0);
}

TEST(ShapeHalving, FullShapesAreSolid) {
  VoxelRegistry types;
  const ShapeTypes t(types);
  Grid slabs;
  slabs.fill_box({{0, 0, 0}, {16, 2, 16}}, t.slab);
  EXPECT_EQ(downsample(slabs, types)->voxel_count(), 64) << "two layers of half cubes";
}

// A thin layer on the ground gives its colour to the cells below and only sometimes adds one.
TEST(ShapeHalving, CarpetColoursTheGround) {
  VoxelRegistry types;
  const ShapeTypes t(types);
  const VoxelType carpet = types.add({.name = "carpet", .shapes = VoxelShape::box({0, 0, 0}, {16, 1, 16})}).value();
  for (const int height : {4, 5}) {
    Grid grid;
    grid.fill_box({{0, 0, 0}, {64, height, 64}}, t.stone);
    grid.fill_box({{0, height, 0}, {64, height + 1, 64}}, carpet);
    const Grid coarse = *downsample(grid, types);
    int shown = 0;
    int grown = 0;
    for (int i = 0; i < 30 * 30; ++i) {  // without the rim, whose sides are open
      const IVec3 ground{1 + i % 30, (height - 1) / 2, 1 + i / 30};
      const VoxelType above = coarse.get(ground + IVec3(0, 1, 0));
      shown += (above == kAir ? coarse.get(ground) : above) == carpet;
      grown += above != kAir;
    }
    EXPECT_EQ(shown, 30 * 30) << height;
    if (height == 5) {
      EXPECT_EQ(grown, 0);
    } else {
      EXPECT_NEAR(grown, 30 * 30 * (2.0 / 16.0) / 3.0, 25.0);
    }
  }
}

TEST(ShapeHalving, GlassDoesNotReplaceOpaqueCells) {
  VoxelRegistry types;
  const ShapeTypes t(types);
  Grid grid;
  grid.fill_box({{0, 0, 0}, {16, 3, 16}}, t.stone);
  grid.fill_box({{0, 3, 0}, {16, 4, 16}}, t.water);
  const Grid coarse = *downsample(grid, types);
  EXPECT_EQ(count(coarse, t.stone), 128);
}

TEST(ShapeHalving, CubesStayAsTheyAre) {
  VoxelRegistry types;
  const ShapeTypes t(types);
  VoxelRegistry plain;
  ASSERT_TRUE(plain.add(types[t.stone]));
  Grid grid;
  std::mt19937 random(5);
  for (int i = 0; i < 3000; ++i) {
    grid.set({static_cast<int>(random() % 40), static_cast<int>(random() % 40), static_cast<int>(random() % 40)},
             t.stone);
  }
  const Grid before = *downsample(grid, plain);
  EXPECT_TRUE(have_equal_states(*downsample(grid, types), before));
  grid.set({60, 60, 60}, t.torch);
  Grid after = *downsample(grid, types);
  after.set({30, 30, 30}, kAir);
  EXPECT_TRUE(have_equal_states(after, before)) << "a shape changes its own cell only";
}

TEST(ShapeHalving, TypesOfHalvedGridsAreCubes) {
  VoxelRegistry types;
  const ShapeTypes t(types);
  const VoxelRegistry cubes = types_of_halved(types);
  EXPECT_FALSE(cubes.has_shapes());
  EXPECT_TRUE(cubes.is_opaque(t.slab));
  EXPECT_TRUE(cubes.is_opaque(t.flower));
  EXPECT_TRUE(cubes.is_transparent(t.water));
  EXPECT_EQ(cubes[t.stone], types[t.stone]);
  // Two sides of one colour, four of another.
  VoxelProperties striped{.name = "striped", .colour = {200, 0, 0}};
  ShapeElement box{.min = {0, 0, 0}, .max = {16, 16, 8}};
  for (const Direction side : {Direction::PosZ, Direction::NegZ}) {
    box.faces[static_cast<std::size_t>(side)].face = VoxelFace{.tint = {0, 0, 200, 255}};
  }
  striped.shapes = *VoxelShape::from_elements({box});
  const Vec3 mean = mean_of_shapes(striped);
  EXPECT_FLOAT_EQ(mean.z, linear_colour({0, 0, 200}).z * 0.5F);
  EXPECT_FLOAT_EQ(mean.x, linear_colour({200, 0, 0}).x * 0.5F);
  // Fluids do not show their parts.
  striped.shapes = *VoxelShapes::from_rules(
      {.parts = {{.shape = *VoxelShape::from_elements({box})}}, .neighbours = ShapeNeighbours::Fluid});
  EXPECT_FLOAT_EQ(mean_of_shapes(striped).x, linear_colour(striped.colour).x);
  EXPECT_EQ(mean_of_shapes(striped).z, 0.0F);
}

TEST(ShapeHalving, TypesAreKeptUntilTheyChange) {
  VoxelRegistry plain;
  ASSERT_TRUE(plain.add({.name = "stone"}));
  HalvedTypes halved;
  EXPECT_EQ(&halved.of(plain), &plain);
  VoxelRegistry types;
  const ShapeTypes t(types);
  const VoxelRegistry& cubes = halved.of(types);
  EXPECT_FALSE(cubes.has_shapes());
  const VoxelProperties* const kept = &cubes[t.slab];
  EXPECT_EQ(&halved.of(types)[t.slab], kept);
  const VoxelRegistry snapshot = types;
  EXPECT_EQ(&halved.of(snapshot)[t.slab], kept);
  VoxelProperties red = types[t.slab];
  red.colour = {255, 0, 0};
  types.replace(t.slab, red);
  EXPECT_EQ(halved.of(types)[t.slab].colour, types_of_halved(types)[t.slab].colour);
  EXPECT_EQ(halved.of(types)[t.slab].colour, red.colour);
  EXPECT_NE(halved.of(snapshot)[t.slab].colour, red.colour) << "another registry by now";
  VoxelRegistry fewer;
  ASSERT_TRUE(fewer.add(types[t.fence]));
  EXPECT_EQ(halved.of(fewer).size(), fewer.size());
}

TEST(ShapeHalving, KeepsStatesThatTurn) {
  VoxelRegistry types;
  const VoxelType furnace =
      types.add({.name = "furnace", .state_bits = 2, .orientations = StateOrientations::about_y()}).value();
  const VoxelType chest = types.add({.name = "chest", .state_bits = 2}).value();
  Grid grid;
  grid.fill_box({{0, 0, 0}, {4, 2, 2}}, furnace);
  grid.fill_box({{4, 0, 0}, {6, 2, 2}}, chest);
  for (int x = 0; x < 6; ++x) grid.set_data({x, 0, 0}, {.state = 3});
  for (int i = 0; i < 8; ++i) grid.set_data({2 + i % 2, i / 2 % 2, i / 4}, {.state = 1});
  const Grid coarse = *downsample(grid, types);
  EXPECT_EQ(coarse.data({0, 0, 0}).state, 0U) << "six of eight";
  EXPECT_EQ(coarse.data({1, 0, 0}).state, 1U);
  EXPECT_EQ(coarse.data({2, 0, 0}).state, 0U) << "data that turns nothing";
}

// Applies the rules of the header voxel by voxel, with shapes and sums in the order of the voxels.
class ShapeOracle {
 public:
  ShapeOracle(const Grid& grid, const VoxelRegistry& types) : grid_(grid), types_(types) {
    grid.for_each([&](IVec3 voxel, VoxelType type) {
      if (!types.is_shaped(type)) cubes_.set(voxel, type);
    });
    by_cubes_ = *downsample(cubes_, types);
  }

  // Returns a chunk of the halved grid, without states.
  [[nodiscard]] Chunk chunk(IVec3 at) {
    cells_.clear();
    for (int i = 0; i < 64; ++i) {
      const IVec3 octant = IVec3{i & 3, i >> 2 & 3, i >> 4} - 1;
      if (grid_.find_chunk(2 * at + octant) == nullptr) continue;
      for (int n = 0; n < static_cast<int>(kChunkVoxels); ++n) {
        take(2 * kChunkEdge * at, octant * kChunkEdge + IVec3{n & 63, n >> 6 & 63, n >> 12});
      }
    }
    Chunk made;
    if (const Chunk* const known = by_cubes_.find_chunk(at)) made = *known;
    for (const auto& [cell, sums] : cells_) {
      const VoxelType chosen =
          choose(at * kChunkEdge, {cell[0], cell[1], cell[2]}, sums, made.get(cell[0], cell[1], cell[2]));
      if (chosen != kAir) made.set(cell[0], cell[1], cell[2], chosen);
    }
    return made;
  }

 private:
  struct Sum {
    VoxelType type = kAir;
    bool is_opaque = true;
    float filled = 0.0F;
    float covered = 0.0F;
  };

  [[nodiscard]] bool is_cube(IVec3 voxel) const { return cubes_.get(voxel) != kAir; }

  [[nodiscard]] Sum& sum_of(IVec3 fine, VoxelType type) {
    std::vector<Sum>& all = cells_[{fine.x / 2, fine.y / 2, fine.z / 2}];
    for (Sum& sum : all) {
      if (sum.type == type) return sum;
    }
    return all.emplace_back(Sum{type, !has_glass_parts(types_[type])});
  }

  void take(IVec3 origin, IVec3 fine) {
    const IBox inside{IVec3(0), IVec3(2 * kChunkEdge)};
    const VoxelType type = grid_.get(origin + fine);
    if (!types_.is_shaped(type)) return;
    const ShapeModel& model = *shape_at(grid_, types_, origin + fine);
    Vec3 hidden(0.0F);
    for (const Direction direction : kDirections) {
      const IVec3 next = fine + normal_of(direction);
      if (!(inside.contains(fine) || inside.contains(next)) || !is_cube(origin + next)) continue;
      int squares = 0;
      for (const std::uint64_t word : model.sides.at(static_cast<std::size_t>(direction)))
        squares += std::popcount(word);
      const float share = static_cast<float>(squares) / 256.0F;
      hidden[frame_of(direction).axis] = std::max(hidden[frame_of(direction).axis], share);
      if (share > 0.0F && inside.contains(next) && !has_glass_parts(types_[type])) sum_of(next, type).covered += share;
    }
    if (!inside.contains(fine)) return;
    const Vec3 seen = glm::max(coverage_of(model, types_[type].faces) - hidden, Vec3(0.0F));
    const float filled = (seen.x + seen.y + seen.z) / 3.0F;
    if (filled > 0.0F) sum_of(fine, type).filled += filled;
  }

  [[nodiscard]] VoxelType choose(IVec3 first, IVec3 cell, const std::vector<Sum>& sums, VoxelType present) const {
    const bool is_solid = present != kAir;
    int cubes = 0;
    int open_faces = 0;
    for (int i = 0; i < 8; ++i) {
      const IVec3 fine = 2 * (first + cell) + IVec3{i & 1, i >> 1 & 1, i >> 2};
      if (!is_cube(fine)) continue;
      ++cubes;
      for (const Direction direction : kDirections) open_faces += is_cube(fine + normal_of(direction)) ? 0 : 1;
    }
    const auto weight = [&](const Sum& sum) { return is_solid ? sum.filled + sum.covered : sum.filled; };
    const Sum* best = nullptr;
    for (const Sum& sum : sums) {
      const bool is_better = best == nullptr || (sum.is_opaque != best->is_opaque ? sum.is_opaque
                                                 : weight(sum) != weight(*best)   ? weight(sum) > weight(*best)
                                                                                  : sum.type < best->type);
      if (is_better) best = &sum;
    }
    float filled = 0.0F;
    float covered = 0.0F;
    for (const Sum& sum : sums) {
      if (is_solid && sum.is_opaque != best->is_opaque) continue;
      filled += sum.filled;
      covered += sum.covered;
    }
    std::uint32_t hash = 0;
    for (int axis = 0; axis < 3; ++axis) hash = mix_bits(hash ^ static_cast<std::uint32_t>((first + cell)[axis]));
    const float number = static_cast<float>(hash >> 8) / 16'777'216.0F;
    if (!is_solid) {
      return best->filled > 0.0F && number * static_cast<float>(4 - cubes) < filled ? best->type : kAir;
    }
    if (!best->is_opaque && types_.is_opaque(present)) return kAir;
    const float open = std::max(static_cast<float>(open_faces) - covered, 0.0F);
    return number * (filled + covered + open) < filled + covered ? best->type : kAir;
  }

  const Grid& grid_;
  const VoxelRegistry& types_;
  Grid cubes_;
  Grid by_cubes_;
  std::map<std::array<int, 3>, std::vector<Sum>> cells_;
};

// Returns boxes of shapes and cubes across the borders of chunks and of halved chunks, with random states. Some are
// larger than a row of cells, and all of water or of fences.
Grid grid_of_shapes(const VoxelRegistry& types, std::mt19937& random, int boxes) {
  Grid grid;
  const auto below = [&](int limit) { return static_cast<int>(random() % static_cast<unsigned>(limit)); };
  grid.fill_box({{-3, -40, -30}, {131, -20, 40}},
                static_cast<VoxelType>(1 + below(static_cast<int>(types.size()) - 1)));
  for (int i = 0; i < boxes; ++i) {
    const IVec3 centre = (i % 2 == 0 ? 0 : 128) * IVec3(below(2), below(2), below(2));
    const IVec3 at = centre + IVec3(below(24), below(24), below(24)) - 12;
    const IVec3 size = i % 8 == 0 ? IVec3(70, 1 + below(9), 1 + below(9)) : IVec3(below(4), below(4), below(4));
    grid.fill_box({at, at + size}, static_cast<VoxelType>(below(static_cast<int>(types.size()))));
  }
  for (int i = 0; i < 20'000; ++i) {
    const IVec3 at =
        (i % 2 == 0 ? 0 : 128) * IVec3(below(2), below(2), below(2)) + IVec3(below(30), below(30), below(30)) - 15;
    const std::uint8_t bits = types[grid.get(at)].state_bits;
    if (bits != 0) grid.set_data(at, {.state = static_cast<std::uint32_t>(below(1 << bits))});
  }
  return grid;
}

// The sums are floats, so that all of the order must be the same.
TEST(ShapeHalving, MatchesOracleBitForBit) {
  VoxelRegistry types;
  const ShapeTypes t(types);
  VoxelProperties bent{.name = "bent", .state_bits = 3};
  bent.orientations = StateOrientations::about_y_and_upside_down();
  bent.shapes = shapes_for_tests::stairs();
  ASSERT_TRUE(types.add(bent));
  int cells = 0;
  for (int seed = 1; seed <= cases(3, 12); ++seed) {
    std::mt19937 random(seed);
    const Grid grid = grid_of_shapes(types, random, 150);
    ShapeOracle oracle(grid, types);
    for (const IVec3 chunk : {IVec3(0), IVec3(-1, -1, -1), IVec3(0, -1, 0), IVec3(1, 1, 0), IVec3(5)}) {
      const Chunk expected = oracle.chunk(chunk);
      const Chunk made = downsample_chunk(grid, types, chunk);
      cells += made.non_air_count();
      for (int i = 0; i < static_cast<int>(kChunkVoxels); ++i) {
        const IVec3 cell{i & 63, i >> 6 & 63, i >> 12};
        ASSERT_EQ(made.get(cell), expected.get(cell))
            << "seed " << seed << " chunk " << chunk.x << " " << chunk.y << " " << chunk.z << " cell " << cell.x << " "
            << cell.y << " " << cell.z;
      }
    }
  }
  EXPECT_GT(cells, 10'000);
}

// A chunk of water is found by rows, and its surface by repeated neighbourhoods.
TEST(ShapeHalving, OceanMatchesOracle) {
  VoxelRegistry types;
  const ShapeTypes t(types);
  Grid ocean;
  ocean.fill_box({{-8, 0, -8}, {136, 21, 136}}, t.water);
  ocean.fill_box({{-8, 0, -8}, {136, 3, 136}}, t.stone);
  ocean.fill_box({{30, 18, 40}, {34, 21, 44}}, t.fence);
  ocean.set_data({70, 20, 70}, {.state = 3});
  EXPECT_EQ(downsample_chunk(ocean, types, IVec3(0)), ShapeOracle(ocean, types).chunk(IVec3(0)));
  // One voxel makes a difference.
  Grid other = ocean.snapshot();
  other.fill_box({{60, 10, 60}, {62, 12, 62}}, kAir);
  EXPECT_NE(downsample_chunk(other, types, IVec3(0)), ShapeOracle(ocean, types).chunk(IVec3(0)));
}

TEST(ShapeHalving, PyramidFollowsEditsOfShapesAndStates) {
  VoxelRegistry types;
  const ShapeTypes t(types);
  const VoxelType furnace =
      types.add({.name = "furnace", .state_bits = 2, .orientations = StateOrientations::about_y()}).value();
  const std::array<VoxelType, 6> all = {kAir, t.stone, t.slab, t.fence, t.stairs, furnace};
  std::mt19937 random(3);
  Grid grid;
  const auto at = [&] {
    const auto along = [&] { return static_cast<int>(random() % 12) + 64 * static_cast<int>(random() % 3) - 6; };
    return IVec3(along(), along(), along());
  };
  const auto edit = [&](int times) {
    for (int i = 0; i < times; ++i) {
      grid.set(at(), all.at(random() % all.size()));
      const IVec3 voxel = at();
      const VoxelType type = grid.get(voxel);
      if (type == t.stairs || type == furnace)
        grid.set_data(voxel, {.state = static_cast<std::uint32_t>(random() % 4)});
    }
  };
  edit(2000);
  GridPyramid pyramid;
  for (int step = 0; step < 4; ++step) {
    pyramid.update(grid, types, 2);
    const Grid once = *downsample(grid, types);
    ASSERT_TRUE(have_equal_states(pyramid.level(1), once)) << step;
    ASSERT_TRUE(have_equal_states(pyramid.level(2), *downsample(once, types_of_halved(types)))) << step;
    edit(20);
  }
}

}  // namespace
}  // namespace quoin
