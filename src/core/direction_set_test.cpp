#include <quoin/core/direction.h>

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"

namespace quoin {
namespace {

TEST(DirectionSet, ContainsInsertedDirections) {
  for (unsigned bits = 0; bits < 64; ++bits) {
    DirectionSet set;
    int count = 0;
    for (const Direction direction : kDirections) {
      if ((bits >> static_cast<unsigned>(direction) & 1U) == 0) continue;
      set.insert(direction);
      set.insert(direction);
      ++count;
    }
    EXPECT_EQ(set, DirectionSet::from_bits(static_cast<std::uint8_t>(bits)));
    EXPECT_EQ(set.bits(), bits);
    EXPECT_EQ(set.size(), count);
    EXPECT_EQ(set.empty(), count == 0);
    std::vector<Direction> expected;
    std::ranges::copy_if(kDirections, std::back_inserter(expected), [&](Direction d) { return set.contains(d); });
    EXPECT_EQ(std::vector<Direction>(set.begin(), set.end()), expected);
    for (const Direction direction : kDirections) set.erase(direction);
    EXPECT_EQ(set, DirectionSet());
  }
}

TEST(DirectionSet, IgnoresBitsBeyondSixDirections) {
  EXPECT_EQ(DirectionSet::from_bits(0xFF), DirectionSet::all());
  EXPECT_EQ(DirectionSet::all().size(), 6);
}

TEST(DirectionSet, IteratesInOrderAndNamesDirections) {
  std::string names;
  for (const Direction direction : DirectionSet{Direction::NegZ, Direction::PosX, Direction::NegY}) {
    names += name_of(direction);
  }
  EXPECT_EQ(names, "+X-Y-Z");
  for (const Direction direction : kDirections) {
    const FaceFrame& frame = frame_of(direction);
    EXPECT_EQ(name_of(direction), std::string(1, frame.sign > 0 ? '+' : '-') + "XYZ"[frame.axis]);
  }
}

TEST(DirectionSetDeathTest, RejectsValueOfEndIterator) {
  QUOIN_EXPECT_MISTAKE((void)*DirectionSet::all().end(), "an iterator before the end");
}

TEST(DirectionDeathTest, RejectsUnknownDirection) {
  [[maybe_unused]] const auto unknown = static_cast<Direction>(6);
  QUOIN_EXPECT_MISTAKE((void)frame_of(unknown), "one of the six directions");
  QUOIN_EXPECT_MISTAKE((void)name_of(unknown), "one of the six directions");
}

}  // namespace
}  // namespace quoin
