#include <quoin/core/parallel.h>

#include <algorithm>
#include <thread>

#ifdef QUOIN_PARALLEL_WITH_JTHREAD
// Thread-sanitizer builds: oneTBB is not instrumented and gives false reports.
#include <atomic>
#include <exception>
#include <mutex>
#include <vector>
#else
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <memory>
#include <utility>
#include <vector>
#endif

namespace quoin {

unsigned thread_count(Threads threads) {
  return threads.count != 0 ? threads.count : std::max(1U, std::thread::hardware_concurrency());
}

#ifdef QUOIN_PARALLEL_WITH_JTHREAD

void parallel_for(std::size_t count, Threads threads, FunctionRef<void(std::size_t i)> body) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_lock;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) body(i);
    } catch (...) {
      const std::lock_guard lock(failure_lock);
      failure = std::current_exception();
      next = count;
    }
  };
  {
    std::vector<std::jthread> workers;
    const std::size_t helpers = std::min<std::size_t>(thread_count(threads), count);
    for (std::size_t i = 1; i < helpers; ++i) workers.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

#else

namespace {

// Arenas that are made for one call each are given back late, to the thread that made them: a game that calls this every
// frame would grow by some kilobytes a call. So each thread keeps one for each number of workers that it asked for.
oneapi::tbb::task_arena& arena_of(unsigned workers) {
  thread_local std::vector<std::pair<unsigned, std::unique_ptr<oneapi::tbb::task_arena>>> arenas;
  const auto known = std::ranges::find(arenas, workers, [](const auto& arena) { return arena.first; });
  if (known != arenas.end()) return *known->second;
  arenas.emplace_back(workers, std::make_unique<oneapi::tbb::task_arena>(static_cast<int>(workers)));
  return *arenas.back().second;
}

}  // namespace

void parallel_for(std::size_t count, Threads threads, FunctionRef<void(std::size_t i)> body) {
  // Asked for more workers than there are processors, oneTBB starts no more but complains on standard error.
  const auto processors = static_cast<unsigned>(std::max(1, oneapi::tbb::info::default_concurrency()));
  const unsigned workers = std::min(thread_count(threads), processors);
  if (workers == 1 || count <= 1) {
    for (std::size_t i = 0; i < count; ++i) body(i);
    return;
  }
  arena_of(workers).execute([&] { oneapi::tbb::parallel_for(std::size_t{0}, count, body); });
}

#endif

}  // namespace quoin
