#include "live/mesh_scheduler.h"

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <new>
#include <thread>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"
#include "grid/chunk/chunk_storage.h"
#include "live/live_test_support.h"
#include "render/chunks/surface_source.h"
#include "render/chunks/voxel_densities.h"

namespace quoin {
namespace {

// Workers that stop at a gate, with a log of their work.
class GatedWork {
 public:
  explicit GatedWork(const LiveMeshOptions& options) : options_(options) {}

  MeshJobQueue::Work work() {
    return [this](SurfaceJob& job, SurfaceWorkspace& workspace) {
      {
        std::unique_lock lock(mutex_);
        started_.push_back({job.chunk, job.distance});
        progressed_.notify_all();
        progressed_.wait(lock, [&] { return is_open_ || allowed_ != 0; });
        if (!is_open_) --allowed_;
      }
      make_live_surface(options_, job, workspace);
    };
  }
  void let_through(int jobs) {
    const std::lock_guard lock(mutex_);
    allowed_ += jobs;
    progressed_.notify_all();
  }
  void open() {
    const std::lock_guard lock(mutex_);
    is_open_ = true;
    progressed_.notify_all();
  }
  void wait_for_started(std::size_t jobs) {
    std::unique_lock lock(mutex_);
    progressed_.wait(lock, [&] { return started_.size() >= jobs; });
  }
  struct Started {
    IVec3 chunk{0};
    double distance = 0.0;
  };
  std::vector<Started> started() {
    const std::lock_guard lock(mutex_);
    return started_;
  }

 private:
  LiveMeshOptions options_;
  std::mutex mutex_;
  std::condition_variable progressed_;
  std::vector<Started> started_;
  int allowed_ = 0;
  bool is_open_ = false;
};

LiveMeshOptions blocky(unsigned threads) {
  LiveMeshOptions options;
  options.merge = false;
  options.workers = {threads};
  return options;
}

// Sets a voxel in each of a row of chunks.
void fill_row(Grid& grid, int chunks) {
  for (int i = 0; i < chunks; ++i) grid.set({64 * i + 30, 30, 30}, 1);
}

std::size_t faces_of(const SurfaceUpdate& update) {
  return update.surface == nullptr ? 0 : update.surface->quads.size();
}

TEST(MeshScheduler, MeshesNearestChunksFirst) {
  OneGrid one;
  fill_row(one.grid(), 200);
  Instance& instance = one.scene.edit(one.placed);
  instance.voxel_size = 0.5;
  instance.mirrored = true;
  GatedWork gated(blocky(1));
  gated.open();
  MeshScheduler scheduler(blocky(1), gated.work());
  // Mirrored, chunk i lies from -32 i to -32 i - 32.
  scheduler.finish(one.scene, {-32 * 120.0, 0.0, 15.0});
  const std::vector<GatedWork::Started> started = gated.started();
  ASSERT_EQ(started.size(), 200U);
  EXPECT_TRUE(started[0].chunk.x == 119 || started[0].chunk.x == 120);
  for (std::size_t i = 1; i < started.size(); ++i) EXPECT_GE(started[i].distance, started[i - 1].distance) << i;
  EXPECT_EQ(started.back().chunk.x, 0);
}

TEST(MeshScheduler, ReordersQueueWhenEyeMoves) {
  OneGrid one;
  fill_row(one.grid(), 200);
  GatedWork gated(blocky(1));
  MeshScheduler scheduler(blocky(1), gated.work());
  scheduler.update(one.scene, {0.0, 30.0, 30.0});
  gated.wait_for_started(1);
  scheduler.update(one.scene, {64 * 150.0 + 30.0, 30.0, 30.0});
  gated.let_through(1);
  gated.wait_for_started(2);
  EXPECT_EQ(gated.started()[1].chunk.x, 150);
  EXPECT_EQ(scheduler.pending(), 200U);
  gated.open();
  scheduler.finish(one.scene, {});
  EXPECT_EQ(scheduler.take().size(), 200U);
  EXPECT_EQ(scheduler.stats().chunks_meshed, 200);
}

TEST(MeshScheduler, ReleasesUnneededSnapshots) {
  OneGrid one;
  for (int i = 0; i < 100; ++i) {
    for (int x = 0; x < 64; ++x) one.grid().set({64 * i + x, x, x / 2}, static_cast<VoxelType>(1 + x % 3));
  }
  GatedWork gated(blocky(1));
  MeshScheduler scheduler(blocky(1), gated.work());
  const auto storage = [&](int chunk) { return ChunkStorage::of(*one.grid().find_chunk({chunk, 0, 0})); };
  scheduler.update(one.scene, {});
  gated.wait_for_started(1);
  const ChunkStorage* before = storage(90);
  one.grid().set({64 * 90 + 5, 40, 40}, 1);
  EXPECT_NE(storage(90), before) << "workers must see the earlier voxels";
  gated.open();
  scheduler.finish(one.scene, {});
  EXPECT_EQ(scheduler.take().size(), 100U);
  // The worker destroys the last snapshot soon. Each attempt needs a chunk that was not copied yet.
  bool is_shared = true;
  for (int chunk = 0; chunk < 90 && is_shared; ++chunk) {
    before = storage(chunk);
    one.grid().set({64 * chunk + 5, 40, 40}, 1);
    is_shared = storage(chunk) != before;
    if (is_shared) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_FALSE(is_shared);
}

TEST(MeshScheduler, DeliversAllChunksOfOneFieldEditTogether) {
  OneGrid one;
  DensityGrid& field = one.scene.edit(one.handle).field;
  field.add_box(DVec3(10.0), DVec3(118.0), 1);  // in eight chunks
  GatedWork gated(blocky(1));
  MeshScheduler scheduler(blocky(1), gated.work());
  scheduler.update(one.scene, {});
  gated.wait_for_started(1);
  gated.let_through(1);
  gated.wait_for_started(2);
  EXPECT_EQ(scheduler.take().size(), 1U) << "first meshes do not wait for other chunks";
  gated.let_through(7);
  while (scheduler.pending() != 0) {
    scheduler.update(one.scene, {});
    (void)scheduler.take();
  }
  EXPECT_EQ(gated.started().size(), 8U);
  field.remove_sphere(DVec3(64.0, 118.0, 64.0), 6.0);
  scheduler.update(one.scene, {});
  for (int done = 1; done <= 4; ++done) {
    EXPECT_TRUE(scheduler.take().empty()) << done;
    gated.wait_for_started(8U + static_cast<std::size_t>(done));
    // Changes made in the meantime wait for these jobs.
    if (done == 2) field.remove_sphere(DVec3(64.0, 118.0, 20.0), 6.0);
    scheduler.update(one.scene, {});
    gated.let_through(1);
  }
  std::size_t given = 0;
  while (given == 0) {
    scheduler.update(one.scene, {});
    given = scheduler.take().size();
  }
  EXPECT_EQ(given, 4U);
  EXPECT_EQ(scheduler.pending(), 2U);
  gated.open();
  scheduler.finish(one.scene, {});
  EXPECT_EQ(scheduler.take().size(), 2U);
  EXPECT_EQ(gated.started().size(), 14U);
}

TEST(MeshScheduler, MeshesTheLastOfSeveralEdits) {
  OneGrid one;
  fill_row(one.grid(), 2);
  GatedWork gated(blocky(1));
  MeshScheduler scheduler(blocky(1), gated.work());
  scheduler.update(one.scene, {});
  gated.wait_for_started(1);  // chunk 0; chunk 1 waits
  for (int i = 1; i <= 5; ++i) {
    one.grid().set({64 + 4 * i, 4, 4}, 1);
    scheduler.update(one.scene, {});
  }
  gated.open();
  scheduler.finish(one.scene, {});
  EXPECT_EQ(scheduler.stats().chunks_meshed, 3) << "chunk 0, the first edit, and all others at once";
  for (const SurfaceUpdate& update : scheduler.take()) EXPECT_EQ(faces_of(update), update.chunk.x == 0 ? 6U : 36U);
}

TEST(MeshScheduler, DeliversEditDuringMeshingInOrder) {
  OneGrid one;
  fill_row(one.grid(), 1);
  GatedWork gated(blocky(1));
  MeshScheduler scheduler(blocky(1), gated.work());
  scheduler.update(one.scene, {});
  gated.wait_for_started(1);
  one.grid().set({3, 3, 3}, 1);
  scheduler.update(one.scene, {});
  gated.let_through(1);
  gated.wait_for_started(2);
  std::vector<SurfaceUpdate> first = scheduler.take();
  ASSERT_EQ(first.size(), 1U);
  EXPECT_EQ(faces_of(first[0]), 6U);
  EXPECT_EQ(scheduler.pending(), 1U);
  gated.open();
  scheduler.finish(one.scene, {});
  std::vector<SurfaceUpdate> second = scheduler.take();
  ASSERT_EQ(second.size(), 1U);
  EXPECT_EQ(faces_of(second[0]), 12U);
  EXPECT_EQ(scheduler.pending(), 0U);
}

TEST(MeshScheduler, DropsChunksRemovedOrReplacedDuringMeshing) {
  for (const bool replaced : {false, true}) {
    SCOPED_TRACE(replaced);
    OneGrid one;
    fill_row(one.grid(), 1);
    GatedWork gated(blocky(1));
    MeshScheduler scheduler(blocky(1), gated.work());
    scheduler.update(one.scene, {});
    gated.wait_for_started(1);
    one.grid() = Grid();
    if (replaced) one.grid().fill_box({{30, 30, 30}, {32, 31, 31}}, 1);
    scheduler.update(one.scene, {});
    EXPECT_EQ(scheduler.pending(), replaced ? 1U : 0U);
    gated.open();
    scheduler.finish(one.scene, {});
    const std::vector<SurfaceUpdate> taken = scheduler.take();
    ASSERT_EQ(taken.size(), replaced ? 1U : 0U);
    if (replaced) {
      EXPECT_EQ(faces_of(taken[0]), 10U);
    }
  }
}

// Returns a scene with two chunks that were taken, and an edit of both.
void edit_two_chunks(OneGrid& one, GatedWork& gated, MeshScheduler& scheduler) {
  fill_row(one.grid(), 2);
  gated.let_through(2);
  scheduler.finish(one.scene, {});
  EXPECT_EQ(scheduler.take().size(), 2U);
  one.grid().fill_box({{63, 3, 3}, {65, 4, 4}}, 1);
  scheduler.update(one.scene, {});
}

TEST(MeshScheduler, DeliversAllChunksOfAnEditTogether) {
  for (const std::size_t max_bytes : {~std::size_t{0}, std::size_t{0}}) {
    OneGrid one;
    GatedWork gated(blocky(2));
    MeshScheduler scheduler(blocky(2), gated.work());
    edit_two_chunks(one, gated, scheduler);
    const std::uint64_t before = scheduler.shown_update();
    gated.wait_for_started(4);
    gated.let_through(1);
    while (scheduler.stats().chunks_meshed < 3) std::this_thread::yield();
    EXPECT_TRUE(scheduler.take(max_bytes).empty());
    EXPECT_EQ(scheduler.shown_update(), before);
    EXPECT_EQ(scheduler.pending(), 2U);
    gated.open();
    while (scheduler.stats().chunks_meshed < 4) std::this_thread::yield();
    EXPECT_EQ(scheduler.take(max_bytes).size(), 2U) << "the limit does not divide them";
    EXPECT_EQ(scheduler.shown_update(), before + 1);
    EXPECT_EQ(scheduler.update(one.scene, {}), before + 2);
    EXPECT_TRUE(scheduler.take().empty());
    EXPECT_EQ(scheduler.shown_update(), before + 2) << "nothing changed since";
  }
}

// A field chunk of a complete edit gets another level while the next edit is in progress, before the first is taken.
TEST(MeshScheduler, DeliversAnEditWithFieldsThatChangedLevelSince) {
  OneGrid one;
  SceneGrid& both = one.scene.edit(one.handle);
  both.field.add_box(DVec3(10.0), DVec3(50.0), 1);
  both.grid.set({100, 30, 30}, 1);
  LiveMeshOptions options = blocky(2);
  options.detail_distance = 100.0;
  GatedWork voxels(options);
  MeshScheduler scheduler(options, [&, work = voxels.work()](SurfaceJob& job, SurfaceWorkspace& workspace) {
    if (job.source.content == SurfaceContent::Voxels) return work(job, workspace);
    make_live_surface(options, job, workspace);
  });
  const auto wait_for_meshed = [&](std::int64_t chunks) {
    while (scheduler.stats().chunks_meshed < chunks) std::this_thread::yield();
  };
  voxels.let_through(1);
  scheduler.finish(one.scene, {});
  EXPECT_EQ(scheduler.take().size(), 2U);
  // The first edit changes a chunk of voxels and one of the field.
  SceneGrid& edited = one.scene.edit(one.handle);
  edited.grid.set({101, 30, 30}, 1);
  edited.field.remove_sphere(DVec3(30.0), 5.0);
  edited.field.remove_sphere({30.0, 50.0, 30.0}, 5.0);
  voxels.let_through(1);
  const std::uint64_t first = scheduler.update(one.scene, {});
  wait_for_meshed(4);
  // The next one changes voxels. The eye has moved away.
  one.grid().set({102, 30, 30}, 1);
  scheduler.update(one.scene, DVec3(300.0));
  wait_for_meshed(5);
  const std::vector<SurfaceUpdate> updates = scheduler.take();
  EXPECT_EQ(updates.size(), 2U) << "of the first edit";
  EXPECT_EQ(scheduler.shown_update(), first);
  voxels.open();
  scheduler.finish(one.scene, DVec3(300.0));
  EXPECT_EQ(scheduler.take().size(), 1U);
}

TEST(MeshScheduler, RepeatsJobsOfAnEditWithoutMemory) {
  OneGrid one;
  GatedWork gated(blocky(1));
  std::atomic<int> failures{0};
  MeshScheduler scheduler(blocky(1), [&, work = gated.work()](SurfaceJob& job, SurfaceWorkspace& workspace) {
    if (failures-- > 0) throw std::bad_alloc();
    work(job, workspace);
  });
  edit_two_chunks(one, gated, scheduler);
  gated.open();
  scheduler.finish(one.scene, {});
  EXPECT_EQ(scheduler.take().size(), 2U);
  one.grid().set({63, 5, 5}, 1);
  failures = 1;
  scheduler.update(one.scene, {});
  while (scheduler.stats().chunks_meshed < 5) std::this_thread::yield();
  EXPECT_TRUE(scheduler.take().empty());
  // The repeated job shows the state of the edit, not a later one.
  one.grid().set({63, 7, 7}, 1);
  scheduler.update(one.scene, {});
  while (scheduler.stats().chunks_meshed < 6) std::this_thread::yield();
  const std::vector<SurfaceUpdate> updates = scheduler.take();
  ASSERT_EQ(updates.size(), 2U);
  std::size_t faces = 0;
  for (const SurfaceUpdate& update : updates) faces += faces_of(update);
  EXPECT_EQ(faces, 6U + 6U + 10U + 6U);
  EXPECT_EQ(scheduler.stats().out_of_memory, 1);
}

TEST(MeshScheduler, DeliversLoadedChunksOneByOne) {
  OneGrid one;
  fill_row(one.grid(), 3);
  GatedWork gated(blocky(1));
  MeshScheduler scheduler(blocky(1), gated.work());
  scheduler.update(one.scene, {});
  for (std::size_t done = 1; done <= 3; ++done) {
    gated.let_through(1);
    while (scheduler.stats().chunks_meshed < static_cast<std::int64_t>(done)) std::this_thread::yield();
    EXPECT_EQ(scheduler.take().size(), 1U);
  }
}

TEST(MeshScheduler, MeshesEditsBeforeLoadedChunks) {
  OneGrid one;
  fill_row(one.grid(), 50);
  GatedWork gated(blocky(1));
  MeshScheduler scheduler(blocky(1), gated.work());
  scheduler.update(one.scene, {});
  gated.wait_for_started(1);
  one.grid().set({64 * 40 + 3, 3, 3}, 1);
  scheduler.update(one.scene, {});
  gated.let_through(2);
  gated.wait_for_started(3);
  EXPECT_EQ(gated.started()[1].chunk.x, 40);
  while (scheduler.stats().chunks_meshed < 2) std::this_thread::yield();
  EXPECT_EQ(scheduler.take().size(), 2U) << "no other chunk holds them back";
  gated.open();
}

// Otherwise edits near the eye would wait for all of them.
TEST(MeshScheduler, DeliversVeryLargeEditsOneByOne) {
  for (const int chunks : {256, 257}) {
    OneGrid one;
    fill_row(one.grid(), chunks);
    GatedWork gated(blocky(1));
    MeshScheduler scheduler(blocky(1), gated.work());
    gated.let_through(chunks);
    scheduler.finish(one.scene, {});
    EXPECT_EQ(scheduler.take().size(), static_cast<std::size_t>(chunks));
    one.grid().fill_box({{0, 40, 40}, {64 * chunks, 41, 41}}, 1);
    scheduler.update(one.scene, {});
    gated.let_through(1);
    while (scheduler.stats().chunks_meshed < chunks + 1) std::this_thread::yield();
    EXPECT_EQ(scheduler.take().size(), chunks == 256 ? 0U : 1U);
    gated.open();
    scheduler.finish(one.scene, {});
    EXPECT_EQ(scheduler.take().size(), chunks == 256 ? 256U : 256U);
  }
}

// The same blocks are edited in every frame, for a long time, and workers are slower than frames: each edit is shown
// after at most two epochs.
TEST(MeshScheduler, ShowsEveryEditSoonWhileEditsGoOn) {
  OneGrid one;
  GatedWork gated(blocky(1));
  MeshScheduler scheduler(blocky(1), gated.work());
  edit_two_chunks(one, gated, scheduler);
  std::map<std::uint64_t, std::int64_t> meshed_before;  // chunks, by update
  std::int64_t most = 0;
  std::uint64_t shown = 0;
  int deliveries = 0;
  for (int frame = 0; frame < 400; ++frame) {
    one.grid().fill_box({{63, 3, 3}, {65, 4, 4}}, frame % 2 == 0 ? kAir : VoxelType{1});
    const std::int64_t meshed = scheduler.stats().chunks_meshed;
    meshed_before[scheduler.update(one.scene, {})] = meshed;
    if (frame % 3 == 0) {
      gated.let_through(1);
      while (scheduler.stats().chunks_meshed == meshed) std::this_thread::yield();
    }
    const std::size_t taken = scheduler.take().size();
    EXPECT_TRUE(taken == 0 || taken == 2) << taken;
    deliveries += taken == 2 ? 1 : 0;
    for (; shown < scheduler.shown_update(); ++shown) {
      const auto found = meshed_before.find(shown + 1);
      if (found != meshed_before.end()) most = std::max(most, scheduler.stats().chunks_meshed - found->second);
    }
  }
  EXPECT_GT(deliveries, 60);
  EXPECT_LE(most, 4) << "chunks meshed between an edit and its surfaces";
  gated.open();
}

// Each edit adds an isolated voxel: the number of faces counts the edits.
TEST(MeshScheduler, DeliversNoOlderMeshAfterNewer) {
  LiveMeshOptions options = blocky(4);
  OneGrid one;
  MeshScheduler scheduler(options, [&](SurfaceJob& job, SurfaceWorkspace& workspace) {
    // Jobs of one chunk overtake each other.
    if (job.serial % 3 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    make_live_surface(options, job, workspace);
  });
  std::map<int, std::size_t> faces;
  std::mt19937 random(3);
  std::size_t edits = 0;
  const auto take = [&] {
    for (const SurfaceUpdate& update : scheduler.take()) {
      EXPECT_GT(faces_of(update), faces[update.chunk.x]);
      faces[update.chunk.x] = faces_of(update);
    }
  };
  for (int i = 0; i < 1000; ++i) {
    const IVec3 at{64 * static_cast<int>(random() % 2) + 2 * (i % 30) + 1, 2 * (i / 30 % 30) + 1, 2 * (i / 900) + 1};
    edits += one.grid().set(at, 1) ? 1 : 0;
    scheduler.update(one.scene, {});
    if (random() % 4 == 0) take();
    if (random() % 16 == 0) std::this_thread::sleep_for(std::chrono::microseconds(500));
  }
  scheduler.finish(one.scene, {});
  take();
  EXPECT_EQ(faces[0] + faces[1], 6 * edits);
}

// Unchanged chunks deliver no surface, but callers that wait for `pending` to be 0 still finish.
TEST(MeshScheduler, OnReadyDeliversAllMeshes) {
  OneGrid one;
  constexpr int kEdited = 40;
  for (int row = 0; row < 2; ++row) {
    for (int i = 0; i < kEdited; ++i)
      one.grid().fill_box({{64 * i + 28, 64 * row + 28, 28}, {64 * i + 37, 64 * row + 37, 37}}, 1);
  }
  std::mutex mutex;
  std::condition_variable called;
  int calls = 0;
  LiveMeshOptions options;
  options.style = SurfaceStyle::Smooth;
  options.workers = {1};
  options.on_ready = [&] {
    const std::lock_guard lock(mutex);
    ++calls;
    called.notify_all();
  };
  std::atomic<int> as_before{0};
  MeshScheduler scheduler(options, [&](SurfaceJob& job, SurfaceWorkspace& workspace) {
    make_live_surface(options, job, workspace);
    as_before += job.outcome == SurfaceJob::Outcome::AsBefore ? 1 : 0;
  });
  const DVec3 eye{0.0, -1'000'000.0, 0.0};  // the lower row, which is edited, has priority
  const auto come_to_the_end = [&] {
    for (int seen = -1;;) {
      scheduler.update(one.scene, eye);
      (void)scheduler.take();
      if (scheduler.pending() == 0) return true;
      std::unique_lock lock(mutex);
      if (!called.wait_for(lock, std::chrono::seconds(20), [&] { return calls != seen; })) return false;
      seen = calls;
    }
  };
  ASSERT_TRUE(come_to_the_end());
  for (int i = 0; i < kEdited; ++i) one.grid().set({64 * i + 28, 28, 28}, kAir);
  ASSERT_TRUE(come_to_the_end());
  EXPECT_GT(as_before, 0) << "the test is of such chunks";
}

TEST(MeshScheduler, RetriesAfterRunningOutOfMemory) {
  for (const SurfaceStyle style : {SurfaceStyle::Blocky, SurfaceStyle::Smooth}) {
    LiveMeshOptions options = blocky(2);
    options.style = style;
    OneGrid one;
    one.grid().fill_box({{25, 25, 25}, {36, 36, 36}}, 1);
    std::atomic<int> calls{0};
    MeshScheduler scheduler(options, [&](SurfaceJob& job, SurfaceWorkspace& workspace) {
      if (++calls % 2 == 1) throw std::bad_alloc();
      make_live_surface(options, job, workspace);
    });
    ShownSurfaces shown;
    int updates = 0;
    do {
      scheduler.update(one.scene, {});
      shown.apply(scheduler.take());
      ++updates;
    } while (scheduler.pending() != 0 && updates < 100'000'000);
    expect_surfaces(shown, one.scene, options);
    EXPECT_EQ(scheduler.stats().out_of_memory, calls / 2);
    EXPECT_GT(scheduler.stats().out_of_memory, 0);
  }
}

TEST(MeshScheduler, FinishThrowsWithoutMemory) {
  OneGrid one;
  fill_row(one.grid(), 3);
  MeshScheduler scheduler(blocky(2), [](SurfaceJob&, SurfaceWorkspace&) { throw std::bad_alloc(); });
  EXPECT_THROW(scheduler.finish(one.scene, {}), std::bad_alloc);
  EXPECT_EQ(scheduler.pending(), 3U);
  EXPECT_TRUE(scheduler.take().empty());
}

TEST(MeshScheduler, StopsWithoutMeshingQueue) {
  OneGrid one;
  fill_row(one.grid(), 60);
  std::atomic<int> started{0};
  std::atomic<int> ended{0};
  {
    MeshScheduler scheduler(blocky(2), [&](SurfaceJob&, SurfaceWorkspace&) {
      ++started;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      ++ended;
    });
    scheduler.update(one.scene, {});
    while (started == 0) std::this_thread::yield();
  }
  EXPECT_EQ(started, ended);
  EXPECT_LT(started, 60);
}

// GridSurfaces uses the defaults, and must give the surfaces of LiveMeshes with one region per chunk.
TEST(MeshScheduler, HasDefaultsOfGridSurfaces) {
  LiveMeshOptions options;
  options.region_edge = kChunkEdge;
  EXPECT_TRUE(surface_options(options) == ChunkSurfaceOptions{});
  options.merge = false;
  EXPECT_FALSE(surface_options(options) == ChunkSurfaceOptions{});
}

TEST(MeshJobQueueDeathTest, RejectsQueuesWithoutWorkersAndMissingJobs) {
  const MeshJobQueue::Work work = [](SurfaceJob&, SurfaceWorkspace&) {};
  QUOIN_EXPECT_MISTAKE(MeshJobQueue(0, work, {}), "workers with a function");
  QUOIN_EXPECT_MISTAKE(MeshJobQueue(1, {}, {}), "workers with a function");
  QUOIN_EXPECT_MISTAKE(MeshJobQueue(1, work, {}).push(nullptr), "a job with a distance");
}

TEST(VoxelDensityDeathTest, RejectsReadingBeforeDensitiesAreMade) {
  VoxelDensity density(std::make_shared<const Grid>(), {}, nullptr, {}, std::make_shared<const VoxelRegistry>());
  QUOIN_EXPECT_MISTAKE((void)density.densities(), "densities that were made");
  QUOIN_EXPECT_MISTAKE((void)density.reads_as(1, 1, {}), "densities that were made");
}

TEST(ChunkDistancesDeathTest, RejectsInvalidTransform) {
  ChunkDistances distances({}, {});
  Instance instance;
  instance.voxel_size = 0.0;
  QUOIN_EXPECT_MISTAKE(distances.add(instance, SceneGrid()), "an instance with a finite transform");
}

}  // namespace
}  // namespace quoin
