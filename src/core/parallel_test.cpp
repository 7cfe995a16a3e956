#include <quoin/core/parallel.h>

#include <unistd.h>

#include <atomic>
#include <cstddef>
#include <fstream>
#include <thread>

#include <gtest/gtest.h>

namespace quoin {
namespace {

TEST(Parallel, CallsWithinCallsWithOtherNumbersOfThreadsDoAll) {
  std::atomic<int> calls{0};
  parallel_for(4, {2}, [&](std::size_t) {
    parallel_for(4, {3}, [&](std::size_t) { parallel_for(4, {2}, [&](std::size_t) { ++calls; }); });
  });
  EXPECT_EQ(calls, 64);
}

double resident_megabytes() {
  std::ifstream in("/proc/self/statm");
  double total = 0.0;
  double resident = 0.0;
  in >> total >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

// A store that commits six times a second would grow by 4 GB a day.
TEST(Parallel, ManyCallsTakeNoMemory) {
  const auto call = [](int times) {
    for (int i = 0; i < times; ++i) parallel_for(2, {2}, [](std::size_t) {});
  };
  std::thread([&] {
    call(100);
    const double before = resident_megabytes();
    if (before == 0.0) GTEST_SKIP() << "there is no /proc/self/statm";
    call(4000);
    EXPECT_LT(resident_megabytes(), before + 10.0);
  }).join();
}

}  // namespace
}  // namespace quoin
