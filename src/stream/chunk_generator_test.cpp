// Generators of streamed worlds: their boxes, replacing them while workers run, and their failures.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/stream/streamed_world.h>
#include <quoin/terrain/terrain.h>

#include "core/death_for_tests.h"
#include "stream/streamed_world_fixture.h"

namespace quoin {
namespace {

// Only the generator's chunks are loaded, planned and moved; the air around them is known.
TEST_F(StreamedWorldTest, LoadsNothingOutsideOfGenerator) {
  auto generator = std::make_shared<PatternGround>();
  StreamedWorld world = ground(path(), generator);
  const GridHandle handle = only_grid(world);
  const Viewer viewer{.position = {10.0, 5.0, 10.0}, .radius = 400.0};
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  const StreamStats stats = world.stats();
  EXPECT_EQ(stats.loaded_chunks, generator->asked());
  EXPECT_EQ(stats.wanted_chunks, generator->asked());
  EXPECT_EQ(stats.chunks_made, generator->asked());
  EXPECT_EQ(stats.complete_radius, 400.0);
  EXPECT_TRUE(stats.is_complete);
  const SceneGrid& content = world.scene().grids()[handle];
  EXPECT_EQ(content.grid.loaded_chunks().size(), generator->asked());
  EXPECT_EQ(content.field.loaded_chunks().size(), generator->asked());
  EXPECT_TRUE(world.is_loaded(handle, {0, 100, 0}));
  EXPECT_FALSE(world.is_loaded(handle, {100, 0, 0}));
  const auto stored = world.store().chunks(0, 0);
  ASSERT_TRUE(stored.has_value());
  EXPECT_EQ(stored->size(), generator->asked());
}

// A second, coarse world shows the land far away: its cost depends on its chunks, not on its size in the world.
TEST_F(StreamedWorldTest, CoarseGridCostsAsManyChunksAsFineOne) {
  std::vector<StreamStats> ends;
  for (const double voxel_size : {1.0, 8.0}) {
    std::filesystem::remove(path());
    auto generator = std::make_shared<PatternGround>();
    StreamedWorld world = ground(path(), generator, {.keep_generated = false});
    const InstanceHandle instance = world.scene().instances().handles().front();
    world.scene().edit(instance).voxel_size = voxel_size;
    const Viewer viewer{.position = voxel_size * DVec3(10.0, 5.0, 10.0), .radius = voxel_size * 500.0};
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
    ends.push_back(world.stats());
    EXPECT_EQ(ends.back().complete_radius, viewer.radius);
    EXPECT_EQ(ends.back().chunks_made, generator->asked());
  }
  EXPECT_EQ(ends[0].wanted_chunks, ends[1].wanted_chunks);
  EXPECT_EQ(ends[0].chunks_made, ends[1].chunks_made);
  EXPECT_EQ(ends[0].loaded_bytes, ends[1].loaded_bytes);
}

TEST_F(StreamedWorldTest, KeepsEditsOutsideOfGenerator) {
  auto generator = std::make_shared<PatternGround>();
  const IVec3 tower{3, 1000, 3};
  const IVec3 chunk = chunk_of(tower);
  Viewer viewer{.position = {0.0, 0.0, 0.0}, .radius = 100.0};
  {
    StreamedWorld world = ground(path(), generator);
    const GridHandle handle = only_grid(world);
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
    const std::size_t loaded = world.stats().loaded_chunks;
    EXPECT_TRUE(world.scene().edit(handle).grid.set(tower.x, tower.y, tower.z, 3));
    ASSERT_TRUE(world.apply({0, WorldEdit::SetVoxels{{{tower + IVec3(0, 1, 0), 2}}}}).has_value());
    EXPECT_EQ(world.stats().waiting_edits, 0U) << "known air is edited at once";
    ASSERT_TRUE(world.update({&viewer, 1}).has_value());
    EXPECT_EQ(world.stats().loaded_chunks, loaded + 1);
    // It leaves with its surroundings, and comes back.
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
    viewer.position.x = 5000.0;
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
    EXPECT_FALSE(world.is_loaded(handle, chunk));
    EXPECT_EQ(world.scene().grids()[handle].grid.get(tower.x, tower.y, tower.z), kAir);
    ASSERT_TRUE(world.apply({0, WorldEdit::SetVoxels{{{tower + IVec3(0, 2, 0), 1}}}}).has_value());
    EXPECT_EQ(world.stats().waiting_edits, 1U) << "unloaded chunks are edited when they are loaded";
    viewer.position = DVec3(tower);
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
    EXPECT_EQ(world.stats().loaded_chunks, 1U);
    const Grid& grid = world.scene().grids()[handle].grid;
    for (int i = 0; i < 3; ++i) EXPECT_EQ(grid.get(tower.x, tower.y + i, tower.z), 3 - i);
  }
  StreamedWorld world = ground(path(), generator);
  const GridHandle handle = only_grid(world);
  EXPECT_FALSE(world.is_loaded(handle, chunk)) << "it is stored";
  EXPECT_TRUE(world.is_loaded(handle, chunk + 1));
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  EXPECT_EQ(world.stats().loaded_chunks, 1U);
  EXPECT_EQ(world.scene().grids()[handle].grid.get(tower.x, tower.y, tower.z), 3);
  EXPECT_EQ(generator->most_asked(), 1);
}

TEST_F(StreamedWorldTest, KeepsEditedAirOfReadOnlyWorld) {
  auto generator = std::make_shared<PatternGround>();
  Viewer viewer{.radius = 100.0};
  {
    StreamedWorld world = ground(path(), generator);
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  }
  auto world = StreamedWorld::open(path(), WorldAccess::Read);
  ASSERT_TRUE(world.has_value()) << to_string(world.error());
  const GridHandle grid = only_grid(*world);
  ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
  EXPECT_TRUE(world->scene().edit(grid).grid.set(3, 3000, 3, 2));
  viewer.position.x = 4000.0;
  ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
  EXPECT_EQ(world->scene().grids()[grid].grid.get(3, 3000, 3), 2);
}

// Without a generator, the stored chunks are all there is.
TEST_F(StreamedWorldTest, LoadsOnlyStoredChunksWithoutGenerator) {
  const Viewer viewer{.radius = 500.0};
  {
    auto world = StreamedWorld::open_or_create(path());
    ASSERT_TRUE(world.has_value());
    add_types(*world);
    const auto grid = world->add_grid({.name = "ship"});
    ASSERT_TRUE(grid.has_value());
    Instance instance;
    instance.grid = *grid;
    world->scene().add_instance(instance);
    EXPECT_EQ(world->scene().edit(*grid).grid.fill_box({{-70, 0, 0}, {70, 10, 10}}, 1), 140 * 100);
    ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
    EXPECT_EQ(world->stats().loaded_chunks, 4U);
    ASSERT_TRUE(world->flush().has_value());
  }
  auto world = StreamedWorld::open(path(), WorldAccess::Write);
  ASSERT_TRUE(world.has_value()) << to_string(world.error());
  ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
  const StreamStats stats = world->stats();
  EXPECT_EQ(stats.loaded_chunks, 4U);
  EXPECT_EQ(stats.wanted_chunks, 4U);
  EXPECT_EQ(stats.chunks_read, 4U);
  EXPECT_EQ(stats.complete_radius, 500.0);
  EXPECT_EQ(world->scene().grids()[only_grid(*world)].grid.voxel_count(), 140 * 100);
}

// A generator that is set while the program runs: loaded and edited chunks stay, waiting edits find their chunks.
TEST_F(StreamedWorldTest, KeepsLoadedChunksWhenGeneratorChanges) {
  auto generator = std::make_shared<PatternGround>();
  StreamedWorld world = ground(path(), generator);
  const GridHandle handle = only_grid(world);
  Viewer viewer{.radius = 150.0};
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  EXPECT_TRUE(world.scene().edit(handle).grid.set(3, 130, 3, 3));
  ASSERT_TRUE(world.apply({0, WorldEdit::SetVoxels{{{{900, -1, 1}, 3}}}}).has_value());
  world.use_generator(handle, nullptr);
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  ASSERT_TRUE(world.flush().has_value());
  EXPECT_EQ(world.stats().waiting_edits, 0U);
  const Grid& grid = world.scene().grids()[handle].grid;
  EXPECT_EQ(grid.get(3, 130, 3), 3);
  EXPECT_EQ(grid.get(3, -1, 3) == kAir, false);
  EXPECT_TRUE(world.is_loaded(handle, {50, 0, 0})) << "air that no generator makes";
  const auto kept = world.store().load_chunk({0, 0, chunk_of(IVec3{900, -1, 1})});
  ASSERT_TRUE(kept.has_value() && kept->has_value());
  EXPECT_EQ((*kept)->voxels.get(local_of(IVec3{900, -1, 1})), 3);
  world.use_generator(handle, generator);
  EXPECT_FALSE(world.is_loaded(handle, {50, 0, 0}));
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  EXPECT_EQ(grid.get(3, 130, 3), 3);
  EXPECT_TRUE(world.scene().edit(handle).grid.set(4, 130, 3, 2));
  EXPECT_GT(world.scene().edit(handle).field.add_sphere({20.0, -20.0, 20.0}, 5.0, 2), 0);
  viewer.position.x = 5000.0;
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  ASSERT_TRUE(world.apply({0, WorldEdit::FieldSphere{{20.0, 130.0, 20.0}, 5.0, 0.0, 2}}).has_value());
  ASSERT_TRUE(world.flush().has_value());
  viewer.position.x = 0.0;
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  EXPECT_EQ(grid.get(4, 130, 3), 2);
  EXPECT_LT(world.scene().grids()[handle].field.density({20, -20, 20}), 0.0F);
  EXPECT_LT(world.scene().grids()[handle].field.density({20, 130, 20}), 0.0F);
  EXPECT_EQ(grid.loaded_chunks(), world.scene().grids()[handle].field.loaded_chunks());
}

// Chunks of air that were edited outside of the former generator's box are loaded, in the voxels and in the field.
TEST_F(StreamedWorldTest, KeepsEditedAirWhenGeneratorBoxGrows) {
  auto generator = std::make_shared<PatternGround>();
  StreamedWorld world = ground(path(), nullptr);
  const GridHandle handle = only_grid(world);
  const SceneGrid& content = world.scene().grids()[handle];
  Viewer viewer{.radius = 100.0};
  EXPECT_TRUE(world.scene().edit(handle).grid.set(3, -3, 3, 3));
  EXPECT_GT(world.scene().edit(handle).field.add_sphere({100.0, -20.0, 20.0}, 5.0, 2), 0);
  world.use_generator(handle, generator);
  for (const IVec3 chunk : {IVec3{0, -1, 0}, IVec3{1, -1, 0}}) {
    EXPECT_TRUE(content.grid.is_loaded(chunk));
    EXPECT_TRUE(content.field.is_loaded(chunk));
  }
  EXPECT_GT(world.scene().edit(handle).field.add_sphere({20.0, -20.0, 20.0}, 5.0, 2), 0);
  EXPECT_TRUE(world.scene().edit(handle).grid.set(100, -3, 3, 2));
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  EXPECT_EQ(content.grid.loaded_chunks(), content.field.loaded_chunks());
  viewer.position.x = 5000.0;
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  EXPECT_FALSE(content.grid.is_loaded({0, -1, 0}));
  EXPECT_FALSE(content.field.is_loaded({0, -1, 0}));
  ASSERT_TRUE(world.apply({0, WorldEdit::FieldSphere{{30.0, -30.0, 30.0}, 5.0, 0.0, 2}}).has_value());
  ASSERT_TRUE(world.flush().has_value());
  viewer.position.x = 0.0;
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  EXPECT_EQ(content.grid.get(3, -3, 3), 3);
  EXPECT_EQ(content.grid.get(100, -3, 3), 2);
  for (const IVec3 centre : {IVec3{20, -20, 20}, IVec3{30, -30, 30}, IVec3{100, -20, 20}}) {
    EXPECT_LT(content.field.density(centre), 0.0F) << centre.x;
  }
}

// Until the program sets the generator, no chunk of the file's grid is known to be air.
TEST_F(StreamedWorldTest, KeepsLandThatIsEditedBeforeGeneratorIsSet) {
  auto generator = std::make_shared<PatternGround>();
  { const StreamedWorld world = ground(path(), generator); }
  auto world = StreamedWorld::open(path(), WorldAccess::Write);
  ASSERT_TRUE(world.has_value()) << to_string(world.error());
  const GridHandle handle = only_grid(*world);
  EXPECT_FALSE(world->is_loaded(handle, {0, -1, 0}));
  EXPECT_FALSE(world->scene().edit(handle).grid.set(3, -3, 3, 3));
  ASSERT_TRUE(world->apply({0, WorldEdit::SetVoxels{{{{5, -3, 3}, 3}}}}).has_value());
  EXPECT_EQ(world->stats().waiting_edits, 1U);
  world->use_generator(handle, generator);
  const Viewer viewer{.radius = 100.0};
  ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
  ASSERT_TRUE(world->flush().has_value());
  Chunk expected = PatternGround::of({0, -1, 0});
  expected.set({5, 61, 3}, 3);
  const auto kept = world->store().load_chunk({0, 0, {0, -1, 0}});
  ASSERT_TRUE(kept.has_value() && kept->has_value());
  EXPECT_EQ((*kept)->voxels, expected);
}

/// Makes chunks of one type, each after `open` was called.
class GatedGround final : public ChunkGenerator {
 public:
  explicit GatedGround(VoxelType type = 1) : type_(type) {}
  [[nodiscard]] IBox chunks() const override { return {{-9, -9, -9}, {9, 9, 9}}; }
  [[nodiscard]] Result<StoredChunk> make(IVec3, const Cancellation& /*cancelled*/) const override {
    ++inside_;
    is_begun_ = true;
    is_begun_.notify_all();
    is_open_.wait(false);
    ++made_;
    --inside_;
    return StoredChunk{Chunk(type_)};
  }
  [[nodiscard]] int inside() const { return inside_; }
  [[nodiscard]] int made() const { return made_; }
  [[nodiscard]] bool is_open() const { return is_open_; }
  void wait() const { is_begun_.wait(false); }
  void open() {
    is_open_ = true;
    is_open_.notify_all();
  }

 private:
  VoxelType type_;
  mutable std::atomic<int> inside_{0};
  mutable std::atomic<int> made_{0};
  mutable std::atomic<bool> is_begun_{false};
  std::atomic<bool> is_open_{false};
};

/// Opens a generator soon, from another thread.
class OpenGroundSoon {
 public:
  explicit OpenGroundSoon(GatedGround& ground)
      : thread_([&ground] {
          std::this_thread::sleep_for(std::chrono::milliseconds(30));
          ground.open();
        }) {}

 private:
  std::jthread thread_;
};

// A worker saves a chunk of the former generator while the new one, which does not make it, is set.
TEST_F(StreamedWorldTest, LoadsChunkThatWasBegunBeforeGeneratorChanged) {
  auto world = StreamedWorld::open_or_create(path());
  ASSERT_TRUE(world.has_value());
  add_types(*world);
  const auto generator = std::make_shared<GatedGround>();
  const auto grid = world->add_grid({}, generator);
  ASSERT_TRUE(grid.has_value());
  Instance instance;
  instance.grid = *grid;
  world->scene().add_instance(instance);
  const Viewer viewer{.position = DVec3(32.0), .radius = 10.0};
  ASSERT_TRUE(world->update({&viewer, 1}).has_value());
  generator->wait();
  {
    const OpenGroundSoon soon(*generator);
    world->use_generator(*grid, nullptr);
  }
  EXPECT_TRUE(world->is_loaded(*grid, IVec3(0)));
  ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
  EXPECT_EQ(world->scene().grids()[*grid].grid.get(3, 3, 3), 1);
  ASSERT_TRUE(world->flush().has_value());
  const auto kept = world->store().load_chunk({0, 0, IVec3(0)});
  ASSERT_TRUE(kept.has_value() && kept->has_value());
  EXPECT_EQ((*kept)->voxels, Chunk(1));
}

// A plug-in is loaded again: its former generator ends before `use_generator` returns, and its chunks stay.
TEST_F(StreamedWorldTest, ReplacesGeneratorWhileWorkersRun) {
  auto world = StreamedWorld::open_or_create(path(), {.workers = {3}});
  ASSERT_TRUE(world.has_value());
  add_types(*world);
  auto former = std::make_shared<GatedGround>(VoxelType{1});
  const auto newer = std::make_shared<GatedGround>(VoxelType{2});
  const auto grid = world->add_grid({}, former);
  ASSERT_TRUE(grid.has_value());
  Instance instance;
  instance.grid = *grid;
  world->scene().add_instance(instance);
  Viewer viewer{.position = DVec3(32.0), .radius = 100.0};
  ASSERT_TRUE(world->update({&viewer, 1}).has_value());
  former->wait();
  newer->open();
  {
    const OpenGroundSoon soon(*former);
    world->use_generator(*grid, newer);
    EXPECT_TRUE(former->is_open());
    EXPECT_EQ(former->inside(), 0);
    EXPECT_EQ(former.use_count(), 1) << "no worker keeps it";
  }
  const int made = former->made();
  EXPECT_GT(made, 0);
  ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
  EXPECT_EQ(former->made(), made);
  EXPECT_GT(newer->made(), 0);
  const Grid& voxels = world->scene().grids()[*grid].grid;
  const auto count = [&](VoxelType type) {
    const std::vector<IVec3> chunks = voxels.chunks();
    return std::count_if(chunks.begin(), chunks.end(),
                         [&](IVec3 chunk) { return voxels.find_chunk(chunk)->get(3, 3, 3) == type; });
  };
  EXPECT_EQ(count(1), made) << "the chunks made before stay";
  EXPECT_EQ(count(2), newer->made());
  former.reset();
  viewer.position.x = 400.0;
  ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
  viewer.position.x = 32.0;
  ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
  EXPECT_EQ(count(1), made);
}

TEST_F(StreamedWorldTest, UnloadsEditedAirFarFromViewers) {
  StreamedWorld world = ground(path(), std::make_shared<PatternGround>());
  const Viewer viewer{.radius = 100.0};
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  const std::size_t loaded = world.stats().loaded_chunks;
  EXPECT_TRUE(world.scene().edit(only_grid(world)).grid.set(3, 1000, 3, 3));
  ASSERT_TRUE(world.update({&viewer, 1}).has_value());
  EXPECT_EQ(world.stats().loaded_chunks, loaded + 1);
  for (int i = 0; i < 500 && world.stats().loaded_chunks != loaded; ++i) {
    ASSERT_TRUE(world.update({&viewer, 1}).has_value());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(world.stats().loaded_chunks, loaded);
}

/// Fails for one chunk.
class BrokenGround final : public ChunkGenerator {
 public:
  [[nodiscard]] IBox chunks() const override { return {{-9, -9, -9}, {9, 9, 9}}; }
  [[nodiscard]] Result<StoredChunk> make(IVec3 chunk, const Cancellation& /*cancelled*/) const override {
    if (chunk == IVec3{0, 0, 0}) return make_error(ErrorCode::BadFormat, "a broken region");
    return StoredChunk{Chunk(1)};
  }
};

TEST_F(StreamedWorldTest, ReportsFailedChunksAndShowsAir) {
  auto world = StreamedWorld::open_or_create(path());
  ASSERT_TRUE(world.has_value());
  add_types(*world);
  const auto grid = world->add_grid({}, std::make_shared<BrokenGround>());
  Instance instance;
  instance.grid = *grid;
  world->scene().add_instance(instance);
  const Viewer viewer{.radius = 80.0};
  ASSERT_TRUE(world->load_all({&viewer, 1}).has_value());
  EXPECT_TRUE(world->is_loaded(*grid, {0, 0, 0}));
  EXPECT_EQ(world->scene().grids()[*grid].grid.get(1, 1, 1), kAir);
  const auto problems = world->take_problems();
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_NE(problems[0].find("a broken region"), std::string::npos);
}

TEST(TerrainGeneratorDeathTest, RejectsChunkOutsideLandscape) {
  VoxelRegistry types;
  const auto generator = make_terrain_generator({.seed = 5, .height = 2}, types);
  ASSERT_TRUE(generator.has_value());
  QUOIN_EXPECT_MISTAKE(static_cast<void>((*generator)->make({0, 2, 0}, {})), "a chunk of the landscape");
}

TEST(StreamedWorldDeathTest, RejectsGeneratorForUnknownGrid) {
  const WorldFolder folder;
  auto world = StreamedWorld::open_or_create(folder / "w.quoin");
  ASSERT_TRUE(world.has_value());
  QUOIN_EXPECT_MISTAKE(world->use_generator({}, nullptr), "a grid of the scene");
}

}  // namespace
}  // namespace quoin
