#include <quoin/grid/downsample.h>

#include <array>
#include <map>
#include <random>

#include <gtest/gtest.h>

#include <quoin/core/direction.h>

namespace quoin {
namespace {

VoxelRegistry some_types() {
  VoxelRegistry types;
  for (int i = 0; i < 4; ++i) {
    VoxelProperties properties;
    properties.name = std::to_string(i);
    properties.visibility = i < 2 ? Visibility::Transparent : Visibility::Opaque;
    EXPECT_TRUE(types.add(properties));
  }
  return types;  // 1 and 2 are transparent, 3 and 4 opaque
}

IVec3 unit(int axis) {
  IVec3 step{0};
  step[axis] = 1;
  return step;
}

// Applies the rules of the header voxel by voxel.
class Oracle {
 public:
  Oracle(const Grid& grid, const VoxelRegistry& types) : grid_(&grid), types_(&types) {}

  [[nodiscard]] VoxelType cell(IVec3 at) const {
    const int voxels = count(at);
    if (voxels == 0) return kAir;
    bool is_solid = voxels >= 4;
    for (int axis = 0; axis < 3; ++axis) is_solid |= is_kept_rod(at, axis);
    return is_solid ? type(at) : kAir;
  }

 private:
  static IVec3 voxel(IVec3 cell, int i) { return 2 * cell + IVec3{i & 1, i >> 1 & 1, i >> 2}; }
  [[nodiscard]] int count(IVec3 cell) const {
    int solid = 0;
    for (int i = 0; i < 8; ++i) solid += grid_->get(voxel(cell, i)) != kAir;
    return solid;
  }
  [[nodiscard]] bool is_rod(IVec3 cell, int axis) const {
    std::array<int, 2> halves{};
    for (int i = 0; i < 8; ++i) halves.at(i >> axis & 1) += grid_->get(voxel(cell, i)) != kAir;
    return halves[0] > 0 && halves[1] > 0 && halves[0] + halves[1] < 4;
  }
  [[nodiscard]] bool is_kept_rod(IVec3 cell, int axis) const {
    if (!is_rod(cell, axis)) return false;
    if (count(cell + unit(axis)) == 0 && count(cell - unit(axis)) == 0) return false;
    for (int side = 0; side < 3; ++side) {
      if (side == axis) continue;
      if (count(cell + unit(side)) >= 4 || count(cell - unit(side)) >= 4) return false;
      if ((cell[side] & 1) != 0 && is_rod(cell - unit(side), axis)) return false;
    }
    return true;
  }
  [[nodiscard]] VoxelType type(IVec3 cell) const {
    std::map<VoxelType, int> opaque;
    std::map<VoxelType, int> transparent;
    for (int i = 0; i < 8; ++i) {
      const IVec3 at = voxel(cell, i);
      const VoxelType type = grid_->get(at);
      if (type == kAir) continue;
      int& weight = (types_->is_opaque(type) ? opaque : transparent)[type];
      weight += 1;
      for (const Direction face : kDirections) weight += grid_->get(at + normal_of(face)) == kAir ? 8 : 0;
    }
    std::pair<VoxelType, int> best{kAir, 0};
    for (const auto& each : opaque.empty() ? transparent : opaque) {
      if (each.second > best.second) best = each;
    }
    return best.first;
  }

  const Grid* grid_;
  const VoxelRegistry* types_;
};

// Returns boxes, rods and specks across the borders of chunks and of coarse chunks.
Grid random_grid(std::mt19937& random) {
  Grid grid;
  const auto below = [&](int limit) { return static_cast<int>(random() % static_cast<unsigned>(limit)); };
  for (int i = 0; i < 220; ++i) {
    const std::array<IVec3, 3> centres = {IVec3(0), IVec3(128, 0, -64), IVec3(-128, 64, 127)};
    const IVec3 at = centres.at(i % 3U) + IVec3(below(40) - 20, below(40) - 20, below(40) - 20);
    IVec3 size{below(3), below(3), below(3)};
    if (i % 2 == 0) size = unit(below(3)) * below(12);
    grid.fill_box({at, at + size + 1}, static_cast<VoxelType>(below(6) % 5));
  }
  return grid;
}

bool are_equal(const Grid& a, const Grid& b) {
  if (a.voxel_count() != b.voxel_count()) return false;
  bool equal = true;
  a.for_each([&](IVec3 voxel, VoxelType type) { equal &= b.get(voxel) == type; });
  return equal;
}

TEST(Downsample, MatchesOracle) {
  const VoxelRegistry types = some_types();
  for (unsigned seed = 1; seed <= 6; ++seed) {
    std::mt19937 random(seed);
    const Grid grid = random_grid(random);
    const Grid coarse = *downsample(grid, types);
    const Oracle oracle(grid, types);
    const IBox box = grid.bounds();
    std::int64_t solid = 0;
    for (const IVec3 chunk : grid.chunks()) {
      for (int i = 0; i < 32 * 32 * 32; ++i) {
        const IVec3 cell = chunk * 32 + IVec3{i & 31, i >> 5 & 31, i >> 10};
        const VoxelType expected = oracle.cell(cell);
        solid += expected != kAir;
        ASSERT_EQ(coarse.get(cell), expected)
            << "seed " << seed << " cell " << cell.x << " " << cell.y << " " << cell.z;
      }
    }
    EXPECT_EQ(coarse.voxel_count(), solid);
    EXPECT_LE(8 * solid, 4 * grid.voxel_count());
    EXPECT_FALSE(box.empty());
  }
}

TEST(Downsample, IsTheSameAtAnyThreadCount) {
  const VoxelRegistry types = some_types();
  std::mt19937 random(8);
  const Grid grid = random_grid(random);
  EXPECT_TRUE(are_equal(*downsample(grid, types, {1}), *downsample(grid, types, {5})));
}

TEST(Downsample, HalvesEmptyAndUniformGrids) {
  const VoxelRegistry types = some_types();
  EXPECT_EQ(downsample(Grid(), types)->chunk_count(), 0U);
  Grid block;
  block.fill_box({{-128, -128, 0}, {128, 128, 256}}, 3);
  Grid expected;
  expected.fill_box({{-64, -64, 0}, {64, 64, 128}}, 3);
  EXPECT_TRUE(are_equal(*downsample(block, types), expected));
}

TEST(Downsample, KeepsRodsWhole) {
  const VoxelRegistry types = some_types();
  for (int axis = 0; axis < 3; ++axis) {
    for (int width = 1; width <= 2; ++width) {
      for (int place = 0; place < 4; ++place) {
        Grid grid;
        IVec3 first = unit((axis + 1) % 3) * (place & 1) + unit((axis + 2) % 3) * (place >> 1);
        first[axis] = -70;
        IVec3 last = first + (IVec3(1) - unit(axis)) * (width - 1);
        last[axis] = 69;
        grid.fill_box({first, last + 1}, 3);
        const Grid coarse = *downsample(grid, types);
        for (int along = -35; along < 35; ++along) {
          int cells = 0;
          coarse.for_each([&](IVec3 cell, VoxelType) { cells += cell[axis] == along; });
          EXPECT_GE(cells, 1) << axis << " " << width << " " << place << " at " << along;
          EXPECT_LE(cells, 2) << axis << " " << width << " " << place << " at " << along;
        }
      }
    }
  }
}

TEST(Downsample, DropsSpecksWithoutGrowingSteps) {
  const VoxelRegistry types = some_types();
  Grid grid;
  grid.fill_box({{-20, -20, -20}, {20, 0, 20}}, 3);
  const std::int64_t ground = downsample(grid, types)->voxel_count();
  grid.fill_box({{-20, 0, 3}, {20, 1, 4}}, 3);  // a kerb on the ground
  grid.set({5, 30, 5}, 3);
  grid.fill_box({{5, 40, 5}, {7, 41, 6}}, 3);
  EXPECT_EQ(downsample(grid, types)->voxel_count(), ground);
}

TEST(Downsample, PrefersExposedAndOpaqueTypes) {
  const VoxelRegistry types = some_types();
  Grid lawn;
  lawn.fill_box({{0, 0, 0}, {8, 7, 8}}, 4);
  lawn.fill_box({{0, 7, 0}, {8, 8, 8}}, 3);  // half of each topmost cell, on top
  EXPECT_EQ(downsample(lawn, types)->get({1, 3, 1}), 3);
  EXPECT_EQ(downsample(lawn, types)->get({1, 2, 1}), 4);
  Grid framed;
  framed.fill_box({{0, 0, 0}, {2, 2, 2}}, 1);
  framed.set({0, 0, 0}, 4);
  EXPECT_EQ(downsample(framed, types)->get({0, 0, 0}), 4);
}

TEST(Downsample, PyramidFollowsEdits) {
  const VoxelRegistry types = some_types();
  std::mt19937 random(21);
  Grid grid = random_grid(random);
  GridPyramid pyramid;
  EXPECT_EQ(pyramid.levels(), 0);
  for (int step = 0; step < 12; ++step) {
    pyramid.update(grid, types, 3);
    Grid expected = grid.snapshot();
    for (int level = 1; level <= pyramid.levels(); ++level) {
      expected = *downsample(expected, types);
      ASSERT_TRUE(are_equal(pyramid.level(level), expected)) << "step " << step << " level " << level;
    }
    ASSERT_EQ(pyramid.levels(), 3);
    const auto near_border = [&] { return 64 * (static_cast<int>(random() % 5) - 2) - static_cast<int>(random() % 4); };
    const IVec3 at{near_border(), near_border(), near_border()};
    if (step == 5) grid.fill_box({{-30, -30, -30}, {31, 31, 31}}, kAir);
    grid.fill_box({at, at + IVec3(static_cast<int>(random() % 5)) + 1}, static_cast<VoxelType>(random() % 5));
  }
  grid.clear();
  pyramid.update(grid, types, 3);
  EXPECT_EQ(pyramid.levels(), 0);
}

TEST(Downsample, UpdateKeepsUntouchedChunks) {
  const VoxelRegistry types = some_types();
  Grid grid;
  grid.fill_box({{0, 0, 0}, {601, 21, 21}}, 3);
  GridPyramid pyramid;
  pyramid.update(grid, types, 1);
  const Grid* level = &pyramid.level(1);
  ChangeCursor cursor = level->cursor();
  grid.set({5, 5, 5}, 4);
  grid.fill_box({{4, 4, 4}, {6, 6, 6}}, 4);
  pyramid.update(grid, types, 1);
  EXPECT_EQ(&pyramid.level(1), level);
  EXPECT_EQ(level->get({2, 2, 2}), 4);
  const GridChanges changes = level->changes_since(cursor);
  ASSERT_EQ(changes.items_unless_all().size(), 1U);
  EXPECT_EQ(changes.items_unless_all()[0].chunk, IVec3(0));
}

TEST(Downsample, RebuildsOnlyChunksThatReadEdit) {
  const VoxelRegistry types = some_types();
  Grid grid;
  grid.fill_box({{-150, -150, -150}, {151, 151, 151}}, 3);
  GridPyramid pyramid;
  pyramid.update(grid, types, 1);
  const auto made_anew = [&](IVec3 voxel) {
    std::vector<Chunk> before;
    const std::vector<IVec3> chunks = pyramid.level(1).chunks();
    for (const IVec3 chunk : chunks) before.push_back(*pyramid.level(1).find_chunk(chunk));
    grid.fill_box({voxel, voxel + 1}, 4);
    pyramid.update(grid, types, 1);
    int anew = 0;
    for (std::size_t i = 0; i < chunks.size(); ++i) {
      anew += static_cast<int>(!before[i].shares_storage_with(*pyramid.level(1).find_chunk(chunks[i])));
    }
    return anew;
  };
  grid.set({0, 0, 0}, 4);  // uniform chunks have no storage to compare
  grid.fill_box({{-1, -1, -1}, {0, 0, 0}}, 4);
  for (const int x : {-40, 40}) {
    for (const int y : {-40, 40}) {
      for (const int z : {-40, 40}) grid.fill_box({{x, y, z}, {x + 3, y + 3, z + 3}}, 4);
    }
  }
  pyramid.update(grid, types, 1);
  EXPECT_EQ(made_anew({60, 60, 60}), 1);
  EXPECT_EQ(made_anew({64, 60, 60}), 1) << "both chunks of voxels are halved into one";
  EXPECT_EQ(made_anew({2, 60, 60}), 1);
  EXPECT_EQ(made_anew({1, 60, 60}), 2);
  EXPECT_EQ(made_anew({-2, 60, 60}), 2);
  EXPECT_EQ(made_anew({-2, 1, -2}), 8);
}

TEST(Downsample, PyramidStopsBeforeEmptyLevel) {
  const VoxelRegistry types = some_types();
  Grid grid;
  grid.fill_box({{0, 0, 0}, {4, 4, 4}}, 3);
  GridPyramid pyramid;
  pyramid.update(grid, types, 4);
  EXPECT_EQ(pyramid.levels(), 2);
  EXPECT_EQ(pyramid.level(2).voxel_count(), 1);
}

TEST(Downsample, StopsWhenCancelled) {
  Grid grid;
  grid.fill_box({IVec3(-70), IVec3(200)}, 1);
  VoxelRegistry types;
  ASSERT_TRUE(types.add({}).has_value());
  double last = 0.0;
  EXPECT_TRUE(downsample(grid, types, {2}, [&](double fraction) { return (last = fraction) <= 1.0; }).has_value());
  EXPECT_EQ(last, 1.0);
  const auto cancelled = downsample(grid, types, {2}, [](double) { return false; });
  ASSERT_FALSE(cancelled.has_value());
  EXPECT_EQ(cancelled.error().code, ErrorCode::Cancelled);
  DensityGrid field;
  field.add_sphere(DVec3(0.0), 80.0, 1);
  const auto also = downsample(field, {2}, [](double) { return false; });
  ASSERT_FALSE(also.has_value());
  EXPECT_EQ(also.error().code, ErrorCode::Cancelled);
}

}  // namespace
}  // namespace quoin
