#pragma once

#include <algorithm>

#include <quoin/core/parallel.h>

namespace quoin {

/// How many threads those have that work beside their caller's: unlike `thread_count`, for 0 one less than the machine
/// has, at least 1.
[[nodiscard]] inline unsigned worker_count(Threads threads) {
  return threads.count != 0 ? threads.count : std::max(2U, thread_count(threads)) - 1;
}

}  // namespace quoin
