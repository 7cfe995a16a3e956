// Transforms and bounds of scenes, reported changes, addresses of grids, and contents of snapshots.

#include <quoin/scene/scene.h>

#include <array>
#include <map>
#include <random>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "scene/scene_follower.h"

namespace quoin {
namespace {

const DQuat kQuarterTurnAboutY = glm::angleAxis(1.5707963267948966, DVec3(0, 1, 0));

SceneGrid box_grid(IVec3 first, IVec3 last) {
  SceneGrid grid;
  grid.grid.fill_box({first, last + 1}, 1);
  return grid;
}

TEST(Scene, WorldFromGridMirrorsThenTurnsAboutPivot) {
  SceneGrid grid;
  grid.pivot = {1, 2, 3};
  Instance instance;
  instance.position = {100, 200, 300};
  instance.rotation = kQuarterTurnAboutY;
  EXPECT_EQ(world_from_grid(instance, grid, {1, 2, 3}), DVec3(100, 200, 300));
  EXPECT_EQ(world_from_grid(instance, grid, {5, 2, 3}), DVec3(100, 200, 296));
  instance.mirrored = true;
  instance.voxel_size = 0.5;
  EXPECT_EQ(world_from_grid(instance, grid, {5, 2, 3}), DVec3(100, 200, 302));
}

TEST(Scene, BoundsSurroundPlacedInstances) {
  Scene scene;
  EXPECT_TRUE(scene.bounds(InstanceFilter::All).empty());
  const GridHandle grid = scene.add_grid(box_grid({0, 0, 0}, {3, 1, 0}));
  EXPECT_TRUE(scene.bounds(InstanceFilter::All).empty());
  scene.add_instance({"", grid, {10, 0, 0}, kQuarterTurnAboutY});
  const DBox shown = scene.bounds();
  EXPECT_EQ(shown.min, DVec3(10, 0, -4));
  EXPECT_EQ(shown.max, DVec3(11, 2, 0));
  scene.add_instance({"", grid, {0, 50, 0}, DQuat(1, 0, 0, 0), 1.0, false, false});
  EXPECT_EQ(scene.bounds().max, shown.max);
  EXPECT_EQ(scene.bounds(InstanceFilter::All).max.y, 52);
}

TEST(Scene, RemovesInstancesOfRemovedGrid) {
  Scene scene;
  const GridHandle a = scene.add_grid(box_grid({0, 0, 0}, {0, 0, 0}));
  const GridHandle b = scene.add_grid(box_grid({0, 0, 0}, {1, 1, 1}));
  scene.add_instance({"a", a});
  scene.add_instance({"b", b});
  scene.add_instance({"a too", a});
  EXPECT_EQ(scene.voxel_count(), 9);
  EXPECT_TRUE(scene.remove_grid(a));
  EXPECT_FALSE(scene.remove_grid(a));
  ASSERT_EQ(scene.instances().size(), 1U);
  EXPECT_EQ(scene.instances()[scene.instances().handles()[0]].name, "b");
  EXPECT_EQ(scene.voxel_count(), 8);
}

TEST(Scene, DeclaredBoxIncludesCanvasAndVoxels) {
  SceneGrid grid = box_grid({5, 5, 5}, {5, 5, 5});
  EXPECT_EQ(grid.declared_box(), (IBox{{5, 5, 5}, {6, 6, 6}}));
  grid.canvas = {{0, 0, 0}, {2, 2, 2}};
  EXPECT_EQ(grid.declared_box(), (IBox{{0, 0, 0}, {6, 6, 6}}));
}

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

// A snapshot follows its grids from the first edit on.
TEST(SceneChanges, SnapshotReportsEditsOfItsGrids) {
  Scene scene;
  const GridHandle first = scene.add_grid({});
  const GridHandle second = scene.add_grid({});
  Scene copy = scene.snapshot();
  SceneGrid& edited = copy.edit(first);
  ChangeCursor cursor = copy.cursor();
  edited.grid.set({1, 2, 3}, 1);
  EXPECT_EQ(copy.changes_since(cursor).grids, std::vector<GridHandle>{first});
  edited.field.edit({{0, 0, 0}, {1, 1, 1}}, [](IVec3, DensitySample) { return DensitySample{-1.0F, 1}; });
  EXPECT_EQ(copy.changes_since(cursor).grids, std::vector<GridHandle>{first});
  const GridHandle added = copy.add_grid({});
  EXPECT_EQ(copy.changes_since(cursor).grids, std::vector<GridHandle>{added});
  Scene of_copy = copy.snapshot();
  of_copy.edit(second).grid.set({1, 2, 3}, 1);
  EXPECT_TRUE(copy.changes_since(cursor).empty());
  EXPECT_TRUE(scene.grids()[second].grid.chunks().empty());
}

// The grids that instances place, found by a scan of all instances.
std::set<GridHandle> slow_placed_grids(const Scene& scene, InstanceFilter filter) {
  std::set<GridHandle> placed;
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    if (is_drawn(scene, instance, filter) && has_valid_transform(instance)) placed.insert(instance.grid);
  });
  return placed;
}

void edit_at_random(Scene& scene, std::mt19937& random) {
  const auto grids = scene.grids().handles();
  const auto instances = scene.instances().handles();
  const auto any = [&](const auto& all) { return all[random() % all.size()]; };
  switch (random() % 9) {
    case 0:
      scene.add_grid({});
      break;
    case 1:
    case 2:
      scene.add_instance(
          {.name = "", .grid = any(grids), .visible = random() % 2 == 0, .group = any(scene.groups().handles())});
      break;
    case 3:
      if (!instances.empty()) scene.remove_instance(any(instances));
      break;
    case 4:
      if (grids.size() > 2) scene.remove_grid(any(grids));
      break;
    case 5:
      if (!instances.empty()) scene.edit(any(instances)).grid = any(grids);
      break;
    case 6:
      if (!instances.empty()) scene.edit(any(instances)).voxel_size = static_cast<double>(random() % 3);
      break;
    case 7: {
      SceneGroup& group = scene.edit(any(scene.groups().handles()));
      group.visible = !group.visible;
      break;
    }
    default:
      scene.edit(any(grids)).grid.set({static_cast<int>(random() % 64), 0, 0}, 1);
  }
}

// The content of a scene, with its handles.
std::string text_of(const Scene& scene) {
  std::ostringstream text;
  const auto begin = [&](const char* kind, auto handle) -> std::ostream& {
    return text << '\n' << kind << ' ' << handle.index << ' ' << handle.generation << ' ';
  };
  scene.grids().for_each([&](GridHandle handle, const SceneGrid& grid) {
    begin("grid", handle) << grid.name << ' ' << grid.grid.voxel_count() << ' ' << grid.field.chunk_count();
  });
  scene.instances().for_each([&](InstanceHandle handle, const Instance& instance) {
    begin("instance", handle) << instance.grid.generation << ' ' << instance.voxel_size << ' ' << instance.visible;
  });
  scene.groups().for_each(
      [&](GroupHandle handle, const SceneGroup& group) { begin("group", handle) << group.visible; });
  scene.layers().for_each([&](LayerHandle handle, const SceneLayer& layer) { begin("layer", handle) << layer.name; });
  text << '\n' << scene.types.size() << ' ' << scene.lamps.size() << ' ' << scene.environment.has_value();
  return text.str();
}

// One snapshot is brought up to date again and again, by the scene or by later snapshots.
TEST(SceneChanges, UpdatedSnapshotEqualsNewOne) {
  std::mt19937 random(5);
  Scene scene;
  scene.add_grid({});
  scene.add_grid({.name = "field"});
  scene.add_group({.name = "group"});
  Scene kept = scene.snapshot();
  SceneChanges memory;
  ChangeCursor of_scene;
  ChangeCursor of_kept;
  for (int step = 0; step < 2'000; ++step) {
    edit_at_random(scene, random);
    switch (random() % 50) {
      case 0:
        scene.lamps.push_back({});
        break;
      case 1:
        scene.environment.emplace();
        break;
      case 2:
        EXPECT_TRUE(scene.types.add({.name = "type " + std::to_string(step)}));
        break;
      case 3:
        scene.add_layer({"layer"});
        break;
      case 4:  // not a snapshot of the scene any more
        kept.edit(kept.grids().handles().front()).grid.set({1, 1, 1}, 1);
        break;
      default:
        break;
    }
    if (random() % 3 == 0) continue;
    if (random() % 2 == 0) {
      scene.update_snapshot(kept, memory);
    } else {
      scene.snapshot().update_snapshot(kept, memory);
    }
    ASSERT_EQ(text_of(kept), text_of(scene)) << step;
    const SceneChanges changes = scene.changes_since(of_scene);
    const SceneChanges same = kept.changes_since(of_kept);
    ASSERT_EQ(changes.all, same.all) << step;
    ASSERT_EQ(changes.grids, same.grids) << step;
    ASSERT_EQ(changes.instances, same.instances) << step;
    ASSERT_EQ(changes.groups, same.groups) << step;
    ASSERT_EQ(changes.layers, same.layers) << step;
  }
}

// Snapshots know the loaded chunks of a grid, even if it has no chunk.
TEST(SceneChanges, UpdatedSnapshotHasLoadedChunksOfEmptyGrids) {
  Scene scene;
  const GridHandle handle = scene.add_grid({});
  SceneGrid& land = scene.edit(handle);
  Scene kept = scene.snapshot();
  SceneChanges memory;
  const auto expect_copied = [&](bool is_partial, bool is_loaded) {
    scene.update_snapshot(kept, memory);
    const SceneGrid& copy = kept.grids()[handle];
    EXPECT_EQ(copy.grid.is_partial(), is_partial);
    EXPECT_EQ(copy.field.is_partial(), is_partial);
    EXPECT_EQ(copy.grid.is_loaded(IVec3(5)), is_loaded);
    EXPECT_EQ(copy.field.is_loaded(IVec3(5)), is_loaded);
  };
  expect_copied(false, true);
  land.grid.make_partial();
  land.field.make_partial();
  expect_copied(true, false);
  land.grid.set_extent({IVec3(0), IVec3(2)});
  land.field.set_extent({IVec3(0), IVec3(2)});
  expect_copied(true, true);
}

// A consumer that keeps the voxel counts of placed grids, and fails at random before it has read all of them.
struct VoxelCounts {
  SceneFollower follower;
  std::map<GridHandle, std::int64_t> of;
  std::mt19937 random{7};

  void update(const Scene& scene, unsigned chance_of_failure) {
    SceneFollower::Update update(follower, scene);
    for (const GridHandle grid : update.touched()) {
      if (chance_of_failure != 0 && random() % chance_of_failure == 0) throw std::runtime_error("enough");
      if (follower.places(grid)) {
        of[grid] = scene.grids()[grid].grid.voxel_count();
      } else {
        of.erase(grid);
      }
    }
    update.commit();
  }
};

TEST(SceneFollower, FollowsPlacedGridsThroughFailures) {
  for (const InstanceFilter filter : {InstanceFilter::Visible, InstanceFilter::All}) {
    std::mt19937 random(5);
    Scene scene;
    scene.add_grid({});
    for (int i = 0; i < 3; ++i) scene.add_group({});
    VoxelCounts counts{SceneFollower(filter, SceneFollower::Transforms::Valid), {}};
    int failures = 0;
    for (int round = 0; round < 2'000; ++round) {
      for (std::size_t i = random() % 4; i > 0; --i) edit_at_random(scene, random);
      try {
        counts.update(scene, 3);
      } catch (const std::runtime_error&) {
        ++failures;
        continue;
      }
      std::set<GridHandle> known;
      for (const auto& [grid, count] : counts.of) {
        known.insert(grid);
        ASSERT_EQ(count, scene.grids()[grid].grid.voxel_count()) << round;
      }
      ASSERT_EQ(known, slow_placed_grids(scene, filter)) << round;
    }
    EXPECT_GT(failures, 100);
  }
}

TEST(SceneFollower, TouchesOnlyChangedGrids) {
  Scene scene;
  const GridHandle a = scene.add_grid({});
  const GridHandle b = scene.add_grid({});
  const InstanceHandle instance = scene.add_instance({.name = "", .grid = a});
  scene.add_instance({.name = "", .grid = b});
  SceneFollower follower;
  const auto touched = [&] {
    SceneFollower::Update update(follower, scene);
    std::vector<GridHandle> grids(update.touched().begin(), update.touched().end());
    update.commit();
    return grids;
  };
  EXPECT_EQ(touched(), (std::vector{a, b}));
  EXPECT_TRUE(touched().empty());
  scene.edit(b).grid.set({1, 1, 1}, 1);
  EXPECT_EQ(touched(), std::vector{b});
  scene.edit(instance).grid = b;
  EXPECT_EQ(touched(), (std::vector{a, b}));
  EXPECT_FALSE(follower.places(a));
  scene.edit(instance).position.x = 5.0;
  EXPECT_EQ(touched(), std::vector{b});
}

}  // namespace
}  // namespace quoin
