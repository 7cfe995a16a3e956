#include <quoin/core/axis_orientation.h>

#include <limits>
#include <optional>
#include <set>

#include <glm/matrix.hpp>
#include <gtest/gtest.h>

#include "core/death_for_tests.h"

namespace quoin {
namespace {

TEST(AxisOrientation, TurnsCounterClockwiseAboutAxis) {
  EXPECT_EQ(AxisOrientation::quarter_turns(2, 1).apply(IVec3(1, 0, 0)), IVec3(0, 1, 0));
  EXPECT_EQ(AxisOrientation::quarter_turns(0, 1).apply(IVec3(0, 1, 0)), IVec3(0, 0, 1));
  EXPECT_EQ(AxisOrientation::quarter_turns(1, 1).apply(IVec3(0, 0, 1)), IVec3(1, 0, 0));
  EXPECT_EQ(AxisOrientation::quarter_turns(1, -1).apply(IVec3(1, 0, 0)), IVec3(0, 0, 1));
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(AxisOrientation::quarter_turns(axis, 4), AxisOrientation());
    EXPECT_EQ(AxisOrientation::quarter_turns(axis, -5), AxisOrientation::quarter_turns(axis, 3));
    for (int turns = -3; turns <= 3; ++turns) {
      DVec3 about(0.0);
      about[axis] = 1.0;
      const glm::dmat3 expected = glm::mat3_cast(glm::angleAxis(1.5707963267948966 * turns, about));
      const glm::dmat3 found = AxisOrientation::quarter_turns(axis, turns).matrix();
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) EXPECT_NEAR(found[i][j], expected[i][j], 1e-12);
      }
    }
  }
}

TEST(AxisOrientation, Has48OrientationsHalfMirrored) {
  std::set<std::array<double, 9>> matrices;
  int mirrored = 0;
  for (int index = 0; index < AxisOrientation::kCount; ++index) {
    const AxisOrientation orientation = AxisOrientation::at(index);
    EXPECT_EQ(orientation.index(), index);
    const glm::dmat3 matrix = orientation.matrix();
    std::array<double, 9> numbers{};
    for (int i = 0; i < 9; ++i) numbers[static_cast<std::size_t>(i)] = matrix[i / 3][i % 3];
    matrices.insert(numbers);
    EXPECT_EQ(glm::determinant(matrix), orientation.is_mirrored() ? -1.0 : 1.0);
    mirrored += int{orientation.is_mirrored()};
  }
  EXPECT_EQ(matrices.size(), 48U);
  EXPECT_EQ(mirrored, 24);
  EXPECT_EQ(AxisOrientation::at(0), AxisOrientation());
}

TEST(AxisOrientation, ComposesAndInvertsLikeMatrix) {
  for (int i = 0; i < AxisOrientation::kCount; ++i) {
    const AxisOrientation a = AxisOrientation::at(i);
    EXPECT_EQ(a * a.inverse(), AxisOrientation());
    EXPECT_EQ(a.inverse() * a, AxisOrientation());
    EXPECT_EQ(a.apply(DVec3(1.5, -2.0, 3.0)), a.matrix() * DVec3(1.5, -2.0, 3.0));
    EXPECT_EQ(a.size_of({2, 3, 5}), glm::abs(a.apply(IVec3(2, 3, 5))));
    for (const Direction direction : kDirections) {
      EXPECT_EQ(normal_of(a.apply(direction)), a.apply(normal_of(direction)));
    }
    for (int j = 0; j < AxisOrientation::kCount; ++j) {
      const AxisOrientation b = AxisOrientation::at(j);
      EXPECT_EQ((a * b).matrix(), a.matrix() * b.matrix());
      EXPECT_EQ((a * b).apply(IVec3(1, 2, 3)), a.apply(b.apply(IVec3(1, 2, 3))));
    }
  }
}

TEST(AxisOrientation, WorksInConstantExpressions) {
  constexpr AxisOrientation kHalf = AxisOrientation::quarter_turns(1, 1) * AxisOrientation::quarter_turns(1, 1);
  static_assert(kHalf == AxisOrientation::mirror(0) * AxisOrientation::mirror(2));
  static_assert(!kHalf.is_mirrored() && AxisOrientation::mirror(1).is_mirrored());
}

TEST(AxisOrientation, IsFoundNearItsMatrix) {
  for (int index = 0; index < AxisOrientation::kCount; ++index) {
    const AxisOrientation orientation = AxisOrientation::at(index);
    glm::dmat3 matrix = orientation.matrix();
    EXPECT_EQ(AxisOrientation::near_matrix(matrix, 0.0), orientation);
    matrix[index % 3][index / 3 % 3] += 0.125;
    EXPECT_EQ(AxisOrientation::near_matrix(matrix, 0.125), orientation);
    EXPECT_EQ(AxisOrientation::near_matrix(matrix, 0.12), std::nullopt);
    matrix[index % 3][index / 3 % 3] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(AxisOrientation::near_matrix(matrix, 0.125), std::nullopt);
  }
  EXPECT_EQ(AxisOrientation::near_matrix(glm::dmat3(0.0), 0.1), std::nullopt);
  EXPECT_EQ(AxisOrientation::near_matrix({0, 1, 0, 1, 1, 0, 0, 0, 1}, 0.1), std::nullopt) << "two entries in a row";
  EXPECT_EQ(AxisOrientation::near_matrix({1, 1, 0, 0, 0, 0, 0, 0, 1}, 0.1), std::nullopt) << "two in a column";
  EXPECT_EQ(AxisOrientation::near_matrix({1, 0, 0, 1, 0, 0, 0, 0, 1}, 0.1), std::nullopt) << "none in a row";
}

TEST(AxisOrientationDeathTest, AssertsOnInvalidAxisOrIndex) {
  QUOIN_EXPECT_MISTAKE((void)AxisOrientation::quarter_turns(3, 1), "0 <= axis < 3");
  QUOIN_EXPECT_MISTAKE((void)AxisOrientation::mirror(-1), "0 <= axis < 3");
  QUOIN_EXPECT_MISTAKE((void)AxisOrientation::at(48), "0 <= index < kCount");
  QUOIN_EXPECT_MISTAKE((void)AxisOrientation().source_axis(3), "0 <= axis < 3");
  QUOIN_EXPECT_MISTAKE((void)AxisOrientation().is_negated(-1), "0 <= axis < 3");
  QUOIN_EXPECT_MISTAKE((void)AxisOrientation::near_matrix(glm::dmat3(1.0), 0.5), "tolerance < 0.5");
}

}  // namespace
}  // namespace quoin
