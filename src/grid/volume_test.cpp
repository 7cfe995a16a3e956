#include <quoin/grid/volume.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "core/death_for_tests.h"

namespace quoin {

namespace {

Volume volume_of(IVec3 size, const std::vector<float>& values) {
  Volume volume;
  volume.size = size;
  volume.values = values;
  volume.min = std::numeric_limits<float>::infinity();
  volume.max = -volume.min;
  for (const float value : values) {
    if (!std::isfinite(value)) continue;
    volume.min = std::min(volume.min, value);
    volume.max = std::max(volume.max, value);
  }
  return volume;
}

float threshold_of(const Volume& volume) {
  return surface_value(volume).value();
}

/// Finds Otsu's threshold by trying every value.
double variance_within(const std::vector<float>& values, double threshold) {
  double sum[2] = {}, squares[2] = {}, count[2] = {};
  for (const double value : values) {
    const int side = value > threshold ? 1 : 0;
    sum[side] += value;
    squares[side] += value * value;
    count[side] += 1;
  }
  double within = 0.0;
  for (int side = 0; side < 2; ++side) {
    if (count[side] > 0) within += squares[side] - sum[side] * sum[side] / count[side];
  }
  return within;
}

TEST(VolumeThreshold, SeparatesTwoGroups) {
  const std::uint32_t seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < 20; ++round) {
    std::normal_distribution<float> low(-40.0F, 5.0F + static_cast<float>(round));
    std::normal_distribution<float> high(120.0F, 30.0F);
    std::vector<float> values;
    for (int i = 0; i < 3000; ++i) values.push_back(i % 4 == 0 ? high(random) : low(random));
    const Volume volume = volume_of({3000, 1, 1}, values);
    double least = std::numeric_limits<double>::infinity();
    for (const float value : values) least = std::min(least, variance_within(values, value));
    EXPECT_LT(variance_within(values, threshold_of(volume)), least * 1.001);
  }
}

TEST(VolumeThreshold, LiesInMiddleOfGap) {
  EXPECT_EQ(threshold_of(volume_of({4, 1, 1}, {0, 0, 255, 255})), 127.5F);
  EXPECT_NEAR(threshold_of(volume_of({4, 1, 1}, {-1e30F, -1e30F, 3e30F, 3e30F})), 1e30F, 1e28F);
  const float huge = std::numeric_limits<float>::max();
  EXPECT_NEAR(threshold_of(volume_of({2, 1, 1}, {-huge, huge})), 0.0F, huge * 1e-3F);
}

TEST(VolumeThreshold, SeparatesAdjacentFloats) {
  float low = 1.0F;
  for (int i = 0; i < 4; ++i) {
    const float high = std::nextafter(low, 2.0F);
    EXPECT_EQ(threshold_of(volume_of({2, 1, 1}, {low, high})), low) << "values above the threshold are solid";
    low = high;
  }
}

TEST(VolumeThreshold, HandlesUniformAndNonFiniteVolumes) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(threshold_of(volume_of({3, 1, 1}, {7, 7, 7})), 7.0F);
  EXPECT_EQ(threshold_of(volume_of({5, 1, 1}, {nan, 0, 10, INFINITY, -INFINITY})), 5.0F);
  Volume none = volume_of({1, 1, 1}, {nan});
  none.nan_count = 1;
  EXPECT_FALSE(surface_value(none)) << "no value has a threshold";
}

TEST(LengthUnits, ConvertToMetres) {
  EXPECT_EQ(metres_of_unit("mm"), 1e-3);
  EXPECT_EQ(metres_of_unit("um"), 1e-6);
  EXPECT_EQ(metres_of_unit("microns"), 1e-6);
  EXPECT_EQ(metres_of_unit("m"), 1.0);
  EXPECT_EQ(metres_of_unit(""), std::nullopt);
  EXPECT_EQ(metres_of_unit("furlong"), std::nullopt);
}

TEST(VolumeDeathTest, RejectsUnknownType) {
  [[maybe_unused]] const auto unknown = static_cast<ScalarType>(10);
  QUOIN_EXPECT_MISTAKE((void)size_of(unknown), "a known type");
  QUOIN_EXPECT_MISTAKE((void)name_of(unknown), "a known type");
}

}  // namespace

}  // namespace quoin
