#include <quoin/core/assert.h>

#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"

namespace quoin {
namespace {

// A custom handler that throws instead of aborting.
struct Caught : std::runtime_error {
  explicit Caught(const AssertFailure& failure)
      : std::runtime_error(std::string(failure.condition) + "|" + failure.message), line(failure.location.line()) {}
  unsigned line;
};

void throw_caught(const AssertFailure& failure) {
  throw Caught(failure);
}

TEST(Assert, CallsReplacedHandler) {
  const AssertHandler before = set_assert_handler(&throw_caught);
  EXPECT_NE(before, nullptr);
  EXPECT_THROW(handle_assert_failure({"1 == 2", "sums must add up", std::source_location::current()}), Caught);
  EXPECT_EQ(set_assert_handler(before), &throw_caught);
}

TEST(AssertDeathTest, AbortsEvenIfHandlerReturns) {
  EXPECT_DEATH(handle_assert_failure({"1 == 2", "sums must add up", std::source_location::current()}),
               "assert_test.cpp:.*requires 1 == 2: sums must add up");
  EXPECT_DEATH(
      {
        set_assert_handler([](const AssertFailure&) {});
        handle_assert_failure({"1 == 2", "", std::source_location::current()});
      },
      "");
}

TEST(Assert, EvaluatesConditionOnlyIfEnabled) {
  int evaluated = 0;
  QUOIN_ASSERT(++evaluated > 0, "never fails");
  EXPECT_EQ(evaluated, QUOIN_ASSERT_ENABLED);
}

TEST(AssertDeathTest, ReportsConditionAndRequirement) {
  const int size = 3;
  QUOIN_EXPECT_MISTAKE(QUOIN_ASSERT(size < 3, "fewer than three"), "requires size < 3: fewer than three");
}

}  // namespace
}  // namespace quoin
