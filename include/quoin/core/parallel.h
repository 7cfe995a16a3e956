#pragma once

#include <cstddef>

#include <quoin/core/function_ref.h>

namespace [[gnu::visibility("default")]] quoin {

/// The number of threads that a call may use. 0 uses all hardware threads.
struct Threads {
  unsigned count = 0;
};

/// Returns the number of threads that `threads` resolves to on this machine; at least 1.
[[nodiscard]] unsigned thread_count(Threads threads);

/// Calls `body(i)` once for every i in [0, count) on several threads, and returns when all calls are done.
///
/// Order:   unspecified. If call i writes only result i, the output is the same at any thread count.
/// Errors:  an exception from `body` (only bad_alloc is expected) is rethrown to the caller after the other threads
///          stop.
void parallel_for(std::size_t count, Threads threads, FunctionRef<void(std::size_t i)> body);

}  // namespace quoin
