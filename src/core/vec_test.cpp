#include <quoin/core/vec.h>

#include <limits>
#include <map>
#include <unordered_map>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"

namespace quoin {
namespace {

TEST(Coordinates, SortByZyxAndHash) {
  const std::map<IVec3, int, ByZyx> sorted{{{1, 0, 0}, 1}, {{0, 1, 0}, 2}, {{0, 0, 1}, 3}, {{0, 0, 0}, 0}};
  int next = 0;
  for (const auto& [at, number] : sorted) EXPECT_EQ(number, next++) << at.x << at.y << at.z;
  std::unordered_map<IVec3, int, CoordinateHash> hashed;
  for (int i = 0; i < 1000; ++i) hashed[{i % 10 - 5, i / 10 % 10, -(i / 100)}] = i;
  EXPECT_EQ(hashed.size(), 1000U);
  EXPECT_EQ(hashed.at({0, 2, -3}), 325);
}

TEST(Boxes, RoundOutwardsToVoxels) {
  EXPECT_EQ(box_around({{0.5, -0.5, 2.0}, {1.5, 0.0, 3.0}}), (IBox{{0, -1, 2}, {2, 0, 3}}));
  // Points and flat boxes also lie in voxels.
  EXPECT_EQ(box_around({DVec3(-1.0), DVec3(-1.0)}), (IBox{IVec3(-1), IVec3(0)}));
  EXPECT_EQ(box_around({{0.0, 0.25, 0.0}, {2.0, 0.25, 1.0}}), (IBox{{0, 0, 0}, {2, 1, 1}}));
  EXPECT_TRUE(box_around({}).empty());
  EXPECT_FALSE(box_around({DVec3(-1e300), DVec3(1e300)}).empty());
}

TEST(BoxesDeathTest, RejectsUnknownCorner) {
  QUOIN_EXPECT_MISTAKE((void)box_corner(IBox{IVec3(0), IVec3(1)}, 8), "0 <= index < 8");
}

}  // namespace
}  // namespace quoin
