#include "core/change_journal.h"

#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace quoin {
namespace {

TEST(ChangeNotifiers, ReportOnceUntilFollowedAgain) {
  ChangeNotifiers notifiers;
  ChangeNotifier a;
  ChangeNotifier b;
  notifiers.follow(a, 4);
  notifiers.follow(b, 2);
  a.notify();
  b.notify();
  a.notify();
  std::vector<std::uint32_t> taken;
  notifiers.take(taken);
  EXPECT_EQ(taken, (std::vector<std::uint32_t>{4, 2}));
  taken.clear();
  a.notify();
  notifiers.take(taken);
  EXPECT_TRUE(taken.empty()) << "not followed since";
  notifiers.follow(a, 4);
  a.notify();
  notifiers.take(taken);
  EXPECT_EQ(taken, (std::vector<std::uint32_t>{4}));
}

TEST(ChangeNotifiers, ReportReusedNumberOnce) {
  ChangeNotifiers notifiers;
  for (int i = 0; i < 1'000; ++i) {
    ChangeNotifier notifier;
    notifiers.follow(notifier, 7);
    notifier.notify();
  }
  std::vector<std::uint32_t> taken;
  notifiers.take(taken);
  EXPECT_EQ(taken, (std::vector<std::uint32_t>{7}));
}

}  // namespace
}  // namespace quoin
