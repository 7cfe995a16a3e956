#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/result.h>

namespace quoin {

/// Returns BadFormat at an offset in the file.
[[nodiscard]] inline Error bad_at(std::uint64_t offset, std::string message) {
  return make_error(ErrorCode::BadFormat, std::move(message), {}, offset);
}

/// Returns the bytes as characters.
[[nodiscard]] inline std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Reads little-endian values from bytes that may end too early.
///
/// After a read past the end, all reads return zeros (or an empty view) and `failed` stays true. A parser can read a
/// whole record and check once.
class ByteReader {
 public:
  /// Reads `bytes[begin, end)`. Requires: begin <= end <= bytes.size().
  ByteReader(std::span<const std::byte> bytes, std::size_t begin, std::size_t end)
      : bytes_(bytes), position_(begin), end_(end) {
    QUOIN_ASSERT(begin <= end && end <= bytes.size(), "a stretch of the bytes");
  }
  explicit ByteReader(std::span<const std::byte> bytes) : ByteReader(bytes, 0, bytes.size()) {}

  [[nodiscard]] bool failed() const { return failed_; }
  /// The offset from the beginning of `bytes`.
  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] std::size_t remaining() const {
    QUOIN_ASSERT(position_ <= end_, "a position within the bytes");
    return end_ - position_;
  }

  [[nodiscard]] std::span<const std::byte> take(std::size_t count) {
    if (count > remaining()) {
      failed_ = true;
      position_ = end_;
      return {};
    }
    const std::span<const std::byte> taken = bytes_.subspan(position_, count);
    position_ += count;
    return taken;
  }
  [[nodiscard]] std::string_view text(std::size_t count) { return text_of(take(count)); }
  [[nodiscard]] std::uint32_t u32() {
    const std::span<const std::byte> b = take(4);
    if (b.empty()) return 0;
    return static_cast<std::uint32_t>(b[0]) | static_cast<std::uint32_t>(b[1]) << 8 |
           static_cast<std::uint32_t>(b[2]) << 16 | static_cast<std::uint32_t>(b[3]) << 24;
  }
  [[nodiscard]] std::uint8_t u8() {
    const std::span<const std::byte> b = take(1);
    return b.empty() ? std::uint8_t{0} : static_cast<std::uint8_t>(b[0]);
  }
  [[nodiscard]] std::uint16_t u16() {
    const std::span<const std::byte> b = take(2);
    if (b.empty()) return 0;
    return static_cast<std::uint16_t>(static_cast<unsigned>(b[0]) | static_cast<unsigned>(b[1]) << 8);
  }
  [[nodiscard]] float f32() { return std::bit_cast<float>(u32()); }
  [[nodiscard]] std::int32_t i32() { return static_cast<std::int32_t>(u32()); }

  /// Reads a count of records of at least `record_bytes` each. Fails if the remaining bytes cannot hold that many.
  [[nodiscard]] std::size_t count(std::size_t record_bytes) {
    QUOIN_ASSERT(record_bytes > 0, "records of at least one byte");
    const std::size_t claimed = u32();
    if (claimed <= remaining() / record_bytes) return claimed;
    failed_ = true;
    return 0;
  }

 private:
  std::span<const std::byte> bytes_;
  std::size_t position_;
  std::size_t end_;
  bool failed_ = false;
};

}  // namespace quoin
