// All objects with workers share the job system of the process.

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <map>
#include <memory>
#include <system_error>
#include <thread>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>

#include <quoin/live/live_light.h>
#include <quoin/live/live_meshes.h>
#include <quoin/live/live_tracer.h>
#include <quoin/render/impostor_cache.h>
#include <quoin/stream/streamed_world.h>

#include "core/memory/block_arena_for_tests.h"
#include "core/work/job_system_for_tests.h"
#include "store/world/world_for_tests.h"

namespace quoin {
namespace {

// A game with an object of each kind that has workers.
class WorkingGame {
 public:
  explicit WorkingGame(const std::filesystem::path& file) {
    auto opened = StreamedWorld::open_or_create(file, {});
    EXPECT_TRUE(opened);
    world = std::make_unique<StreamedWorld>(std::move(*opened));
    const auto added = world->add_terrain({.seed = 9});
    EXPECT_TRUE(added);
    land = *added;
    light = std::make_unique<LiveLight>();
    meshes = std::make_unique<LiveMeshes>();
    meshes->use_light(*light);
  }
  // Runs one frame. Returns true if no work is left.
  bool frame() {
    EXPECT_TRUE(world->update({&viewer, 1}));
    tracer->update(world->scene());
    meshes->update(world->scene(), viewer.position);
    bool is_idle = meshes->pending() == 0 && !light->is_late() && !tracer->is_late() && world->stats().is_complete;
    tracer->take();
    for (const SurfaceUpdate& update : meshes->take()) {
      is_idle = false;
      const std::tuple key(update.chunk.x, update.chunk.y, update.chunk.z);
      if (update.surface == nullptr) {
        uploads.erase(key);
      } else {
        uploads[key] = update.surface->upload_bytes();
      }
    }
    light->take();
    (void)impostors->find(world->scene(), land);
    return impostors->wait(world->scene(), 0.0) == 0 && is_idle;
  }
  void run_until_idle() {
    for (int idle = 0; idle < 10; ++idle) {
      if (!frame()) idle = 0;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  void dig(int step) { world->scene().edit(land).grid.fill_sphere({7.0 * step - 10.0, 60.0, 5.0 * step}, 12.0, kAir); }

  Viewer viewer{.position = {0.0, 100.0, 0.0}, .direction = {1.0, 0.0, 0.0}, .radius = 100.0};
  GridHandle land;
  std::map<std::tuple<int, int, int>, std::size_t> uploads;  // bytes of the surfaces shown
  std::unique_ptr<StreamedWorld> world;
  std::unique_ptr<LiveTracer> tracer = std::make_unique<LiveTracer>();
  std::unique_ptr<ImpostorCache> impostors = std::make_unique<ImpostorCache>();
  std::unique_ptr<LiveLight> light;
  std::unique_ptr<LiveMeshes> meshes;
};

// Returns 0 if the system does not tell.
std::ptrdiff_t threads_of_process() {
  std::error_code error;
  const std::filesystem::directory_iterator threads("/proc/self/task", error);
  return error ? 0 : std::distance(threads, std::filesystem::directory_iterator());
}

struct GameResult {
  std::map<std::tuple<int, int, int>, std::size_t> uploads;
  std::size_t voxels = 0;
  std::ptrdiff_t threads = 0;
};

GameResult play() {
  const WorldFolder folder;
  WorkingGame game(folder / "land.quoin");
  game.run_until_idle();
  for (int i = 0; i < 3; ++i) {
    game.dig(i);
    game.frame();
  }
  game.run_until_idle();
  EXPECT_TRUE(game.world->flush());
  EXPECT_EQ(game.world->take_problems().size(), 0U);
  return {game.uploads, static_cast<std::size_t>(game.world->scene().grids()[game.land].grid.voxel_count()),
          threads_of_process()};
}

class GameJobs : public testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Workers, GameJobs, testing::Values(1U, 3U));

TEST_P(GameJobs, OneLimitHoldsForAllObjects) {
  static const GameResult expected = play();  // with Quoin's own threads, for all parameters
  const auto jobs = std::make_shared<CountingJobs>(GetParam());
  const ScopedJobSystem scope(jobs);
  const std::ptrdiff_t threads = threads_of_process();
  const GameResult result = play();
  EXPECT_LE(result.threads, threads) << "Quoin started threads";
  EXPECT_FALSE(expected.uploads.empty());
  EXPECT_EQ(result.uploads, expected.uploads);
  EXPECT_EQ(result.voxels, expected.voxels);
  EXPECT_LE(jobs->most_at_once(), static_cast<int>(GetParam()));
  const auto posted = jobs->posted();
  for (const char* const name : {"impostor", "light", "loop", "mesh", "store", "stream", "tracer"}) {
    EXPECT_TRUE(posted.contains(name)) << name;
  }
  EXPECT_EQ(posted.size(), 7U);
}

TEST_P(GameJobs, BlockingCallsReturnInJobs) {
  const auto jobs = std::make_shared<CountingJobs>(GetParam());
  const ScopedJobSystem scope(jobs);
  const WorldFolder folder;
  WorkingGame game(folder / "land.quoin");
  call_as_job(*jobs, [&] {
    EXPECT_TRUE(game.world->load_all({&game.viewer, 1}));
    game.meshes->finish(game.world->scene(), game.viewer.position);
    game.tracer->finish(game.world->scene());
    (void)game.impostors->find(game.world->scene(), game.land);
    EXPECT_EQ(game.impostors->wait(game.world->scene()), 0U);
    EXPECT_TRUE(game.world->flush());
  });
  EXPECT_FALSE(game.meshes->take().empty());
  EXPECT_EQ(game.meshes->pending(), 0U);
  EXPECT_FALSE(game.tracer->is_late());
}

TEST_P(GameJobs, ObjectsEndInJobsWhileWorkersAreBusy) {
  for (int round = 0; round < 3; ++round) {
    const auto jobs = std::make_shared<CountingJobs>(GetParam());
    const ScopedJobSystem scope(jobs);
    const WorldFolder folder;
    WorkingGame game(folder / "land.quoin");
    for (int i = 0; i < 10 * round; ++i) game.frame();
    if (round == 2) {
      EXPECT_TRUE(game.world->load_all({&game.viewer, 1}));
    }
    game.dig(round);
    game.frame();
    call_as_job(*jobs, [&] {
      if (round == 1) game.light.reset();
      game.meshes.reset();
      game.tracer.reset();
      game.impostors.reset();
      game.world.reset();
      game.light.reset();
    });
  }
}

// On a thread of its own, which frees its scratch memory at its end.
void play_with_block_functions() {
  static BlockArena arena;
  ASSERT_TRUE(set_block_functions(arena.functions()));
  std::thread([] {
    {
      const ScopedJobSystem scope(make_worker_pool({.count = 3}));
      const GameResult result = play();
      EXPECT_GT(result.uploads.size(), 0U);
    }
    EXPECT_GT(arena.made, 100);
  }).join();
  EXPECT_EQ(arena.blocks, 0);
  EXPECT_EQ(arena.bytes, 0);
}
TEST(BlockFunctionsDeathTest, ServeAStreamedGameAndGetAllBlocksBack) {
  QUOIN_EXPECT_IN_NEW_PROCESS(play_with_block_functions);
}

TEST(GameJobPriority, EditsAreMeshedBeforeLoadedChunks) {
  const auto jobs = std::make_shared<CountingJobs>(1);
  const ScopedJobSystem scope(jobs);
  Scene scene;
  const GridHandle handle = scene.add_grid({});
  scene.add_instance({.name = "", .grid = handle});
  scene.edit(handle).grid.fill_box({{0, 0, 0}, {256, 64, 256}}, 1);
  LiveMeshes meshes;
  const auto run = [&] {
    do {
      meshes.update(scene, {});
      (void)meshes.take();
    } while (meshes.pending() != 0);
    while (jobs->unfinished() != 0) std::this_thread::yield();
  };
  run();
  EXPECT_FALSE(jobs->run(JobPriority::Normal).empty());
  EXPECT_TRUE(jobs->run(JobPriority::High).empty());
  scene.edit(handle).grid.set({10, 63, 10}, kAir);
  run();
  EXPECT_FALSE(jobs->run(JobPriority::High).empty());
}

}  // namespace
}  // namespace quoin
