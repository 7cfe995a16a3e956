#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace quoin {

/// Returns the linear light of an sRGB byte, 0 to 1.
///
/// Source: IEC 61966-2-1. Computed in long double, rounded to float once.
[[nodiscard]] float linear_from_srgb(std::uint8_t encoded);
/// As above, for values between bytes: `encoded` is 0 to 1 for bytes 0 to 255.
[[nodiscard]] float linear_from_srgb(float encoded);
/// Returns the linear light of all bytes, which is computed at the first call.
[[nodiscard]] const std::array<float, 256>& linear_bytes();

/// Turns linear light into sRGB bytes, rounded to the nearest: exactly, for every float. Less than 0 and NaN give 0,
/// more than 1 gives 255.
///
/// Cost: one lookup by the float's highest bits, which leaves two candidate bytes, and one comparison.
class SrgbEncoder {
 public:
  SrgbEncoder();
  /// Returns the encoder, which is made at the first call.
  static const SrgbEncoder& shared();

  [[nodiscard]] std::uint8_t operator()(float linear) const {
    if (!(linear >= kLowest)) return 0;
    if (linear >= 1.0F) return 255;
    const std::uint8_t low = bytes_[(std::bit_cast<std::uint32_t>(linear) >> kShift) - kFirst];
    return static_cast<std::uint8_t>(low + static_cast<std::uint8_t>(linear >= thresholds_[low + std::size_t{1}]));
  }

 private:
  // Below 2^-13 every value is byte 0. With 7 bits of mantissa no two thresholds share an entry.
  static constexpr unsigned kShift = 23 - 7;
  static constexpr float kLowest = 0x1p-13F;
  static constexpr std::uint32_t kFirst = std::bit_cast<std::uint32_t>(kLowest) >> kShift;
  static constexpr std::uint32_t kEnd = std::bit_cast<std::uint32_t>(1.0F) >> kShift;

  std::array<std::uint8_t, kEnd - kFirst> bytes_{};  // of the entry's lowest float
  std::array<float, 257> thresholds_{};              // [b]: the smallest float whose byte is at least b
};

}  // namespace quoin
