#pragma once

#include <source_location>

namespace quoin {

/// A programmer's mistake: a `Requires:` of the documentation that did not hold; or something within Quoin that never
/// fails to, and then is Quoin's own.
struct AssertFailure {
  const char* condition;  ///< as it stands in the source
  const char* message;    ///< what should hold, or an empty string
  std::source_location location;
};

/// Called for every mistake that is found. When it returns, the process is aborted; it may throw or exit instead. A
/// throw ends the process too where the function that found the mistake is noexcept.
using AssertHandler = void (*)(const AssertFailure& failure);

/// Replaces the handler, for the whole process; null restores the default, which writes one line to standard error.
/// Returns the handler that was there. Threads: any; the handler is called on the thread that made the mistake.
AssertHandler set_assert_handler(AssertHandler handler);

/// Calls the handler, then aborts.
[[noreturn]] void handle_assert_failure(const AssertFailure& failure);

}  // namespace quoin

/// 1 where mistakes are looked for: in debug builds and wherever QUOIN_CHECKED is defined (CMake: -DQUOIN_CHECKED=ON).
#if defined(QUOIN_CHECKED) || !defined(NDEBUG)
#define QUOIN_ASSERT_ENABLED 1
#else
#define QUOIN_ASSERT_ENABLED 0
#endif

/// Checks what should hold, where that is enabled; elsewhere the condition is compiled but never evaluated.
/// Usage: QUOIN_ASSERT(i < size(), "the type must be registered").
#if QUOIN_ASSERT_ENABLED
#define QUOIN_ASSERT(condition, ...) \
  (static_cast<bool>(condition)      \
       ? static_cast<void>(0)        \
       : ::quoin::handle_assert_failure({#condition, "" __VA_ARGS__, ::std::source_location::current()}))
#else
#define QUOIN_ASSERT(condition, ...) static_cast<void>(sizeof(static_cast<bool>(condition)))
#endif
