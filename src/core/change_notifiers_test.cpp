#include "core/change_notifiers.h"

#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace quoin {
namespace {

TEST(ChangeNotifiers, AreTakenOnceAndGivenAgainOnceFollowedAnew) {
  ChangeNotifiers notices;
  ChangeNotifier a;
  ChangeNotifier b;
  notices.follow(a, 4);
  notices.follow(b, 2);
  a.notify();
  b.notify();
  a.notify();
  std::vector<std::uint32_t> taken;
  notices.take(taken);
  EXPECT_EQ(taken, (std::vector<std::uint32_t>{4, 2}));
  taken.clear();
  a.notify();
  notices.take(taken);
  EXPECT_TRUE(taken.empty()) << "not followed since";
  notices.follow(a, 4);
  a.notify();
  notices.take(taken);
  EXPECT_EQ(taken, (std::vector<std::uint32_t>{4}));
}

TEST(ChangeNotifiers, ANumberThatOthersTookOverStandsThereOnce) {
  ChangeNotifiers notices;
  for (int i = 0; i < 1'000; ++i) {
    ChangeNotifier notice;
    notices.follow(notice, 7);
    notice.notify();
  }
  std::vector<std::uint32_t> taken;
  notices.take(taken);
  EXPECT_EQ(taken, (std::vector<std::uint32_t>{7}));
}

}  // namespace
}  // namespace quoin
