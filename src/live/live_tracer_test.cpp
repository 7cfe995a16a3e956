// A tracer kept up to date by a worker: it always equals a tracer built from scratch for the scene it comes with.

#include <quoin/live/live_tracer.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <new>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "live/latest_state.h"
#include "scene/tracer/changing_scene_for_tests.h"

namespace quoin {
namespace {

void expect_right(const LiveTracer& live, ChangingScene& world, TracerCounts& counts) {
  const SceneTracer& shown = live.shown();
  const SceneTracer fresh(shown.scene(), InstanceFilter::Visible, {1});
  expect_same_placed(shown, fresh, false, counts);
  expect_same_hits(shown, fresh, world, counts);
}

TEST(LiveTracer, ShownTracerIsAlwaysCorrect) {
  TracerCounts counts;
  int taken = 0;
  for (unsigned seed = 0; seed < 8; ++seed) {
    SCOPED_TRACE(seed);
    ChangingScene world(seed, true);
    LiveTracer live;
    EXPECT_FALSE(first_hit(live.shown(), {{0.0, 50.0, 0.0}, {0.0, -1.0, 0.0}})) << "an empty scene at first";
    for (int frame = 0; frame < 40; ++frame) {
      for (int i = world.below(6); i > 0; --i) world.change();
      live.update(world.scene);
      bool is_taken = live.take();
      // Waits for a result from time to time.
      while (frame % 8 == 7 && !is_taken && live.is_late()) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        is_taken = live.take();
      }
      if (!is_taken) continue;
      ++taken;
      expect_right(live, world, counts);
      if (HasFatalFailure()) return;
    }
    live.finish(world.scene);
    EXPECT_FALSE(live.is_late());
    EXPECT_FALSE(live.take());
    EXPECT_EQ(live.shown().scene().instances().size(), world.scene.instances().size());
    EXPECT_EQ(live.shown().scene().voxel_count(), world.scene.voxel_count());
    expect_right(live, world, counts);
  }
  EXPECT_GT(taken, 30);
  EXPECT_GT(counts.hits, 200);
}

// Rays are traced by the shown tracer while the worker computes the next one and the scene is edited.
TEST(LiveTracer, AllowsTracingWhileWorkerRuns) {
  ChangingScene world(3, true);
  LiveTracer live;
  live.finish(world.scene);
  const auto sum = [&] {
    double distances = 0.0;
    for (int i = 0; i < 600; ++i) {
      const auto hit = first_hit(live.shown(), {{i - 300.0, 500.0, i % 90 - 45.0}, {0.1, -1.0, 0.01 * (i % 30)}});
      if (hit) distances += hit->t;
    }
    return distances;
  };
  for (int frame = 0; frame < 30; ++frame) {
    double first = 0.0;
    std::thread reader([&] { first = sum(); });
    for (int i = 0; i < 3; ++i) world.change();
    live.update(world.scene);
    reader.join();
    EXPECT_EQ(first, sum()) << "before it is taken, nothing changes";
    live.take();
  }
}

TEST(LiveTracer, DoesNothingWithoutChanges) {
  ChangingScene world(4);
  LiveTracer live({InstanceFilter::All, {2}});
  live.finish(world.scene);
  const Scene* const scene = &live.shown().scene();
  live.update(world.scene);
  EXPECT_FALSE(live.is_late());
  EXPECT_FALSE(live.take());
  EXPECT_EQ(&live.shown().scene(), scene);
  world.scene.edit(world.scene.instances().handles().front()).visible = false;
  live.update(world.scene);
  EXPECT_TRUE(live.is_late());
  live.finish(world.scene);
  EXPECT_EQ(placed_in(live.shown()).size(), placed_in(SceneTracer(world.scene, InstanceFilter::All, {1})).size());
}

TEST(LiveTracer, FollowsAnotherScene) {
  ChangingScene first(5);
  ChangingScene second(6, true);
  LiveTracer live;
  TracerCounts counts;
  for (ChangingScene* world : {&first, &second, &first}) {
    live.finish(world->scene);
    EXPECT_EQ(live.shown().scene().voxel_count(), world->scene.voxel_count());
    expect_right(live, *world, counts);
  }
}

// A caller that never takes gets the next result, not an endless wait.
TEST(LiveTracer, FinishesWithoutTakes) {
  ChangingScene world(7, true);
  LiveTracer live;
  for (int frame = 0; frame < 50; ++frame) {
    world.change();
    live.update(world.scene);
  }
  EXPECT_TRUE(live.is_late());
  live.finish(world.scene);
  TracerCounts counts;
  expect_right(live, world, counts);
  EXPECT_EQ(live.shown().scene().voxel_count(), world.scene.voxel_count());
}

TEST(LiveTracer, EndsWhileWorking) {
  ChangingScene world(8, true);
  for (int i = 0; i < 20; ++i) {
    LiveTracer live;
    if (i % 2 == 0) live.finish(world.scene);
    world.change();
    live.update(world.scene);
    if (i % 3 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (i % 4 == 0) live.take();
    world.change();
    live.update(world.scene);
  }
}

// A state with a number, which counts the states there are.
struct Counted {
  explicit Counted(int value, std::atomic<int>& all) : number(value), alive(&all) { ++all; }
  Counted(Counted&& other) noexcept : number(other.number), alive(other.alive) { ++*alive; }
  Counted& operator=(Counted&& other) noexcept {
    number = other.number;
    return *this;
  }
  ~Counted() { --*alive; }

  int number = 0;
  std::atomic<int>* alive;
};

// Lets a worker continue by hand.
class Gate {
 public:
  void open(int times) {
    const std::lock_guard lock(mutex_);
    open_ += times;
    changed_.notify_all();
  }
  void pass() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return open_ > 0; });
    --open_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int open_ = 0;
};

using CountedStates = LatestState<Counted>;

struct CountedWork {
  CountedWork()
      : states(Counted(0, alive), [this](const CountedStates::Request&, std::unique_ptr<Counted>& former) {
          gate.pass();
          if (fails.exchange(false)) throw std::bad_alloc();
          most = std::max(most.load(), alive.load());
          auto state = former == nullptr ? std::make_unique<Counted>(0, alive) : std::move(former);
          state->number = ++made;
          return state;
        }) {}
  ~CountedWork() { gate.open(1'000); }

  Scene scene;
  Gate gate;
  std::atomic<int> alive = 0;
  std::atomic<int> most = 0;
  std::atomic<int> made = 0;
  std::atomic<bool> fails = false;
  CountedStates states;
};

void wait_for(const std::atomic<int>& number, int value) {
  while (number < value) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

bool take_in_time(CountedStates& states) {
  for (int i = 0; i < 20'000; ++i) {
    if (states.take()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

TEST(LatestState, UpdateWaitsForTake) {
  CountedWork work;
  work.gate.open(100);
  work.states.update(work.scene, true);
  work.states.wait();
  const int made = work.made;
  EXPECT_EQ(work.states.shown().number, made);
  work.states.update(work.scene, true);
  wait_for(work.made, made + 1);
  for (int i = 0; i < 20; ++i) {
    work.states.update(work.scene, true);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(work.made, made + 1) << "no third state";
  ASSERT_TRUE(take_in_time(work.states));
  EXPECT_EQ(work.states.shown().number, made + 1);
  ASSERT_TRUE(take_in_time(work.states)) << "the update that waited begins by itself";
  EXPECT_EQ(work.states.shown().number, made + 2);
  EXPECT_LE(work.most, 2);
}

TEST(LatestState, RethrowsFailureAndRecovers) {
  CountedWork work;
  work.gate.open(100);
  work.states.update(work.scene, true);
  work.states.wait();
  EXPECT_EQ(work.states.shown().number, 1);
  work.fails = true;
  work.states.update(work.scene, true);
  EXPECT_THROW(work.states.wait(), std::bad_alloc);
  EXPECT_EQ(work.states.shown().number, 1);
  EXPECT_TRUE(work.states.is_late());
  work.states.update(work.scene, false);
  work.states.wait();
  EXPECT_EQ(work.states.shown().number, 2) << "the failed update is made up for";
  EXPECT_FALSE(work.states.is_late());

  work.fails = true;
  work.states.update(work.scene, true);
  bool has_thrown = false;
  for (int i = 0; i < 20'000 && !has_thrown; ++i) {
    try {
      work.states.update(work.scene, false);
    } catch (const std::bad_alloc&) {
      has_thrown = true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(has_thrown);
  work.states.wait();

  work.fails = true;
  work.states.update(work.scene, true);
  while (work.fails) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_TRUE(work.states.is_late()) << "before the next call reports it";
}

TEST(LatestState, KeepsNoOldStates) {
  CountedWork work;
  work.gate.open(1'000);
  for (int i = 0; i < 20; ++i) {
    work.states.update(work.scene, true);
    work.states.wait();
    EXPECT_LE(work.alive, 2);
  }
}

}  // namespace
}  // namespace quoin
