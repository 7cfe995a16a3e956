#include <quoin/core/parallel.h>

#include <atomic>
#include <cstdio>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace quoin
