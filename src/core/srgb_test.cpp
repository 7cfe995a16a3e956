#include "core/srgb.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace quoin {
namespace {

// Applies the standard's formula, rounded to the nearest byte.
int by_formula(float linear) {
  const long double x = linear;
  const long double encoded = x <= 0.0031308L ? 12.92L * x : 1.055L * std::pow(x, 1.0L / 2.4L) - 0.055L;
  return static_cast<int>(std::floor(encoded * 255.0L + 0.5L));
}

TEST(Srgb, RoundTripsEveryByte) {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  for (int byte = 0; byte < 256; ++byte) {
    EXPECT_EQ(encode(linear_from_srgb(static_cast<std::uint8_t>(byte))), byte);
  }
}

TEST(Srgb, RoundsRandomFloatsToNearestByte) {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  std::mt19937 random(5);
  for (int i = 0; i < 300'000; ++i) {
    // Covers the floats from 2^-16 to 1 evenly.
    const float x =
        std::ldexp(1.0F + static_cast<float>(random() >> 9) * 0x1p-23F, -1 - static_cast<int>(random() % 16));
    ASSERT_EQ(encode(x), by_formula(x)) << x;
  }
}

TEST(Srgb, RoundsCorrectlyNextToEveryThreshold) {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  for (int byte = 1; byte < 256; ++byte) {
    const double middle = (byte - 0.5) / 255.0;
    const double exact = middle <= 0.04045 ? middle / 12.92 : std::pow((middle + 0.055) / 1.055, 2.4);
    float x = static_cast<float>(exact);
    for (int i = 0; i < 4; ++i) x = std::nextafter(x, 0.0F);
    // The float closest to the threshold may go either way by the formula's own rounding; its neighbours may not.
    for (int i = 0; i < 8; ++i, x = std::nextafter(x, 2.0F)) {
      if (std::abs(x - exact) <= exact * 1e-10) continue;
      ASSERT_EQ(encode(x), x < exact ? byte - 1 : byte) << x;
    }
  }
}

TEST(Srgb, ClampsValuesOutOfRange) {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const float low : {-1.0F, -0.0F, 0.0F, -kInfinity, std::numeric_limits<float>::quiet_NaN(), 1e-30F}) {
    EXPECT_EQ(encode(low), 0) << low;
  }
  for (const float high : {1.0F, 1.0001F, 7.0F, kInfinity}) EXPECT_EQ(encode(high), 255) << high;
}

}  // namespace
}  // namespace quoin
