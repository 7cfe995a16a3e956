#pragma once

// Resources of the test process, to find leaks.

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <thread>

#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/allocator_interface.h>
#endif

#include "process_memory.h"

namespace quoin::viewer {

inline std::size_t open_files() {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {}));
}

inline std::size_t threads() {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator("/proc/self/task"), {}));
}

/// Returns the memory of this process, in 10^6 bytes. Under the address sanitizer only allocated bytes count: it keeps
/// freed memory and records of every address ever used, so resident memory keeps growing.
inline double held_megabytes() {
#ifdef __SANITIZE_ADDRESS__
  return static_cast<double>(__sanitizer_get_current_allocated_bytes()) / 1e6;
#else
  return resident_megabytes();
#endif
}

/// Returns the number of threads after joined ones have disappeared: the kernel lists a thread for a moment after its
/// join returns. Waits at most 5 s for the number to fall to `expected`.
inline std::size_t threads_after_joining(std::size_t expected) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  std::size_t count = threads();
  while (count > expected && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    count = threads();
  }
  return count;
}

}  // namespace quoin::viewer
