#include <quoin/core/assert.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>

namespace quoin {
namespace {

void write_line(const AssertFailure& failure) {
  std::fprintf(stderr, "%s:%u: %s: requires %s%s%s\n", failure.location.file_name(),
               static_cast<unsigned>(failure.location.line()), failure.location.function_name(), failure.condition,
               *failure.message == '\0' ? "" : ": ", failure.message);
}

std::atomic<AssertHandler>& handler() {
  static std::atomic<AssertHandler> current{&write_line};
  return current;
}

}  // namespace

AssertHandler set_assert_handler(AssertHandler wanted) {
  return handler().exchange(wanted == nullptr ? &write_line : wanted);
}

void handle_assert_failure(const AssertFailure& failure) {
  handler().load()(failure);
  std::abort();
}

}  // namespace quoin
