#include <quoin/core/parallel.h>

#include <algorithm>
#include <thread>

#ifdef QUOIN_PARALLEL_WITH_JTHREAD
// Thread-sanitizer builds: oneTBB is not instrumented and gives false reports.
#include <atomic>
#include <exception>
#include <mutex>
#include <vector>
#elif !defined(QUOIN_PARALLEL_ON_ONE_THREAD)
#include <map>

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#endif

namespace quoin {

#ifdef QUOIN_PARALLEL_ON_ONE_THREAD

// WebAssembly: there are neither threads nor oneTBB.
unsigned thread_count(Threads /*threads*/) {
  return 1;
}

void parallel_for(std::size_t count, Threads /*threads*/, FunctionRef<void(std::size_t i)> body) {
  for (std::size_t i = 0; i < count; ++i) body(i);
}

#else

unsigned thread_count(Threads threads) {
  if (threads.count != 0) return threads.count;
  // Read once: glibc opens a file in /sys, which takes 7 microseconds.
  static const unsigned processors = std::max(1U, std::thread::hardware_concurrency());
  return processors;
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

// Arenas of one thread, by their number of workers. oneTBB 2021.8 never frees some 7 KB per arena, so a program that
// created an arena per call would grow without limit.
oneapi::tbb::task_arena& arena_of(unsigned workers) {
  thread_local std::map<unsigned, oneapi::tbb::task_arena> arenas;
  return arenas.try_emplace(workers, static_cast<int>(workers)).first->second;
}

}  // namespace

void parallel_for(std::size_t count, Threads threads, FunctionRef<void(std::size_t i)> body) {
  if (count == 0) return;
  // With more workers than processors, oneTBB starts no more threads but prints a warning to standard error.
  static const auto processors = static_cast<unsigned>(std::max(1, oneapi::tbb::info::default_concurrency()));
  const unsigned workers = count == 1 ? 1 : std::min(thread_count(threads), processors);
  if (workers == 1) {
    for (std::size_t i = 0; i < count; ++i) body(i);
    return;
  }
  arena_of(workers).execute([&] { oneapi::tbb::parallel_for(std::size_t{0}, count, body); });
}

#endif
#endif

}  // namespace quoin
