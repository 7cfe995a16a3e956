#include "io/base64.h"

#include <array>
#include <cstdint>

#include <quoin/core/assert.h>

namespace quoin {
namespace {

constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr std::uint8_t kNoDigit = 64;

constexpr std::array<std::uint8_t, 256> values_of_digits() {
  std::array<std::uint8_t, 256> values{};
  for (std::uint8_t& value : values) value = kNoDigit;
  for (std::size_t i = 0; i < kDigits.size(); ++i) {
    values[static_cast<unsigned char>(kDigits[i])] = static_cast<std::uint8_t>(i);
  }
  return values;
}
constexpr std::array<std::uint8_t, 256> kValues = values_of_digits();

}  // namespace

std::string to_base64(std::span<const std::byte> bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - at);
    std::uint32_t three = 0;
    for (std::size_t i = 0; i < 3; ++i)
      three = three << 8 | (i < count ? std::to_integer<std::uint32_t>(bytes[at + i]) : 0);
    for (std::size_t i = 0; i < 4; ++i) text += i <= count ? kDigits[three >> (18 - 6 * i) & 63] : '=';
  }
  return text;
}

Result<std::vector<std::byte>> from_base64(std::string_view text) {
  if (text.size() % 4 != 0) {
    return make_error(ErrorCode::BadFormat, "the base64 text is cut off: its length is not a multiple of 4", {},
                      text.size());
  }
  std::vector<std::byte> bytes;
  bytes.reserve(text.size() / 4 * 3);
  for (std::size_t at = 0; at < text.size(); at += 4) {
    const bool is_last = at + 4 == text.size();
    std::size_t digits = 4;
    if (is_last && text[at + 3] == '=') digits = text[at + 2] == '=' ? 2 : 3;
    std::uint32_t three = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::uint8_t value = i < digits ? kValues[static_cast<unsigned char>(text[at + i])] : 0;
      if (value == kNoDigit) return make_error(ErrorCode::BadFormat, "not a base64 character", {}, at + i);
      three = three << 6 | value;
    }
    for (std::size_t i = 0; i + 1 < digits; ++i) bytes.push_back(static_cast<std::byte>(three >> (16 - 8 * i)));
    const std::uint32_t left_over = digits == 4 ? 0 : three & ((1U << (digits == 3 ? 8 : 16)) - 1);
    if (left_over != 0)
      return make_error(ErrorCode::BadFormat, "the last base64 character has bits beyond the last byte", {}, at);
  }
  QUOIN_ASSERT(bytes.size() <= text.size() / 4 * 3, "at most three bytes for four characters");
  return bytes;
}

}  // namespace quoin
