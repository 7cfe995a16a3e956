// Reported scene changes, positions of grids, and contents of snapshots.

#include <quoin/scene/scene.h>

#include <random>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace quoin {
namespace {

struct Consumer {
  ChangeCursor cursor;
  std::set<GridHandle> grids;
  std::set<InstanceHandle> instances;
};

template <class T>
std::set<Handle<T>> as_set(const std::vector<Handle<T>>& handles) {
  return {handles.begin(), handles.end()};
}

TEST(SceneChanges, ReportChangesSinceEachCursor) {
  std::mt19937 random(2);
  Scene scene;
  std::vector<GridHandle> grids;
  std::vector<InstanceHandle> instances;
  std::array<Consumer, 4> consumers;
  for (Consumer& each : consumers) EXPECT_TRUE(scene.changes_since(each.cursor).all);
  const auto reported_change = [&](GridHandle grid) {
    for (Consumer& each : consumers) each.grids.insert(grid);
  };
  const auto reported_instance = [&](InstanceHandle instance) {
    for (Consumer& each : consumers) each.instances.insert(instance);
  };
  for (int round = 0; round < 600; ++round) {
    const auto any = [&](auto& all) -> auto& { return all[random() % all.size()]; };
    switch (random() % 8) {
      case 0:
        reported_change(grids.emplace_back(scene.add_grid({})));
        break;
      case 1:
        if (!grids.empty()) {
          Instance instance;
          instance.grid = any(grids);
          reported_instance(instances.emplace_back(scene.add_instance(instance)));
        }
        break;
      case 2:
        if (instances.size() > 2) {
          std::swap(any(instances), instances.back());
          reported_instance(instances.back());
          EXPECT_TRUE(scene.remove_instance(instances.back()));
          instances.pop_back();
        }
        break;
      case 3:
        if (grids.size() > 2) {
          std::swap(any(grids), grids.back());
          reported_change(grids.back());
          std::erase_if(instances, [&](InstanceHandle each) {
            if (scene.instances()[each].grid != grids.back()) return false;
            reported_instance(each);
            return true;
          });
          EXPECT_TRUE(scene.remove_grid(grids.back()));
          grids.pop_back();
        }
        break;
      case 4:
        if (!instances.empty()) {
          reported_instance(any(instances));
          scene.edit(instances.front()).position.x += 1.0;
          reported_instance(instances.front());
          scene.edit(any(instances)).visible = true;
          for (Consumer& each : consumers) each.instances.insert(instances.begin(), instances.end());
          for (const InstanceHandle each : instances) scene.edit(each).voxel_size = 2.0;
        }
        break;
      default:
        if (!grids.empty()) {
          const GridHandle grid = any(grids);
          scene.edit(grid).grid.set({round, 0, 0}, 1);
          reported_change(grid);
        }
    }
    for (std::size_t i = 0; i < consumers.size(); ++i) {
      if (random() % (1U << (2 * i)) != 0) continue;
      Consumer& each = consumers[i];
      const SceneChanges changes =
          random() % 4 == 0 ? scene.snapshot().changes_since(each.cursor) : scene.changes_since(each.cursor);
      ASSERT_FALSE(changes.all);
      ASSERT_EQ(as_set(changes.grids), each.grids);
      ASSERT_EQ(as_set(changes.instances), each.instances);
      each.grids.clear();
      each.instances.clear();
    }
  }
}

TEST(SceneChanges, ReportChangesPerFrameOfBusyScene) {
  Scene scene;
  std::vector<GridHandle> grids;
  for (int i = 0; i < 50; ++i) grids.push_back(scene.add_grid({}));
  std::vector<InstanceHandle> instances;
  for (int i = 0; i < 12'000; ++i) {
    Instance instance;
    instance.grid = grids[static_cast<std::size_t>(i) % grids.size()];
    instances.push_back(scene.add_instance(instance));
  }
  ChangeCursor cursor = scene.cursor();
  for (int frame = 0; frame < 4; ++frame) {
    for (const InstanceHandle each : instances) scene.edit(each).position.x += 1.0;
    for (const GridHandle each : grids) scene.edit(each).grid.set({frame, 0, 0}, 1);
    const SceneChanges changes = scene.changes_since(cursor);
    EXPECT_FALSE(changes.all);
    EXPECT_EQ(changes.instances.size(), instances.size());
    EXPECT_EQ(changes.grids.size(), grids.size());
  }
}

TEST(SceneChanges, ReportEditsThroughKeptReference) {
  Scene scene;
  const GridHandle first = scene.add_grid({});
  Grid& kept = scene.edit(first).grid;
  ChangeCursor cursor = scene.cursor();
  for (int i = 0; i < 100; ++i) scene.add_grid({});
  EXPECT_EQ(&scene.edit(first).grid, &kept) << "it stays where it is";
  cursor = scene.cursor();
  for (int round = 0; round < 3; ++round) {
    kept.set({round, 2, 3}, 4);
    kept.set({round, 2, 4}, 4);
    EXPECT_TRUE(scene.has_changed_since(cursor));
    EXPECT_EQ(scene.changes_since(cursor).grids, std::vector<GridHandle>{first}) << round;
    EXPECT_FALSE(scene.has_changed_since(cursor));
    EXPECT_TRUE(scene.changes_since(cursor).empty());
  }
  Scene moved = std::move(scene);
  kept.set({9, 9, 9}, 4);
  EXPECT_EQ(moved.changes_since(cursor).grids, std::vector<GridHandle>{first});
  kept = Grid();
  EXPECT_EQ(moved.changes_since(cursor).grids, std::vector<GridHandle>{first}) << "another in its place";
  kept.set({1, 1, 1}, 1);
  EXPECT_EQ(moved.changes_since(cursor).grids, std::vector<GridHandle>{first});
}

TEST(SceneChanges, ReportEditThatThrows) {
  Scene scene;
  const GridHandle handle = scene.add_grid({});
  Grid& grid = scene.edit(handle).grid;
  ChangeCursor cursor = scene.cursor();
  const auto pick = [](IVec3 voxel, VoxelType) {
    if (voxel.y == 1) throw std::runtime_error("enough");
    return VoxelType{1};
  };
  EXPECT_THROW(grid.edit({{0, 0, 0}, {4, 4, 4}}, pick), std::runtime_error);
  EXPECT_EQ(grid.voxel_count(), 4);
  EXPECT_EQ(scene.changes_since(cursor).grids, std::vector<GridHandle>{handle});
  EXPECT_EQ(grid.fill_box({{0, 0, 0}, {4, 1, 1}}, 1), 0);
  EXPECT_TRUE(scene.changes_since(cursor).empty()) << "an edit that changes nothing";
}

// A consumer that reads during an edit's callback reads the rest of the edit later.
TEST(SceneChanges, ReportRestOfEditReadHalfway) {
  Scene scene;
  const GridHandle handle = scene.add_grid({});
  Grid& grid = scene.edit(handle).grid;
  ChangeCursor cursor = scene.cursor();
  grid.edit({{60, 0, 0}, {70, 1, 1}}, [&](IVec3 voxel, VoxelType) {
    if (voxel.x == 64) {
      EXPECT_EQ(scene.changes_since(cursor).grids, std::vector<GridHandle>{handle});
    }
    return VoxelType{1};
  });
  EXPECT_EQ(scene.changes_since(cursor).grids, std::vector<GridHandle>{handle});
}

TEST(SceneChanges, AllowConcurrentEditsOfGrids) {
  Scene scene;
  std::vector<Grid*> grids;
  for (int i = 0; i < 8; ++i) grids.push_back(&scene.edit(scene.add_grid({})).grid);
  ChangeCursor cursor = scene.cursor();
  for (int round = 0; round < 20; ++round) {
    {
      std::vector<std::jthread> editors;
      for (Grid* grid : grids) {
        editors.emplace_back([grid, round] {
          for (int i = 0; i < 50; ++i) grid->set({i, round, 0}, 1);
        });
      }
    }
    EXPECT_EQ(scene.changes_since(cursor).grids.size(), grids.size());
  }
}

TEST(SceneChanges, SnapshotStaysUnchanged) {
  Scene scene;
  VoxelProperties properties;
  properties.name = "stone";
  const VoxelType stone = scene.types.add(properties).value();
  SceneGrid hill;
  hill.name = "hill";
  hill.pivot = {1.0, 2.0, 3.0};
  hill.grid.fill_box({{0, 0, 0}, {10, 10, 10}}, stone);
  const GridHandle grid = scene.add_grid(std::move(hill));
  Instance instance;
  instance.grid = grid;
  instance.name = "first";
  const InstanceHandle placed = scene.add_instance(instance);
  const Scene copy = scene.snapshot();
  scene.edit(grid).grid.clear();
  scene.edit(grid).name = "hole";
  scene.edit(placed).position = {7, 7, 7};
  properties.name = "gravel";
  scene.types.replace(stone, properties);
  scene.add_instance(instance);
  EXPECT_EQ(copy.voxel_count(), 1'000);
  EXPECT_EQ(copy.grids()[grid].name, "hill");
  EXPECT_EQ(copy.grids()[grid].pivot, DVec3(1.0, 2.0, 3.0));
  EXPECT_EQ(copy.instances()[placed].position, DVec3(0.0));
  EXPECT_EQ(copy.instances().size(), 1U);
  EXPECT_EQ(copy.types[stone].name, "stone");
  EXPECT_EQ(scene.voxel_count(), 0);
}

}  // namespace
}  // namespace quoin
