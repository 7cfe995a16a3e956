#include "core/work/workers.h"

#include <algorithm>
#include <atomic>
#include <deque>
#include <functional>
#include <memory>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>

#include "core/work/job_system_for_tests.h"

namespace quoin {
namespace {

using namespace std::chrono_literals;

// The simplest owner: a queue of functions.
class Queue {
 public:
  using Job = std::function<void()>;

  explicit Queue(unsigned workers) {
    workers_.start(workers, [this](Workers::Lock& lock, unsigned /*worker*/) { return step(lock); });
  }
  void push(Job job) {
    {
      const std::lock_guard lock(mutex_);
      jobs_.push_back(std::move(job));
      ++unfinished_;
    }
    workers_.wake_one();
  }
  std::size_t cancel() {
    const std::lock_guard lock(mutex_);
    const std::size_t count = jobs_.size();
    unfinished_ -= count;
    jobs_.clear();
    return count;
  }
  void finish() {
    std::unique_lock lock(mutex_);
    workers_.wait(lock, [&] { return unfinished_ == 0; });
  }
  bool finish_within(double seconds) {
    std::unique_lock lock(mutex_);
    return workers_.wait_for(lock, seconds, [&] { return unfinished_ == 0; });
  }
  std::exception_ptr take_failure() {
    const std::lock_guard lock(mutex_);
    return workers_.take_failure();
  }
  Workers& workers() { return workers_; }
  std::mutex& mutex() { return mutex_; }

 private:
  Workers::Clock::time_point step(Workers::Lock& lock) {
    if (jobs_.empty()) return Workers::kWhenWoken;
    const Job job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    std::exception_ptr failure;
    try {
      job();
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    --unfinished_;
    if (failure != nullptr) std::rethrow_exception(failure);
    return Workers::kAgain;
  }

  std::mutex mutex_;
  std::deque<Job> jobs_;
  std::size_t unfinished_ = 0;
  Workers workers_{mutex_};
};

// Lets a test hold a worker within a job.
class Gate {
 public:
  void pass() {
    is_reached_ = true;
    is_reached_.notify_all();
    is_open_.wait(false);
  }
  void wait_until_reached() { is_reached_.wait(false); }
  void open() {
    is_open_ = true;
    is_open_.notify_all();
  }

 private:
  std::atomic<bool> is_reached_{false};
  std::atomic<bool> is_open_{false};
};

TEST(Workers, RunWorkOfManyProducers) {
  std::atomic<int> done{0};
  Queue queue(3);
  std::vector<std::thread> producers;
  for (int i = 0; i < 4; ++i) {
    producers.emplace_back([&] {
      for (int k = 0; k < 500; ++k) queue.push([&] { ++done; });
    });
  }
  for (std::thread& each : producers) each.join();
  queue.workers().drain();
  EXPECT_EQ(done, 2000);
}

TEST(Workers, StopLeavesWaitingWork) {
  std::atomic<int> done{0};
  Gate gate;
  Queue queue(1);
  queue.push([&] {
    gate.pass();
    ++done;
  });
  for (int i = 0; i < 10; ++i) queue.push([&] { ++done; });
  gate.wait_until_reached();
  std::thread opener([&] {
    // Opens the gate once the worker has to stop.
    for (bool is_stopping = false; !is_stopping;) {
      const std::lock_guard lock(queue.mutex());
      is_stopping = queue.workers().is_stopping();
    }
    gate.open();
  });
  queue.workers().stop();
  opener.join();
  EXPECT_EQ(done, 1);
  EXPECT_EQ(queue.cancel(), 10);
  EXPECT_FALSE(queue.workers().is_started());
}

TEST(Workers, DrainRunsWaitingWork) {
  std::atomic<int> done{0};
  Gate gate;
  Queue queue(2);
  queue.push([&] { gate.pass(); });
  for (int i = 0; i < 10; ++i) {
    queue.push([&] {
      if (++done < 20) queue.push([&] { ++done; });
    });
  }
  gate.wait_until_reached();
  gate.open();
  queue.workers().drain();
  EXPECT_EQ(done, 20);
  EXPECT_EQ(queue.cancel(), 0);
}

TEST(Workers, SkipCancelledWork) {
  std::atomic<int> done{0};
  Gate gate;
  Queue queue(1);
  queue.push([&] { gate.pass(); });
  gate.wait_until_reached();
  for (int i = 0; i < 5; ++i) queue.push([&] { ++done; });
  EXPECT_EQ(queue.cancel(), 5);
  queue.push([&] { done += 100; });
  gate.open();
  queue.workers().drain();
  EXPECT_EQ(done, 100);
}

TEST(Workers, KeepTheFirstExceptionAndContinue) {
  std::atomic<int> done{0};
  Queue queue(1);
  queue.push([] { throw std::runtime_error("first"); });
  queue.push([] { throw 2; });
  queue.push([&] { ++done; });
  queue.workers().drain();
  EXPECT_EQ(done, 1);
  try {
    std::rethrow_exception(queue.take_failure());
    FAIL() << "no exception";
  } catch (const std::runtime_error& failure) {
    EXPECT_STREQ(failure.what(), "first");
  }
  EXPECT_EQ(queue.take_failure(), nullptr);
}

TEST(Workers, WakeWaitingCallersOnException) {
  Queue queue(1);
  queue.push([] { throw std::runtime_error("failed"); });
  queue.finish();
  EXPECT_TRUE(queue.finish_within(10.0));
}

TEST(Workers, WaitForEndsAtTimeout) {
  Gate gate;
  Queue queue(1);
  queue.push([&] { gate.pass(); });
  gate.wait_until_reached();
  queue.push([] {});
  EXPECT_FALSE(queue.finish_within(0.001));
  gate.open();
  queue.finish();
}

TEST(Workers, RepeatStepAtReturnedTime) {
  std::mutex mutex;
  int steps = 0;
  Workers workers(mutex);
  workers.start(1, [&](Workers::Lock& /*lock*/, unsigned /*worker*/) {
    ++steps;
    return Workers::Clock::now() + 1ms;
  });
  {
    std::unique_lock lock(mutex);
    workers.wait(lock, [&] { return steps >= 3; });
  }
  workers.stop();
  EXPECT_GE(steps, 3);
}

TEST(Workers, StopWithoutWaitingForNextStep) {
  std::mutex mutex;
  std::atomic<int> steps = 0;
  Workers workers(mutex);
  workers.start(2, [&](Workers::Lock& /*lock*/, unsigned /*worker*/) {
    ++steps;
    return Workers::Clock::now() + 24h;
  });
  {
    std::unique_lock lock(mutex);
    workers.wait(lock, [&] { return steps == 2; });
  }
  workers.stop();
  EXPECT_EQ(steps, 2);
}

TEST(Workers, NumberTheirThreads) {
  std::mutex mutex;
  std::vector<int> steps(3);
  Workers workers(mutex);
  workers.start(3, [&](Workers::Lock& /*lock*/, unsigned worker) {
    ++steps.at(worker);
    return Workers::kWhenWoken;
  });
  {
    std::unique_lock lock(mutex);
    workers.wait(lock, [&] { return std::ranges::all_of(steps, [](int count) { return count > 0; }); });
  }
}

TEST(Workers, StopWithoutStart) {
  std::mutex mutex;
  Workers workers(mutex);
  EXPECT_FALSE(workers.is_started());
  workers.stop();
  const std::lock_guard lock(mutex);
  EXPECT_TRUE(workers.is_stopping());
}

// Records the thread that destroys it.
class Destroyed {
 public:
  explicit Destroyed(std::atomic<std::thread::id>& by) : by_(by) {}
  Destroyed(const Destroyed&) = delete;
  Destroyed& operator=(const Destroyed&) = delete;
  ~Destroyed() {
    by_ = std::this_thread::get_id();
    by_.notify_all();
  }

 private:
  std::atomic<std::thread::id>& by_;
};

TEST(ReleaseQueue, DestroysOnSleepingWorker) {
  std::atomic<std::thread::id> by;
  Queue queue(2);
  for (int i = 0; i < 200; ++i) {
    by = std::thread::id();
    auto object = queue.workers().releases()->defer(std::make_shared<Destroyed>(by));
    auto copy = object;
    object.reset();
    EXPECT_EQ(by.load(), std::thread::id());
    if (i % 3 == 0) std::this_thread::sleep_for(100us);  // until the workers sleep
    copy.reset();
    by.wait(std::thread::id());
    EXPECT_NE(by.load(), std::this_thread::get_id());
  }
  EXPECT_EQ(queue.workers().releases()->defer(std::shared_ptr<int>()), nullptr);
}

TEST(ReleaseQueue, TakesObjectsUnderAnyLock) {
  std::atomic<std::thread::id> by;
  Queue queue(1);
  auto object = queue.workers().releases()->defer(std::make_shared<Destroyed>(by));
  {
    const std::lock_guard lock(queue.mutex());
    object.reset();
  }
  by.wait(std::thread::id());
  EXPECT_NE(by.load(), std::this_thread::get_id());
}

TEST(ReleaseQueue, DestroysObjectsOfObjects) {
  std::atomic<std::thread::id> by;
  Queue queue(1);
  const auto& releases = queue.workers().releases();
  using Inner = std::shared_ptr<Destroyed>;
  auto outer = releases->defer(std::make_shared<Inner>(releases->defer(std::make_shared<Destroyed>(by))));
  outer.reset();
  by.wait(std::thread::id());
  EXPECT_NE(by.load(), std::this_thread::get_id());
}

TEST(ReleaseQueue, BoundsWhatWaitsForBusyWorkers) {
  Gate gate;
  Queue queue(1);
  queue.push([&] { gate.pass(); });
  gate.wait_until_reached();
  const auto& releases = queue.workers().releases();
  std::atomic<std::thread::id> by;
  // Each of these limits alone makes the calling thread destroy the object.
  releases->defer(std::make_shared<Destroyed>(by), ReleaseQueue::kMaxBytes + 1).reset();
  EXPECT_EQ(by.load(), std::this_thread::get_id());
  for (std::size_t i = 0; i < ReleaseQueue::kMaxObjects; ++i) {
    by = std::thread::id();
    releases->defer(std::make_shared<Destroyed>(by)).reset();
    ASSERT_EQ(by.load(), std::thread::id()) << i;
  }
  releases->defer(std::make_shared<Destroyed>(by)).reset();
  EXPECT_EQ(by.load(), std::this_thread::get_id());
  gate.open();
  queue.finish();
  while (by.load() == std::this_thread::get_id()) std::this_thread::yield();
  queue.workers().stop();
}

TEST(ReleaseQueue, DestroysOnCallingThreadOnceWorkersHaveEnded) {
  std::atomic<std::thread::id> by;
  std::shared_ptr<Destroyed> late;
  {
    Gate gate;
    Queue queue(1);
    late = queue.workers().releases()->defer(std::make_shared<Destroyed>(by));
    std::atomic<std::thread::id> waiting_by;
    queue.push([&] { gate.pass(); });
    gate.wait_until_reached();
    queue.workers().releases()->defer(std::make_shared<Destroyed>(waiting_by)).reset();
    EXPECT_EQ(waiting_by.load(), std::thread::id());
    gate.open();
    queue.workers().stop();
    EXPECT_NE(waiting_by.load(), std::thread::id());
  }
  EXPECT_EQ(by.load(), std::thread::id());
  late.reset();
  EXPECT_EQ(by.load(), std::this_thread::get_id());
}

TEST(ReleaseQueue, TakesObjectsOfManyThreadsDuringStop) {
  for (int round = 0; round < 50; ++round) {
    std::atomic<int> alive{0};
    struct Counted {
      explicit Counted(std::atomic<int>& count) : alive(count) { ++alive; }
      Counted(const Counted&) = delete;
      Counted& operator=(const Counted&) = delete;
      ~Counted() { --alive; }
      std::atomic<int>& alive;
    };
    std::shared_ptr<ReleaseQueue> releases;
    std::vector<std::thread> threads;
    {
      Queue queue(2);
      releases = queue.workers().releases();
      for (int i = 0; i < 3; ++i) {
        threads.emplace_back([&] {
          for (int k = 0; k < 200; ++k) releases->defer(std::make_shared<Counted>(alive), 100).reset();
        });
      }
      queue.workers().stop();
    }
    for (std::thread& each : threads) each.join();
    EXPECT_EQ(alive, 0);
  }
}

// Objects in the list, and one that a worker destroys at the moment.
TEST(ReleaseQueue, FinishWaitsForAllObjects) {
  struct Gated {
    Gated(Gate& closed, std::atomic<int>& count) : gate(closed), alive(count) { ++alive; }
    Gated(const Gated&) = delete;
    Gated& operator=(const Gated&) = delete;
    ~Gated() {
      gate.pass();
      --alive;
    }
    Gate& gate;
    std::atomic<int>& alive;
  };
  Gate gate;
  std::atomic<int> alive{0};
  Queue queue(1);
  const std::shared_ptr<ReleaseQueue> releases = queue.workers().releases();
  releases->finish();
  for (int i = 0; i < 3; ++i) releases->defer(std::make_shared<Gated>(gate, alive)).reset();
  gate.wait_until_reached();
  std::thread opener([&] {
    std::this_thread::sleep_for(20ms);
    gate.open();
  });
  releases->finish();
  EXPECT_EQ(alive, 0);
  opener.join();
}

// The worker that destroys the outer object is busy afterwards.
TEST(ReleaseQueue, FinishDestroysObjectsOfObjects) {
  struct Owner {
    Owner(Gate& closed, std::shared_ptr<Destroyed> object) : gate(closed), inner(std::move(object)) {}
    Owner(const Owner&) = delete;
    Owner& operator=(const Owner&) = delete;
    ~Owner() { gate.pass(); }
    Gate& gate;
    std::shared_ptr<Destroyed> inner;
  };
  Gate destroys;
  Gate works;
  std::atomic<std::thread::id> by;
  Queue queue(1);
  const std::shared_ptr<ReleaseQueue> releases = queue.workers().releases();
  auto inner = releases->defer(std::make_shared<Destroyed>(by));
  releases->defer(std::make_shared<Owner>(destroys, std::move(inner))).reset();
  destroys.wait_until_reached();
  queue.push([&] { works.pass(); });
  std::thread opener([&] {
    std::this_thread::sleep_for(20ms);
    destroys.open();
  });
  releases->finish();
  EXPECT_EQ(by.load(), std::this_thread::get_id());
  works.open();
  opener.join();
}

TEST(Replaceable, WaitsForUsesOfFormerValue) {
  Gate gate;
  std::atomic<int> inside{0};
  Replaceable<std::function<int()>> function([&] {
    ++inside;
    gate.pass();
    --inside;
    return 1;
  });
  int first = 0;
  std::thread user([&] {
    const auto use = function.use();
    first = (*use)();
  });
  gate.wait_until_reached();
  std::thread opener([&] {
    std::this_thread::sleep_for(20ms);
    gate.open();
  });
  function.replace([] { return 2; });
  EXPECT_EQ(inside, 0);
  const auto use = function.use();
  EXPECT_EQ((*use)(), 2);
  user.join();
  opener.join();
  EXPECT_EQ(first, 1);
}

// Many threads use values while others replace them; each value ends after its last use.
TEST(Replaceable, KeepsValuesInUse) {
  struct Value {
    explicit Value(std::atomic<int>& count) : alive(count) { ++alive; }
    Value(const Value&) = delete;
    Value& operator=(const Value&) = delete;
    ~Value() {
      is_over = true;
      --alive;
    }
    std::atomic<int>& alive;
    std::atomic<bool> is_over{false};
  };
  std::atomic<int> alive{0};
  {
    Replaceable<std::unique_ptr<Value>> value(std::make_unique<Value>(alive));
    std::vector<std::thread> threads;
    for (int i = 0; i < 3; ++i) {
      threads.emplace_back([&] {
        for (int k = 0; k < 500; ++k) {
          const auto use = value.use();
          EXPECT_FALSE((*use)->is_over);
        }
      });
    }
    for (int i = 0; i < 2; ++i) {
      threads.emplace_back([&] {
        for (int k = 0; k < 100; ++k) value.replace(std::make_unique<Value>(alive));
      });
    }
    for (std::thread& each : threads) each.join();
    EXPECT_EQ(alive, 1);
  }
  EXPECT_EQ(alive, 0);
}

// Workers whose steps are jobs of a system of 1 or 3 threads.
class WorkersAsJobs : public testing::TestWithParam<unsigned> {
 protected:
  const std::shared_ptr<CountingJobs> jobs_ = std::make_shared<CountingJobs>(GetParam());
  const ScopedJobSystem scope_{jobs_};
};
INSTANTIATE_TEST_SUITE_P(Workers, WorkersAsJobs, testing::Values(1U, 3U));

TEST_P(WorkersAsJobs, RunWorkOfManyProducers) {
  std::atomic<int> done{0};
  std::atomic<int> running{0};
  std::atomic<bool> is_exceeded{false};
  Queue queue(2);
  std::vector<std::thread> producers;
  for (int i = 0; i < 4; ++i) {
    producers.emplace_back([&] {
      for (int k = 0; k < 500; ++k) {
        queue.push([&] {
          if (++running > 2) is_exceeded = true;
          ++done;
          --running;
        });
      }
    });
  }
  for (std::thread& each : producers) each.join();
  queue.finish();
  EXPECT_EQ(done, 2000);
  EXPECT_FALSE(is_exceeded);
  EXPECT_LE(jobs_->most_at_once(), static_cast<int>(GetParam()));
  EXPECT_GT(jobs_->posted()["worker"], 0);
}

// Without a caller that waits, all work is found: no wake is lost between steps.
TEST_P(WorkersAsJobs, FindAllWorkAlone) {
  std::atomic<int> done{0};
  Queue queue(2);
  for (int i = 1; i <= 2000; ++i) {
    queue.push([&] {
      ++done;
      done.notify_all();
    });
    if (i % 3 != 0) continue;
    for (int seen = done; seen != i; seen = done) done.wait(seen);
  }
}

TEST_P(WorkersAsJobs, DoTheWorkOfCallersThatWaitInJobs) {
  std::atomic<int> done{0};
  Queue queue(1);
  call_as_job(*jobs_, [&] {
    for (int i = 0; i < 100; ++i) queue.push([&] { ++done; });
    queue.finish();
  });
  EXPECT_EQ(done, 100);
}

TEST_P(WorkersAsJobs, SeeWhatTheirLastStepChanged) {
  std::mutex mutex;
  bool is_looking = false;
  bool is_seen = false;
  Workers workers(mutex);
  workers.start(1, [&](Workers::Lock& /*lock*/, unsigned /*worker*/) {
    is_seen = is_looking;
    return Workers::kWhenWoken;
  });
  call_as_job(*jobs_, [&] {
    std::unique_lock lock(mutex);
    is_looking = true;
    workers.wait(lock, [&] { return is_seen; });
  });
  workers.stop();
}

TEST_P(WorkersAsJobs, DrainWithoutAFreeWorker) {
  std::atomic<int> done{0};
  call_as_job(*jobs_, [&] {
    Queue queue(2);
    for (int i = 0; i < 10; ++i) {
      queue.push([&] {
        if (++done < 20) queue.push([&] { ++done; });
      });
    }
    queue.workers().drain();
  });
  EXPECT_EQ(done, 20);
}

TEST_P(WorkersAsJobs, StopWhileTheWorkersAreBusy) {
  std::vector<std::unique_ptr<Gate>> gates;
  std::vector<std::thread> holders;
  for (unsigned i = 0; i < GetParam(); ++i) {
    Gate& gate = *gates.emplace_back(std::make_unique<Gate>());
    holders.emplace_back([&] { call_as_job(*jobs_, [&] { gate.pass(); }); });
    gate.wait_until_reached();
  }
  std::atomic<int> done{0};
  std::atomic<std::thread::id> by;
  {
    Queue queue(2);
    for (int i = 0; i < 10; ++i) queue.push([&] { ++done; });
    queue.workers().releases()->defer(std::make_shared<Destroyed>(by)).reset();
  }  // its jobs have not started
  EXPECT_NE(by.load(), std::thread::id());
  for (const auto& gate : gates) gate->open();
  for (std::thread& each : holders) each.join();
  while (jobs_->unfinished() != 0) std::this_thread::yield();
  EXPECT_EQ(done, 0);
}

TEST_P(WorkersAsJobs, StopDuringStepsAndWakes) {
  for (int round = 0; round < 100; ++round) {
    std::atomic<int> done{0};
    Queue queue(3);
    for (int i = 0; i < 20; ++i) queue.push([&] { ++done; });
    queue.workers().stop();
    EXPECT_EQ(static_cast<std::size_t>(done) + queue.cancel(), 20U);
  }
}

TEST_P(WorkersAsJobs, KeepTheFirstExceptionAndContinue) {
  std::atomic<int> done{0};
  Queue queue(1);
  queue.push([] { throw std::runtime_error("first"); });
  queue.push([&] { ++done; });
  queue.finish();
  EXPECT_EQ(done, 1);
  EXPECT_THROW(std::rethrow_exception(queue.take_failure()), std::runtime_error);
}

TEST_P(WorkersAsJobs, RepeatStepAtReturnedTime) {
  std::mutex mutex;
  std::atomic<int> steps = 0;
  Workers workers(mutex);
  workers.start(1, [&](Workers::Lock& /*lock*/, unsigned /*worker*/) {
    ++steps;
    steps.notify_all();
    return Workers::Clock::now() + 1ms;
  });
  for (int seen = steps; seen < 3; seen = steps) steps.wait(seen);
  workers.stop();
}

TEST_P(WorkersAsJobs, LookWithTheNewestPriority) {
  std::mutex mutex;
  int work = 0;
  Workers workers(mutex);
  const auto step = [&](Workers::Lock& /*lock*/, unsigned /*worker*/) {
    if (work == 0) return Workers::kWhenWoken;
    --work;
    return Workers::kAgain;
  };
  workers.start(1, step, {.name = "probe", .priority = JobPriority::Low});
  {
    const std::lock_guard lock(mutex);
    work = 1;
    workers.set_priority(JobPriority::High);
  }
  workers.wake_one();
  {
    std::unique_lock lock(mutex);
    while (work != 0) {
      lock.unlock();
      std::this_thread::yield();
      lock.lock();
    }
  }
  workers.stop();
  while (jobs_->unfinished() != 0) std::this_thread::yield();
  EXPECT_FALSE(jobs_->run(JobPriority::High).empty());
  EXPECT_EQ(jobs_->run(JobPriority::Normal), std::vector<std::string>());
}

TEST_P(WorkersAsJobs, ReleaseObjectsUnderAnyLock) {
  std::atomic<std::thread::id> by;
  Queue queue(1);
  for (int i = 0; i < 200; ++i) {
    by = std::thread::id();
    auto object = queue.workers().releases()->defer(std::make_shared<Destroyed>(by));
    {
      const std::lock_guard lock(queue.mutex());
      object.reset();
    }
    by.wait(std::thread::id());
    EXPECT_NE(by.load(), std::this_thread::get_id());
  }
}

TEST_P(WorkersAsJobs, KeepTheJobSystemUntilTheirEnd) {
  std::atomic<int> done{0};
  auto queue = std::make_unique<Queue>(2);
  set_job_system(nullptr);
  for (int i = 0; i < 100; ++i) queue->push([&] { ++done; });
  queue->finish();
  EXPECT_EQ(done, 100);
  EXPECT_GT(jobs_->posted()["worker"], 0);
  queue.reset();
}

TEST(Workers, BearSlowPostsOfAJobSystem) {
  const auto jobs = std::make_shared<CountingJobs>(2, 300us);
  const ScopedJobSystem scope(jobs);
  std::atomic<int> done{0};
  Queue queue(2);
  for (int i = 0; i < 100; ++i) queue.push([&] { ++done; });
  queue.workers().drain();
  EXPECT_EQ(done, 100);
}

}  // namespace
}  // namespace quoin
