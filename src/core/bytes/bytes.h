#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/result.h>

namespace quoin {

namespace byte_order {

template <std::size_t Bytes>
struct Word;
template <>
struct Word<1> {
  using Type = std::uint8_t;
  static Type swapped(Type word) { return word; }
};
template <>
struct Word<2> {
  using Type = std::uint16_t;
  static Type swapped(Type word) { return __builtin_bswap16(word); }
};
template <>
struct Word<4> {
  using Type = std::uint32_t;
  static Type swapped(Type word) { return __builtin_bswap32(word); }
};
template <>
struct Word<8> {
  using Type = std::uint64_t;
  static Type swapped(Type word) { return __builtin_bswap64(word); }
};

}  // namespace byte_order

/// Reads a number at `bytes`, in either order. Requires: sizeof(T) bytes; T is a number.
template <class T>
[[nodiscard]] T load(const std::byte* bytes, std::endian order) {
  QUOIN_ASSERT(bytes != nullptr, "bytes of a number");
  using Word = byte_order::Word<sizeof(T)>;
  typename Word::Type word;
  std::memcpy(&word, bytes, sizeof(T));
  return std::bit_cast<T>(order == std::endian::native ? word : Word::swapped(word));
}

/// Writes a number at `bytes`, in either order. Requires: space for sizeof(T) bytes; T is a number.
template <class T>
void put_number(std::byte* bytes, T value, std::endian order) {
  QUOIN_ASSERT(bytes != nullptr, "space for a number");
  using Word = byte_order::Word<sizeof(T)>;
  const auto native = std::bit_cast<typename Word::Type>(value);
  const typename Word::Type word = order == std::endian::native ? native : Word::swapped(native);
  std::memcpy(bytes, &word, sizeof(T));
}

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
  [[nodiscard]] std::uint64_t u64() {
    const std::span<const std::byte> b = take(8);
    return b.empty() ? 0 : load<std::uint64_t>(b.data(), std::endian::little);
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

/// Builds the bytes of a file; numbers are little-endian.
class ByteWriter {
 public:
  /// Reserves memory for `more` bytes, so that growth does not move the data.
  void reserve(std::size_t more) { bytes_.reserve(bytes_.size() + more); }
  void raw(std::span<const std::byte> bytes) {
    // Avoids `insert`: GCC 12 gives a false warning when it is inlined.
    const std::size_t at = bytes_.size();
    bytes_.resize(at + bytes.size());
    std::copy(bytes.begin(), bytes.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(at));
  }
  void text(std::string_view text) { raw(std::as_bytes(std::span(text.data(), text.size()))); }
  void u8(std::uint8_t value) { bytes_.push_back(static_cast<std::byte>(value)); }
  void u16(std::uint16_t value) { put(value, 2); }
  void u32(std::uint32_t value) { put(value, 4); }
  void i32(std::int32_t value) { u32(static_cast<std::uint32_t>(value)); }
  void u64(std::uint64_t value) { put(value, 8); }
  void f32(float value) { u32(std::bit_cast<std::uint32_t>(value)); }
  void f64(double value) { u64(std::bit_cast<std::uint64_t>(value)); }

  /// Appends space to be written through `bytes` later.
  void leave(std::size_t count) { bytes_.resize(bytes_.size() + count); }
  /// Overwrites four bytes at `offset` with the lowest four bytes of a number.
  void patch(std::size_t offset, std::size_t value) {
    QUOIN_ASSERT(offset + 4 <= bytes_.size(), "four bytes that were written");
    for (std::size_t i = 0; i < 4; ++i) bytes_[offset + i] = static_cast<std::byte>(value >> (8 * i) & 0xFFU);
  }

  [[nodiscard]] std::span<std::byte> bytes() { return bytes_; }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  [[nodiscard]] std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  void put(std::uint64_t value, std::size_t count) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + count);
    for (std::size_t i = 0; i < count; ++i) bytes_[at + i] = static_cast<std::byte>(value >> (8 * i) & 0xFFU);
  }

  std::vector<std::byte> bytes_;
};

}  // namespace quoin
