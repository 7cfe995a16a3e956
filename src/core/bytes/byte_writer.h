#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

namespace quoin {

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
  void f32(float value) { u32(std::bit_cast<std::uint32_t>(value)); }
  void f64(double value) { put(std::bit_cast<std::uint64_t>(value), 8); }

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
