#include <quoin/core/parallel.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#ifdef __linux__
#include <pthread.h>
#endif

#include <gtest/gtest.h>

#include "core/work/job_system_for_tests.h"
#include "core/work/workers.h"

namespace quoin {
namespace {

TEST(ParallelFor, RunsEachIndexOnceNestedOrConcurrent) {
  std::vector<std::jthread> callers;
  for (unsigned caller = 0; caller < 4; ++caller) {
    callers.emplace_back([caller] {
      for (int round = 0; round < 50; ++round) {
        std::vector<std::atomic<int>> done(64);
        parallel_for(8, {caller % 3 + 1},
                     [&](std::size_t i) { parallel_for(8, {2}, [&](std::size_t k) { ++done[i * 8 + k]; }); });
        for (const auto& each : done) EXPECT_EQ(each, 1);
      }
    });
  }
}

TEST(ParallelFor, RethrowsExceptions) {
  EXPECT_THROW(parallel_for(100, {2},
                            [](std::size_t i) {
                              if (i == 37) throw std::runtime_error("here");
                            }),
               std::runtime_error);
  std::atomic<int> done{0};
  parallel_for(100, {2}, [&](std::size_t) { ++done; });
  EXPECT_EQ(done, 100);
}

#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
long resident_kilobytes() {
  long pages = 0;
  long resident = 0;
  std::FILE* const file = std::fopen("/proc/self/statm", "r");
  if (file == nullptr) return 0;
  if (std::fscanf(file, "%ld %ld", &pages, &resident) != 2) resident = 0;
  std::fclose(file);
  return 4 * resident;
}

// A game calls parallel_for several times per frame, for hours.
TEST(ParallelFor, LeaksNoMemoryOverManyCalls) {
  std::atomic<int> done{0};
  const auto call = [&](int times) {
    for (int i = 0; i < times; ++i) parallel_for(8, {2}, [&](std::size_t) { ++done; });
  };
  call(100);
  const long before = resident_kilobytes();
  call(5000);
  EXPECT_LT(resident_kilobytes() - before, 4000);
  EXPECT_EQ(done, 8 * 5100);
}
#endif

class JobSystems : public testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Workers, JobSystems, testing::Values(1U, 3U));

TEST_P(JobSystems, RunEachIndexOnceNestedOrConcurrent) {
  const auto jobs = std::make_shared<CountingJobs>(GetParam());
  const ScopedJobSystem scope(jobs);
  std::vector<std::jthread> callers;
  for (unsigned caller = 0; caller < 3; ++caller) {
    callers.emplace_back([] {
      for (int round = 0; round < 50; ++round) {
        std::vector<std::atomic<int>> done(64);
        parallel_for(8, {}, [&](std::size_t i) { parallel_for(8, {}, [&](std::size_t k) { ++done[i * 8 + k]; }); });
        for (const auto& each : done) EXPECT_EQ(each, 1);
      }
    });
  }
  callers.clear();
  EXPECT_LE(jobs->most_at_once(), static_cast<int>(GetParam()));
  EXPECT_GT(jobs->posted()["loop"], 0);
}

TEST_P(JobSystems, RethrowExceptionsOfLoops) {
  const ScopedJobSystem scope(std::make_shared<CountingJobs>(GetParam()));
  EXPECT_THROW(parallel_for(100, {},
                            [](std::size_t i) {
                              if (i == 37) throw std::runtime_error("here");
                            }),
               std::runtime_error);
  std::atomic<int> done{0};
  parallel_for(100, {}, [&](std::size_t) { ++done; });
  EXPECT_EQ(done, 100);
}

TEST_P(JobSystems, CountTheCallingThreadInZero) {
  const unsigned before = thread_count({});
  {
    const ScopedJobSystem scope(make_worker_pool({.count = GetParam()}));
    EXPECT_EQ(thread_count({}), GetParam() + 1);
    EXPECT_EQ(worker_count({}), GetParam());
    EXPECT_EQ(thread_count({7}), 7U);
    EXPECT_EQ(worker_count({7}), 7U);
  }
  EXPECT_EQ(thread_count({}), before);
  EXPECT_EQ(worker_count({}), std::max(1U, before - 1));
}

// The loop must not wait for jobs that cannot start.
TEST(JobSystem, DoesLoopsWhileAllWorkersAreBusy) {
  const auto jobs = make_worker_pool({1});
  const ScopedJobSystem scope(jobs);
  std::atomic<int> done{0};
  call_as_job(*jobs, [&] { parallel_for(100, {4}, [&](std::size_t) { ++done; }); });
  EXPECT_EQ(done, 100);
}

// A job that notes its number.
class Noted final : public Job {
 public:
  Noted(std::vector<int>& numbers, int number, JobPriority wanted) : numbers_(numbers), number_(number) {
    priority = wanted;
  }
  void run() noexcept override { numbers_.push_back(number_); }

 private:
  std::vector<int>& numbers_;
  int number_;
};

TEST(WorkerPool, StartsJobsByPriorityAndThenInOrder) {
  std::vector<int> order;  // of the only worker
  const std::unique_ptr<Noted> noted[] = {
      std::make_unique<Noted>(order, 5, JobPriority::Low),    std::make_unique<Noted>(order, 3, JobPriority::Normal),
      std::make_unique<Noted>(order, 1, JobPriority::High),   std::make_unique<Noted>(order, 2, JobPriority::High),
      std::make_unique<Noted>(order, 4, JobPriority::Normal), std::make_unique<Noted>(order, 6, JobPriority::Low)};
  auto pool = make_worker_pool({1});
  call_as_job(*pool, [&] {
    for (const auto& each : noted) pool->post(*each);
  });
  pool.reset();  // runs what waits
  EXPECT_EQ(order, (std::vector<int>{1, 2, 3, 4, 5, 6}));
}

TEST(WorkerPool, MayBeDestroyedByItsOwnJob) {
  auto pool = make_worker_pool({2});
  JobSystem& jobs = *pool;
  std::atomic<int> done{0};
  call_as_job(jobs, [&done, kept = std::move(pool)]() mutable {
    kept.reset();
    ++done;
  });
  EXPECT_EQ(done, 1);
}

#ifdef __linux__
TEST(WorkerPool, NamesItsThreads) {
  const auto pool = make_worker_pool({1});
  char name[16] = {};
  call_as_job(*pool, [&] { ::pthread_getname_np(::pthread_self(), name, sizeof name); });
  EXPECT_STREQ(name, "quoin worker 1");
}
#endif

}  // namespace
}  // namespace quoin
