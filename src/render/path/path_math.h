#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <quoin/core/assert.h>
#include <quoin/core/hash.h>
#include <quoin/core/vec.h>

// Path tracing arithmetic with the same bits on every machine: sums, products, quotients and square roots round alike
// everywhere; the C library's sine, exponential and power do not.

namespace quoin::path {

constexpr float kPi = std::numbers::pi_v<float>;

struct SineCosine {
  float sine = 0.0F;
  float cosine = 1.0F;
};

/// Returns the sine and cosine of an angle in turns. Error: 1e-7. Requires: 0 <= turns <= 1.
///
/// Source: Taylor's series about the nearest eighth of a turn.
[[nodiscard]] inline SineCosine of_turns(float turns) {
  QUOIN_ASSERT(turns >= 0.0F && turns <= 1.0F, "0 <= turns <= 1");
  const float quarters = turns * 4.0F;
  const int nearest = static_cast<int>(turns * 8.0F + 1.0F) / 2;
  const float x = (quarters - static_cast<float>(nearest)) * (kPi / 2.0F);  // -pi/4 to pi/4
  const float xx = x * x;
  const float sine =
      x * (1.0F + xx * (-1.0F / 6.0F + xx * (1.0F / 120.0F + xx * (-1.0F / 5040.0F + xx * (1.0F / 362880.0F)))));
  const float cosine =
      1.0F + xx * (-0.5F + xx * (1.0F / 24.0F + xx * (-1.0F / 720.0F + xx * (1.0F / 40320.0F - xx / 3628800.0F))));
  switch (nearest & 3) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}

/// Returns the angle of (x, y) in radians, -pi to pi; 0 for (0, 0). Error: 1e-7.
///
/// Source: the series of the arc tangent after one halving of the angle.
[[nodiscard]] inline double arc_tangent(double y, double x) {
  const double larger = std::max(std::abs(x), std::abs(y));
  if (!(larger > 0.0)) return 0.0;
  const double ratio = std::min(std::abs(x), std::abs(y)) / larger;     // 0 to 1
  const double first = ratio / (1.0 + std::sqrt(1.0 + ratio * ratio));  // of half the angle
  const double t = first / (1.0 + std::sqrt(1.0 + first * first));      // of a quarter: up to 0.199
  const double tt = t * t;
  const double quarter =
      t * (1.0 + tt * (-1.0 / 3 + tt * (1.0 / 5 + tt * (-1.0 / 7 + tt * (1.0 / 9 - tt * (1.0 / 11))))));
  double angle = 4.0 * quarter;
  if (std::abs(y) > std::abs(x)) angle = std::numbers::pi / 2 - angle;
  if (x < 0.0) angle = std::numbers::pi - angle;
  return y < 0.0 ? -angle : angle;
}

/// Returns the arc cosine in radians, 0 to pi. Arguments are clamped to -1 to 1. Error: 1e-7.
[[nodiscard]] inline double arc_cosine(double x) {
  const double c = std::clamp(x, -1.0, 1.0);
  return arc_tangent(std::sqrt((1.0 - c) * (1.0 + c)), c);
}

/// Returns 2^x; 0 on underflow, the largest float on overflow. Relative error: 2e-7.
[[nodiscard]] inline float power_of_two(float x) {
  if (!(x > -126.0F)) return 0.0F;
  if (x >= 128.0F) return std::numeric_limits<float>::max();
  const float whole = std::floor(x);
  const float y = (x - whole - 0.5F) * std::numbers::ln2_v<float>;  // -0.35 to 0.35
  constexpr float kRootOfTwo = std::numbers::sqrt2_v<float>;
  const float part =
      1.0F + y * (1.0F + y * (0.5F + y * (1.0F / 6 + y * (1.0F / 24 + y * (1.0F / 120 + y * (1.0F / 720))))));
  const auto exponent = static_cast<std::uint32_t>(static_cast<int>(whole) + 127) << 23;
  return part * kRootOfTwo * std::bit_cast<float>(exponent);
}

/// Returns e^x; the same bits on every machine.
[[nodiscard]] inline float exponential(float x) {
  return power_of_two(x * std::numbers::log2e_v<float>);
}

/// Returns the base-2 logarithm; smaller values count as the smallest normal float. Error: 2e-7, absolute or relative.
[[nodiscard]] inline float log_of_two(float x) {
  if (!(x >= std::numeric_limits<float>::min())) return -126.0F;
  const auto bits = std::bit_cast<std::uint32_t>(x);
  auto exponent = static_cast<int>(bits >> 23) - 127;
  float mantissa = std::bit_cast<float>((bits & 0x7F'FFFFU) | 0x3F80'0000U);  // 1 to 2
  if (mantissa > std::numbers::sqrt2_v<float>) mantissa *= 0.5F, ++exponent;
  const float s = (mantissa - 1.0F) / (mantissa + 1.0F);  // -0.172 to 0.172
  const float ss = s * s;
  const float natural = 2.0F * s * (1.0F + ss * (1.0F / 3 + ss * (1.0F / 5 + ss * (1.0F / 7 + ss * (1.0F / 9)))));
  return static_cast<float>(exponent) + natural * std::numbers::log2e_v<float>;
}

/// Returns x^y. Requires: x >= 0.
[[nodiscard]] inline float power(float x, float y) {
  return x > 0.0F ? power_of_two(log_of_two(x) * y) : 0.0F;
}

[[nodiscard]] inline float square(float x) {
  return x * x;
}

/// Returns the luminance of a linear sRGB colour (ITU-R BT.709).
[[nodiscard]] inline float luminance(Vec3 colour) {
  return 0.2126F * colour.x + 0.7152F * colour.y + 0.0722F * colour.z;
}

[[nodiscard]] inline float largest(Vec3 colour) {
  return std::max({colour.x, colour.y, colour.z});
}

[[nodiscard]] inline bool is_black(Vec3 colour) {
  return !(largest(colour) > 0.0F);
}

/// A right-handed frame whose third axis is a unit vector.
///
/// Source: T. Duff et al., "Building an orthonormal basis, revisited" (2017).
struct Frame {
  Vec3 x, y, z;

  explicit Frame(Vec3 normal) : z(normal) {
    const float sign = std::copysign(1.0F, normal.z);
    const float a = -1.0F / (sign + normal.z);
    const float b = normal.x * normal.y * a;
    x = {1.0F + sign * normal.x * normal.x * a, sign * b, -sign * normal.x};
    y = {b, sign + normal.y * normal.y * a, -normal.y};
  }
  [[nodiscard]] Vec3 to_world(Vec3 v) const { return x * v.x + y * v.y + z * v.z; }
  [[nodiscard]] Vec3 to_local(Vec3 v) const {
    return {v.x * x.x + v.y * x.y + v.z * x.z, v.x * y.x + v.y * y.y + v.z * y.z, v.x * z.x + v.y * z.y + v.z * z.z};
  }
};

/// Two numbers of a sample, 0 to less than 1.
struct Pair {
  float x = 0.0F;
  float y = 0.0F;
};

/// Maps a pair to a point of the unit disc with uniform density. Source: P. Shirley, K. Chiu, "A low distortion map
/// between disk and square" (1997).
[[nodiscard]] inline Pair on_disc(Pair u) {
  const float a = 2.0F * u.x - 1.0F;
  const float b = 2.0F * u.y - 1.0F;
  if (a == 0.0F && b == 0.0F) return {};
  const bool is_wide = std::abs(a) > std::abs(b);
  const float radius = is_wide ? a : b;
  float turns = is_wide ? b / a * 0.125F : 0.25F - a / b * 0.125F;
  if (turns < 0.0F) turns += 1.0F;
  const SineCosine angle = of_turns(turns);
  return {radius * angle.cosine, radius * angle.sine};
}

/// Returns a direction about +z with density cosine / pi.
[[nodiscard]] inline Vec3 cosine_weighted(Pair u) {
  const Pair disc = on_disc(u);
  return {disc.x, disc.y, std::sqrt(std::max(0.0F, 1.0F - disc.x * disc.x - disc.y * disc.y))};
}

/// Returns the weight of a strategy with density `own` against another of density `other`: the balance heuristic of E.
/// Veach (1995).
[[nodiscard]] inline float balance(float own, float other) {
  return own / (own + other);
}

/// Returns the bits in reverse order.
[[nodiscard]] constexpr std::uint32_t reversed(std::uint32_t x) {
  x = (x >> 1 & 0x5555'5555U) | (x & 0x5555'5555U) << 1;
  x = (x >> 2 & 0x3333'3333U) | (x & 0x3333'3333U) << 2;
  x = (x >> 4 & 0x0F0F'0F0FU) | (x & 0x0F0F'0F0FU) << 4;
  x = (x >> 8 & 0x00FF'00FFU) | (x & 0x00FF'00FFU) << 8;
  return x >> 16 | x << 16;
}

/// Multiplies the bits of an index by Pascal's triangle modulo 2: bit i of the result is the sum of all bits j whose
/// binary digits include those of i. Reversed, it is the second coordinate of Sobol's sequence; the reversed index is
/// the first.
[[nodiscard]] constexpr std::uint32_t pascal(std::uint32_t x) {
  x ^= x >> 1 & 0x5555'5555U;
  x ^= x >> 2 & 0x3333'3333U;
  x ^= x >> 4 & 0x0F0F'0F0FU;
  x ^= x >> 8 & 0x00FF'00FFU;
  return x ^ (x >> 16 & 0x0000'FFFFU);
}

/// Owen scrambling of a number with bits in reverse order: each bit depends only on the bits below it.
///
/// Source: B. Burley, "Practical hash-based Owen scrambling" (2020), after S. Laine and T. Karras; constants of
/// N. Vegdahl, "Owen scrambling based dithered blue-noise sampling" (2021).
[[nodiscard]] constexpr std::uint32_t scrambled(std::uint32_t x, std::uint32_t seed) {
  x ^= x * 0x3D20'ADEAU;
  x += seed;
  x *= (seed >> 16) | 1U;
  x ^= x * 0x0552'6C56U;
  x ^= x * 0x53A2'2864U;
  return x;
}

[[nodiscard]] constexpr float unit_of(std::uint32_t bits) {
  return static_cast<float>(bits >> 8) * 0x1p-24F;
}

/// The random numbers of one path: a function of pixel, sample and dimension only.
///
/// Each pair of dimensions is a scrambled (0, 2)-sequence over the samples of a pixel, in its own order.
class Random {
 public:
  Random() = default;
  /// `pixel`: a hash of its position. `sample`: counts up from 0.
  Random(std::uint32_t pixel, std::uint32_t sample) : pixel_(pixel), sample_(sample) {}

  [[nodiscard]] std::uint32_t pixel() const { return pixel_; }
  [[nodiscard]] std::uint32_t sample() const { return sample_; }

  [[nodiscard]] Pair pair(std::uint32_t dimension) const {
    const std::uint32_t seed = mix_bits(pixel_ ^ dimension * 0x9E37'79B9U);
    const std::uint32_t index = reversed(scrambled(reversed(sample_), seed));
    const std::uint32_t other = seed * 0x85EB'CA6BU ^ seed >> 13;
    return {unit_of(reversed(scrambled(index, other * 0xC2B2'AE35U + 1U))),
            unit_of(reversed(scrambled(pascal(index), other * 0x27D4'EB2FU + 0x1656'67B1U)))};
  }
  [[nodiscard]] float one(std::uint32_t dimension) const {
    const std::uint32_t seed = mix_bits(pixel_ ^ dimension * 0x9E37'79B9U);
    const std::uint32_t index = reversed(scrambled(reversed(sample_), seed));
    return unit_of(reversed(scrambled(index, seed * 0x85EB'CA6BU + 1U)));
  }

 private:
  std::uint32_t pixel_ = 0;
  std::uint32_t sample_ = 0;
};

/// Light in 32 bits: three parts of 9 bits with a shared 5-bit exponent. The relative error of the largest part is at
/// most 1/512. Values are clamped to [0, `kMaxPackedLight`].
///
///   bit 31     27 26      18 17       9 8        0
///       | exponent | blue    | green   | red     |
///
/// Source: OpenGL, EXT_texture_shared_exponent (2004), its format RGB9_E5.
inline constexpr float kMaxPackedLight = 65'408.0F;

[[nodiscard]] inline std::uint32_t pack_light(Vec3 light) {
  constexpr int kBias = 15;
  constexpr int kBits = 9;
  // NaN becomes 0: std::max returns its first argument if the comparison fails.
  const auto bounded = [](float x) { return std::min(std::max(0.0F, x), kMaxPackedLight); };
  const Vec3 kept(bounded(light.x), bounded(light.y), bounded(light.z));
  const float most = std::max({kept.x, kept.y, kept.z});
  const int of_float = static_cast<int>(std::bit_cast<std::uint32_t>(most) >> 23) - 127;
  int exponent = std::max(-kBias - 1, of_float) + 1 + kBias;
  const auto scale_of = [](int e) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(127 + kBits + kBias - e) << 23);
  };
  if (most * scale_of(exponent) + 0.5F >= 512.0F) ++exponent;
  const float scale = scale_of(exponent);
  QUOIN_ASSERT(exponent >= 0 && exponent < 32, "an exponent of 5 bits");
  const auto part = [scale](float x) { return static_cast<std::uint32_t>(std::lrint(x * scale)); };
  return static_cast<std::uint32_t>(exponent) << 27 | part(kept.z) << 18 | part(kept.y) << 9 | part(kept.x);
}

[[nodiscard]] inline Vec3 unpack_light(std::uint32_t packed) {
  const float scale = std::bit_cast<float>(((packed >> 27) + 127U - 9U - 15U) << 23);
  const auto part = [packed](int shift) { return static_cast<float>((packed >> shift) & 511U); };
  return Vec3(part(0), part(9), part(18)) * scale;
}

}  // namespace quoin::path
