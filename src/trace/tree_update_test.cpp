// Compares trees that follow edits with trees that are built from scratch.

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/trace/density_ray.h>
#include <quoin/trace/occupancy_tree.h>
#include <quoin/trace/ray.h>

#include "core/death_for_tests.h"
#include "trace/tree_view.h"

namespace quoin {
namespace {

VoxelRegistry two_of_each() {
  VoxelRegistry types;
  VoxelProperties properties;
  for (int i = 0; i < 4; ++i) {
    properties.name = std::to_string(i);
    properties.visibility = i % 2 == 0 ? Visibility::Opaque : Visibility::Transparent;
    EXPECT_TRUE(types.add(properties).has_value());
  }
  return types;
}

struct Random {
  std::mt19937 engine;
  explicit Random(unsigned seed) : engine(seed) {}
  int below(int end) { return std::uniform_int_distribution<int>(0, end - 1)(engine); }
  int between(int low, int high) { return low + below(high - low + 1); }
  DVec3 direction() {
    std::normal_distribution<double> share;
    return {share(engine), share(engine), share(engine)};
  }
};

// Compares all queries of a tree that followed edits and of a tree that was built from scratch.
void expect_equal(const OccupancyTree& followed, const OccupancyTree& built, Random& random, bool has_blocks) {
  ASSERT_EQ(followed.bounds(), built.bounds());
  ASSERT_EQ(followed.view() == nullptr, built.view() == nullptr);
  const trace::TreeNodes a(followed);
  const trace::TreeNodes b(built);
  const IBox box = built.bounds();
  if (box.empty()) return;
  for (int z = box.min.z >> kChunkShift; z <= (box.max.z - 1) >> kChunkShift; ++z) {
    for (int y = box.min.y >> kChunkShift; y <= (box.max.y - 1) >> kChunkShift; ++y) {
      for (int x = box.min.x >> kChunkShift; x <= (box.max.x - 1) >> kChunkShift; ++x) {
        const trace::ChunkNode* const own = a.find_chunk({x, y, z});
        const trace::ChunkNode* const other = b.find_chunk({x, y, z});
        ASSERT_EQ(own == nullptr, other == nullptr) << x << " " << y << " " << z;
        if (own == nullptr) continue;
        ASSERT_EQ(own->cells, other->cells) << x << " " << y << " " << z;
        for (std::size_t i = 0; i < 64; ++i)
          ASSERT_EQ(a.brick(own->bricks[i]).node(), b.brick(other->bricks[i]).node());
        if (!has_blocks) continue;
        ASSERT_EQ(a.uniform_blocks(*own).cells, b.uniform_blocks(*other).cells);
        ASSERT_EQ(a.uniform_blocks(*own).bricks, b.uniform_blocks(*other).bricks);
        ASSERT_EQ(a.uniform_blocks(*own).is_whole, b.uniform_blocks(*other).is_whole);
      }
    }
  }
  for (int i = 0; i < 200; ++i) {
    const DVec3 size(box.size());
    const DVec3 at = DVec3(box.min) + size * DVec3(random.below(1000), random.below(1000), random.below(1000)) / 1000.0;
    const DVec3 way = random.direction();
    const Ray ray{at - way * double(random.below(200)), way};
    const auto own = first_hit(followed, ray);
    const auto other = first_hit(built, ray);
    ASSERT_EQ(own.has_value(), other.has_value());
    if (!own) continue;
    EXPECT_EQ(own->voxel, other->voxel);
    EXPECT_EQ(own->t, other->t);
  }
}

IVec3 anywhere(Random& random, int chunks) {
  const auto along = [&] { return random.between(-64 * chunks, 64 * chunks + 63); };
  return {along(), along(), along()};
}

void edit(Grid& grid, Random& random, int chunks) {
  const VoxelType type = random.below(5) < 2 ? kAir : static_cast<VoxelType>(random.between(1, 4));
  const IVec3 at = anywhere(random, chunks);
  switch (random.below(8)) {
    case 0: {  // whole chunks and parts of them
      const IVec3 corner = at & ~(random.below(2) == 0 ? 63 : 15);
      grid.fill_box({corner, corner + (random.below(2) == 0 ? 64 : 16)}, type);
      break;
    }
    case 1:
      grid.fill_sphere(DVec3(at), random.between(1, 24), type);
      break;
    case 2:  // scattered over a chunk
      for (int i = 0; i < 5; ++i)
        grid.set((at & ~63) + IVec3(random.below(64), random.below(64), random.below(64)), type);
      break;
    default:
      grid.set(at, type);
  }
}

TEST(TreeUpdate, MatchesRebuiltTree) {
  const VoxelRegistry types = two_of_each();
  for (unsigned seed = 1; seed <= 6; ++seed) {
    Random random(seed);
    const int chunks = static_cast<int>(seed % 3);
    Grid grid;
    for (int i = 0; i < 20; ++i) edit(grid, random, chunks);
    ChangeCursor cursor = grid.cursor();
    const std::vector<Occupancy> kinds = {Occupancy::NonAir, Occupancy::Opaque, Occupancy::Transparent};
    std::vector<OccupancyTree> trees;
    for (const Occupancy kind : kinds) trees.push_back(OccupancyTree::build(grid, types, kind));
    for (int step = 0; step < 60; ++step) {
      const int edits = random.below(4) == 0 ? 12 : 1;
      for (int i = 0; i < edits; ++i) edit(grid, random, chunks);
      if (step == 40) grid.clear();
      const GridChanges changes = grid.changes_since(cursor);
      for (std::size_t i = 0; i < kinds.size(); ++i) {
        trees[i].update(grid, types, changes);
        expect_equal(trees[i], OccupancyTree::build(grid, types, kinds[i]), random, kinds[i] == Occupancy::Transparent);
        if (HasFatalFailure()) FAIL() << "seed " << seed << " step " << step << " kind " << i;
      }
    }
  }
}

// Adds voxels one by one, each outside the previous bounds, and then removes them again.
TEST(TreeUpdate, MatchesRebuiltTreeOfGrowingWorld) {
  const VoxelRegistry types = two_of_each();
  Random random(5);
  Grid grid;
  grid.fill_box({{0, 0, 0}, {200, 90, 200}}, 1);
  ChangeCursor cursor = grid.cursor();
  OccupancyTree tree = OccupancyTree::build(grid, types);
  std::vector<IVec3> added;
  for (int step = 0; step < 24; ++step) {
    IVec3 at = anywhere(random, 1);
    at[step % 3] = (step % 2 == 0 ? 230 : -20) + (step % 2 == 0 ? 1 : -1) * 45 * step;
    grid.set(at, 1);
    added.push_back(at);
    tree.update(grid, types, grid.changes_since(cursor));
    expect_equal(tree, OccupancyTree::build(grid, types), random, false);
    if (HasFatalFailure()) FAIL() << step;
  }
  std::shuffle(added.begin(), added.end(), random.engine);
  for (const IVec3 at : added) {
    grid.set(at, kAir);
    tree.update(grid, types, grid.changes_since(cursor));
    expect_equal(tree, OccupancyTree::build(grid, types), random, false);
    if (HasFatalFailure()) FAIL() << at.x;
  }
  // The tree of a large world that shrinks becomes small again.
  grid.fill_box({{10, 0, 0}, {200, 90, 200}}, kAir);
  grid.fill_box({{0, 0, 10}, {10, 90, 200}}, kAir);
  tree.update(grid, types, grid.changes_since(cursor));
  expect_equal(tree, OccupancyTree::build(grid, types), random, false);
}

// The loaded part of a large world, which moves with a viewer.
struct MovingWorld {
  static constexpr int kWide = 20;
  Grid grid;
  IVec3 low{0};
  explicit MovingWorld(Random& random) {
    grid.make_partial();
    for (int z = 0; z < kWide; ++z) {
      for (int x = 0; x < kWide; ++x) load({x, 0, z}, random);
    }
  }
  void load(IVec3 chunk, Random& random) {
    Chunk voxels;
    for (int i = 0; i < 4; ++i) voxels.set(random.below(64), random.below(64), random.below(64), 1);
    voxels.fill_box({{0, 0, 0}, {64, 3, 64}}, 3, [](int, int, std::uint64_t) {});
    grid.load_chunk(chunk, std::move(voxels));
  }
  // Loads or unloads a quarter of the chunks that a step along an axis brings, and those it leaves behind.
  void move(int axis, int way, int quarter, Random& random) {
    const int other = 2 - axis;
    for (int i = quarter; i < kWide; i += 4) {
      IVec3 chunk = low;
      chunk[other] += i;
      chunk[axis] = way > 0 ? low[axis] + kWide : low[axis] - 1;
      load(chunk, random);
      chunk[axis] = way > 0 ? low[axis] : low[axis] + kWide - 1;
      grid.unload_chunk(chunk);
    }
    if (quarter == 3) low[axis] += way;
  }
};

TEST(TreeUpdate, MatchesRebuiltTreeOfMovingWorld) {
  const VoxelRegistry types = two_of_each();
  Random random(9);
  MovingWorld world(random);
  ChangeCursor cursor = world.grid.cursor();
  OccupancyTree tree = OccupancyTree::build(world.grid, types);
  const auto update = [&] {
    tree.update(world.grid, types, world.grid.changes_since(cursor));
    expect_equal(tree, OccupancyTree::build(world.grid, types), random, false);
  };
  for (const auto& [axis, way] : {std::pair{0, 1}, {2, -1}, {0, -1}, {2, 1}}) {
    for (int step = 0; step < 28; ++step) {
      world.move(axis, way, step % 4, random);
      update();
      ASSERT_FALSE(HasFatalFailure()) << axis << " " << way << " " << step;
      if (step < 8) continue;
      // The tables have room ahead before it is needed, so that no update copies all of them.
      const int tables = tree.view()->brick_sizes[axis] / 4;
      const IBox& used = tree.view()->box;
      EXPECT_TRUE(way > 0 ? used.max[axis] <= (tables - 1) * kChunkEdge : used.min[axis] >= kChunkEdge) << step;
    }
  }
  // Jumps, while tables are half copied.
  for (int jump = 0; jump < 6; ++jump) {
    for (int step = 0; step < 4 * (1 + jump % 3); ++step)
      world.move(jump % 2 * 2, jump % 3 == 0 ? -1 : 1, step % 4, random);
    update();
    world.move(0, 1, 0, random);
    update();
    for (int quarter = 1; quarter < 4; ++quarter) world.move(0, 1, quarter, random);
    ASSERT_FALSE(HasFatalFailure()) << jump;
  }
}

TEST(TreeUpdate, MatchesRebuiltTreeOfField) {
  Random random(11);
  DensityGrid field;
  const auto dig = [&](int chunks) {
    const DVec3 at = DVec3(anywhere(random, chunks));
    random.below(2) == 0 ? field.add_sphere(at, random.between(1, 12), 1)
                         : field.remove_sphere(at, random.between(1, 20));
  };
  for (int i = 0; i < 12; ++i) dig(1);
  DensityTree tree(field);
  ChangeCursor cursor = field.cursor();
  for (int step = 0; step < 50; ++step) {
    for (int i = random.below(3); i >= 0; --i) {
      dig(1);
      field.set(anywhere(random, 1), {random.below(2) == 0 ? -0.4F : 0.7F, 1});
    }
    tree.update(field.changes_since(cursor));
    expect_equal(tree.cells(), OccupancyTree::build(field), random, false);
    if (HasFatalFailure()) FAIL() << step;
  }
}

// Eight chunks around the origin lie in eight regions of 16^3 chunks.
TEST(TreeUpdate, TakesFewBytesForSmallGrids) {
  const VoxelRegistry types = two_of_each();
  Grid grid;
  grid.set({0, 0, 0}, 1);
  EXPECT_LT(OccupancyTree::build(grid, types).bytes(), 12'000U);
  grid.fill_box({{-3, -3, -3}, {3, 3, 3}}, 1);
  OccupancyTree tree = OccupancyTree::build(grid, types);
  EXPECT_LT(tree.bytes(), 60'000U);
  // Chunks that come and go change no other entry of their region.
  ChangeCursor cursor = grid.cursor();
  for (int i = 0; i < 30; ++i) {
    const IVec3 at{5 + 64 * (i * 7 % 16), 5 + 64 * (i * 3 % 16), 5};
    grid.set(at, 1);
    tree.update(grid, types, grid.changes_since(cursor));
    ASSERT_TRUE(tree.is_occupied(at));
    grid.set(at, kAir);
    tree.update(grid, types, grid.changes_since(cursor));
    ASSERT_FALSE(tree.is_occupied(at));
    for (int corner = 0; corner < 8; ++corner) {
      ASSERT_TRUE(tree.is_occupied({-(corner & 1), -(corner >> 1 & 1), -(corner >> 2)}));
    }
  }
}

TEST(TreeUpdateDeathTest, RejectsMovedFromTrees) {
  OccupancyTree tree;
  const OccupancyTree moved = std::move(tree);
  // NOLINTNEXTLINE(bugprone-use-after-move)
  QUOIN_EXPECT_MISTAKE(tree.update(Grid(), VoxelRegistry(), GridChanges()), "not moved from");
  QUOIN_EXPECT_MISTAKE(tree.update(DensityGrid(), DensityChanges()), "not moved from");
}

}  // namespace
}  // namespace quoin
