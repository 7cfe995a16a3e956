#pragma once

#include <source_location>

namespace [[gnu::visibility("default")]] quoin {

/// A broken contract: a documented `Requires:` that did not hold, or a broken internal invariant, which is a bug in
/// Quoin.
struct AssertFailure {
  const char* condition;  ///< the expression as written in the source
  const char* message;    ///< the expected condition in words, or an empty string
  std::source_location location;
};

/// Handles a failed assertion. The process aborts when the handler returns. The handler may throw or exit instead. A
/// throw also ends the process if the failing function is noexcept.
using AssertHandler = void (*)(const AssertFailure& failure);

/// Replaces the assert handler of the whole process and returns the previous handler. Null restores the default
/// handler, which writes one line to standard error.
/// Threads: any. The handler runs on the thread that failed the assertion.
AssertHandler set_assert_handler(AssertHandler handler);

/// Calls the current handler, then aborts the process.
[[noreturn]] void handle_assert_failure(const AssertFailure& failure);

}  // namespace quoin

/// Is 1 if assertions are checked: in debug builds, and in any build that defines QUOIN_CHECKED (CMake:
/// -DQUOIN_CHECKED=ON). Is 0 otherwise.
#if defined(QUOIN_CHECKED) || !defined(NDEBUG)
#define QUOIN_ASSERT_ENABLED 1
#else
#define QUOIN_ASSERT_ENABLED 0
#endif

/// Asserts that `condition` is true if QUOIN_ASSERT_ENABLED is 1. Otherwise the condition is compiled but never
/// evaluated.
/// Usage: QUOIN_ASSERT(i < size(), "the type must be registered").
#if QUOIN_ASSERT_ENABLED
#define QUOIN_ASSERT(condition, ...) \
  (static_cast<bool>(condition)      \
       ? static_cast<void>(0)        \
       : ::quoin::handle_assert_failure({#condition, "" __VA_ARGS__, ::std::source_location::current()}))
#else
#define QUOIN_ASSERT(condition, ...) static_cast<void>(sizeof(static_cast<bool>(condition)))
#endif
