#include <quoin/stream/streamed_world.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <thread>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/live/live_meshes.h>
#include <quoin/store/world_maintenance.h>
#include <quoin/terrain/terrain.h>

#include "core/database/connection.h"
#include "stream/streamed_world_fixture.h"

namespace quoin {
namespace {

using Key = std::tuple<int, int, int>;

TEST_F(StreamedWorldTest, LoadsOnlyChunksAroundViewer) {
  auto generator = std::make_shared<PatternGround>();
  StreamedWorld world = ground(path(), generator);
  const Viewer viewer{.position = {10.0, 5.0, 10.0}, .radius = 150.0};
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  const Grid& grid = world.scene().grids()[only_grid(world)].grid;
  for (int z = -4; z <= 4; ++z) {
    for (int y = -4; y <= 4; ++y) {
      for (int x = -4; x <= 4; ++x) {
        const IVec3 chunk{x, y, z};
        const DVec3 low = DVec3(chunk) * 64.0;
        const double distance = glm::length(glm::clamp(viewer.position, low, low + 64.0) - viewer.position);
        // Air above and below the generator's chunks is known without loading it.
        EXPECT_EQ(grid.is_loaded(chunk), distance <= 150.0 || y < -2 || y >= 2) << x << " " << y << " " << z;
        if (!grid.is_loaded(chunk)) continue;
        const Chunk* const held = grid.find_chunk(chunk);
        EXPECT_EQ(held == nullptr ? Chunk(kAir) : *held, y >= -2 ? PatternGround::of(chunk) : Chunk(kAir));
      }
    }
  }
  const StreamStats stats = world.stats();
  EXPECT_EQ(stats.missing_chunks, 0U);
  EXPECT_EQ(stats.complete_radius, 150.0);
  EXPECT_EQ(stats.loaded_chunks, grid.loaded_chunks().size());
  EXPECT_TRUE(world.take_problems().empty());
}

// Another thread may draw the scene during each `plan`, the first one too.
TEST_F(StreamedWorldTest, PlanDoesNotLimitGrids) {
  const Viewer viewer{.radius = 150.0};
  {
    StreamedWorld world = ground(path(), std::make_shared<PatternGround>());
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
    ASSERT_TRUE(world.flush().has_value());
  }
  auto world = StreamedWorld::open(path(), WorldAccess::Read);  // without its generator
  ASSERT_TRUE(world.has_value()) << to_string(world.error());
  const Grid& grid = world->scene().grids()[only_grid(*world)].grid;
  const IBox before = grid.extent();
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(world->plan({&viewer, 1}).has_value());
    EXPECT_EQ(grid.extent(), before);
    EXPECT_TRUE(world->has_chunks_to_move());
    EXPECT_FALSE(world->stats().is_complete);
    // An unlimited grid has endless air around the viewer, which workers need not look up in the file.
    EXPECT_EQ(world->stats().wanted_chunks, 0U);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));  // workers plan meanwhile
  }
  ASSERT_TRUE(world->update({&viewer, 1}).has_value());
  EXPECT_NE(grid.extent(), before);
  ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
  EXPECT_TRUE(world->stats().is_complete);
  EXPECT_FALSE(world->has_chunks_to_move());
  EXPECT_GT(world->stats().loaded_chunks, 0U);
}

TEST_F(StreamedWorldTest, KeepsEditsAfterEvictionAndGeneratesOnce) {
  auto generator = std::make_shared<PatternGround>();
  {
    StreamedWorld world = ground(path(), generator);
    const GridHandle handle = only_grid(world);
    Viewer viewer{.position = {0.0, 0.0, 0.0}, .radius = 100.0};
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
    EXPECT_TRUE(world.scene().edit(handle).grid.set(3, -3, 3, 3));
    EXPECT_TRUE(world.scene().edit(handle).grid.set_data({3, -3, 3}, {9, {}}));
    viewer.position.x = 5000.0;
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
    EXPECT_FALSE(world.is_loaded(handle, {0, -1, 0}));
    EXPECT_EQ(world.scene().grids()[handle].grid.get(3, -3, 3), kAir);
    viewer.position.x = 0.0;
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
    EXPECT_EQ(world.scene().grids()[handle].grid.get(3, -3, 3), 3);
    EXPECT_EQ(world.scene().grids()[handle].grid.data({3, -3, 3}).state, 9U);
    EXPECT_EQ(generator->most_asked(), 1);
  }
  const std::size_t asked = generator->asked();
  StreamedWorld world = ground(path(), generator);
  const Viewer viewer{.position = {0.0, 0.0, 0.0}, .radius = 100.0};
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  EXPECT_EQ(world.scene().grids()[only_grid(world)].grid.get(3, -3, 3), 3);
  EXPECT_EQ(world.scene().instances().size(), 1U);
  EXPECT_EQ(generator->asked(), asked);
  EXPECT_EQ(generator->most_asked(), 1);
}

// With updates that have no time, a save takes several of them.
TEST_F(StreamedWorldTest, SavesManyEditsOfOneMomentInSeveralUpdates) {
  StreamOptions options;
  options.update_seconds = 1e-9;
  options.save_interval = std::chrono::hours(1);
  StreamedWorld world = ground(path(), std::make_shared<PatternGround>(), options);
  const GridHandle handle = only_grid(world);
  Viewer viewer{.position = {0.0, 0.0, 0.0}, .radius = 500.0};
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  std::vector<IVec3> edited;
  for (const IVec3 chunk : world.scene().grids()[handle].grid.loaded_chunks()) {
    if (chunk.y == -1) edited.push_back(chunk);
  }
  ASSERT_GT(edited.size(), 150U);
  const auto edit_all = [&](VoxelType type) {
    for (const IVec3 chunk : edited) {
      if (world.is_loaded(handle, chunk)) world.scene().edit(handle).grid.set(chunk * kChunkEdge, type);
    }
  };
  // Returns the type that the store has, on disk or pending.
  const auto stored = [&](IVec3 chunk) {
    const auto found = world.store().load_chunk({0, 0, chunk});
    return found && *found ? (*found)->voxels.get(0, 0, 0) : kAir;
  };
  edit_all(2);
  viewer.position.x = 1e5;  // chunks that leave are saved first
  for (int i = 0; stored(edited.front()) != 2; ++i) {
    ASSERT_LT(i, 50'000);
    ASSERT_TRUE(world.update({&viewer, 1}).has_value());
    const bool is_saved = stored(edited.front()) == 2;
    for (const IVec3 chunk : edited) {
      ASSERT_EQ(stored(chunk) == 2, is_saved) << "a save is there as a whole, or not at all";
      ASSERT_TRUE(is_saved || world.is_loaded(handle, chunk)) << "unsaved edits are in memory";
    }
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  for (const IVec3 chunk : edited) ASSERT_EQ(stored(chunk), 2);
  edit_all(3);
  ASSERT_TRUE(world.flush());
  viewer.position.x = 0.0;
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  const Grid& grid = world.scene().grids()[handle].grid;
  for (const IVec3 chunk : edited) ASSERT_GE(grid.get(chunk * kChunkEdge), 2);
}

TEST_F(StreamedWorldTest, SavesOnlyEditedChunksAfterManyFrames) {
  StreamOptions options;
  options.save_interval = std::chrono::hours(1);
  StreamedWorld world = ground(path(), std::make_shared<PatternGround>(), options);
  const GridHandle handle = only_grid(world);
  const Viewer viewer{.radius = 200.0};
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  ASSERT_TRUE(world.flush());
  const std::uint64_t before = world.store().stats().saved_chunks;
  for (int frame = 0; frame < 10'000; ++frame) {  // more than a journal keeps
    world.scene().edit(handle).grid.set(1, -1, 1, static_cast<VoxelType>(1 + frame % 2));
    ASSERT_TRUE(world.update({&viewer, 1}).has_value());
  }
  ASSERT_TRUE(world.flush());
  EXPECT_EQ(world.store().stats().saved_chunks - before, 1U);
}

TEST_F(StreamedWorldTest, UnloadsSavedChunksWhileOthersAreEdited) {
  StreamOptions options;
  options.save_interval = std::chrono::hours(1);
  StreamedWorld world = ground(path(), std::make_shared<PatternGround>(), options);
  const GridHandle handle = only_grid(world);
  Viewer viewer{.radius = 200.0};
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  const std::uint64_t unloaded = world.stats().chunks_unloaded;
  viewer.position.x = 1e5;
  VoxelType type = 1;
  for (int i = 0; i < 5000 && world.is_loaded(handle, {0, 0, 1}); ++i) {
    type = static_cast<VoxelType>(3 - type);
    if (world.is_loaded(handle, {0, -1, 0})) world.scene().edit(handle).grid.set(1, -1, 1, type);
    ASSERT_TRUE(world.update({&viewer, 1}).has_value());
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_FALSE(world.is_loaded(handle, {0, 0, 1}));
  EXPECT_GT(world.stats().chunks_unloaded, unloaded + 10);
}

TEST_F(StreamedWorldTest, SavesEditsOnDestruction) {
  auto generator = std::make_shared<PatternGround>();
  {
    StreamedWorld world = ground(path(), generator);
    const Viewer viewer{.radius = 70.0};
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
    world.scene().edit(only_grid(world)).grid.set(1, 1, 1, 2);
    const auto number = world.number_of(world.scene().grids().handles().front());
    ASSERT_TRUE(number);
    EXPECT_FALSE(world.number_of(GridHandle{}));
    ASSERT_TRUE(world.apply({*number, WorldEdit::SetVoxels{{{{9000, 1, 1}, 3}}}}).has_value());
  }
  EXPECT_TRUE(check_world(path())->damage.empty());
  const auto loaded = load_world(*WorldStore::open(path(), WorldAccess::Read));
  ASSERT_TRUE(loaded.has_value());
  const Grid& grid = loaded->loaded.scene.grids()[loaded->loaded.scene.grids().handles().front()].grid;
  EXPECT_EQ(grid.get(1, 1, 1), 2);
  EXPECT_EQ(grid.get(9000, 1, 1), 3);
}

TEST_F(StreamedWorldTest, KeepsBudgetAndNearestChunks) {
  auto generator = std::make_shared<PatternGround>();
  StreamOptions options;
  std::size_t others = 0;
  options.other_bytes = [&] { return others; };
  options.budget_bytes = std::size_t{4} << 20;
  StreamedWorld world = ground(path(), generator, options);
  Viewer viewer{.position = {32.0, -10.0, 32.0}, .radius = 700.0};
  std::size_t most = 0;
  for (int step = 0; step < 25; ++step) {
    viewer.position.x += 20.0;
    for (int i = 0; i < 20; ++i) {
      ASSERT_TRUE(world.update({&viewer, 1}).has_value());
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    const StreamStats stats = world.stats();
    most = std::max(most, stats.loaded_bytes);
    // Simulates meshes and other data derived from loaded chunks.
    others = 3000 * stats.loaded_chunks;
    EXPECT_LE(stats.loaded_bytes + stats.other_bytes, options.budget_bytes + options.budget_bytes / 4) << step;
  }
  EXPECT_GT(most, options.budget_bytes / 16);
  EXPECT_TRUE(world.is_loaded(only_grid(world), chunk_of(IVec3(viewer.position))));
}

TEST_F(StreamedWorldTest, EditsReachUnloadedChunks) {
  auto generator = std::make_shared<PatternGround>();
  StreamedWorld world = ground(path(), generator);
  const Viewer viewer{.radius = 100.0};
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  const std::size_t loaded = world.stats().loaded_chunks;
  ASSERT_TRUE(world.apply({0, WorldEdit::FillBox{{{-10, -10, -10}, {3000, -5, 3}}, 3}}).has_value());
  EXPECT_GT(world.stats().waiting_edits, 0U);
  ASSERT_TRUE(world.apply({0, WorldEdit::SetVoxels{{{{2000, -6, 0}, 2}}}}).has_value());  // later than the box edit
  ASSERT_TRUE(world.flush().has_value());
  EXPECT_EQ(world.stats().waiting_edits, 0U);
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  EXPECT_LT(world.stats().loaded_chunks, loaded + 10);  // keeps only nearby chunks of those on the way
  const auto kept = world.store().load_chunk({0, 0, chunk_of(IVec3{2000, -6, 0})});
  ASSERT_TRUE(kept.has_value() && kept->has_value());
  EXPECT_EQ((*kept)->voxels.get(local_of(IVec3{2000, -6, 0})), 2);
  EXPECT_EQ((*kept)->voxels.get(local_of(IVec3{2001, -6, 0})), 3);
  EXPECT_EQ(world.scene().grids()[only_grid(world)].grid.get(5, -6, 0), 3);
  EXPECT_EQ(world.apply({7, WorldEdit::FillBox{}}).error().code, ErrorCode::InvalidArgument);
}

TEST_F(StreamedWorldTest, MeshesNoWallsAtUnloadedChunks) {
  auto generator = std::make_shared<PatternGround>();
  StreamedWorld world = ground(path(), generator);
  LiveMeshes meshes;
  const Viewer viewer{.position = {32.0, 10.0, 32.0}, .radius = 200.0};
  std::map<Key, std::size_t> quads;
  const auto follow = [&](const Viewer& now) {
    ASSERT_TRUE(world.load_all({&now, 1}).has_value());
    meshes.finish(world.scene(), now.position);
    for (const SurfaceUpdate& update : meshes.take()) {
      const Key key{update.chunk.x, update.chunk.y, update.chunk.z};
      if (update.surface == nullptr) {
        quads.erase(key);
      } else {
        quads[key] = update.surface->quads.size();
        for (const SurfaceRegion& region : update.surface->regions) {
          for (const Direction side : {Direction::PosX, Direction::NegX, Direction::PosZ, Direction::NegZ}) {
            const auto d = static_cast<std::size_t>(side);
            EXPECT_EQ(region.opaque[d], region.opaque[d + 1]) << "a wall";
          }
        }
      }
    }
  };
  follow(viewer);
  // Endless ground from y = -128 to 0.
  ASSERT_FALSE(quads.empty());
  const Grid& grid = world.scene().grids()[only_grid(world)].grid;
  for (const auto& [chunk, count] : quads) {
    EXPECT_TRUE(grid.is_loaded_around({std::get<0>(chunk), std::get<1>(chunk), std::get<2>(chunk)}));
  }
  EXPECT_TRUE(quads.contains({0, -1, 0}));
  Viewer far = viewer;
  far.position.x = 1000.0;
  follow(far);
  EXPECT_FALSE(quads.contains({0, -1, 0}));
  EXPECT_TRUE(quads.contains({15, -1, 0}));
}

TEST_F(StreamedWorldTest, StreamsFieldsLikeVoxels) {
  Viewer viewer{.position = {100.0, 100.0, 100.0}, .radius = 130.0};
  {
    auto world = StreamedWorld::open_or_create(path());
    ASSERT_TRUE(world.has_value());
    const auto grid = world->add_terrain({.seed = 3, .height = 2, .is_smooth = true});
    ASSERT_TRUE(grid.has_value()) << to_string(grid.error());
    ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
    DensityGrid& field = world->scene().edit(*grid).field;
    EXPECT_GT(field.chunk_count(), 4U);
    EXPECT_GT(field.add_sphere({100.0, 110.0, 100.0}, 12.0, 1), 0);
    LiveMeshes meshes;
    meshes.finish(world->scene(), viewer.position);
    std::set<Key> drawn;
    const auto take = [&] {
      for (const SurfaceUpdate& update : meshes.take()) {
        const Key key{update.chunk.x, update.chunk.y, update.chunk.z};
        if (update.surface == nullptr) {
          drawn.erase(key);
        } else {
          drawn.insert(key);
        }
      }
    };
    take();
    EXPECT_FALSE(drawn.empty());
    viewer.position.x = 2000.0;
    ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
    EXPECT_FALSE(world->is_loaded(*grid, {1, 1, 1}));
    meshes.finish(world->scene(), viewer.position);
    take();
    EXPECT_FALSE(drawn.empty());
    for (const Key& chunk : drawn) EXPECT_GT(std::get<0>(chunk), 25);  // unloaded chunks are not drawn
    viewer.position.x = 100.0;
    ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
    EXPECT_LT(world->scene().grids()[*grid].field.density({100, 110, 100}), 0.0F);
  }
  // The landscape continues when the world is opened again.
  auto world = StreamedWorld::open(path(), WorldAccess::Write);
  ASSERT_TRUE(world.has_value()) << to_string(world.error());
  viewer.position.z = 1500.0;
  ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
  EXPECT_GT(world->stats().chunks_made, 0U);
  EXPECT_GT(world->scene().grids()[only_grid(*world)].field.chunk_count(), 4U);
}

TEST_F(StreamedWorldTest, MatchesTerrainGeneratedInOnePiece) {
  VoxelRegistry types;
  const auto filled = add_terrain_types(types);
  const auto whole = generate_terrain({.seed = 5, .size = {8, 4, 8}}, *filled);
  VoxelRegistry again;
  const auto generator = make_terrain_generator({.seed = 5, .height = 2}, again);
  ASSERT_TRUE(generator.has_value());
  for (int z = 1; z < 3; ++z) {
    for (int y = 0; y < 2; ++y) {
      for (int x = 1; x < 3; ++x) {
        const Chunk* const expected = whole->find_chunk(x, y, z);
        EXPECT_EQ((*generator)->make({x, y, z}, {})->voxels, expected == nullptr ? Chunk(kAir) : *expected);
      }
    }
  }
  EXPECT_FALSE(make_terrain_generator({.height = 0}, again).has_value());
  EXPECT_FALSE(make_terrain_generator({.height = 17}, again).has_value());
}

TEST_F(StreamedWorldTest, KeepsEditsInMemoryWhenReadOnly) {
  auto generator = std::make_shared<PatternGround>();
  Viewer viewer{.radius = 100.0};
  {
    StreamedWorld world = ground(path(), generator);
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  }
  auto world = StreamedWorld::open(path(), WorldAccess::Read);
  ASSERT_TRUE(world.has_value()) << to_string(world.error());
  const GridHandle grid = only_grid(*world);
  world->use_generator(grid, generator);
  ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
  EXPECT_TRUE(world->scene().edit(grid).grid.set(3, 3, 3, 2));
  viewer.position.x = 4000.0;
  ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
  EXPECT_TRUE(world->is_loaded(grid, {0, 0, 0}));
  EXPECT_FALSE(world->is_loaded(grid, {0, -1, 0}));
  EXPECT_EQ(world->scene().grids()[grid].grid.get(3, 3, 3), 2);
  EXPECT_TRUE(world->flush().has_value());
}

TEST_F(StreamedWorldTest, SavesWaitingEditsWithNewTypes) {
  {
    StreamedWorld world = ground(path(), std::make_shared<PatternGround>());
    const VoxelType fresh = world.scene().types.add(coloured_type(9)).value();
    ASSERT_TRUE(world.apply({0, WorldEdit::SetVoxels{{{{900, 1, 1}, fresh}}}}).has_value());
    EXPECT_EQ(world.apply({0, WorldEdit::SetVoxels{{{{900, 1, 1}, 60'000}}}}).error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(world.apply({0, WorldEdit::FillBox{{{0, 0, 0}, {1, 1, 1}}, 60'000}}).error().code,
              ErrorCode::InvalidArgument);
    // State bits that the type lacks are removed.
    ASSERT_TRUE(world.apply({0, WorldEdit::SetData{{900, 1, 1}, 0xFFFF, {}}}).has_value());
    ASSERT_TRUE(world.flush().has_value());
    EXPECT_TRUE(world.take_problems().empty());
  }
  const auto store = WorldStore::open(path(), WorldAccess::Read);
  const auto kept = store->load_chunk({0, 0, {14, 0, 0}});
  ASSERT_TRUE(kept.has_value() && kept->has_value());
  EXPECT_EQ((*kept)->voxels.get(local_of(IVec3{900, 1, 1})), 4);
}

TEST_F(StreamedWorldTest, DropsWaitingEditsOfRemovedGrid) {
  StreamedWorld world = ground(path(), std::make_shared<PatternGround>());
  ASSERT_TRUE(world.apply({0, WorldEdit::FillBox{{{900, 0, 0}, {1000, 9, 9}}, 1}}).has_value());
  world.scene().remove_grid(only_grid(world));
  ASSERT_TRUE(world.flush().has_value());
  EXPECT_EQ(world.stats().waiting_edits, 0U);
}

TEST_F(StreamedWorldTest, AppliesWaitingEditsInTurn) {
  StreamedWorld world = ground(path(), std::make_shared<PatternGround>());
  const Viewer viewer{.radius = 70.0};
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(world.apply({0, WorldEdit::SetVoxels{{{{3000 + 100 * i, 1, 1}, 2}}}}).has_value());
    ASSERT_TRUE(world.update({&viewer, 1}).has_value());
  }
  for (int i = 0; i < 1000 && world.stats().waiting_edits != 0; ++i) {
    ASSERT_TRUE(world.update({&viewer, 1}).has_value());
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  EXPECT_EQ(world.stats().waiting_edits, 0U);
}

TEST_F(StreamedWorldTest, AppliesLargeWaitingEdit) {
  StreamedWorld world = ground(path(), std::make_shared<PatternGround>());
  const Viewer viewer{.radius = 70.0};
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  ASSERT_TRUE(world.apply({0, WorldEdit::FillBox{{{0, -64, 0}, {1280, 0, 1280}}, 3}}).has_value());  // 400 chunks
  EXPECT_GT(world.stats().waiting_edits, 300U) << "apply returns before they are loaded";
  ASSERT_TRUE(world.flush().has_value());
  EXPECT_EQ(world.stats().waiting_edits, 0U);
  for (int i = 0; i < 400; ++i) {
    const auto kept = world.store().load_chunk({0, 0, {i % 20, -1, i / 20}});
    ASSERT_TRUE(kept.has_value() && kept->has_value()) << i;
    EXPECT_EQ((*kept)->voxels, Chunk(3)) << i;
  }
}

// Random flights, edits and threads: the world file has the same chunks in any order of events.
TEST_F(StreamedWorldTest, StoresSameChunksForRandomSchedules) {
  const int rounds = std::getenv("QUOIN_SCHEDULES") == nullptr ? 8 : std::atoi(std::getenv("QUOIN_SCHEDULES"));
  std::map<Key, StoredChunk> expected;
  for (int round = 0; round < rounds; ++round) {
    std::mt19937 edits(7);  // the same in all rounds
    std::mt19937 chance(static_cast<unsigned>(round));
    auto generator = std::make_shared<PatternGround>(static_cast<int>(chance() % 200));
    StreamOptions options;
    options.workers.count = 1 + chance() % 3;
    options.budget_bytes = std::size_t{1} << (21 + chance() % 3);
    options.save_interval = std::chrono::milliseconds(chance() % 20);
    options.update_seconds = (chance() % 10) * 1e-4;
    const std::filesystem::path file = path(("round" + std::to_string(round) + ".quoin").c_str());
    {
      StreamedWorld world = ground(file, generator, options);
      for (int step = 0; step < 40; ++step) {
        const auto at = [&](int range) { return static_cast<int>(edits() % static_cast<unsigned>(2 * range)) - range; };
        const IVec3 low{at(400), at(60), at(400)};
        ASSERT_TRUE(world.apply({0, WorldEdit::FillBox{{low, low + 40}, static_cast<VoxelType>(edits() % 4)}}));
        ASSERT_TRUE(world.apply({0, WorldEdit::FillSphere{DVec3(low), 17.5, static_cast<VoxelType>(edits() % 4)}}));
        const Viewer viewer{.position = DVec3(low), .radius = 80.0 + static_cast<double>(chance() % 200)};
        for (unsigned i = chance() % 6; i != 0; --i) {
          ASSERT_TRUE(world.update({&viewer, 1}).has_value());
          if (chance() % 3 == 0) std::this_thread::sleep_for(std::chrono::microseconds(chance() % 2000));
        }
      }
      ASSERT_TRUE(world.flush().has_value());
      EXPECT_EQ(generator->most_asked(), 1);
      EXPECT_TRUE(world.take_problems().empty());
    }
    const auto store = WorldStore::open(file, WorldAccess::Read);
    ASSERT_TRUE(store.has_value());
    std::map<Key, StoredChunk> found;
    for (int z = -7; z <= 7; ++z) {
      for (int y = -2; y < 2; ++y) {
        for (int x = -7; x <= 7; ++x) {
          auto chunk = store->load_chunk({0, 0, {x, y, z}});
          ASSERT_TRUE(chunk.has_value());
          // Chunks far from all viewers are not generated.
          found[{x, y, z}] = *chunk ? std::move(**chunk) : StoredChunk{PatternGround::of({x, y, z})};
        }
      }
    }
    if (round == 0) expected = found;
    EXPECT_TRUE(found == expected) << round;
    std::filesystem::remove(file);
  }
}

// Simulates a server: the same log is applied to two worlds with viewers at different positions.
TEST_F(StreamedWorldTest, ReplaysLogToSameWorld) {
  EditLog log;
  std::mt19937 chance(3);
  for (std::uint64_t i = 1; i <= 60; ++i) {
    const auto at = [&] { return static_cast<int>(chance() % 300) - 150; };
    const IVec3 low{at(), at() / 2, at()};
    const auto type = static_cast<VoxelType>(chance() % 4);
    if (i % 3 == 0) {
      log.add({i, 1, {0, WorldEdit::SetVoxels{{{low, 2}, {low + 70, type}}}}});
    } else {
      log.add({i, 1, {0, WorldEdit::FillBox{{low, low + 20}, type}}});
    }
  }
  const auto sent = EditLog::decode(log.encode());
  ASSERT_TRUE(sent.has_value());
  std::vector<std::map<Key, StoredChunk>> ends;
  for (const double place : {0.0, 900.0}) {
    const std::filesystem::path file = path(("at" + std::to_string(place) + ".quoin").c_str());
    {
      StreamedWorld world = ground(file, std::make_shared<PatternGround>());
      const Viewer viewer{.position = {place, 0.0, 0.0}, .radius = 200.0};
      for (const LoggedEdit& each : sent->edits()) {
        ASSERT_TRUE(world.update({&viewer, 1}).has_value());
        ASSERT_TRUE(world.apply(each.edit).has_value());
      }
      ASSERT_TRUE(world.flush().has_value());
    }
    const auto store = WorldStore::open(file, WorldAccess::Read);
    auto& end = ends.emplace_back();
    for (int z = -4; z <= 4; ++z) {
      for (int y = -2; y < 2; ++y) {
        for (int x = -4; x <= 4; ++x) {
          auto chunk = store->load_chunk({0, 0, {x, y, z}});
          end[{x, y, z}] = *chunk ? std::move(**chunk) : StoredChunk{PatternGround::of({x, y, z})};
        }
      }
    }
  }
  EXPECT_TRUE(ends[0] == ends[1]);
}

// A game with a streamed land and one prop, placed many times at a small scale, as it opens its world each time.
class StreamedWorldWithProps : public StreamedWorldTest {
 protected:
  static constexpr Viewer kEye{.position = {0.0, 20.0, 0.0}, .radius = 256.0};

  StreamedWorld opened() const { return ground(path(), std::make_shared<PatternGround>()); }
  static GridHandle add_props(Scene& scene, int count = 20) {
    SceneGrid prop{.name = "prop"};
    prop.grid.fill_box({{0, 0, 0}, {16, 8, 16}}, 1);
    prop.field.add_sphere({8.0, 20.0, 8.0}, 5.0, 2);
    const GridHandle handle = scene.add_grid(std::move(prop));
    for (int i = 0; i < count; ++i) {
      scene.add_instance({.name = "prop", .grid = handle, .position = {3.0 * i, 8.0, 3.0}, .voxel_size = 1.0 / 16});
    }
    return handle;
  }
  static GridHandle grid_named(const Scene& scene, const std::string& name) {
    for (const GridHandle handle : scene.grids().handles()) {
      if (scene.grids()[handle].name == name) return handle;
    }
    ADD_FAILURE() << "no grid " << name;
    return {};
  }
  static bool is_streamed(const StreamedWorld& world, const std::string& name) {
    const GridHandle handle = grid_named(world.scene(), name);
    const SceneGrid& grid = world.scene().grids()[handle];
    EXPECT_EQ(grid.grid.is_partial(), grid.field.is_partial());
    EXPECT_EQ(grid.grid.is_partial(), world.number_of(handle).has_value());
    return grid.grid.is_partial();
  }
};

TEST_F(StreamedWorldWithProps, WholeGridStaysWhole) {
  std::size_t wanted = 0;
  std::int64_t voxels = 16 * 8 * 16;
  for (int run = 0; run < 3; ++run) {
    StreamedWorld world = opened();
    if (run == 0) add_props(world.scene());
    ASSERT_TRUE(world.load_all({&kEye, 1}).has_value());
    const StreamStats stats = world.stats();
    EXPECT_TRUE(stats.is_complete) << run;
    EXPECT_EQ(stats.missing_chunks, 0U) << run;
    if (run == 0) wanted = stats.wanted_chunks;
    EXPECT_EQ(stats.wanted_chunks, wanted) << run << ": wants no chunks of the prop";
    EXPECT_TRUE(is_streamed(world, "ground"));
    EXPECT_FALSE(is_streamed(world, "prop"));
    const GridHandle prop = grid_named(world.scene(), "prop");
    EXPECT_EQ(world.scene().grids()[prop].grid.voxel_count(), voxels) << run;
    EXPECT_LT(world.scene().grids()[prop].field.density({8, 20, 8}), 0.0F);
    EXPECT_EQ(world.scene().instances().size(), 21U);
    // Its edits are saved like those of other grids.
    EXPECT_TRUE(world.scene().edit(prop).grid.set(run, 9, 0, 2));
    ++voxels;
    ASSERT_TRUE(world.flush().has_value());
    EXPECT_TRUE(world.take_problems().empty());
  }
  EXPECT_GT(wanted, 100U);
  EXPECT_TRUE(check_world(path())->damage.empty());
}

TEST_F(StreamedWorldWithProps, LoadsWholeGridsOfReadOnlyWorld) {
  {
    StreamedWorld world = opened();
    add_props(world.scene());
  }
  auto world = StreamedWorld::open(path(), WorldAccess::Read);
  ASSERT_TRUE(world.has_value());
  EXPECT_FALSE(is_streamed(*world, "prop"));
  EXPECT_TRUE(is_streamed(*world, "ground"));
  EXPECT_EQ(world->apply({1, WorldEdit::FillBox{}}).error().code, ErrorCode::InvalidArgument) << "not streamed";
  const auto extent = world->extent();
  ASSERT_TRUE(extent.has_value());
  EXPECT_EQ(extent->stored_chunks, 0U);
  EXPECT_EQ(extent->stored.min, (DVec3{0.0, 8.0, 3.0}));
  EXPECT_EQ(extent->stored.max.x, 58.0) << "20 props, 3 apart";
}

TEST_F(StreamedWorldWithProps, OpensWorldsOfVersion3AsStreamed) {
  const std::filesystem::path sample = QUOIN_SOURCE_DIR "/tests/corpus/cases/quoin-version-3.quoin";
  std::filesystem::copy_file(sample, path());
  {
    const auto world = StreamedWorld::open(path(), WorldAccess::Read);
    ASSERT_TRUE(world.has_value()) << to_string(world.error());
    EXPECT_TRUE(is_streamed(*world, "land"));
    EXPECT_TRUE(is_streamed(*world, "prop"));
  }
  EXPECT_EQ(summarize_world(path())->version, 3) << "reading upgrades nothing";
  {
    auto world = StreamedWorld::open(path(), WorldAccess::Write);
    ASSERT_TRUE(world.has_value()) << to_string(world.error());
    const GridHandle prop = grid_named(world->scene(), "prop");
    EXPECT_FALSE(world->scene().grids()[prop].whole);
    world->scene().edit(prop).whole = true;
    ASSERT_TRUE(world->flush().has_value());
    EXPECT_TRUE(is_streamed(*world, "prop")) << "until the world is opened again";
  }
  EXPECT_EQ(summarize_world(path())->version, 6);
  auto world = StreamedWorld::open(path(), WorldAccess::Write);
  ASSERT_TRUE(world.has_value());
  EXPECT_TRUE(is_streamed(*world, "land"));
  EXPECT_FALSE(is_streamed(*world, "prop"));
  EXPECT_EQ(world->scene().grids()[grid_named(world->scene(), "prop")].grid.voxel_count(), 16 * 8 * 16);
  ASSERT_TRUE(world->load_all({&kEye, 1}).has_value());
  EXPECT_LT(world->stats().wanted_chunks, 1000U);
}

TEST_F(StreamedWorldWithProps, RefusesWholeGridsAboveLimit) {
  {
    StreamedWorld world = opened();
    add_props(world.scene());
  }
  StreamOptions options;
  options.max_whole_bytes = 100;
  const auto refused = StreamedWorld::open(path(), WorldAccess::Write, options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
  EXPECT_NE(refused.error().message.find("\"prop\""), std::string::npos) << refused.error().message;
  EXPECT_TRUE(StreamedWorld::open(path(), WorldAccess::Write).has_value()) << "the file is unchanged and free";
}

TEST_F(StreamedWorldWithProps, KeepsDamagedChunkOfWholeGrid) {
  std::uint32_t number = 0;
  {
    StreamedWorld world = opened();
    SceneGrid far{.name = "far"};
    far.grid.set({0, 0, 0}, 1);
    far.grid.set({1000, 0, 0}, 1);
    world.scene().add_grid(std::move(far));
    ASSERT_TRUE(world.flush().has_value());
    const auto grids = world.store().grids();
    ASSERT_TRUE(grids);
    for (const auto& [each, grid] : *grids) {
      if (grid.name == "far") number = each;
    }
  }
  {  // the last byte of a chunk's body
    auto connection = Connection::open(path().string(), Connection::Mode::Write);
    ASSERT_TRUE(connection);
    const std::string sql =
        "UPDATE chunks SET body = substr(body, 1, length(body) - 1) || x'7E' WHERE key IN (SELECT key FROM chunks, "
        "regions WHERE key >> 15 = id AND grid = " +
        std::to_string(number) + " ORDER BY key LIMIT 1)";
    ASSERT_TRUE(connection->run(sql.c_str()));
  }
  for (int run = 0; run < 2; ++run) {
    StreamedWorld world = opened();
    ASSERT_EQ(world.opened().warnings.size(), 1U) << run;
    EXPECT_NE(world.opened().warnings[0].find("of grid " + std::to_string(number)), std::string::npos);
    const GridHandle far = grid_named(world.scene(), "far");
    EXPECT_EQ(world.scene().grids()[far].grid.voxel_count(), 1 + run);
    EXPECT_TRUE(world.scene().edit(far).grid.set({1001 + run, 0, 0}, 2));
    ASSERT_TRUE(world.flush().has_value());
  }
  EXPECT_EQ(check_world(path())->damage.size(), 1U) << "still damaged, not air";
}

TEST_F(StreamedWorldWithProps, LeavesOutWhatIsNotSaved) {
  {
    StreamedWorld world = opened();
    Scene& scene = world.scene();
    const GridHandle prop = add_props(scene, 3);
    const GridHandle debris = add_props(scene, 4);
    scene.edit(debris).name = "debris";
    scene.edit(debris).saved = false;
    scene.add_instance({.name = "shot", .grid = prop, .saved = false});
    const GroupHandle wreck = scene.add_group({.name = "wreck", .saved = false});
    scene.add_instance({.name = "part", .grid = prop, .group = scene.add_group({.parent = wreck})});
    ASSERT_TRUE(world.flush().has_value());
    EXPECT_EQ(world.store().grids()->size(), 2U);
    EXPECT_EQ(scene.instances().size(), 1U + 3U + 4U + 2U) << "the scene keeps them";
  }
  {
    StreamedWorld world = opened();
    const Scene& scene = world.scene();
    EXPECT_EQ(scene.grids().size(), 2U);
    EXPECT_EQ(scene.instances().size(), 1U + 3U);
    EXPECT_EQ(scene.groups().size(), 0U);
    // A streamed grid must stay in the file.
    const GridHandle land = grid_named(scene, "ground");
    world.scene().edit(land).saved = false;
    const Status refused = world.flush();
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
    EXPECT_NE(refused.error().message.find("\"ground\""), std::string::npos) << refused.error().message;
    world.scene().edit(land).saved = true;
    const auto added = world.add_grid({.name = "preview", .saved = false});
    ASSERT_FALSE(added);
    EXPECT_EQ(added.error().code, ErrorCode::InvalidArgument);
    // A prop that becomes temporary leaves the file, and comes back.
    world.scene().edit(grid_named(scene, "prop")).saved = false;
    ASSERT_TRUE(world.flush().has_value());
    EXPECT_EQ(world.store().grids()->size(), 1U);
    world.scene().edit(grid_named(scene, "prop")).saved = true;
    ASSERT_TRUE(world.flush().has_value());
  }
  StreamedWorld world = opened();
  EXPECT_EQ(world.scene().instances().size(), 1U + 3U);
  EXPECT_FALSE(is_streamed(world, "prop"));
  EXPECT_EQ(world.scene().grids()[grid_named(world.scene(), "prop")].grid.voxel_count(), 16 * 8 * 16);
  EXPECT_TRUE(check_world(path())->damage.empty());
}

TEST_F(StreamedWorldWithProps, ReportsGeneratorOfWholeGrid) {
  {
    StreamedWorld world = opened();
    add_props(world.scene());
  }
  StreamedWorld world = opened();
  world.use_generator(grid_named(world.scene(), "prop"), std::make_shared<PatternGround>());
  const auto problems = world.take_problems();
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_NE(problems[0].find("is whole, so its generator is not used"), std::string::npos) << problems[0];
}

TEST_F(StreamedWorldWithProps, ReportsGeneratorOfGridThatIsNotSaved) {
  StreamedWorld world = opened();
  const GridHandle prop = add_props(world.scene());
  ASSERT_TRUE(world.flush().has_value());
  world.scene().edit(prop).saved = false;
  ASSERT_TRUE(world.flush().has_value());
  world.use_generator(prop, std::make_shared<PatternGround>());
  ASSERT_EQ(world.take_problems().size(), 1U);
}

TEST_F(StreamedWorldWithProps, ReportsLandThatIsMarkedAsWhole) {
  const Viewer viewer{.position = {0.0, 50.0, 0.0}, .radius = 70.0};
  {
    auto world = StreamedWorld::open_or_create(path());
    ASSERT_TRUE(world.has_value());
    const auto refused = world->add_grid({.name = "land", .whole = true}, std::make_shared<PatternGround>());
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
    EXPECT_NE(refused.error().message.find("\"land\": it is marked as whole"), std::string::npos);
    const auto land = world->add_terrain({.seed = 3, .height = 2});
    ASSERT_TRUE(land.has_value());
    world->scene().edit(*land).whole = true;
    ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
    ASSERT_TRUE(world->flush().has_value());
  }
  for (int run = 0; run < 2; ++run) {
    auto world = StreamedWorld::open(path(), WorldAccess::Write);
    ASSERT_TRUE(world.has_value()) << to_string(world.error());
    const auto problems = world->take_problems();
    EXPECT_EQ(problems.size(), run == 0 ? 1U : 0U);
    if (run == 0) {
      EXPECT_NE(problems.at(0).find("its terrain is not generated"), std::string::npos) << problems[0];
    }
    EXPECT_EQ(is_streamed(*world, "terrain"), run == 1);
    world = StreamedWorld::open(path(), WorldAccess::Read);  // releases the file
    auto store = WorldStore::open(path(), WorldAccess::Write);
    ASSERT_TRUE(store.has_value()) << to_string(store.error());
    auto loaded = load_world(*store);
    ASSERT_TRUE(loaded.has_value());
    Scene& scene = loaded->loaded.scene;
    scene.edit(scene.grids().handles().front()).whole = false;
    ASSERT_TRUE(loaded->saver.save(*store, scene).has_value());
  }
}

TEST_F(StreamedWorldWithProps, CountsDataOfWholeGrids) {
  {
    StreamedWorld world = opened();
    const GridHandle prop = add_props(world.scene());
    const std::vector<std::byte> bytes(60'000, std::byte{7});
    for (int i = 0; i < 400; ++i) world.scene().edit(prop).grid.set_data({i % 16, i / 16 % 8, i / 128}, {0, bytes});
  }
  StreamOptions options;
  options.max_whole_bytes = std::size_t{20} << 20;  // chunks without data would fit
  const auto refused = StreamedWorld::open(path(), WorldAccess::Write, options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
  EXPECT_NE(refused.error().message.find("\"prop\""), std::string::npos) << refused.error().message;
  options.max_whole_bytes = std::size_t{48} << 20;
  EXPECT_TRUE(StreamedWorld::open(path(), WorldAccess::Write, options).has_value());
}

// Without the index the stored chunks cannot be listed, but each can be read.
TEST_F(StreamedWorldWithProps, OpensWorldWithDamagedIndexOfChunks) {
  const Viewer viewer{.radius = 100.0};
  {
    StreamedWorld world = opened();
    add_props(world.scene());
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
    EXPECT_TRUE(world.scene().edit(grid_named(world.scene(), "ground")).grid.set(3, -3, 3, 3));
    ASSERT_TRUE(world.flush().has_value());
  }
  std::int64_t page = 0;
  std::int64_t page_bytes = 0;
  {
    auto connection = Connection::open(path().string(), Connection::Mode::Write);
    ASSERT_TRUE(connection);
    const auto number = [&](const char* sql) {
      auto select = connection->prepare(sql);
      EXPECT_TRUE(select && *select->step());
      return select->integer(0);
    };
    page = number("SELECT rootpage FROM sqlite_master WHERE name = 'chunk_keys'");
    page_bytes = number("PRAGMA page_size");
  }
  {
    std::fstream file(path(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp((page - 1) * page_bytes);
    const std::string zeros(static_cast<std::size_t>(page_bytes), '\0');
    file.write(zeros.data(), page_bytes);
    ASSERT_TRUE(file.flush().good());
  }
  auto world = StreamedWorld::open(path(), WorldAccess::Read);
  ASSERT_TRUE(world.has_value()) << to_string(world.error());
  EXPECT_EQ(world->store().chunks(0, 0).error().code, ErrorCode::BadFormat);
  EXPECT_EQ(world->scene().grids()[grid_named(world->scene(), "prop")].grid.voxel_count(), 16 * 8 * 16);
  const GridHandle land = grid_named(world->scene(), "ground");
  world->use_generator(land, std::make_shared<PatternGround>());
  const auto problems = world->take_problems();
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_NE(problems[0].find("the stored chunks of grid 0 cannot be listed"), std::string::npos) << problems[0];
  ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
  EXPECT_EQ(world->scene().grids()[land].grid.get(3, -3, 3), 3);
  EXPECT_FALSE(world->is_loaded(land, {0, 50, 0})) << "it might be stored";
}

}  // namespace
}  // namespace quoin
