// The calling thread of a game's frame neither allocates while the player walks, nor frees large blocks.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/grid/connected.h>
#include <quoin/live/live_light.h>
#include <quoin/live/live_meshes.h>
#include <quoin/live/live_tracer.h>
#include <quoin/render/propagated_light.h>
#include <quoin/scene/scene_tracer.h>
#include <quoin/scene/solid_shapes.h>
#include <quoin/scene/sweep.h>
#include <quoin/stream/streamed_world.h>

#include "live/allocations_for_tests.h"
#include "store/world/world_for_tests.h"

namespace quoin {
namespace {

/// A game on streamed land, as one thread sees it.
class Game {
 public:
  explicit Game(bool is_smooth) {
    auto opened = StreamedWorld::open_or_create(folder_ / "land.quoin", {});
    EXPECT_TRUE(opened);
    world_.emplace(std::move(*opened));
    const auto grid = world_->add_terrain({.seed = 9, .is_smooth = is_smooth});
    EXPECT_TRUE(grid);
    grid_ = *grid;
    EXPECT_TRUE(world_->add_grid({.name = "a ship that is not placed"}));
    EXPECT_TRUE(world_->load_all({&viewer, 1}));
    meshes_.use_light(light_);
    meshes_.finish(world_->scene(), viewer.position);
    // Until workers have nothing left to do.
    for (int idle = 0; idle < 20; ++idle) {
      if (!frame()) idle = 0;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

  /// Runs one frame. Returns true if no surface changed and none is pending.
  bool frame() {
    EXPECT_TRUE(world_->update({&viewer, 1}));
    tracer_.update(world_->scene());
    const std::int64_t freed_before = large_frees_of_this_thread();
    meshes_.update(world_->scene(), viewer.position);
    bool is_idle = meshes_.pending() == 0 && !light_.is_late() && !tracer_.is_late();
    for (SurfaceUpdate& update : meshes_.take()) {
      is_idle = false;
      shown_[{static_cast<int>(update.content), update.chunk.x, update.chunk.y, update.chunk.z}] =
          std::move(update.surface);
    }
    light_.take();
    tracer_.take();
    freed_for_meshes += large_frees_of_this_thread() - freed_before;
    return is_idle;
  }
  void dig(DVec3 at) {
    SceneGrid& land = world_->scene().edit(grid_);
    land.grid.fill_sphere(at, 4.0, kAir);
    if (land.field.chunk_count() != 0) land.field.remove_sphere(at, 4.0);
  }

  /// Walks and falls for a frame, from a place above the ground.
  template <class Body>
  void walk(Body& body, SlideResult& result) const {
    const SlideOptions options{.floor = FloorOptions{.step_height = 1.1, .snap_distance = 0.6}};
    move_and_slide(tracer_.shown(), body, {0.08, -0.3, 0.02}, options, result);
    body.centre = result.centre;
  }

  std::int64_t freed_for_meshes = 0;  // large blocks, by the thread of the frames
  Viewer viewer{.position = {0.0, 120.0, 0.0}, .direction = {1.0, 0.0, 0.0}, .radius = 160.0};

 private:
  WorldFolder folder_;
  std::optional<StreamedWorld> world_;
  GridHandle grid_;
  LiveTracer tracer_;
  LiveLight light_;
  LiveMeshes meshes_;
  std::map<std::tuple<int, int, int, int>, std::shared_ptr<const ChunkSurface>> shown_;
};

std::int64_t median(std::vector<std::int64_t> counts) {
  std::ranges::sort(counts);
  return counts[counts.size() / 2];
}

TEST(FrameAllocations, AreNoneWhileWalking) {
  for (const bool is_smooth : {false, true}) {
    Game game(is_smooth);
    std::vector<std::int64_t> counts;
    for (int i = 0; i < 100; ++i) {
      game.viewer.position.x += 0.08;
      const std::int64_t before = allocations_of_this_thread();
      game.frame();
      counts.push_back(allocations_of_this_thread() - before);
    }
    EXPECT_EQ(median(counts), 0) << (is_smooth ? "smooth" : "blocky");
  }
}

template <class Body>
std::int64_t allocations_of_walking(const Game& game, Body body) {
  SlideResult result;
  std::vector<std::int64_t> counts;
  for (int i = 0; i < 400; ++i) {
    const std::int64_t before = allocations_of_this_thread();
    game.walk(body, result);
    counts.push_back(allocations_of_this_thread() - before);
  }
  EXPECT_GT(body.centre.x, 5.0) << "it walks";
  return median(counts);
}

TEST(FrameAllocations, AreNoneForBodiesThatWalk) {
  for (const bool is_smooth : {false, true}) {
    const Game game(is_smooth);
    EXPECT_EQ(allocations_of_walking(game, OrientedBox{{0.5, 120.0, 0.5}, {0.3, 0.9, 0.3}}), 0) << is_smooth;
    EXPECT_EQ(allocations_of_walking(game, Capsule{0.4, {0.5, 120.0, 0.5}, {0.0, 0.5, 0.0}}), 0) << is_smooth;
  }
}

TEST(FrameAllocations, AreFewInFlight) {
  Game game(false);
  std::vector<std::int64_t> counts;
  for (int i = 0; i < 300; ++i) {
    game.viewer.position.x += 2.0;
    const std::int64_t before = allocations_of_this_thread();
    game.frame();
    counts.push_back(allocations_of_this_thread() - before);
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
  }
  // Mostly those of the parts of tries that snapshots share and chunks change. Slow machines receive more chunks per
  // frame, and make more of them.
  EXPECT_LE(median(counts), 22);
}

// Returns the allocations of LiveMeshes::update per frame, in which some of 300 instances move.
std::int64_t allocations_of_moving(int moving, bool is_lit) {
  Scene scene;
  const VoxelType stone = *scene.types.add({.name = "stone"});
  std::vector<InstanceHandle> instances;
  for (int i = 0; i < 300; ++i) {
    SceneGrid grid;
    grid.grid.fill_box({{0, 0, 0}, {9, 8, 7}}, stone);
    instances.push_back(
        scene.add_instance({.grid = scene.add_grid(std::move(grid)), .position = {60.0 * i, 0.0, 0.0}}));
  }
  LiveMeshes meshes;
  LiveLight light;
  if (is_lit) meshes.use_light(light);
  meshes.finish(scene, {});
  (void)meshes.take();
  std::vector<std::int64_t> counts;
  for (int frame = 0; frame < 20; ++frame) {
    for (int i = 0; i < moving; ++i) scene.edit(instances[static_cast<std::size_t>(i)]).position.y += 0.5;
    const std::int64_t before = allocations_of_this_thread();
    meshes.update(scene, {});
    counts.push_back(allocations_of_this_thread() - before);
    EXPECT_TRUE(meshes.take().empty());
  }
  return median(counts);
}

TEST(FrameAllocations, AreNoneForMovingInstances) {
  for (const bool is_lit : {false, true}) {
    EXPECT_EQ(allocations_of_moving(1, is_lit), 0) << is_lit;
    EXPECT_EQ(allocations_of_moving(300, is_lit), 0) << is_lit;
  }
}

// Freeing a large block is a call of the system after `return_freed_memory`. Workers do it.
TEST(FrameAllocations, FreeNoLargeBlocksOfOldSurfaces) {
  for (const bool is_smooth : {false, true}) {
    Game game(is_smooth);
    game.freed_for_meshes = 0;
    for (int i = 0; i < 60; ++i) {
      game.dig({7.0 * (i % 9) - 30.0, 50.0 + i % 30, 5.0 * (i % 11) - 20.0});
      game.frame();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    EXPECT_EQ(game.freed_for_meshes, 0) << (is_smooth ? "smooth" : "blocky");
  }
}

// Updates without changes, with default threads, as a game calls them in each frame.
TEST(FrameAllocations, AreNoneWithoutChanges) {
  Scene scene;
  const VoxelType stone = *scene.types.add({.name = "stone"});
  for (int i = 0; i < 300; ++i) {
    SceneGrid grid;
    grid.grid.fill_box({{0, 0, 0}, {40, 8, 12}}, stone);
    scene.add_instance({.grid = scene.add_grid(std::move(grid)), .position = {60.0 * (i % 20), 0.0, 60.0 * (i / 20)}});
  }
  const Grid& grid = scene.grids()[scene.grids().handles().front()].grid;
  SolidShapes shapes;
  ConnectedPieces pieces;
  SceneTracer tracer(scene);
  LiveMeshes meshes;
  LiveLight light;
  light.finish(scene);
  meshes.finish(scene, {});
  (void)meshes.take();
  const auto frame = [&] {
    (void)shapes.update(grid, scene.types);
    (void)pieces.update(grid);
    (void)tracer.update();
    light.update(scene);
    light.take();
    meshes.update(scene, {});
    EXPECT_TRUE(meshes.take().empty());
  };
  frame();
  const std::int64_t before = allocations_of_this_thread();
  for (int i = 0; i < 100; ++i) frame();
  EXPECT_EQ(allocations_of_this_thread() - before, 0);
}

TEST(FrameAllocations, SnapshotsOfScenesAllocateLessThanOncePerGrid) {
  Scene scene;
  for (int i = 0; i < 300; ++i) {
    SceneGrid grid;
    grid.name = "a ship with a long name";
    grid.grid.set({i, 0, 0}, 1);
    const GridHandle handle = scene.add_grid(std::move(grid));
    scene.add_instance({.name = "", .grid = handle});
    (void)scene.grids()[handle].grid.cursor();  // from now on, its journal has records, which snapshots share
    scene.edit(handle).grid.set({i, 1, 0}, 1);
  }
  ChangeCursor cursor;
  (void)scene.changes_since(cursor);
  const std::int64_t before = allocations_of_this_thread();
  const Scene snapshot = scene.snapshot();
  const std::int64_t count = allocations_of_this_thread() - before;
  EXPECT_LT(count - 300, 100) << "apart from the names";
  EXPECT_EQ(snapshot.grids().size(), 300U);
}

TEST(FrameAllocations, UpdatedSnapshotsAllocateForChangedGridsOnly) {
  Scene scene;
  std::vector<InstanceHandle> instances;
  for (int i = 0; i < 300; ++i) {
    SceneGrid grid;
    grid.grid.set({i, 0, 0}, 1);
    instances.push_back(scene.add_instance({.name = "ship", .grid = scene.add_grid(std::move(grid))}));
  }
  Scene snapshot = scene.snapshot();
  SceneChanges memory;
  for (int frame = 0; frame < 4; ++frame) {
    for (const InstanceHandle instance : instances) scene.edit(instance).position.y += 1.0;
    scene.edit(scene.instances()[instances[7]].grid).grid.set({frame, 1, 0}, 1);
    const std::int64_t before = allocations_of_this_thread();
    scene.update_snapshot(snapshot, memory);
    const std::int64_t count = allocations_of_this_thread() - before;
    if (frame == 0) continue;  // lists grow
    EXPECT_LE(count, 3) << "the implementations of a grid and of its field";
    EXPECT_EQ(snapshot.instances()[instances[9]].position.y, frame + 1.0);
  }
}

// After a snapshot, a chunk that comes or goes copies parts of one list of loaded chunks: not those of the field, too.
TEST(FrameAllocations, LoadedChunksAreOneListOfGridAndField) {
  Scene scene;
  SceneGrid& land = scene.edit(scene.add_grid({.name = "land"}));
  land.grid.make_partial();
  land.field.make_partial();
  for (int z = 0; z < 32; ++z) {
    for (int x = 0; x < 32; ++x) land.grid.load_chunk({x, 0, z}, Chunk(kAir), land.field, std::nullopt);
  }
  (void)scene.cursor();
  for (int i = 0; i < 10; ++i) {
    const Scene snapshot = scene.snapshot();
    const std::int64_t before = allocations_of_this_thread();
    for (int y = 1; y < 4; ++y) land.grid.load_chunk({3 * i, y, 7}, Chunk(kAir), land.field, std::nullopt);
    land.grid.unload_chunk({3 * i, 0, 8}, land.field);
    const std::int64_t count = allocations_of_this_thread() - before;
    EXPECT_LE(count, i == 0 ? 8 : 2) << "the root and the node of 16^3 chunks; first, the blocks of two journals";
  }
}

// A snapshot shares the columns of the light's domain. A chunk that arrives changes nine of them.
TEST(FrameAllocations, LightCopiesOnlyColumnsAroundNewChunk) {
  constexpr int kColumns = 48;
  Scene scene;
  scene.types = coloured_types(1);
  Grid& land = scene.edit(scene.add_grid({.name = "land"})).grid;
  for (int z = 0; z < kColumns; ++z) {
    for (int x = 0; x < kColumns; ++x) land.put_chunk({x, 0, z}, Chunk(1));
  }
  PropagatedLight light;
  light.update(land, scene.types, {1});
  const auto allocations_of_update = [&](IVec3 chunk) {
    land.put_chunk(chunk, Chunk(1));
    const std::int64_t before = allocations_of_this_thread();
    light.update(land, scene.types, {1});
    return allocations_of_this_thread() - before;
  };
  (void)allocations_of_update({10, 1, 10});
  const std::int64_t alone = allocations_of_update({20, 1, 20});
  const PropagatedLight snapshot = light.snapshot();
  EXPECT_LT(allocations_of_update({30, 1, 30}), alone + kColumns * kColumns);
}

TEST(FrameAllocations, SavesAllocateLessThanOncePerChunkOrInstance) {
  const WorldFolder folder;
  auto store = WorldStore::create(folder / "w.quoin");
  if (!store && store.error().code == ErrorCode::Unsupported) GTEST_SKIP() << to_string(store.error());
  ASSERT_TRUE(store) << to_string(store.error());
  constexpr int kCount = 500;
  Scene scene;
  scene.types = coloured_types(3);
  const GridHandle grid = scene.add_grid({.name = "ground"});
  for (int i = 0; i < kCount; ++i) scene.edit(grid).grid.set({64 * i, 0, 0}, 1);
  WorldSaver saver;
  std::int64_t of_begin = 0;
  const auto allocations_of_save = [&](VoxelType type) {
    for (int i = 0; i < kCount; ++i) scene.edit(grid).grid.set({64 * i, 1, 0}, type);
    saver.follow(scene);
    const std::int64_t before = allocations_of_this_thread();
    EXPECT_TRUE(saver.begin(*store, scene));
    of_begin = allocations_of_this_thread() - before;
    EXPECT_TRUE(saver.step(*store, 1e9));
    const std::int64_t count = allocations_of_this_thread() - before;
    EXPECT_TRUE(store->flush());
    return count;
  };
  (void)allocations_of_save(1);
  EXPECT_LT(allocations_of_save(2), kCount / 5);
  // An instance needs a node in the list of changes. Its name is shared with the save before.
  std::vector<InstanceHandle> ships;
  for (int i = 0; i < kCount; ++i) {
    ships.push_back(scene.add_instance({.name = "a ship with a long name " + std::to_string(i), .grid = grid}));
  }
  (void)allocations_of_save(1);
  for (const InstanceHandle ship : ships) scene.edit(ship).position.x += 1.0;
  EXPECT_LT(allocations_of_save(2), kCount + kCount / 5);
  EXPECT_LT(of_begin, kCount / 10) << "steps do the rest";
  for (const InstanceHandle ship : ships) scene.edit(ship).position.x += 1.0;
  saver.follow(scene);
  for (const InstanceHandle ship : ships) scene.edit(ship).position.x += 1.0;
  const std::int64_t before_follow = allocations_of_this_thread();
  saver.follow(scene);
  EXPECT_LT(allocations_of_this_thread() - before_follow, 10) << "known changes";
  (void)allocations_of_save(1);
  for (const InstanceHandle ship : ships) (void)scene.edit(ship);  // as before
  EXPECT_LT(allocations_of_save(3), kCount / 5);
}

}  // namespace
}  // namespace quoin
