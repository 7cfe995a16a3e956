#pragma once

#include <cstddef>

#include <quoin/core/function_ref.h>

namespace quoin {

/// How many threads a call may use: 0 means as many as the machine has.
struct Threads {
  unsigned count = 0;
};

/// The number of threads that a `Threads` stands for on this machine; at least 1.
[[nodiscard]] unsigned thread_count(Threads threads);

/// Calls `body(i)` once for every i in [0, count), on several threads at once, and returns when all are done.
///
/// Order:  none; write results to slot i and the outcome is the same at any thread count.
/// Errors: an exception from `body` (only bad_alloc is expected) reaches the caller once the others have stopped.
void parallel_for(std::size_t count, Threads threads, FunctionRef<void(std::size_t i)> body);

}  // namespace quoin
