#pragma once

#include <algorithm>

#include <quoin/core/parallel.h>

namespace quoin {

/// Returns the number of worker threads in addition to the calling thread. Unlike `thread_count`, 0 means one less than
/// the machine has, at least 1.
[[nodiscard]] inline unsigned worker_count(Threads threads) {
  return threads.count != 0 ? threads.count : std::max(2U, thread_count(threads)) - 1;
}

}  // namespace quoin
