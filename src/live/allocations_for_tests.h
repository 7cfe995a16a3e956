#pragma once

#include <cstdint>

namespace quoin {

// Counters of the test program's `operator new` and `operator delete`, which failed_allocations_test.cpp defines.

/// Returns the number of blocks that the calling thread has allocated so far.
[[nodiscard]] std::int64_t allocations_of_this_thread();
/// Returns the number of blocks of 32 KiB or more that the calling thread has freed so far. Always 0 without glibc.
[[nodiscard]] std::int64_t large_frees_of_this_thread();

}  // namespace quoin
