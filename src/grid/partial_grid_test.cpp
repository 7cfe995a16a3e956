#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/core/axis_orientation.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/copy_box.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>

namespace quoin {
namespace {

Grid partial() {
  Grid grid;
  grid.make_partial();
  return grid;
}

TEST(PartialGrid, WholeGridIsFullyLoaded) {
  Grid grid;
  EXPECT_FALSE(grid.is_partial());
  EXPECT_TRUE(grid.is_loaded({1, 2, 3}));
  EXPECT_TRUE(grid.is_loaded_around({1, 2, 3}, 2));
  EXPECT_FALSE(grid.load_chunk({0, 0, 0}, Chunk(1)));
  EXPECT_FALSE(grid.unload_chunk({0, 0, 0}));
  EXPECT_EQ(grid.voxel_count(), 0);
}

TEST(PartialGrid, RefusesEditsInUnloadedChunks) {
  Grid grid = partial();
  ChangeCursor cursor = grid.cursor();
  const std::array<VoxelType, kChunkEdge> row{1, 2, 3};
  const std::array<PlacedVoxel, 1> placed{{{{3, 3, 3}, 1}}};
  EXPECT_FALSE(grid.set(1, 2, 3, 1));
  EXPECT_EQ(grid.set(placed), 0);
  EXPECT_EQ(grid.write_row({0, 0, 0}, 7, row), 0);
  EXPECT_EQ(grid.fill_box({{0, 0, 0}, {10, 10, 10}}, 1), 0);
  EXPECT_EQ(grid.fill_box({{0, 0, 0}, {64, 64, 64}}, 1), 0);
  EXPECT_EQ(grid.fill_sphere({0, 0, 0}, 5.0, 1), 0);
  EXPECT_EQ(grid.edit({{0, 0, 0}, {2, 2, 2}}, [](IVec3, VoxelType) { return VoxelType{1}; }), 0);
  EXPECT_EQ(grid.put_chunk({0, 0, 0}, Chunk(1)), 0);
  EXPECT_FALSE(grid.has_changed_since(cursor));
  // An edit of a box that is only partly loaded changes the loaded part.
  EXPECT_TRUE(grid.load_chunk({0, 0, 0}, Chunk(kAir)));
  EXPECT_EQ(grid.fill_box({{-5, 0, 0}, {5, 1, 1}}, 1), 5);
}

TEST(PartialGrid, ReportsLoadingAsNoEdit) {
  Grid grid = partial();
  ChangeCursor cursor = grid.cursor();
  Chunk chunk(kAir);
  chunk.set({1, 2, 3}, 7);
  chunk.set_data({1, 2, 3}, {5, {}});
  EXPECT_TRUE(grid.load_chunk({1, 0, 0}, chunk));
  EXPECT_FALSE(grid.load_chunk({1, 0, 0}, Chunk(3)));
  EXPECT_TRUE(grid.load_chunk({2, 0, 0}, Chunk(kAir)));
  EXPECT_EQ(grid.get(65, 2, 3), 7);
  EXPECT_EQ(grid.voxel_count(), 1);
  EXPECT_EQ(grid.data_count(), 1);
  EXPECT_EQ(grid.loaded_chunks(), (std::vector<IVec3>{{1, 0, 0}, {2, 0, 0}}));
  EXPECT_EQ(grid.chunks(), (std::vector<IVec3>{{1, 0, 0}}));
  ChangeCursor data = cursor;
  const GridChanges loaded = grid.changes_since(cursor);
  ASSERT_EQ(loaded.items_unless_all().size(), 2U);
  EXPECT_FALSE(loaded.items_unless_all()[0].is_edit);
  EXPECT_FALSE(loaded.items_unless_all()[1].is_edit);
  const DataChanges of_data = grid.data_changes_since(data);
  ASSERT_EQ(of_data.items_unless_all().size(), 1U);
  EXPECT_FALSE(of_data.items_unless_all()[0].is_edit);

  grid.set(65, 2, 3, 8);
  const GridChanges edited = grid.changes_since(cursor);
  ASSERT_EQ(edited.items_unless_all().size(), 1U);
  EXPECT_TRUE(edited.items_unless_all()[0].is_edit);

  EXPECT_TRUE(grid.unload_chunk({1, 0, 0}));
  EXPECT_FALSE(grid.unload_chunk({1, 0, 0}));
  EXPECT_TRUE(grid.unload_chunk({2, 0, 0}));
  EXPECT_EQ(grid.voxel_count(), 0);
  EXPECT_EQ(grid.data_count(), 0);
  EXPECT_EQ(grid.chunk_count(), 0U);
  const GridChanges unloaded = grid.changes_since(cursor);
  ASSERT_EQ(unloaded.items_unless_all().size(), 2U);
  EXPECT_FALSE(unloaded.items_unless_all()[0].is_edit);
  EXPECT_TRUE(grid.loaded_chunks().empty());
}

TEST(PartialGrid, ReportsEditsAfterLoading) {
  Grid grid = partial();
  ChangeCursor cursor = grid.cursor();
  grid.load_chunk({0, 0, 0}, Chunk(1));
  grid.set(0, 0, 0, 2);
  const GridChanges changes = grid.changes_since(cursor);
  ASSERT_EQ(changes.items_unless_all().size(), 1U);
  EXPECT_TRUE(changes.items_unless_all()[0].is_edit);
}

TEST(PartialGrid, HasNeighbourhoodOnceNeighboursAreLoaded) {
  Grid grid = partial();
  ChangeCursor cursor = grid.cursor();
  std::vector<IVec3> to_mesh;
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        EXPECT_FALSE(grid.is_loaded_around({0, 0, 0}));
        EXPECT_EQ(grid.neighbourhood({0, 0, 0}).centre(), nullptr);
        grid.load_chunk({x, y, z}, Chunk(y < 1 ? 1 : kAir));
        to_mesh = chunks_to_mesh(grid, grid.changes_since(cursor));
      }
    }
  }
  EXPECT_EQ(std::ranges::count(to_mesh, IVec3(0)), 1) << "its last neighbour is loaded";
  EXPECT_TRUE(grid.is_loaded_around({0, 0, 0}));
  EXPECT_NE(grid.neighbourhood({0, 0, 0}).centre(), nullptr);
  grid.unload_chunk({1, 1, 1});
  EXPECT_FALSE(grid.is_loaded_around({0, 0, 0}));
  const std::vector<IVec3> again = chunks_to_mesh(grid, grid.changes_since(cursor));
  EXPECT_NE(std::find(again.begin(), again.end(), IVec3(0, 0, 0)), again.end());
}

TEST(PartialGrid, VisitChangesSkipsLoadedAndUnloadedChunks) {
  Grid grid = partial();
  grid.load_chunk({0, 0, 0}, Chunk(1));
  grid.load_chunk({1, 0, 0}, Chunk(1));
  ChangeCursor cursor = grid.cursor();
  const Grid before = grid.snapshot();
  grid.unload_chunk({0, 0, 0});
  grid.load_chunk({2, 0, 0}, Chunk(2));
  grid.set(64, 0, 0, 3);
  int rows = 0;
  visit_changes(before, grid, grid.changes_since(cursor), [&](const RowChange& row) {
    ++rows;
    EXPECT_EQ(row.first, IVec3(64, 0, 0));
    EXPECT_EQ(row.changed, 1U);
  });
  EXPECT_EQ(rows, 1);
}

TEST(PartialGrid, SnapshotsKeepLoadedChunks) {
  Grid grid = partial();
  grid.load_chunk({0, 0, 0}, Chunk(1));
  const Grid before = grid.snapshot();
  grid.unload_chunk({0, 0, 0});
  grid.load_chunk({5, 5, 5}, Chunk(2));
  EXPECT_TRUE(before.is_loaded({0, 0, 0}));
  EXPECT_FALSE(before.is_loaded({5, 5, 5}));
  EXPECT_EQ(before.get(1, 1, 1), 1);
  EXPECT_TRUE(grid.is_loaded({5, 5, 5}));
}

// A grid and the field of its scene grid, loaded together, against two that are loaded one by one.
TEST(PartialGrid, LoadsChunksOfGridAndFieldTogether) {
  std::mt19937 random(11);
  Grid grid = partial();
  DensityGrid field;
  field.make_partial();
  Grid slow_grid = grid.snapshot();
  DensityGrid slow_field = field.snapshot();
  std::vector<Grid> snapshots;
  const auto chunk_at_random = [&] {
    const auto coordinate = [&] { return static_cast<int>(random() % 20U) - 10; };
    return IVec3{coordinate(), coordinate() / 4, coordinate()};
  };
  for (int step = 0; step < 3'000; ++step) {
    const IVec3 chunk = chunk_at_random();
    const Chunk voxels(static_cast<VoxelType>(random() % 2U));
    switch (random() % 9U) {
      case 0:  // one of them
        EXPECT_EQ(field.load_air_chunk(chunk), slow_field.load_air_chunk(chunk));
        break;
      case 1:
        grid.share_loaded(field);
        break;
      case 2:
        snapshots.push_back(grid.snapshot());
        if (snapshots.size() > 4) snapshots.erase(snapshots.begin());
        break;
      case 3:
      case 4:
        EXPECT_EQ(grid.unload_chunk(chunk, field), slow_grid.unload_chunk(chunk));
        slow_field.unload_chunk(chunk);
        break;
      default: {
        std::optional<DensityChunk> samples;
        if (random() % 3U == 0) samples = DensityChunk(half_from_float(-1.0F), 1);
        const bool is_new = !slow_field.is_loaded(chunk);
        if (is_new && samples) slow_field.load_chunk(chunk, *samples);
        if (is_new && !samples) slow_field.load_air_chunk(chunk);
        EXPECT_EQ(grid.load_chunk(chunk, voxels, field, std::move(samples)), slow_grid.load_chunk(chunk, voxels));
      }
    }
    if (step == 1'500) {
      const std::vector<IVec3> others = {{3, 9, 3}, {4, 9, 4}};
      grid.set_extent({{-8, -2, -8}, {8, 2, 8}}, others);
      slow_grid.set_extent({{-8, -2, -8}, {8, 2, 8}}, others);
      field.set_extent({{-8, -2, -8}, {8, 2, 8}}, others);
      slow_field.set_extent({{-8, -2, -8}, {8, 2, 8}}, others);
    }
    const IVec3 other = chunk_at_random();
    for (const IVec3 each : {chunk, other}) {
      ASSERT_EQ(grid.is_loaded(each), slow_grid.is_loaded(each)) << step;
      ASSERT_EQ(field.is_loaded(each), slow_field.is_loaded(each)) << step;
      ASSERT_EQ(grid.get(each * kChunkEdge), slow_grid.get(each * kChunkEdge)) << step;
      ASSERT_EQ(field.density(each * kChunkEdge), slow_field.density(each * kChunkEdge)) << step;
    }
    if (step % 100 != 0) continue;
    ASSERT_EQ(grid.loaded_chunks(), slow_grid.loaded_chunks()) << step;
    ASSERT_EQ(field.loaded_chunks(), slow_field.loaded_chunks()) << step;
    const IBox box{chunk * kChunkEdge, (chunk + 2) * kChunkEdge};
    ASSERT_EQ(grid.is_loaded_within(box), slow_grid.is_loaded_within(box)) << step;
  }
}

TEST(PartialGrid, BoxIsLoadedIfAllItsChunksAre) {
  Grid grid = partial();
  DensityGrid field;
  field.make_partial();
  for (int x = 0; x < 2; ++x) {
    grid.load_chunk({x, 0, 0}, Chunk(kAir));
    field.load_air_chunk({x, 0, 0});
  }
  EXPECT_TRUE(grid.is_loaded_within({{0, 0, 0}, {128, 64, 64}}));
  EXPECT_TRUE(field.is_loaded_within({{0, 0, 0}, {128, 64, 64}}));
  EXPECT_FALSE(grid.is_loaded_within({{0, 0, 0}, {129, 64, 64}}));
  EXPECT_FALSE(field.is_loaded_within({{0, 0, 0}, {129, 64, 64}}));
  EXPECT_FALSE(grid.is_loaded_within({{-1, 0, 0}, {1, 1, 1}}));
  EXPECT_TRUE(grid.is_loaded_within({{5, 5, 5}, {5, 5, 5}}));
  const int least = std::numeric_limits<int>::min();
  const int most = std::numeric_limits<int>::max();
  EXPECT_FALSE(grid.is_loaded_within({IVec3(least), IVec3(most)}));
  EXPECT_TRUE(grid.is_loaded_within({IVec3(least), IVec3(least + 64)}));  // the outermost chunk is air
  EXPECT_TRUE(Grid().is_loaded_within({IVec3(least), IVec3(most)}));
}

TEST(PartialGrid, CopiesOnlyLoadedVoxels) {
  Grid grid = partial();
  grid.load_chunk({0, 0, 0}, Chunk(kAir));
  grid.set(63, 5, 5, 2);
  for (int x = 0; x < 64; ++x) grid.set(x, 0, 0, 3);
  const IBox box{{60, 0, 0}, {68, 10, 10}};  // half of the box is loaded
  for (const bool is_turned : {false, true}) {
    Grid to;
    to.fill_box({{0, 0, 0}, {20, 20, 20}}, 1);
    const AxisOrientation turn = is_turned ? AxisOrientation::quarter_turns(1, 1) : AxisOrientation();
    const std::int64_t changed = copy_box(grid, box, to, {0, 0, 0}, turn);
    EXPECT_EQ(changed, 4 * 10 * 10);
    std::int64_t air = 0;
    for (int z = 0; z < 10; ++z) {
      for (int y = 0; y < 10; ++y) {
        for (int x = 0; x < 10; ++x) air += to.get(x, y, z) == kAir ? 1 : 0;
      }
    }
    EXPECT_EQ(air, 4 * 10 * 10 - 4 - 1);
    EXPECT_EQ(to.voxel_count(), 20 * 20 * 20 - air);
  }
}

TEST(PartialGrid, DensityGridBehavesAlike) {
  DensityGrid field;
  field.add_sphere({32.0, 32.0, 32.0}, 10.0, 1);
  const DensityChunk sphere = *field.find_chunk({0, 0, 0});
  field.make_partial();
  EXPECT_EQ(field.chunk_count(), 0U);
  EXPECT_EQ(field.add_sphere({32.0, 32.0, 32.0}, 10.0, 1), 0);
  EXPECT_EQ(field.put_chunk({0, 0, 0}, sphere), 0);
  ChangeCursor cursor = field.cursor();
  EXPECT_TRUE(field.load_chunk({0, 0, 0}, sphere));
  EXPECT_TRUE(field.load_air_chunk({1, 0, 0}));
  EXPECT_FALSE(field.load_air_chunk({1, 0, 0}));
  EXPECT_LT(field.density({32, 32, 32}), 0.0F);
  const DensityChanges loaded = field.changes_since(cursor);
  ASSERT_EQ(loaded.items_unless_all().size(), 2U);
  EXPECT_FALSE(loaded.items_unless_all()[0].is_edit);
  EXPECT_GT(field.add_sphere({70.0, 32.0, 32.0}, 10.0, 2), 0);  // changes the loaded part
  EXPECT_EQ(field.material({70, 32, -5}), kAir);
  const DensityChanges edited = field.changes_since(cursor);
  ASSERT_EQ(edited.items_unless_all().size(), 2U);
  EXPECT_TRUE(edited.items_unless_all()[0].is_edit);
  EXPECT_EQ(field.smooth({70.0, 32.0, 32.0}, 10.0, 1.0), 0);  // not all samples around the sphere are loaded
  EXPECT_TRUE(field.unload_chunk({0, 0, 0}));
  EXPECT_FALSE(field.is_loaded({0, 0, 0}));
  EXPECT_FALSE(field.is_loaded_around({1, 0, 0}));
  EXPECT_EQ(field.density({32, 32, 32}), field.band());
}

// A partial grid with content in the chunks (0, 0, 0) to (3, 1, 3), and in (0, 5, 0).
Grid limited() {
  Grid grid = partial();
  grid.set_extent({{0, 0, 0}, {4, 2, 4}}, std::vector<IVec3>{{0, 5, 0}});
  return grid;
}

TEST(PartialGrid, ChunksOutsideOfExtentAreLoadedAir) {
  const Grid grid = limited();
  EXPECT_FALSE(grid.is_loaded({3, 1, 3}));
  EXPECT_FALSE(grid.is_loaded({0, 5, 0}));
  EXPECT_TRUE(grid.is_loaded({3, 2, 3}));
  EXPECT_TRUE(grid.is_loaded({1 << 20, 0, 0}));
  EXPECT_TRUE(grid.is_loaded_around({9, 9, 9}, 3));
  EXPECT_FALSE(grid.is_loaded_around({2, 2, 2}));
  EXPECT_TRUE(grid.is_loaded_within({{-1000, 128, -1000}, {1000, 320, 1000}}));
  EXPECT_FALSE(grid.is_loaded_within({{-1000, 128, -1000}, {1000, 321, 1000}}));
  EXPECT_FALSE(grid.is_loaded_within({{-1000, 127, -1000}, {1000, 320, 1000}}));
  EXPECT_TRUE(grid.loaded_chunks().empty());
  EXPECT_EQ(grid.extent(), (IBox{{0, 0, 0}, {4, 6, 4}}));
  EXPECT_TRUE(Grid().extent().empty());
  EXPECT_TRUE(partial().extent().contains({-1000, 0, 1000}));
}

TEST(PartialGrid, EditsFillChunksOutsideOfExtent) {
  Grid grid = limited();
  ChangeCursor cursor = grid.cursor();
  const IVec3 above{0, 3, 0};
  EXPECT_TRUE(grid.set(5, 200, 5, 7));
  const GridChanges edited = grid.changes_since(cursor);
  ASSERT_EQ(edited.items_unless_all().size(), 1U);
  EXPECT_TRUE(edited.items_unless_all()[0].is_edit);
  EXPECT_EQ(grid.loaded_chunks(), std::vector<IVec3>{above});
  // Half of the box lies in unloaded chunks, a quarter of the rest in the chunk (0, 5, 0).
  EXPECT_EQ(grid.fill_box({{0, 126, 0}, {1, 130, 1}}, 2), 2);
  EXPECT_EQ(grid.fill_box({{0, 318, 0}, {1, 322, 1}}, 2), 2);
  // Once unloaded, its content is unknown until it is loaded again.
  const Chunk kept = *grid.find_chunk(above);
  EXPECT_FALSE(grid.load_chunk(above, Chunk(3)));
  EXPECT_TRUE(grid.unload_chunk(above));
  EXPECT_FALSE(grid.unload_chunk(above));
  EXPECT_FALSE(grid.is_loaded(above));
  EXPECT_FALSE(grid.set(5, 201, 5, 7));
  EXPECT_EQ(grid.get(5, 200, 5), kAir);
  EXPECT_TRUE(grid.load_chunk(above, kept));
  EXPECT_EQ(grid.get(5, 200, 5), 7);
  EXPECT_TRUE(grid.unload_chunk(above));
  EXPECT_FALSE(grid.is_loaded(above));
}

TEST(PartialGrid, LoadedChunksStayWhenExtentChanges) {
  Grid grid = limited();
  grid.load_chunk({0, 0, 0}, Chunk(1));
  grid.set(5, 200, 5, 7);
  ChangeCursor cursor = grid.cursor();
  grid.set_extent({{0, 2, 0}, {4, 4, 4}});
  EXPECT_TRUE(grid.is_loaded({0, 0, 0}));
  EXPECT_TRUE(grid.is_loaded({0, 3, 0})) << "it was edited";
  EXPECT_FALSE(grid.is_loaded({1, 3, 0}));
  EXPECT_TRUE(grid.is_loaded({0, 5, 0}));
  const GridChanges changes = grid.changes_since(cursor);
  ASSERT_EQ(changes.items_unless_all().size(), 2U);
  EXPECT_FALSE(changes.items_unless_all()[0].is_edit);
  EXPECT_EQ(chunks_to_mesh(grid, changes), (std::vector<IVec3>{{0, 0, 0}, {0, 3, 0}}));
  EXPECT_TRUE(grid.unload_chunk({0, 0, 0}));
  EXPECT_FALSE(grid.is_loaded({0, 0, 0})) << "its content is unknown";
}

TEST(PartialGrid, DensityGridHasSameExtent) {
  DensityGrid field;
  field.make_partial();
  field.set_extent({{0, 0, 0}, {4, 2, 4}}, std::vector<IVec3>{{0, 5, 0}});
  EXPECT_FALSE(field.is_loaded({0, 0, 0}));
  EXPECT_FALSE(field.is_loaded({0, 5, 0}));
  EXPECT_TRUE(field.is_loaded({0, 3, 0}));
  EXPECT_TRUE(field.is_loaded_within({{0, 128, 0}, {64, 320, 64}}));
  EXPECT_EQ(field.extent(), (IBox{{0, 0, 0}, {4, 6, 4}}));
  EXPECT_EQ(field.add_sphere({32.0, 32.0, 32.0}, 10.0, 1), 0);
  EXPECT_GT(field.add_sphere({32.0, 224.0, 32.0}, 10.0, 1), 0);
  EXPECT_EQ(field.loaded_chunks(), (std::vector<IVec3>{{0, 3, 0}}));
  EXPECT_TRUE(field.unload_chunk({0, 3, 0}));
  EXPECT_FALSE(field.is_loaded({0, 3, 0}));
  EXPECT_TRUE(field.load_air_chunk({0, 3, 0}));
  EXPECT_TRUE(field.is_loaded({0, 3, 0}));
}

}  // namespace
}  // namespace quoin
