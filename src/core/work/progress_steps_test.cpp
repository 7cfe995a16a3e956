#include "core/work/progress_steps.h"

#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/parallel.h>

namespace quoin {
namespace {

TEST(ProgressSteps, ReportsFractionOfFinishedSteps) {
  std::vector<double> reports;
  const Progress listener = [&](double fraction) {
    reports.push_back(fraction);
    return true;
  };
  ProgressSteps steps(listener, 4);
  steps.step();
  EXPECT_TRUE(steps.add(1.5));
  EXPECT_TRUE(steps.add(1.5));
  EXPECT_EQ(reports, (std::vector<double>{0.25, 0.625, 1.0}));
}

TEST(ProgressSteps, ReportsAtMostOne) {
  double last = 0.0;
  const Progress listener = [&](double fraction) {
    last = fraction;
    return true;
  };
  ProgressSteps none(listener, 0);
  none.add(3.0);
  EXPECT_EQ(last, 1.0);
  ProgressSteps two(listener, 2);
  two.add(1.5);
  two.add(1.5);
  EXPECT_EQ(last, 1.0);
}

TEST(ProgressSteps, StopsCallingOnceCancelled) {
  int calls = 0;
  const Progress listener = [&](double) { return ++calls < 2; };
  ProgressSteps steps(listener, 10);
  EXPECT_TRUE(steps.add(1.0));
  EXPECT_FALSE(steps.cancelled());
  EXPECT_FALSE(steps.add(1.0));
  EXPECT_FALSE(steps.add(1.0));
  EXPECT_TRUE(steps.cancelled());
  EXPECT_EQ(calls, 2);
}

TEST(ProgressSteps, NeverCancelsWithoutACallback) {
  const Progress none;
  ProgressSteps steps(none, 1);
  EXPECT_TRUE(steps.add(5.0));
  EXPECT_FALSE(steps.cancelled());
}

TEST(ProgressSteps, CountsStepsOfManyThreads) {
  double last = 0.0;
  const Progress listener = [&](double fraction) {
    EXPECT_GE(fraction, last);
    last = fraction;
    return true;
  };
  ProgressSteps steps(listener, 1000);
  parallel_for(1000, Threads{4}, [&](std::size_t) { steps.step(); });
  EXPECT_EQ(last, 1.0);
}

}  // namespace
}  // namespace quoin
