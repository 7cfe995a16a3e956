#include "core/instruction_set.h"

#include <thread>

#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>

#include "core/death_for_tests.h"
#include "core/instruction_sets_for_tests.h"

namespace quoin {
namespace {

TEST(InstructionSets, RangeFromPlainToBest) {
  const auto sets = sets_of_this_machine();
  ASSERT_FALSE(sets.empty());
  EXPECT_EQ(sets.front(), InstructionSet::Plain);
  EXPECT_EQ(sets.back(), instruction_set());
}

TEST(InstructionSets, OverrideAppliesWithinScopeOnAllThreads) {
  const InstructionSet before = instruction_set();
  {
    const InstructionSetOverride over(InstructionSet::Plain);
    InstructionSet seen = before;
    std::thread([&] { seen = instruction_set(); }).join();
    EXPECT_EQ(seen, InstructionSet::Plain);
  }
  EXPECT_EQ(instruction_set(), before);
}

// Runs a test that compares instruction sets as on a machine that has only the plain one.
void compare_with_avx2(bool& is_compared) {
  QUOIN_SKIP_WITHOUT(InstructionSet::Avx2);
  is_compared = true;
}

TEST(InstructionSets, SkipTestsThatNeedMissingSet) {
  const InstructionSetOverride over(InstructionSet::Plain);
  bool is_compared = false;
  testing::TestPartResultArray results;
  {
    const testing::ScopedFakeTestPartResultReporter reporter(
        testing::ScopedFakeTestPartResultReporter::INTERCEPT_ONLY_CURRENT_THREAD, &results);
    compare_with_avx2(is_compared);
  }
  EXPECT_FALSE(is_compared);
  ASSERT_EQ(results.size(), 1);
  EXPECT_TRUE(results.GetTestPartResult(0).skipped());
  EXPECT_STREQ(results.GetTestPartResult(0).message(), "this machine lacks AVX2, BMI and BMI2");
}

TEST(InstructionSetsDeathTest, AssertsOnOverrideBeyondMachine) {
  const InstructionSetOverride over(InstructionSet::Plain);
  QUOIN_EXPECT_MISTAKE(InstructionSetOverride{InstructionSet::Avx2}, "must have the instruction set");
}

}  // namespace
}  // namespace quoin
