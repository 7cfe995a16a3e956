#include "core/srgb.h"

#include <cmath>
#include <limits>

namespace quoin {
namespace {

// `encoded`: 0 to 1. Uses long double, so that rounding to float is correct.
long double decode(long double encoded) {
  return encoded <= 0.04045L ? encoded / 12.92L : std::pow((encoded + 0.055L) / 1.055L, 2.4L);
}

}  // namespace

float linear_from_srgb(std::uint8_t encoded) {
  return static_cast<float>(decode(encoded / 255.0L));
}

float linear_from_srgb(float encoded) {
  return static_cast<float>(decode(encoded));
}

const std::array<float, 256>& linear_bytes() {
  static const std::array<float, 256> linear = [] {
    std::array<float, 256> values{};
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = linear_from_srgb(static_cast<std::uint8_t>(i));
    return values;
  }();
  return linear;
}

SrgbEncoder::SrgbEncoder() {
  for (std::size_t byte = 1; byte < 256; ++byte) {
    const long double exact = decode((static_cast<long double>(byte) - 0.5L) / 255.0L);
    auto nearest = static_cast<float>(exact);
    if (nearest < exact) nearest = std::nextafter(nearest, 1.0F);
    thresholds_[byte] = nearest;
  }
  thresholds_[256] = std::numeric_limits<float>::infinity();
  std::uint8_t byte = 0;
  for (std::uint32_t i = 0; i < bytes_.size(); ++i) {
    const auto lowest = std::bit_cast<float>((kFirst + i) << kShift);
    while (lowest >= thresholds_[byte + std::size_t{1}]) ++byte;
    bytes_[i] = byte;
  }
}

const SrgbEncoder& SrgbEncoder::shared() {
  static const SrgbEncoder encoder;
  return encoder;
}

}  // namespace quoin
