// Halved grids of voxels with shapes and states.

#include <quoin/grid/downsample.h>

#include <cmath>
#include <random>
#include <utility>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/grid/texture.h>

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
