#pragma once

#include <cstdint>
#include <new>

namespace quoin {

// Counters of the test program's `operator new` and `operator delete`, which failed_allocations_test.cpp defines.

/// Returns the number of blocks that the calling thread has allocated so far.
[[nodiscard]] std::int64_t allocations_of_this_thread();
/// Returns the number of blocks of 32 KiB or more that the calling thread has freed so far. Always 0 without glibc.
[[nodiscard]] std::int64_t large_frees_of_this_thread();

/// Makes one allocation of the calling thread fail: the next if `n` is 0, else the one after n others; none if `n` is
/// negative. Returns the number that was left until a failure, negative if it has happened or none was set.
std::int64_t fail_allocation(std::int64_t n);

/// Calls `work` again and again while its first, second, third ... allocation fails, until none does. Calls `check`
/// after each failure. Returns the number of failures.
template <class Work, class Check>
int fail_each_allocation(Work&& work, Check&& check) {
  for (int n = 0;; ++n) {
    bool has_failed = false;
    fail_allocation(n);
    try {
      work();
    } catch (const std::bad_alloc&) {
      has_failed = true;
    }
    fail_allocation(-1);
    if (!has_failed) return n;
    check();
  }
}

}  // namespace quoin
