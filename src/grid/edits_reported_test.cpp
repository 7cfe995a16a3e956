// The change records of edits: bricks of 16^3, and voxel by voxel.

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/grid/grid.h>

#include "core/work/nightly_for_tests.h"
namespace quoin {
namespace {

using Place = std::tuple<int, int, int>;
// Position, old type, new type.
using Reported = std::vector<std::tuple<int, int, int, VoxelType, VoxelType>>;

Reported reported(const Grid& before, const Grid& now, const GridChanges& changes) {
  Reported all;
  IVec3 last{-100'000};
  visit_changes(before, now, changes, [&](const RowChange& row) {
    EXPECT_NE(row.changed, 0U);
    EXPECT_EQ(row.first.x & 63, 0);
    const IVec3 a = chunk_of(last);
    const IVec3 b = chunk_of(row.first);
    EXPECT_TRUE(std::tie(a.z, a.y, a.x, last.z, last.y) < std::tie(b.z, b.y, b.x, row.first.z, row.first.y));
    last = row.first;
    row.for_each([&](IVec3 voxel, VoxelType old_type, VoxelType new_type) {
      EXPECT_NE(old_type, new_type);
      EXPECT_EQ(before.get(voxel), old_type);
      EXPECT_EQ(now.get(voxel), new_type);
      all.emplace_back(voxel.x, voxel.y, voxel.z, old_type, new_type);
    });
  });
  std::sort(all.begin(), all.end());
  return all;
}

// Returns all voxels that differ, each once.
Reported compared(const Grid& before, const Grid& now) {
  Reported all;
  before.for_each([&](IVec3 p, VoxelType type) {
    if (now.get(p) != type) all.emplace_back(p.x, p.y, p.z, type, now.get(p));
  });
  now.for_each([&](IVec3 p, VoxelType type) {
    if (before.get(p) == kAir) all.emplace_back(p.x, p.y, p.z, kAir, type);
  });
  std::sort(all.begin(), all.end());
  return all;
}

struct Random {
  std::mt19937 engine{3};
  int between(int low, int high) { return std::uniform_int_distribution<int>(low, high)(engine); }
  IVec3 place() { return {between(-70, 70), between(-20, 90), between(-70, 70)}; }
};

void edit(Grid& grid, Random& random) {
  const auto type = static_cast<VoxelType>(random.between(0, 40) < 12 ? 0 : random.between(1, 40));
  const IVec3 at = random.place();
  switch (random.between(0, 5)) {
    case 0:
      grid.fill_box({at, at + IVec3{random.between(1, 70), 3, random.between(1, 20)}}, type);
      break;
    case 1:
      grid.fill_sphere(DVec3(at), random.between(1, 9), type);
      break;
    case 2: {
      std::vector<PlacedVoxel> many;
      for (int i = 0; i < 50; ++i) many.push_back({random.place(), static_cast<VoxelType>(random.between(0, 3))});
      grid.set(many);
      break;
    }
    case 3:
      grid.put_chunk(chunk_of(at), Chunk(type));
      break;
    default:
      grid.set(at, type);
  }
}

TEST(VisitChanges, ReportsEveryVoxelAndItsOldType) {
  Random random;
  Grid grid;
  for (int i = 0; i < 30; ++i) edit(grid, random);
  ChangeCursor cursor = grid.cursor();
  Grid before = grid.snapshot();
  for (int step = 0; step < cases(30, 80); ++step) {
    for (int i = random.between(0, 4); i >= 0; --i) edit(grid, random);
    if (step == cases(20, 50)) grid.clear();
    const GridChanges changes = grid.changes_since(cursor);
    const Reported expected = compared(before, grid);
    ASSERT_EQ(reported(before, grid, changes), expected) << step;
    GridChanges unknown;
    unknown.all = true;
    ASSERT_EQ(reported(before, grid, unknown), expected) << step;
    // Covers the slabs of the changed voxels, and possibly others if an edit was undone.
    std::map<Place, ChunkSlabs> slabs;
    for (const ChunkChange& change : changes.items_unless_all()) {
      slabs[{change.chunk.x, change.chunk.y, change.chunk.z}] = change.slabs;
    }
    for (const auto& [x, y, z, was, is] : expected) {
      const IVec3 voxel{x, y, z};
      const IVec3 chunk = chunk_of(voxel);
      const IVec3 at = local_of(voxel);
      ASSERT_TRUE((slabs[Place(chunk.x, chunk.y, chunk.z)].has(at.y, at.z)));
    }
    before = grid.snapshot();
  }
}

TEST(GridChanges, ReportChangedSlabs) {
  Grid grid;
  ChangeCursor cursor = grid.cursor();
  const auto expect = [&](const IBox& box) {
    const GridChanges changes = grid.changes_since(cursor);
    ASSERT_EQ(changes.items_unless_all().size(), 1U);
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y) {
        const bool is_within = y / 4 >= box.min.y / 4 && y / 4 <= (box.max.y - 1) / 4 && z / 4 >= box.min.z / 4 &&
                               z / 4 <= (box.max.z - 1) / 4;
        ASSERT_EQ(changes.items_unless_all()[0].slabs.has(y, z), is_within) << y << ' ' << z;
        const std::uint32_t block = changes.items_unless_all()[0].slabs.block(y & ~15, z & ~15);
        ASSERT_EQ((block >> ((y >> 2 & 3) + 4 * (z >> 2 & 3)) & 1U) != 0, is_within);
      }
    }
  };
  const auto edit = [&](const IBox& box, VoxelType type) {
    grid.fill_box(box, type);
    expect(box);
  };
  edit({{17, 33, 50}, {18, 34, 51}}, 1);  // inside
  edit({{63, 0, 20}, {64, 1, 21}}, 1);    // on sides
  edit({{10, 5, 5}, {40, 6, 6}}, 2);
  edit({{10, 3, 60}, {12, 41, 64}}, 2);
  edit({{0, 0, 0}, {64, 64, 64}}, 3);
}

TEST(Grid, SetsManyVoxelsAtOnce) {
  Random random;
  Grid one;
  Grid other;
  for (int round = 0; round < 20; ++round) {
    std::vector<PlacedVoxel> voxels;
    for (int i = 0; i < 200; ++i) {
      const IVec3 at = random.place();
      for (int n = random.between(0, 3); n >= 0; --n) {
        voxels.push_back({at + IVec3{n, 0, 0}, static_cast<VoxelType>(random.between(0, 5))});
      }
    }
    // The outermost chunk stays air.
    voxels.push_back({IVec3{std::numeric_limits<int>::max()}, 1});
    std::int64_t changed = 0;
    for (const PlacedVoxel& each : voxels) changed += other.set(each.voxel, each.type) ? 1 : 0;
    EXPECT_EQ(one.set(voxels), changed);
    EXPECT_TRUE(compared(one, other).empty());
    EXPECT_EQ(one.voxel_count(), other.voxel_count());
    EXPECT_EQ(one.chunk_count(), other.chunk_count());
  }
  EXPECT_EQ(one.set(std::span<const PlacedVoxel>()), 0);
}

// A list that is long enough for several threads, in an order in which consecutive voxels lie in different chunks. A
// snapshot shares all chunks before each edit, and some of them share their storage with each other.
TEST(GridChanges, ReportWholeUniformChunks) {
  Grid grid;
  ChangeCursor cursor = grid.cursor();
  VoxelType last = kAir;
  for (const VoxelType type : {VoxelType{1}, VoxelType{1}, VoxelType{2}, kAir, kAir}) {
    EXPECT_EQ(grid.put_chunk({1, 0, -2}, Chunk(type)), type == last ? 0 : 64 * 64 * 64);
    const GridChanges changes = grid.changes_since(cursor);
    ASSERT_EQ(changes.items_unless_all().size(), type == last ? 0U : 1U);
    if (type != last) {
      EXPECT_EQ(changes.items_unless_all()[0].chunk, (IVec3{1, 0, -2}));
      EXPECT_EQ(changes.items_unless_all()[0].box, (IBox{IVec3(0), IVec3(64)}));
      EXPECT_EQ(changes.items_unless_all()[0].neighbours, (1U << 27) - 1U);
      EXPECT_EQ(changes.items_unless_all()[0].slabs, ChunkSlabs::all());
    }
    EXPECT_EQ(grid.voxel_count(), type == kAir ? 0 : 64 * 64 * 64);
    last = type;
  }
}

TEST(Grid, SetsLongListsOnSeveralThreads) {
  const Chunk ground = [] {
    Chunk chunk;
    chunk.fill_box({{0, 0, 0}, {64, 30, 64}}, 7, [](int, int, std::uint64_t) {});
    return chunk;
  }();
  for (const unsigned threads : {1U, 4U, 0U}) {
    std::mt19937 random(threads);
    Grid one;
    Grid other;
    for (Grid* const grid : {&one, &other}) {
      for (int i = 0; i < 25; ++i) grid->put_chunk({i % 5 - 2, 0, i / 5 - 2}, ground);
      for (int i = 0; i < 64; ++i) grid->set_data({i, 29, i}, {3, {}});
    }
    ChangeCursor cursor = one.cursor();
    ChangeCursor of_other = other.cursor();
    ChangeCursor data = one.cursor();
    ChangeCursor data_of_other = other.cursor();
    for (int round = 0; round < cases(3, 6); ++round) {
      std::vector<PlacedVoxel> voxels;
      const auto between = [&](int low, int high) {
        return low + static_cast<int>(random() % static_cast<unsigned>(high - low));
      };
      for (int i = 0; i < 4'000; ++i) {
        const IVec3 at{between(-130, 130), between(20, 70), between(-130, 130)};
        voxels.push_back({at, static_cast<VoxelType>(between(0, 2 + 8 * round))});
        voxels.push_back({at - IVec3{0, 1, 0}, kAir});
        if (i % 50 == 0) voxels.push_back({at, 1});
      }
      const Grid before = one.snapshot();
      std::int64_t changed = 0;
      for (const PlacedVoxel& each : voxels) changed += other.set(each.voxel, each.type) ? 1 : 0;
      EXPECT_EQ(one.set(voxels, {threads}), changed);
      EXPECT_TRUE(compared(one, other).empty());
      EXPECT_EQ(one.voxel_count(), other.voxel_count());
      EXPECT_EQ(one.data_count(), other.data_count());
      EXPECT_EQ(one.chunks(), other.chunks());
      EXPECT_EQ(one.bounds(), other.bounds());
      const GridChanges changes = one.changes_since(cursor);
      EXPECT_EQ(reported(before, one, changes), compared(before, one));
      const GridChanges expected = other.changes_since(of_other);
      ASSERT_EQ(changes.items_unless_all().size(), expected.items_unless_all().size());
      for (std::size_t i = 0; i < expected.items_unless_all().size(); ++i) {
        EXPECT_EQ(changes.items_unless_all()[i].chunk, expected.items_unless_all()[i].chunk);
        EXPECT_EQ(changes.items_unless_all()[i].box, expected.items_unless_all()[i].box);
        EXPECT_EQ(changes.items_unless_all()[i].neighbours, expected.items_unless_all()[i].neighbours);
      }
      const DataChanges removed = one.data_changes_since(data);
      const DataChanges expected_removed = other.data_changes_since(data_of_other);
      ASSERT_EQ(removed.items_unless_all().size(), expected_removed.items_unless_all().size());
      for (std::size_t i = 0; i < removed.items_unless_all().size(); ++i) {
        EXPECT_EQ(removed.items_unless_all()[i].chunk, expected_removed.items_unless_all()[i].chunk);
        EXPECT_EQ(unite(removed.items_unless_all()[i].box, expected_removed.items_unless_all()[i].box),
                  removed.items_unless_all()[i].box);
      }
    }
  }
}

TEST(Grid, RemovesChunksThatListsEmpty) {
  Grid grid;
  std::vector<PlacedVoxel> voxels;
  for (int i = 0; i < 2'000; ++i) voxels.push_back({{64 * (i % 50), i / 50, -64 * (i % 7)}, 3});
  EXPECT_EQ(grid.set(voxels), 2'000);
  EXPECT_EQ(grid.chunk_count(), 350U);
  for (PlacedVoxel& each : voxels) each.type = kAir;
  EXPECT_EQ(grid.set(voxels), 2'000);
  EXPECT_EQ(grid.chunk_count(), 0U);
  EXPECT_EQ(grid.set(voxels), 0);
  EXPECT_EQ(grid.chunk_count(), 0U);
}

TEST(Grid, CancelsEdits) {
  const IBox endless{IVec3{-1'000'000}, IVec3{1'000'000}};
  for (int kind = 0; kind < 3; ++kind) {
    Grid grid;
    double last = 0.0;
    int calls = 0;
    const Progress stop = [&](double share) {
      EXPECT_GE(share, last);
      last = share;
      return ++calls < 10;
    };
    const std::int64_t changed = kind == 0 ? grid.fill_box(endless, 1, stop)
                                 : kind == 1
                                     ? grid.fill_sphere(DVec3(0.0), 1e6, 1, stop)
                                     : grid.edit(
                                           endless, [](IVec3 p, VoxelType) { return VoxelType(p.x & 1); }, stop);
    EXPECT_EQ(calls, 10);
    EXPECT_EQ(grid.voxel_count(), changed);
    EXPECT_LE(grid.chunk_count(), 10U);
  }
  Grid grid;
  double last = 0.0;
  grid.fill_box({{0, 0, 0}, {200, 70, 10}}, 1, [&](double share) {
    last = share;
    return true;
  });
  EXPECT_EQ(last, 1.0);
}

// Functions that take a voxel do not accept a point, whose coordinates would be truncated towards 0.
template <class G, class P>
concept TakesAPoint = requires(const G& grid, P point) { grid.get(point); };
static_assert(TakesAPoint<Grid, IVec3>);
static_assert(!TakesAPoint<Grid, DVec3>);
static_assert(!TakesAPoint<Grid, Vec3>);

TEST(VoxelOf, ReturnsVoxelContainingPoint) {
  EXPECT_EQ(voxel_of({-0.5, 0.5, 1.0}), IVec3(-1, 0, 1));
  EXPECT_EQ(voxel_of({1e300, -1e300, std::nan("")}),
            IVec3(std::numeric_limits<int>::max(), std::numeric_limits<int>::min(), 0));
}

TEST(Grid, HasNoNeighboursBeyondIntegerRange) {
  const Grid grid;
  for (const int end : {std::numeric_limits<int>::max(), std::numeric_limits<int>::min()}) {
    for (const Chunk* chunk : grid.neighbourhood(IVec3{end}).chunks) EXPECT_EQ(chunk, nullptr);
  }
}

TEST(VoxelRegistry, FindsPropertiesWithNanAgain) {
  VoxelRegistry types;
  VoxelProperties odd;
  odd.emission = std::nanf("");
  const auto first = types.find_or_add(odd);
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(*types.find_or_add(odd), *first);
  odd.roughness = 0.25F;
  EXPECT_NE(*types.find_or_add(odd), *first);
  EXPECT_EQ(types.size(), 3U);
}

TEST(VoxelRegistry, ReportsPassableTypes) {
  VoxelRegistry types;
  VoxelProperties properties;
  const VoxelType stone = *types.add(properties);
  EXPECT_FALSE(types.has_passable());
  properties.collides = false;
  types.replace(stone, properties);
  EXPECT_TRUE(types.has_passable());
  const VoxelRegistry copy = types;
  properties.collides = true;
  types.replace(stone, properties);
  EXPECT_FALSE(types.has_passable());
  EXPECT_TRUE(copy.has_passable());
}

}  // namespace
}  // namespace quoin
