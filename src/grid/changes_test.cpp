#include <quoin/grid/changes.h>

#include <array>
#include <map>
#include <random>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

#include "core/coordinates/chunk_order.h"

namespace quoin {
namespace {

using Key = std::tuple<int, int, int>;  // z, y, x: the order in which chunks are listed

Key key_of(IVec3 at) {
  return {at.z, at.y, at.x};
}

// The expected changes for one consumer.
struct Expected {
  std::map<Key, IBox> boxes;  // by chunk, in grid coordinates
  std::set<Key> reached;      // chunks that hold one of the 26 neighbours of a changed voxel

  void add(IVec3 voxel) {
    IBox& box = boxes[key_of(chunk_of(voxel))];
    box = unite(box, {voxel, voxel + 1});
    for (int i = 0; i < 27; ++i) reached.insert(key_of(chunk_of(voxel + Neighbourhood::offset(i))));
  }
};

struct Consumer {
  ChangeCursor cursor;
  Expected expected;
};

void expect_reported(Consumer& consumer, const Grid& grid) {
  const GridChanges changes = grid.changes_since(consumer.cursor);
  ASSERT_FALSE(changes.all);
  ASSERT_EQ(changes.items_unless_all().size(), consumer.expected.boxes.size());
  std::set<Key> meshes;
  for (const ChunkChange& change : changes.items_unless_all()) {
    const auto found = consumer.expected.boxes.find(key_of(change.chunk));
    ASSERT_NE(found, consumer.expected.boxes.end());
    const IVec3 origin = change.chunk * kChunkEdge;
    EXPECT_EQ((IBox{change.box.min + origin, change.box.max + origin}), found->second);
    meshes.insert(found->first);
  }
  for (const Key& key : consumer.expected.reached) {
    if (grid.find_chunk({std::get<2>(key), std::get<1>(key), std::get<0>(key)}) != nullptr) meshes.insert(key);
  }
  std::vector<IVec3> wanted;
  for (const auto& [z, y, x] : meshes) wanted.emplace_back(x, y, z);
  EXPECT_EQ(chunks_to_mesh(grid, changes), wanted);
  EXPECT_TRUE(grid.changes_since(consumer.cursor).empty());
  EXPECT_FALSE(grid.has_changed_since(consumer.cursor));
  consumer.expected = {};
}

// Returns the lowest or highest voxel of a chunk, or one in between.
int random_place(std::mt19937& random) {
  return static_cast<int>(random() % 3) * 64 - 64 + std::array{0, 1, 17, 40, 62, 63}[random() % 6];
}

// Makes a random edit and returns all changed voxels.
std::vector<IVec3> random_edit(std::mt19937& random, Grid& grid) {
  const IVec3 at{random_place(random), random_place(random), random_place(random)};
  const IVec3 size{static_cast<int>(random() % 5), static_cast<int>(random() % 4), static_cast<int>(random() % 5)};
  const auto type = static_cast<VoxelType>(random() % 3);
  const IBox touched{at - 6, at + 7};
  std::map<Key, VoxelType> before;
  const auto for_each_touched = [&](auto&& visit) {
    for (int z = touched.min.z; z < touched.max.z; ++z) {
      for (int y = touched.min.y; y < touched.max.y; ++y) {
        for (int x = touched.min.x; x < touched.max.x; ++x) visit(IVec3{x, y, z});
      }
    }
  };
  for_each_touched([&](IVec3 v) { before[key_of(v)] = grid.get(v); });
  switch (random() % 6) {
    case 0:
      grid.fill_box({at, at + size + 1}, type);
      break;
    case 1:
      grid.fill_sphere(DVec3(at), 0.5 * size.x, type);
      break;
    case 2:
      grid.edit({at, at + size + 1}, [&](IVec3 v, VoxelType t) { return (v.x ^ v.y) % 2 == 0 ? type : t; });
      break;
    case 3: {
      const Chunk* present = grid.find_chunk(chunk_of(at));
      Chunk copy = present == nullptr ? Chunk() : *present;
      copy.set(local_of(at), type);
      grid.put_chunk(chunk_of(at), std::move(copy));
      break;
    }
    default:
      grid.set(at, type);
  }
  std::vector<IVec3> changed;
  for_each_touched([&](IVec3 v) {
    if (grid.get(v) != before[key_of(v)]) changed.push_back(v);
  });
  return changed;
}

TEST(Changes, ReportsChangesSinceEachCursor) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    Grid grid;
    grid.fill_box({{-60, -60, -60}, {121, 121, 121}}, 1);
    std::array<Consumer, 5> consumers;
    for (Consumer& each : consumers) {
      EXPECT_TRUE(grid.changes_since(each.cursor).all) << "the first time";
    }
    for (int round = 0; round < 400; ++round) {
      for (const IVec3 voxel : random_edit(random, grid)) {
        for (Consumer& each : consumers) each.expected.add(voxel);
      }
      for (std::size_t i = 0; i < consumers.size(); ++i) {
        // Each consumer reads at its own rate, some through a snapshot.
        if (random() % (1U << (2 * i)) != 0) continue;
        if (random() % 3 == 0) {
          ASSERT_NO_FATAL_FAILURE(expect_reported(consumers[i], grid.snapshot()));
        } else {
          ASSERT_NO_FATAL_FAILURE(expect_reported(consumers[i], grid));
        }
      }
    }
  }
}

TEST(Changes, SnapshotReadersMissNoChanges) {
  Grid grid;
  ChangeCursor cursor;
  EXPECT_TRUE(grid.snapshot().changes_since(cursor).all);
  grid.set({1, 2, 3}, 4);
  const Grid second = grid.snapshot();
  grid.set({70, 2, 3}, 4);
  ChangeCursor other = cursor;
  EXPECT_EQ(second.changes_since(cursor).items_unless_all().size(), 1U) << "what came after it is not its own";
  EXPECT_EQ(grid.changes_since(cursor).items_unless_all().size(), 1U);
  EXPECT_EQ(grid.changes_since(other).items_unless_all().size(), 2U);
  EXPECT_TRUE(second.changes_since(other).all) << "back in time";
}

TEST(Changes, TreatsEditedSnapshotAsOtherGrid) {
  Grid grid;
  grid.set({1, 2, 3}, 4);
  ChangeCursor cursor = grid.cursor();
  Grid copy = grid.snapshot();
  EXPECT_TRUE(copy.changes_since(cursor).empty());
  copy.set({1, 2, 3}, 5);
  EXPECT_TRUE(copy.changes_since(cursor).all);
  copy.set({1, 2, 3}, 6);
  EXPECT_EQ(copy.changes_since(cursor).items_unless_all().size(), 1U);
  EXPECT_TRUE(grid.changes_since(cursor).all);
  EXPECT_EQ(grid.get({1, 2, 3}), 4);
}

TEST(Changes, ReportsEverythingForForeignCursor) {
  const Grid grid;
  const DensityGrid densities;
  const VoxelRegistry types;
  for (const ChangeCursor& cursor : {grid.cursor(), densities.cursor(), types.cursor()}) {
    ChangeCursor one = cursor;
    ChangeCursor two = cursor;
    ChangeCursor three = cursor;
    const int reported =
        int{grid.changes_since(one).all} + int{densities.changes_since(two).all} + int{types.changes_since(three).all};
    EXPECT_EQ(reported, 2) << "all containers except the cursor's own";
  }
}

TEST(Changes, IgnoresNoOpEditsOfSnapshot) {
  Grid grid;
  grid.set({1, 2, 3}, 4);
  ChangeCursor cursor = grid.cursor();
  Grid copy = grid.snapshot();
  EXPECT_FALSE(copy.set({1, 2, 3}, 4));
  EXPECT_EQ(copy.fill_box({{50, 50, 50}, {61, 61, 61}}, kAir), 0);
  EXPECT_TRUE(copy.changes_since(cursor).empty());
}

TEST(Changes, MergesEditsOfOneChunk) {
  Grid grid;
  grid.set({0, 0, 0}, 1);
  ChangeCursor cursor = grid.cursor();
  const std::size_t bytes = grid.bytes();
  for (int i = 0; i < 200'000; ++i) grid.set({1 + i % 5, 7, 9}, static_cast<VoxelType>(1 + i % 3));
  EXPECT_LT(grid.bytes(), bytes + 32'768U);
  const GridChanges changes = grid.changes_since(cursor);
  ASSERT_EQ(changes.items_unless_all().size(), 1U);
  EXPECT_EQ(changes.items_unless_all()[0].box, (IBox{{1, 7, 9}, {6, 8, 10}}));
  EXPECT_EQ(changes.items_unless_all()[0].neighbours, 1U << 13U);
}

TEST(Changes, ReportsAllChunksForLateCursor) {
  Grid grid;
  ChangeCursor late = grid.cursor();
  ChangeCursor early = late;
  for (int i = 0; i < 40'000; ++i) {
    grid.set({i % 2, 0, 0}, static_cast<VoxelType>(1 + i / 2 % 2));
    ASSERT_EQ(grid.changes_since(early).items_unless_all().size(), 1U);
  }
  EXPECT_TRUE(grid.changes_since(late).all);
  EXPECT_TRUE(grid.changes_since(late).empty());
  EXPECT_LT(grid.bytes(), 2'000'000U);
}

TEST(Changes, ReportsTypeChangesWithVisibilityAndColour) {
  VoxelRegistry types;
  ChangeCursor cursor = types.cursor();
  VoxelProperties properties;
  const VoxelType stone = types.add(properties).value();
  properties.name = "glass";
  properties.visibility = Visibility::Transparent;
  const VoxelType glass = types.add(properties).value();
  TypeChanges changes = types.changes_since(cursor);
  ASSERT_EQ(changes.items_unless_all().size(), 2U);
  EXPECT_EQ(changes.items_unless_all()[0].type, stone);
  EXPECT_FALSE(changes.items_unless_all()[0].visibility_changed) << "unregistered types were opaque";
  EXPECT_TRUE(changes.items_unless_all()[0].colour_changed);
  EXPECT_EQ(changes.items_unless_all()[1].type, glass);
  EXPECT_TRUE(changes.items_unless_all()[1].visibility_changed);
  properties.roughness = 0.25F;
  types.replace(glass, properties);
  changes = types.changes_since(cursor);
  ASSERT_EQ(changes.items_unless_all().size(), 1U);
  EXPECT_FALSE(changes.items_unless_all()[0].visibility_changed || changes.items_unless_all()[0].colour_changed);
  VoxelRegistry copy = types;
  EXPECT_TRUE(copy.changes_since(cursor).empty());
  properties.colour = {1, 2, 3, 4};
  copy.replace(glass, properties);
  EXPECT_NE(types[glass].colour, properties.colour) << "each is by itself";
  EXPECT_TRUE(copy.changes_since(cursor).all);
  EXPECT_EQ(copy.find_or_add(properties).value(), glass);
}

TEST(PendingChanges, ReportEverythingAfterFailure) {
  Grid grid;
  ChangeCursor cursor = grid.cursor();
  grid.set({1, 2, 3}, 4);
  {
    const PendingChanges changes(cursor, grid);
    EXPECT_FALSE(changes->all);
    EXPECT_EQ(changes->items_unless_all().size(), 1U);
  }
  grid.set({100, 2, 3}, 4);
  PendingChanges changes(cursor, grid);
  EXPECT_TRUE(changes->all);
  changes.commit();
  EXPECT_FALSE(grid.has_changed_since(cursor));
  grid.set({1, 2, 4}, 4);
  EXPECT_EQ(PendingChanges(cursor, grid)->items_unless_all().size(), 1U)
      << "each read reports the changes since the commit";
}

TEST(PendingChanges, NeedNoCommitWithoutChanges) {
  Grid grid;
  ChangeCursor cursor = grid.cursor();
  EXPECT_TRUE(PendingChanges(cursor, grid)->empty());
  grid.set({1, 2, 3}, 4);
  EXPECT_FALSE(PendingChanges(cursor, grid)->all);
  EXPECT_TRUE(PendingChanges(cursor, grid)->all) << "the previous read was not committed";
}

TEST(Changes, ChunksAreAllChunksTheFirstTime) {
  Grid grid;
  for (int x = 0; x < 3; ++x) grid.set({64 * x, 0, 0}, 1);
  ChangeCursor cursor;
  EXPECT_EQ(grid.changes_since(cursor).chunks(grid), (std::vector<IVec3>{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}));
  EXPECT_TRUE(grid.changes_since(cursor).chunks(grid).empty());
  grid.set({70, 0, 0}, 1);
  grid.set({128, 0, 0}, kAir);
  EXPECT_EQ(grid.changes_since(cursor).chunks(grid), (std::vector<IVec3>{{1, 0, 0}, {2, 0, 0}})) << "one is gone";
  ChangeCursor of_data;
  EXPECT_EQ(grid.data_changes_since(of_data).chunks(grid), (std::vector<IVec3>{{0, 0, 0}, {1, 0, 0}}));

  DensityGrid field;
  field.add_sphere({32.0, 32.0, 32.0}, 4.0, 1);
  ChangeCursor of_field;
  EXPECT_EQ(field.changes_since(of_field).chunks(field), field.chunks());

  Grid partial;
  partial.make_partial();
  (void)partial.load_chunk({5, 0, 0}, Chunk());
  ChangeCursor of_partial;
  EXPECT_EQ(partial.changes_since(of_partial).chunks(partial), (std::vector<IVec3>{{5, 0, 0}})) << "a chunk of air";
}

template <class Changes>
concept HasPublicItems = requires(Changes changes) { changes.items; } || requires(Changes changes) { changes.items_; };

TEST(Changes, ListItemsByNameThatLeavesOutAll) {
  static_assert(!HasPublicItems<GridChanges> && !HasPublicItems<DensityChanges> && !HasPublicItems<TypeChanges>);
  Grid grid;
  grid.set({0, 0, 0}, 1);
  ChangeCursor cursor;
  EXPECT_TRUE(grid.changes_since(cursor).items_unless_all().empty()) << "everything changed, the first time";
  grid.set({64, 0, 0}, 1);
  std::vector<IVec3> listed;
  // The list of a temporary lives as long as the loop.
  for (const ChunkChange& change : grid.changes_since(cursor).items_unless_all()) listed.push_back(change.chunk);
  EXPECT_EQ(listed, (std::vector<IVec3>{{1, 0, 0}}));
}

}  // namespace
}  // namespace quoin
