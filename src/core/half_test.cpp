#include <quoin/core/half.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace quoin {
namespace {

// Converts a half by the definition of the format.
double value_of(Half half) {
  const int exponent = half >> 10 & 31;
  const double fraction = half & 1023;
  const double magnitude = exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(1024.0 + fraction, exponent - 25);
  return (half & 0x8000) != 0 ? -magnitude : magnitude;
}

// Returns the nearest half by a search over all halves; the even one at ties.
Half nearest_half(float value) {
  const double magnitude = std::abs(double{value});
  Half low = 0;
  Half high = 0x7C00;  // read as 65,536
  while (high - low > 1) {
    const auto middle = static_cast<Half>((low + high) / 2);
    (value_of(middle) <= magnitude ? low : high) = middle;
  }
  const double below = magnitude - value_of(low);
  const double next = high == 0x7C00 ? 65'536.0 : value_of(high);
  const double above = next - magnitude;
  const bool is_high = above < below || (above == below && (high & 1) == 0);
  return static_cast<Half>((is_high ? high : low) | (std::signbit(value) ? 0x8000 : 0));
}

TEST(Half, RoundTripsEveryHalf) {
  for (unsigned bits = 0; bits < 0x10000U; ++bits) {
    const auto half = static_cast<Half>(bits);
    const float read = float_from_half(half);
    if ((half & 0x7C00) != 0x7C00) {
      ASSERT_EQ(double{read}, value_of(half)) << bits;
      ASSERT_EQ(std::signbit(read), (half & 0x8000) != 0) << bits;
      ASSERT_EQ(half_from_float(read), half);
    } else if ((half & 0x3FF) == 0) {
      ASSERT_TRUE(std::isinf(read));
      ASSERT_EQ(half_from_float(read), half);
    } else {
      ASSERT_TRUE(std::isnan(read));
      ASSERT_TRUE(std::isnan(float_from_half(half_from_float(read))));
    }
  }
}

TEST(Half, RoundsToNearestEven) {
  constexpr unsigned kSeed = 11;
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  for (int round = 0; round < 300'000; ++round) {
    const float value = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
    if (!std::isfinite(value) || std::abs(value) >= 65'536.0F) continue;
    ASSERT_EQ(half_from_float(value), nearest_half(value)) << value;
  }
  for (unsigned bits = 0; bits < 0x7BFFU; ++bits) {
    const auto tie =
        static_cast<float>((value_of(static_cast<Half>(bits)) + value_of(static_cast<Half>(bits + 1))) / 2);
    for (const float value : {tie, -tie, std::nextafter(tie, 0.0F), std::nextafter(tie, 1e9F)}) {
      ASSERT_EQ(half_from_float(value), nearest_half(value)) << value;
    }
  }
}

TEST(Half, RoundsOverflowToInfinity) {
  EXPECT_EQ(half_from_float(65'519.0F), 0x7BFF);
  EXPECT_EQ(half_from_float(65'520.0F), 0x7C00);
  EXPECT_EQ(half_from_float(-1e30F), 0xFC00);
  EXPECT_EQ(half_from_float(std::numeric_limits<float>::infinity()), 0x7C00);
}

}  // namespace
}  // namespace quoin
