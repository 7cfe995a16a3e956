// Light kept up to date by workers: it always equals light computed from scratch for the voxels it comes with.

#include <quoin/live/live_light.h>

#include <array>
#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "live/light_worker.h"
#include "live/placed_light_world_for_tests.h"
#include "render/light/surface/light_world_for_tests.h"

namespace quoin {
namespace {

constexpr IBox kAround{{-48, -48, -48}, {48, 48, 48}};

// Calls `visit(voxel, light)` with the first voxel of each row of the box.
template <class Visit>
void for_each_row(const PropagatedLight& light, const IBox& box, const Visit& visit) {
  std::array<std::uint16_t, kChunkEdge> row;
  const IVec3 first = chunk_of(box.min) * kChunkEdge;
  for (int z = box.min.z; z < box.max.z; ++z) {
    for (int y = box.min.y; y < box.max.y; ++y) {
      for (int x = first.x; x < box.max.x; x += kChunkEdge) {
        light.read_row({x, y, z}, row);
        visit(IVec3{x, y, z}, row);
      }
    }
  }
}

void expect_equal(const PropagatedLight& light, const PropagatedLight& wanted) {
  std::array<std::uint16_t, kChunkEdge> other;
  for_each_row(light, kAround, [&](IVec3 first, const auto& row) {
    wanted.read_row(first, other);
    ASSERT_EQ(row, other) << first.x << " " << first.y << " " << first.z;
  });
}

void expect_right(const GridLight& lit, const VoxelRegistry& types) {
  PropagatedLight wanted;
  wanted.update(*lit.voxels, types);
  expect_equal(*lit.light, wanted);
}

struct LampScene : PlacedLightWorld {
  using PlacedLightWorld::PlacedLightWorld;
  [[nodiscard]] Grid& grid() { return scene.edit(handle).grid; }
  void edit(std::mt19937& random) {
    for (int i = 0; i < 5; ++i) grid().set(LightWorld::somewhere(random), static_cast<VoxelType>(random() % 5));
    if (random() % 8 == 0) grid().fill_sphere(DVec3(LightWorld::somewhere(random)), 6.0, kAir);
    if (random() % 8 == 0)
      grid().fill_box({{-30, 12, -30}, {40, 13, 30}}, random() % 2 == 0 ? kAir : LightWorld::kStone);
  }
};

TEST(LiveLight, ShownLightIsAlwaysCorrect) {
  LampScene world(5);
  LiveLight light;
  EXPECT_EQ(light.shown().of(world.handle).light->at({0, 0, 0}), (LightLevels{15, 0, 0, 0})) << "open sky at first";
  std::mt19937 random(7);
  int taken = 0;
  for (int i = 0; i < 60; ++i) {
    world.edit(random);
    light.update(world.scene);
    bool is_taken = light.take();
    // Waits for a result from time to time.
    while (i % 8 == 7 && !is_taken) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      is_taken = light.take();
    }
    if (!is_taken) continue;
    ++taken;
    expect_right(light.shown().of(world.handle), world.scene.types);
    ASSERT_FALSE(HasFatalFailure());
  }
  light.finish(world.scene);
  EXPECT_FALSE(light.is_late());
  EXPECT_FALSE(light.take());
  PropagatedLight wanted;
  wanted.update(world.grid(), world.scene.types);
  expect_equal(*light.shown().of(world.handle).light, wanted);
  EXPECT_GT(taken, 4);
}

TEST(LiveLight, GivesSameLightForAnyWorkerCount) {
  std::vector<std::vector<std::uint16_t>> results;
  for (const unsigned workers : {1U, 3U}) {
    LampScene world(9);
    LiveLight light({{}, {workers}});
    std::mt19937 random(3);
    for (int i = 0; i < 30; ++i) {
      world.edit(random);
      light.update(world.scene);
      if (workers == 1) light.take();
    }
    light.finish(world.scene);
    std::vector<std::uint16_t>& result = results.emplace_back();
    for_each_row(*light.shown().of(world.handle).light, kAround,
                 [&](IVec3, const auto& row) { result.insert(result.end(), row.begin(), row.end()); });
  }
  EXPECT_TRUE(results[0] == results[1]);
}

// Readers use the shown light while workers compute the next light and the scene is edited.
TEST(LiveLight, AllowsReadingWhileWorkersRun) {
  LampScene world(2);
  LiveLight light({{}, {2}});
  light.finish(world.scene);
  std::mt19937 random(8);
  for (int i = 0; i < 20; ++i) {
    const GridLight lit = light.shown().of(world.handle);
    std::uint64_t first = 0;
    std::uint64_t again = 0;
    const auto sum = [&](std::uint64_t& of) {
      for_each_row(*lit.light, {{-30, -30, -30}, {30, 10, 30}},
                   [&](IVec3 voxel, const auto& row) { of = of * 31 + row[5] + lit.voxels->get(voxel); });
    };
    std::thread reader([&] { sum(first); });
    world.edit(random);
    light.update(world.scene);
    reader.join();
    sum(again);
    EXPECT_EQ(first, again);
    light.take();
  }
}

// A consumer that copies only the reported changes has all of the light.
TEST(LiveLight, ReportsChangedRegions) {
  LampScene world(4);
  LiveLight light;
  std::map<std::array<int, 3>, std::vector<std::uint16_t>> copy;  // by chunk row
  ChangeCursor cursor;
  std::mt19937 random(6);
  int reported = 0;
  const auto follow = [&](bool is_first) {
    const PropagatedLight& now = *light.shown().of(world.handle).light;
    const GridChanges changes = now.changes_since(cursor);
    EXPECT_EQ(changes.all, is_first);
    std::vector<IBox> boxes;
    if (changes.all) boxes.push_back({{-128, -128, -128}, {128, 128, 128}});
    for (const ChunkChange& change : changes.items_unless_all()) {
      const IVec3 low = change.chunk * kChunkEdge;
      boxes.push_back({change.box.min + low, change.box.max + low});
    }
    reported += static_cast<int>(changes.items_unless_all().size());
    for (const IBox& box : boxes) {
      for_each_row(now, box, [&](IVec3 voxel, const auto& row) {
        copy[{voxel.x, voxel.y, voxel.z}] = {row.begin(), row.end()};
      });
    }
  };
  light.finish(world.scene);
  follow(true);
  for (int i = 0; i < 20; ++i) {
    world.edit(random);
    light.update(world.scene);
    if (i % 3 == 0) light.finish(world.scene);
    light.take();
    follow(false);
  }
  light.finish(world.scene);
  follow(false);
  EXPECT_GT(reported, 20);
  for_each_row(*light.shown().of(world.handle).light, kAround, [&](IVec3 voxel, const auto& row) {
    ASSERT_EQ((copy.at({voxel.x, voxel.y, voxel.z})), (std::vector<std::uint16_t>(row.begin(), row.end())));
  });
}

TEST(LiveLight, FollowsTypesGridsAndFields) {
  LampScene world(1);
  LiveLight light;
  light.finish(world.scene);
  VoxelProperties dark = world.scene.types[LightWorld::kLamp];
  dark.emission = 0.0F;
  world.scene.types.replace(LightWorld::kLamp, dark);
  light.update(world.scene);
  EXPECT_TRUE(light.is_late());
  light.finish(world.scene);
  expect_right(light.shown().of(world.handle), world.scene.types);

  const GridHandle other = world.scene.add_grid({});
  light.finish(world.scene);
  DensityGrid& field = world.scene.edit(other).field;
  field.add_sphere({10.0, 10.0, 10.0}, 8.0, LightWorld::kStone);
  EXPECT_EQ(light.shown().of(other).light->at({10, 10, 10}).sky, 15);
  light.finish(world.scene);
  EXPECT_EQ(light.shown().of(other).light->at({10, 10, 10}).sky, 0);
  expect_right(light.shown().of(other), world.scene.types);

  world.scene.remove_grid(other);
  light.finish(world.scene);
  EXPECT_EQ(light.shown().of(other).light->at({10, 10, 10}).sky, 15) << "a grid that is not there has open sky";
  light.update(world.scene);
  EXPECT_FALSE(light.is_late()) << "nothing changed";

  Scene nothing;
  light.finish(nothing);
  EXPECT_EQ(light.shown().of(world.handle).light->at({0, -20, 0}).sky, 15);
}

TEST(LiveLight, IgnoresMovedInstances) {
  LampScene world(1);
  const InstanceHandle instance = world.scene.add_instance({"another", world.handle});
  LiveLight light;
  light.finish(world.scene);
  world.scene.edit(instance).position.x += 1.0;
  light.update(world.scene);
  EXPECT_FALSE(light.is_late());
}

TEST(LiveLight, IgnoresVoxelDataAndNames) {
  LampScene world(1);
  ASSERT_TRUE(world.grid().set({0, 0, 0}, LightWorld::kStone) || world.grid().get({0, 0, 0}) == LightWorld::kStone);
  LiveLight light;
  light.finish(world.scene);
  ChangeCursor scene = world.scene.cursor();
  ASSERT_TRUE(world.grid().set_data({0, 0, 0}, {.state = 1}));
  world.scene.edit(world.handle).name = "another";
  EXPECT_EQ(world.scene.changes_since(scene).grids.size(), 1U) << "the scene reports it";
  light.update(world.scene);
  EXPECT_FALSE(light.is_late());

  ASSERT_TRUE(world.grid().set({0, 0, 0}, kAir)) << "which takes data and stone away";
  light.update(world.scene);
  EXPECT_TRUE(light.is_late());
  light.finish(world.scene);
  expect_right(light.shown().of(world.handle), world.scene.types);

  world.scene.edit(world.handle).field.add_sphere({5.0, 5.0, 5.0}, 3.0, LightWorld::kStone);
  light.update(world.scene);
  EXPECT_TRUE(light.is_late()) << "fields are in light's way, too";
  light.finish(world.scene);
  world.scene.remove_grid(world.handle);
  light.update(world.scene);
  EXPECT_TRUE(light.is_late());
}

TEST(LightWorker, DetachCancelsRequestThatHasNotBegun) {
  Scene scene;
  LightWorker worker({{}, {1}});
  std::atomic<int> calls = 0;
  std::atomic<bool> is_blocked = true;
  worker.attach([&](const std::shared_ptr<LitState>&) {
    worker.note_received();
    ++calls;
    while (is_blocked) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  });
  worker.update_for_receiver(scene, 1, true);
  while (calls == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  worker.update_for_receiver(scene, 2, true);
  EXPECT_TRUE(worker.is_state_pending()) << "requested while the receiver is called";
  std::thread opener([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    is_blocked = false;
  });
  worker.detach();
  opener.join();
  EXPECT_EQ(calls, 1);
  EXPECT_TRUE(worker.is_late());
  worker.update(scene);
  EXPECT_TRUE(worker.is_late());
  worker.wait();
  EXPECT_FALSE(worker.is_late()) << "its owner gets the cancelled light";
  EXPECT_FALSE(worker.take()) << "it is shown";
}

}  // namespace
}  // namespace quoin
