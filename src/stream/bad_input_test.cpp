#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/core/assert.h>
#include <quoin/io/file.h>
#include <quoin/store/world_maintenance.h>
#include <quoin/stream/streamed_world.h>

#include "core/work/job_system_for_tests.h"
#include "store/world/disk_for_tests.h"
#include "store/world/world_for_tests.h"
#include "stream/chunk_streamer.h"

// Generators that fail, and full disks: the game goes on, saved data stays, and the error names its place.

namespace quoin {
namespace {

using namespace std::chrono_literals;

/// Makes chunks by a function; a ground of type 1 without one.
class FunctionGround final : public ChunkGenerator {
 public:
  using Make = std::function<Result<StoredChunk>(IVec3 chunk, const Cancellation& cancelled)>;

  explicit FunctionGround(Make make = {}) : make_(std::move(make)) {}
  [[nodiscard]] IBox chunks() const override { return {{-50, -2, -50}, {50, 2, 50}}; }
  [[nodiscard]] Result<StoredChunk> make(IVec3 chunk, const Cancellation& cancelled) const override {
    return make_ ? make_(chunk, cancelled) : StoredChunk{Chunk(1)};
  }

 private:
  Make make_;
};

/// Lets threads wait until it is opened.
class Gate {
 public:
  void open() {
    const std::scoped_lock lock(mutex_);
    is_open_ = true;
    changed_.notify_all();
  }
  void wait() {
    std::unique_lock lock(mutex_);
    is_reached_ = true;
    changed_.notify_all();
    changed_.wait(lock, [&] { return is_open_; });
  }
  void wait_until_reached() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return is_reached_; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_open_ = false;
  bool is_reached_ = false;
};

class StreamedWorldBadInput : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto made = WorldStore::create(folder_ / "tried.quoin");
    if (!made && made.error().code == ErrorCode::Unsupported) GTEST_SKIP() << to_string(made.error());
  }
  [[nodiscard]] std::filesystem::path path() const { return folder_ / "world.quoin"; }

  // Returns a world with one streamed grid, number 0, that has an instance. Type 3 has no state.
  StreamedWorld opened(const std::shared_ptr<const ChunkGenerator>& generator, const StreamOptions& options = {}) {
    auto world = StreamedWorld::open_or_create(path(), options);
    EXPECT_TRUE(world.has_value()) << to_string(world.error());
    if (!world->is_new()) {
      world->use_generator(land(*world), generator);
      return std::move(*world);
    }
    for (std::uint8_t type = 1; type <= 2; ++type) EXPECT_TRUE(world->scene().types.add(coloured_type(type)));
    EXPECT_TRUE(world->scene().types.add({.name = "without state"}));
    const auto grid = world->add_grid({.name = "land"}, generator);
    EXPECT_TRUE(grid.has_value()) << to_string(grid.error());
    world->scene().add_instance({.grid = *grid});
    return std::move(*world);
  }
  static GridHandle land(const StreamedWorld& world) { return world.scene().grids().handles().front(); }
  static Grid& voxels(StreamedWorld& world) { return world.scene().edit(land(world)).grid; }

  // Calls `update` until `is_done()`; returns false after many calls. Adds errors to `errors`.
  template <class IsDone>
  static bool update_until(StreamedWorld& world, const Viewer& viewer, const IsDone& is_done,
                           std::vector<Error>* errors = nullptr) {
    for (int i = 0; i < 20'000; ++i) {
      const Status done = world.update({&viewer, 1});
      if (!done && errors != nullptr) errors->push_back(done.error());
      EXPECT_TRUE(done || errors != nullptr) << to_string(done.error());
      if (is_done()) return true;
      std::this_thread::sleep_for(1ms);
    }
    return false;
  }

  WorldFolder folder_;
};

StoredChunk chunk_with_density(Half density) {
  DensityChunk chunk(stored_density(4.0F, 8.0F));
  std::array<Half, kChunkEdge> row{};
  row.fill(stored_density(-4.0F, 8.0F));
  row[17] = density;
  chunk.write_row(5, 60, row);
  return {Chunk(kAir), chunk};
}

struct Garbage {
  std::string text;  // part of the problem
  FunctionGround::Make make;
};

std::vector<Garbage> all_garbage() {
  const auto made = [](StoredChunk chunk) {
    return [chunk = std::move(chunk)](IVec3, const Cancellation&) { return Result<StoredChunk>(chunk); };
  };
  Chunk with_state(3);
  with_state.set_data({1, 2, 3}, {.state = 1});
  DensityChunk of_unknown(stored_density(-4.0F, 8.0F), 4);
  std::vector<Garbage> all{
      {"voxels of type 777", made({Chunk(777)})},
      {"voxels of type 4", made({Chunk(kAir), of_unknown})},
      {"more bits than its type", made({with_state})},
      {"exception: the noise is broken",
       [](IVec3, const Cancellation&) -> Result<StoredChunk> { throw std::runtime_error("the noise is broken"); }},
      {"exception", [](IVec3, const Cancellation&) -> Result<StoredChunk> { throw 42; }},
      {"a hole in the data",
       [](IVec3, const Cancellation&) -> Result<StoredChunk> {
         return make_error(ErrorCode::BadFormat, "a hole in the data");
       }},
      {"not needed",  // it was not cancelled
       [](IVec3, const Cancellation&) -> Result<StoredChunk> {
         return make_error(ErrorCode::Cancelled, "not needed");
       }},
  };
  std::vector<int> halves{0x0001, 0x4801, 0xC801, 0x7BFF};  // too close to 0, and beyond the band of 8
  // Infinity, two NaN and -0: DensityChunk asserts in builds that check.
  if (QUOIN_ASSERT_ENABLED == 0) halves.insert(halves.end(), {0x7C00, 0x7E00, 0xFFFF, 0x8000});
  for (const int half : halves) {
    all.push_back({"density that is not a number", made(chunk_with_density(static_cast<Half>(half)))});
    all.push_back({"density that is not a number", made({Chunk(1), DensityChunk(static_cast<Half>(half))})});
  }
  return all;
}

TEST_F(StreamedWorldBadInput, KeepsGarbageOutOfWorldAndFile) {
  const IVec3 bad{0, 0, 0};
  int number = 0;
  for (const Garbage& garbage : all_garbage()) {
    SCOPED_TRACE(garbage.text);
    std::filesystem::remove(path());
    const auto generator = std::make_shared<FunctionGround>([&](IVec3 chunk, const Cancellation& cancelled) {
      return chunk == bad ? garbage.make(chunk, cancelled) : StoredChunk{Chunk(1)};
    });
    const Viewer viewer{.position = DVec3(32.0), .radius = 40.0};
    {
      StreamedWorld world = opened(generator, {.keep_generated = number++ % 2 == 0});
      ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
      const auto problems = world.take_problems();
      ASSERT_EQ(problems.size(), 1U);
      EXPECT_NE(problems[0].find("chunk (0, 0, 0) of grid 0"), std::string::npos) << problems[0];
      EXPECT_NE(problems[0].find(garbage.text), std::string::npos) << problems[0];
      const SceneGrid& content = world.scene().grids()[land(world)];
      EXPECT_TRUE(content.grid.is_loaded(bad));
      EXPECT_EQ(content.grid.find_chunk(bad), nullptr);
      EXPECT_EQ(content.field.find_chunk(bad), nullptr);
      EXPECT_EQ(content.grid.get(64, 0, 0), 1);
      // The game goes on.
      EXPECT_TRUE(voxels(world).set(64, 0, 0, 2));
      EXPECT_TRUE(world.flush().has_value());
      EXPECT_FALSE(world.store().load_chunk({0, 0, bad})->has_value()) << "not stored";
      EXPECT_TRUE(world.take_problems().empty());
    }
    EXPECT_TRUE(check_world(path())->damage.empty());
    // A repaired generator is asked again.
    StreamedWorld world = opened(std::make_shared<FunctionGround>());
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
    EXPECT_EQ(world.scene().grids()[land(world)].grid.get(0, 0, 0), 1);
    EXPECT_EQ(world.scene().grids()[land(world)].grid.get(64, 0, 0), 2);
  }
}

// A grid has no kind: a generator may make voxels, densities, or both.
TEST_F(StreamedWorldBadInput, TakesVoxelsAndDensitiesOfOneChunk) {
  const StoredChunk both{Chunk(2), DensityChunk(stored_density(-3.0F, 8.0F), 1)};
  const auto generator =
      std::make_shared<FunctionGround>([&](IVec3, const Cancellation&) { return Result<StoredChunk>(both); });
  const Viewer viewer{.position = DVec3(32.0), .radius = 1.0};
  for (int run = 0; run < 2; ++run) {
    StreamedWorld world = opened(generator);
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
    EXPECT_TRUE(world.take_problems().empty());
    const SceneGrid& content = world.scene().grids()[land(world)];
    ASSERT_NE(content.field.find_chunk(IVec3(0)), nullptr);
    EXPECT_EQ(*content.grid.find_chunk(IVec3(0)), both.voxels);
    EXPECT_EQ(*content.field.find_chunk(IVec3(0)), *both.densities);
  }
}

TEST(ValidateChunk, AcceptsStoredDensitiesOfBand) {
  VoxelRegistry types;
  ASSERT_TRUE(types.add(coloured_type(1)));
  for (const float band : {0.25F, 8.0F, 1000.0F}) {
    std::array<Half, kChunkEdge> row{};
    for (int x = 0; x < kChunkEdge; ++x) {
      row[static_cast<std::size_t>(x)] = stored_density(static_cast<float>(x - 32) * band / 16.0F, band);
    }
    StoredChunk chunk{Chunk(1), DensityChunk(stored_density(band, band), 1)};
    chunk.densities->write_row(63, 1, row);
    EXPECT_TRUE(validate_chunk(chunk, types, band).has_value()) << band;
    EXPECT_FALSE(validate_chunk(chunk, types, band / 2).has_value()) << band;
    EXPECT_FALSE(validate_chunk(chunk, {}, band).has_value()) << "no types";
  }
}

// One of two workers is in a generator that ignores the cancellation.
TEST_F(StreamedWorldBadInput, NamesGeneratorThatDoesNotReturn) {
  Gate gate;
  const auto generator = std::make_shared<FunctionGround>([&](IVec3 chunk, const Cancellation&) {
    if (chunk == IVec3(0)) gate.wait();
    return Result<StoredChunk>(StoredChunk{Chunk(1)});
  });
  StreamedWorld world = opened(generator, {.generator_timeout = 20ms, .workers = {2}});
  const Viewer viewer{.position = DVec3(32.0), .radius = 150.0};
  EXPECT_TRUE(update_until(world, viewer, [&] { return world.stats().missing_chunks == 1; })) << "others are loaded";
  std::vector<std::string> problems;
  EXPECT_TRUE(update_until(world, viewer, [&] {
    for (std::string& problem : world.take_problems()) problems.push_back(std::move(problem));
    return !problems.empty();
  }));
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(world.update({&viewer, 1}).has_value());
  ASSERT_TRUE(world.take_problems().empty()) << "reported once";
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_EQ(problems[0], "chunk (0, 0, 0) of grid 0: its generator has not returned for 20 ms");
  // All other chunks can be edited and saved, also chunks that are not loaded.
  EXPECT_FALSE(world.is_loaded(land(world), IVec3(0)));
  EXPECT_TRUE(voxels(world).set(64, 0, 0, 2));
  ASSERT_TRUE(world.apply({0, WorldEdit::SetVoxels{{{{1000, 0, 0}, 2}}}}).has_value());
  EXPECT_TRUE(world.flush().has_value());
  // An edit of the chunk waits, and `flush` does not wait for it.
  ASSERT_TRUE(world.apply({0, WorldEdit::SetVoxels{{{{3, 3, 3}, 2}, {{65, 0, 0}, 2}}}}).has_value());
  const Status blocked = world.flush();
  ASSERT_FALSE(blocked);
  EXPECT_EQ(blocked.error().code, ErrorCode::CannotRead);
  EXPECT_NE(blocked.error().message.find(
                "edits wait for chunk (0, 0, 0) of grid 0, whose generator has not returned for 20 ms"),
            std::string::npos)
      << to_string(blocked.error());
  EXPECT_EQ(world.stats().waiting_edits, 1U);
  const auto stored = world.store().load_chunk({0, 0, {1, 0, 0}});
  ASSERT_TRUE(stored.has_value() && stored->has_value());
  EXPECT_EQ((*stored)->voxels.get({1, 0, 0}), 2) << "the rest is saved";
  gate.open();
  EXPECT_TRUE(world.flush().has_value());
  EXPECT_EQ(world.stats().waiting_edits, 0U);
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  EXPECT_EQ(voxels(world).get(3, 3, 3), 2);
  EXPECT_EQ(voxels(world).get(4, 3, 3), 1);
  EXPECT_TRUE(world.take_problems().empty());
}

// The only worker is in a generator that ignores the cancellation: loaded chunks stay usable.
TEST_F(StreamedWorldBadInput, SavesLoadedChunksWithoutWorker) {
  Gate gate;
  const auto generator = std::make_shared<FunctionGround>([&](IVec3 chunk, const Cancellation&) {
    if (chunk.x == 20) gate.wait();
    return Result<StoredChunk>(StoredChunk{Chunk(1)});
  });
  StreamedWorld world = opened(generator, {.generator_timeout = 20ms, .workers = {1}});
  const Viewer viewer{.position = DVec3(32.0), .radius = 50.0};
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  ASSERT_TRUE(world.apply({0, WorldEdit::SetVoxels{{{{20 * 64, 0, 0}, 2}}}}).has_value());
  ASSERT_TRUE(world.update({&viewer, 1}).has_value());
  gate.wait_until_reached();
  ASSERT_TRUE(world.apply({0, WorldEdit::SetVoxels{{{{30 * 64, 0, 0}, 2}, {{4, 0, 0}, 2}}}}).has_value());
  EXPECT_TRUE(voxels(world).set(5, 0, 0, 3));
  ASSERT_TRUE(world.update({&viewer, 1}).has_value());
  const Status blocked = world.flush();
  ASSERT_FALSE(blocked);
  EXPECT_NE(blocked.error().message.find("chunk (20, 0, 0) of grid 0, whose generator"), std::string::npos)
      << to_string(blocked.error());
  EXPECT_EQ(world.stats().waiting_edits, 2U);
  const auto stored = world.store().load_chunk({0, 0, IVec3(0)});
  ASSERT_TRUE(stored.has_value() && stored->has_value());
  EXPECT_EQ((*stored)->voxels.get({4, 0, 0}), 2);
  EXPECT_EQ((*stored)->voxels.get({5, 0, 0}), 3);
  gate.open();
  EXPECT_TRUE(world.flush().has_value());
  for (const int x : {20, 30}) {
    const auto late = world.store().load_chunk({0, 0, {x, 0, 0}});
    ASSERT_TRUE(late.has_value() && late->has_value()) << x;
    EXPECT_EQ((*late)->voxels.get({0, 0, 0}), 2) << x;
  }
}

// The calling thread does the work of jobs while it waits, but not this work.
TEST_F(StreamedWorldBadInput, LeavesGeneratorsToJobsInFlush) {
  const ScopedJobSystem scope(make_worker_pool({2}));
  Gate gate;
  std::atomic<int> here = 0;
  const auto generator =
      std::make_shared<FunctionGround>([&, caller = std::this_thread::get_id()](IVec3, const Cancellation&) {
        if (std::this_thread::get_id() != caller) {
          gate.wait();
        } else {
          ++here;
        }
        return Result<StoredChunk>(StoredChunk{Chunk(1)});
      });
  StreamedWorld world = opened(generator, {.generator_timeout = 20ms});
  WorldEdit::SetVoxels edit;
  for (int i = 0; i < 10; ++i) edit.voxels.push_back({{64 * i, 0, 0}, 2});
  ASSERT_TRUE(world.apply({0, edit}).has_value());
  EXPECT_FALSE(world.flush().has_value());
  EXPECT_EQ(here, 0);
  gate.open();
  EXPECT_TRUE(world.flush().has_value());
}

TEST_F(StreamedWorldBadInput, DropsChunksOfRemovedGrids) {
  Gate gate;
  const auto generator = std::make_shared<FunctionGround>([&](IVec3, const Cancellation&) {
    gate.wait();
    return Result<StoredChunk>(StoredChunk{Chunk(1)});
  });
  StreamedWorld world = opened(generator, {.workers = {2}});
  const Viewer viewer{.position = DVec3(32.0), .radius = 20.0};
  ASSERT_TRUE(world.update({&viewer, 1}).has_value());
  gate.wait_until_reached();
  world.scene().remove_grid(land(world));
  const auto other = world.add_grid({.name = "other"}, std::make_shared<FunctionGround>());
  ASSERT_TRUE(other.has_value()) << to_string(other.error());
  world.scene().add_instance({.grid = *other});
  gate.open();
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  EXPECT_EQ(world.scene().grids()[*other].grid.get(0, 0, 0), 1);
  EXPECT_TRUE(world.take_problems().empty());
}

// Waits for its cancellation; gives up after a minute.
Result<StoredChunk> wait_for_cancellation(const Cancellation& cancelled, std::atomic<int>& cancellations) {
  for (int i = 0; i < 60'000; ++i) {
    if (cancelled.is_requested()) {
      ++cancellations;
      return make_error(ErrorCode::Cancelled, "cancelled");
    }
    std::this_thread::sleep_for(1ms);
  }
  return make_error(ErrorCode::InvalidArgument, "was never cancelled");
}

TEST_F(StreamedWorldBadInput, CancelsGeneratorsWhenWorldCloses) {
  std::atomic<int> begun = 0;
  std::atomic<int> cancelled = 0;
  const auto generator = std::make_shared<FunctionGround>([&](IVec3, const Cancellation& cancellation) {
    ++begun;
    return wait_for_cancellation(cancellation, cancelled);
  });
  {
    StreamedWorld world = opened(generator, {.workers = {3}});
    const Viewer viewer{.radius = 200.0};
    ASSERT_TRUE(update_until(world, viewer, [&] { return begun == 3; }));
    EXPECT_EQ(cancelled, 0);
    EXPECT_TRUE(world.flush().has_value()) << "no edit waits";
    EXPECT_TRUE(world.take_problems().empty());
  }
  EXPECT_EQ(cancelled, 3);
  EXPECT_EQ(begun, 3);
}

// Its only worker is in the call, so that the caller's thread cancels it.
TEST_F(StreamedWorldBadInput, CancelsChunksThatNoViewerNeeds) {
  std::atomic<int> begun = 0;
  std::atomic<int> cancelled = 0;
  const auto generator = std::make_shared<FunctionGround>([&](IVec3 chunk, const Cancellation& cancellation) {
    if (chunk == IVec3(0) && ++begun == 1) return wait_for_cancellation(cancellation, cancelled);
    return Result<StoredChunk>(StoredChunk{Chunk(1)});
  });
  StreamedWorld world = opened(generator, {.workers = {1}});
  Viewer viewer{.position = DVec3(32.0), .radius = 20.0};
  ASSERT_TRUE(update_until(world, viewer, [&] { return begun == 1; }));
  viewer.position.x += 100.0;  // the chunk would still stay
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(world.update({&viewer, 1}).has_value());
  EXPECT_EQ(cancelled, 0);
  viewer.position.x = 1500.0;
  ASSERT_TRUE(update_until(world, viewer, [&] { return cancelled == 1; }));
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  viewer.position.x = 32.0;
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  EXPECT_EQ(voxels(world).get(0, 0, 0), 1);
  EXPECT_EQ(begun, 2) << "asked again";
  EXPECT_EQ(cancelled, 1);
  EXPECT_TRUE(world.take_problems().empty()) << "a cancelled chunk is no problem";
}

// A viewer turns back while chunks leave. Workers plan his way back before they learn of chunks that leave meanwhile.
TEST_F(StreamedWorldBadInput, LoadsChunksThatLeaveWhileTheirViewerReturns) {
  Gate gate;
  std::atomic<bool> is_gated = false;
  const auto generator = std::make_shared<FunctionGround>([&](IVec3 chunk, const Cancellation&) {
    if (is_gated && chunk.x > 10) gate.wait();
    return Result<StoredChunk>(StoredChunk{Chunk(1)});
  });
  bool is_planned_meanwhile = false;
  const auto other_bytes = [&] {  // called between the arrival of plans and the departure of chunks
    if (std::exchange(is_planned_meanwhile, false)) {
      gate.open();
      std::this_thread::sleep_for(100ms);
    }
    return std::size_t{0};
  };
  StreamedWorld world = opened(generator, {.other_bytes = other_bytes, .update_seconds = 1e-9, .workers = {1}});
  Viewer viewer{.position = DVec3(32.0), .radius = 200.0};
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  is_gated = true;
  viewer.position.x = 1'500.0;
  ASSERT_TRUE(update_until(world, viewer, [&] { return world.stats().chunks_unloaded > 0; }));
  gate.wait_until_reached();
  viewer.position.x = 32.0;
  std::this_thread::sleep_for(150ms);  // so that the second call asks for other bytes
  ASSERT_TRUE(world.update({&viewer, 1}).has_value());
  std::this_thread::sleep_for(150ms);
  is_planned_meanwhile = true;
  ASSERT_TRUE(world.update({&viewer, 1}).has_value());
  EXPECT_FALSE(is_planned_meanwhile);
  EXPECT_TRUE(update_until(world, viewer, [&] { return world.stats().is_complete; }));
}

TEST_F(StreamedWorldBadInput, FinishesChunksThatEditsNeed) {
  Gate gate;
  std::atomic<bool> was_cancelled = false;
  const auto generator = std::make_shared<FunctionGround>([&](IVec3 chunk, const Cancellation& cancelled) {
    if (chunk == IVec3(0)) {
      gate.wait();
      was_cancelled = cancelled.is_requested();
    }
    return Result<StoredChunk>(StoredChunk{Chunk(1)});
  });
  StreamedWorld world = opened(generator, {.workers = {1}});
  Viewer viewer{.position = {1500.0, 0.0, 0.0}, .radius = 20.0};
  ASSERT_TRUE(world.apply({0, WorldEdit::SetVoxels{{{{3, 3, 3}, 2}}}}).has_value());
  ASSERT_TRUE(world.update({&viewer, 1}).has_value());
  gate.wait_until_reached();
  viewer.position.x = 3000.0;
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(world.update({&viewer, 1}).has_value());
  gate.open();
  EXPECT_TRUE(world.flush().has_value());
  EXPECT_FALSE(was_cancelled);
  const auto stored = world.store().load_chunk({0, 0, IVec3(0)});
  ASSERT_TRUE(stored.has_value() && stored->has_value());
  EXPECT_EQ((*stored)->voxels.get({3, 3, 3}), 2);
}

TEST_F(StreamedWorldBadInput, KeepsAThousandProblems) {
  const auto generator = std::make_shared<FunctionGround>(
      [](IVec3, const Cancellation&) -> Result<StoredChunk> { return make_error(ErrorCode::BadFormat, "broken"); });
  StreamedWorld world = opened(generator);
  Viewer viewer{.radius = 300.0};
  for (int i = 0; i < 8; ++i) {
    viewer.position.x = 400.0 * (i - 4);
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  }
  EXPECT_EQ(world.take_problems().size(), 1000U);
}

// Each message names its subject and the reason.
TEST_F(StreamedWorldBadInput, MessagesNameSubjectAndReason) {
  const auto expect_text = [](const auto& outcome, const std::string& text) {
    ASSERT_FALSE(outcome.has_value()) << text;
    EXPECT_NE(to_string(outcome.error()).find(text), std::string::npos) << to_string(outcome.error());
  };
  expect_text(StreamedWorld::open_or_create("/nonexistent/x.quoin"), "/nonexistent/x.quoin: ");
  const std::filesystem::path text = folder_ / "text.quoin";
  ASSERT_TRUE(write_file(std::as_bytes(std::span("hello world")), text).has_value());
  expect_text(StreamedWorld::open_or_create(text), text.string() + ": not a Quoin world");
  StreamedWorld world = opened(std::make_shared<FunctionGround>(), {.save_interval = std::chrono::hours(1)});
  expect_text(StreamedWorld::open_or_create(path()), "it is already open for writing, in this or another program");
  const auto box = [](int edge, VoxelType type) { return WorldEdit::FillBox{{IVec3(0), IVec3(edge)}, type}; };
  expect_text(world.apply({.grid = 7, .content = box(1, 1)}), "the world has no grid 7");
  expect_text(world.apply({.content = box(1, 9)}), "the edit uses type 9, which the world does not have");
  expect_text(world.apply({.content = box(2'000'000, 1)}), "an edit must not touch more than");
  expect_text(world.apply({.content = WorldEdit::FillSphere{DVec3(std::numeric_limits<double>::quiet_NaN()), 3.0, 1}}),
              "coordinates must be finite");
  ASSERT_TRUE(world.apply({.content = box(10, 1)}).has_value());
  // A type that is not registered, set by the game itself: refused once per save, until the game replaces it.
  const Viewer viewer{.position = DVec3(32.0), .radius = 10.0};
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  ASSERT_TRUE(world.flush().has_value());
  EXPECT_TRUE(voxels(world).set(0, 0, 0, 42));
  const std::string place = path().string() + ": chunk (0, 0, 0) of grid 0: it has voxels of type 42";
  for (int i = 0; i < 2; ++i) expect_text(world.flush(), place);
  EXPECT_TRUE(world.stats().has_save_failed);
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(world.update({&viewer, 1}).has_value()) << "reported by flush";
  EXPECT_TRUE(voxels(world).set(0, 0, 0, 2));
  EXPECT_TRUE(world.flush().has_value());
  EXPECT_FALSE(world.stats().has_save_failed);
}

// `update` itself asks for other bytes: a slow answer costs the frame.
TEST_F(StreamedWorldBadInput, AsksForOtherBytesOnCallersThread) {
  std::atomic<int> elsewhere = 0;
  std::atomic<int> asked = 0;
  StreamOptions options;
  options.other_bytes = [&, caller = std::this_thread::get_id()] {
    ++asked;
    elsewhere += std::this_thread::get_id() == caller ? 0 : 1;
    return std::size_t{0};
  };
  StreamedWorld world = opened(std::make_shared<FunctionGround>(), options);
  const Viewer viewer{.radius = 100.0};
  ASSERT_TRUE(update_until(world, viewer, [&] { return world.stats().is_complete && asked > 1; }));
  EXPECT_EQ(elsewhere, 0);
}

TEST(DiskOutcome, GivesOneErrorPerSave) {
  stream::DiskOutcome disk;
  const Status full = make_error(ErrorCode::CannotWrite, "disk full");
  const auto takes_error = [&] { return !disk.take("w.quoin").has_value(); };
  const std::uint64_t first = disk.begin();
  EXPECT_FALSE(takes_error());
  disk.put(first, full);
  EXPECT_TRUE(disk.has_failed());
  const Status taken = disk.take("w.quoin");
  ASSERT_FALSE(taken);
  EXPECT_EQ(to_string(taken.error()), "w.quoin: disk full");
  EXPECT_FALSE(takes_error());
  for (int i = 0; i < 3; ++i) disk.put(first, full);  // retries, for example because of generated chunks
  EXPECT_FALSE(takes_error());
  EXPECT_TRUE(disk.has_failed());
  const std::uint64_t second = disk.begin();
  const std::uint64_t third = disk.begin();
  for (const std::uint64_t save : {first, second, third}) disk.put(save, full);
  EXPECT_TRUE(takes_error());
  disk.put(third, full);
  EXPECT_FALSE(takes_error());
  // A save that is collected in steps while the error of an earlier one is taken.
  disk.put(disk.begin(), full);
  const std::uint64_t collected = disk.next();
  EXPECT_TRUE(takes_error());
  EXPECT_EQ(collected, disk.begin());
  disk.put(collected, full);
  EXPECT_TRUE(takes_error());
  disk.put(disk.begin(), full);
  disk.put(third, {});  // retried before the error was taken
  EXPECT_FALSE(takes_error());
  EXPECT_FALSE(disk.has_failed());
}

TEST_F(StreamedWorldBadInput, GoesOnWhenDiskIsFull) {
  FullDisk disk;
  const auto generator = std::make_shared<FunctionGround>();
  std::vector<IVec3> made;
  {
    StreamOptions options;
    options.save_interval = std::chrono::hours(1);  // saves only new types, and before chunks leave
    StreamedWorld world = opened(generator, options);
    Viewer viewer{.position = DVec3(32.0), .radius = 50.0};
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
    EXPECT_TRUE(voxels(world).set(1, 0, 0, 2));
    ASSERT_TRUE(world.flush().has_value());
    disk.set_full(true);
    EXPECT_TRUE(voxels(world).set(2, 0, 0, 3));
    // Each save gives one error, however many frames pass and chunks are made.
    viewer.radius = 90.0;
    for (int save = 0; save < 3; ++save) {
      ASSERT_TRUE(world.scene().types.add(coloured_type(static_cast<std::uint8_t>(10 + save))));
      std::vector<Error> errors;
      EXPECT_TRUE(update_until(
          world, viewer, [&] { return !errors.empty() && world.stats().is_complete; }, &errors));
      for (int i = 0; i < 200; ++i) {
        if (const Status done = world.update({&viewer, 1}); !done) errors.push_back(done.error());
        std::this_thread::sleep_for(100us);
      }
      ASSERT_EQ(errors.size(), 1U) << save;
      EXPECT_EQ(errors[0].code, ErrorCode::CannotWrite);
      EXPECT_EQ(to_string(errors[0]).find(path().string() + ": "), 0U) << to_string(errors[0]);
      EXPECT_NE(errors[0].message.find("full"), std::string::npos) << errors[0].message;
      EXPECT_TRUE(world.stats().has_save_failed);
    }
    EXPECT_GT(disk.failures(), 0);
    // More chunks than one commit takes: saves behind them fail as well.
    viewer.radius = 400.0;
    std::vector<Error> errors;
    EXPECT_TRUE(update_until(
        world, viewer, [&] { return world.stats().is_complete; }, &errors));
    EXPECT_GT(world.store().stats().pending_chunks, 256U);
    int frames = 0;
    EXPECT_TRUE(update_until(
        world, viewer, [&] { return ++frames == 100; }, &errors));
    errors.clear();
    ASSERT_TRUE(world.scene().types.add(coloured_type(20)));
    EXPECT_TRUE(update_until(
        world, viewer, [&] { return !errors.empty(); }, &errors));
    // Edited chunks leave memory, and come back.
    viewer.position.x = 2000.0;
    EXPECT_TRUE(update_until(
        world, viewer, [&] { return !world.is_loaded(land(world), IVec3(0)); }, &errors));
    viewer.position.x = 32.0;
    EXPECT_TRUE(update_until(
        world, viewer, [&] { return world.is_loaded(land(world), IVec3(0)); }, &errors));
    EXPECT_EQ(voxels(world).get(2, 0, 0), 3);
    EXPECT_TRUE(world.take_problems().empty()) << "chunks are no problem of their own";
    const Status full = world.flush();
    ASSERT_FALSE(full);
    EXPECT_EQ(full.error().code, ErrorCode::CannotWrite);
    {  // the file still has all of the last save
      const auto reader = WorldStore::open(path(), WorldAccess::Read);
      ASSERT_TRUE(reader.has_value()) << to_string(reader.error());
      const auto kept = reader->load_chunk({0, 0, IVec3(0)});
      ASSERT_TRUE(kept.has_value() && kept->has_value());
      EXPECT_EQ((*kept)->voxels.get({1, 0, 0}), 2);
      EXPECT_EQ((*kept)->voxels.get({2, 0, 0}), 1);
      EXPECT_EQ(reader->types()->size(), 4U);
    }
    disk.set_full(false);
    ASSERT_TRUE(world.flush().has_value());
    ASSERT_TRUE(update_until(world, viewer, [&] { return world.stats().is_complete; }));
    EXPECT_FALSE(world.stats().has_save_failed);
    EXPECT_EQ(world.store().stats().pending_chunks, 0U);
    made = world.scene().grids()[land(world)].grid.chunks();
  }
  EXPECT_TRUE(check_world(path())->damage.empty());
  const auto store = WorldStore::open(path(), WorldAccess::Read);
  ASSERT_TRUE(store.has_value());
  EXPECT_GT(made.size(), 256U);
  EXPECT_EQ(store->types()->size(), 8U);
  for (const IVec3 chunk : made) {
    const auto kept = store->load_chunk({0, 0, chunk});
    ASSERT_TRUE(kept.has_value() && kept->has_value());
    EXPECT_TRUE(chunk == IVec3(0) || (*kept)->voxels == Chunk(1));
  }
  EXPECT_EQ((*store->load_chunk({0, 0, IVec3(0)}))->voxels.get({2, 0, 0}), 3);
}

// Closing does not wait for space, and keeps all earlier saves.
TEST_F(StreamedWorldBadInput, ClosesWhenDiskIsFull) {
  FullDisk disk;
  const auto generator = std::make_shared<FunctionGround>();
  const Viewer viewer{.position = DVec3(32.0), .radius = 100.0};
  {
    StreamedWorld world = opened(generator);
    ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
    EXPECT_TRUE(voxels(world).set(1, 0, 0, 2));
    ASSERT_TRUE(world.flush().has_value());
    disk.set_full(true);
    EXPECT_TRUE(voxels(world).set(2, 0, 0, 3));
  }
  disk.set_full(false);
  StreamedWorld world = opened(generator);
  ASSERT_TRUE(world.load_all({&viewer, 1}).has_value());
  EXPECT_EQ(voxels(world).get(1, 0, 0), 2);
  EXPECT_EQ(voxels(world).get(2, 0, 0), 1);
  EXPECT_TRUE(check_world(path())->damage.empty());
}

}  // namespace
}  // namespace quoin
