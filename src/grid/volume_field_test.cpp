#include <quoin/grid/volume.h>

#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace quoin {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

template <class Value>
Volume sampled(IVec3 size, Value&& value) {
  Volume volume;
  volume.size = size;
  volume.min = kInfinity;
  volume.max = -kInfinity;
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x) {
        const auto v = static_cast<float>(value(IVec3{x, y, z}));
        volume.values.push_back(v);
        if (!std::isfinite(v)) continue;
        volume.min = std::min(volume.min, v);
        volume.max = std::max(volume.max, v);
      }
    }
  }
  return volume;
}

VolumeFieldOptions iso_of(float iso) {
  VolumeFieldOptions options;
  options.iso = iso;
  options.material = 4;
  return options;
}

double ball(IVec3 p) {
  const DVec3 d = DVec3(p) - DVec3(40.2, 35.7, 33.1);
  return 1'000.0 - 50.0 * std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
}

TEST(VolumeField, MatchesDistancesOfBall) {
  const Volume volume = sampled({80, 71, 66}, ball);
  const DensityGrid field = field_from_volume(volume, iso_of(100.0F)).value();
  for (int z = 0; z < 66; z += 3) {
    for (int y = 0; y < 71; ++y) {
      for (int x = 0; x < 80; ++x) {
        const double distance = std::clamp((100.0 - ball({x, y, z})) / 50.0, -8.0, 8.0);
        EXPECT_NEAR(field.density({x, y, z}), distance, 0.02 * std::abs(distance) + 0.01);
      }
    }
  }
  EXPECT_EQ(field.material({40, 36, 33}), 4);
  EXPECT_EQ(field.density({-1, 36, 33}), 8.0F);
}

TEST(VolumeField, MarksGreaterSamplesSolid) {
  // Differences down to the smallest positive float.
  const auto value = [](IVec3 p) {
    const double least = std::numeric_limits<float>::denorm_min();
    return p.x % 3 == 0 ? least : (p.x % 3 == 1 ? 0.0 : -least) + (p.y == 5 ? 1e30 : 0.0);
  };
  const Volume volume = sampled({70, 9, 3}, value);
  const DensityGrid field = field_from_volume(volume, iso_of(0.0F)).value();
  for (int z = 0; z < 3; ++z) {
    for (int y = 0; y < 9; ++y) {
      for (int x = 0; x < 70; ++x) EXPECT_EQ(field.density({x, y, z}) < 0.0F, static_cast<float>(value({x, y, z})) > 0);
    }
  }
}

TEST(VolumeField, PutsSurfaceHalfwayBetweenLabels) {
  const Volume volume = sampled({40, 40, 40}, [](IVec3 p) { return p.y < 20 ? 1 : 0; });
  const DensityGrid field = field_from_volume(volume, iso_of(0.5F)).value();
  EXPECT_NEAR(field.density({20, 19, 20}), -0.5F, 0.01F);
  EXPECT_NEAR(field.density({20, 20, 20}), 0.5F, 0.01F);
}

TEST(VolumeField, TreatsNanAsAirAndInfinitiesBySign) {
  const std::array<float, 4> values = {kNan, kInfinity, -kInfinity, 3.0F};
  const Volume volume = sampled({4, 4, 4}, [&](IVec3 p) { return values[static_cast<std::size_t>(p.x)]; });
  const DensityGrid field = field_from_volume(volume, iso_of(2.0F)).value();
  EXPECT_EQ(field.density({0, 1, 1}), 8.0F);
  EXPECT_EQ(field.density({1, 1, 1}), -8.0F);
  EXPECT_EQ(field.density({2, 1, 1}), 8.0F);
  EXPECT_LT(field.density({3, 1, 1}), 0.0F);
  for (const float iso : {kInfinity, -kInfinity}) {
    const DensityGrid all = field_from_volume(volume, iso_of(iso)).value();
    EXPECT_EQ(all.solid_count(), iso > 0 ? 0 : 32);
  }
}

TEST(VolumeField, UncrossedVolumeIsEmptyOrSolid) {
  const Volume flat = sampled({5, 70, 5}, [](IVec3) { return 7; });
  EXPECT_EQ(field_from_volume(flat, iso_of(9.0F)).value().solid_count(), 0);
  EXPECT_EQ(field_from_volume(flat, iso_of(7.0F)).value().solid_count(), 0);
  EXPECT_EQ(field_from_volume(flat, iso_of(2.0F)).value().solid_count(), 5 * 70 * 5);
  const Volume ramp = sampled({9, 9, 9}, [](IVec3 p) { return p.x; });
  EXPECT_EQ(field_from_volume(ramp, iso_of(100.0F)).value().chunk_count(), 0U);
  EXPECT_EQ(field_from_volume(ramp, iso_of(-100.0F)).value().density({0, 0, 0}), -8.0F);
}

TEST(VolumeField, RefusesInvalidVolumes) {
  const Volume good = sampled({4, 3, 2}, [](IVec3 p) { return p.x; });
  EXPECT_EQ(field_from_volume(good, iso_of(kNan)).error().code, ErrorCode::InvalidArgument);
  constexpr int kMost = std::numeric_limits<int>::max();
  for (const IVec3 size : {IVec3(0, 3, 2), IVec3(-4, -3, 2), IVec3(4, 3, 3), IVec3(4, 3, 1), IVec3(kMost, kMost, kMost),
                           IVec3(65'536, 65'536, 65'536), IVec3(1 << 30, 1 << 30, 1 << 4)}) {
    Volume bad = good;
    bad.size = size;
    const auto field = field_from_volume(bad, iso_of(1.0F));
    ASSERT_FALSE(field.has_value());
    EXPECT_EQ(field.error().code, ErrorCode::InvalidArgument);
  }
  Volume nothing;
  EXPECT_FALSE(field_from_volume(nothing, iso_of(1.0F)).has_value());
}

TEST(VolumeField, IsThreadIndependentAndCancellable) {
  const Volume volume = sampled({130, 70, 66}, ball);
  const DensityGrid one = field_from_volume(volume, iso_of(0.0F), Threads{1}).value();
  const DensityGrid four = field_from_volume(volume, iso_of(0.0F), Threads{4}).value();
  ASSERT_EQ(one.chunks(), four.chunks());
  for (int z = 0; z < 66; ++z) {
    for (int y = 0; y < 70; ++y) {
      for (int x = 0; x < 130; ++x) ASSERT_EQ(one.density({x, y, z}), four.density({x, y, z}));
    }
  }
  double last = 0.0;
  const auto listen = [&](double fraction) { return fraction >= last && (last = fraction, true); };
  EXPECT_TRUE(field_from_volume(volume, iso_of(0.0F), {}, listen).has_value());
  EXPECT_EQ(last, 1.0);
  const auto cancelled = field_from_volume(volume, iso_of(0.0F), {}, [](double) { return false; });
  EXPECT_EQ(cancelled.error().code, ErrorCode::Cancelled);
}

TEST(VolumeField, StoresNothingFarFromTheSurface) {
  const Volume volume = sampled({192, 192, 64}, ball);
  const DensityGrid field = field_from_volume(volume, iso_of(100.0F)).value();
  EXPECT_EQ(field.chunks(), std::vector<IVec3>({{0, 0, 0}, {1, 0, 0}}));
  EXPECT_LT(field.bytes(), volume.values.size() / 4);
}

}  // namespace
}  // namespace quoin
