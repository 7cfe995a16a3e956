#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>
#include <quoin/core/result.h>

#include "core/bytes/bytes.h"

namespace quoin::store {

/// Appends a number, its lowest byte first.
template <class T>
void put_number(BlockVector<std::byte>& out, T number) {
  static_assert(std::is_unsigned_v<T>);
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    out.push_back(static_cast<std::byte>(static_cast<std::uint64_t>(number) >> (8 * i)));
  }
}

template <class T>
[[nodiscard]] T number_at(const std::byte* bytes) {
  QUOIN_ASSERT(bytes != nullptr, "bytes of a number");
  return load<T>(bytes, std::endian::little);
}

/// Appends a number, seven bits per byte, lowest first; the top bit is set in all bytes except the last.
inline void put_short_number(BlockVector<std::byte>& out, std::uint32_t number) {
  for (; number >= 0x80; number >>= 7) out.push_back(static_cast<std::byte>(number | 0x80U));
  out.push_back(static_cast<std::byte>(number));
}

/// Reads a chunk's content sequentially. Offsets are relative to the content.
class ContentReader {
 public:
  explicit ContentReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  [[nodiscard]] std::size_t at() const { return at_; }
  [[nodiscard]] bool is_at_end() const { return at_ == bytes_.size(); }
  [[nodiscard]] bool has(std::size_t count) const {
    QUOIN_ASSERT(at_ <= bytes_.size(), "a position within the content");
    return bytes_.size() - at_ >= count;
  }
  /// Requires: has(sizeof(T)).
  template <class T>
  T take() {
    return number_at<T>(take_bytes(sizeof(T)).data());
  }
  /// Reads a number written by `put_short_number`; rejects longer encodings. Errors: BadFormat.
  Result<std::uint32_t> take_short() {
    std::uint64_t number = 0;
    for (int shift = 0; shift < 35; shift += 7) {
      if (!has(1)) return cut_off();
      const auto byte = take<std::uint8_t>();
      number |= std::uint64_t{byte & 0x7FU} << shift;
      if (byte >= 0x80) continue;
      if ((byte == 0 && shift != 0) || number > 0xFFFF'FFFFU) break;
      return static_cast<std::uint32_t>(number);
    }
    return fault("number too long", at_ - 1);
  }
  /// Requires: has(count).
  std::span<const std::byte> take_bytes(std::size_t count) {
    QUOIN_ASSERT(has(count), "bytes that `has` confirmed");
    const auto taken = bytes_.subspan(at_, count);
    at_ += count;
    return taken;
  }
  [[nodiscard]] static Error fault(const std::string& what, std::size_t at) {
    return make_error(ErrorCode::BadFormat, what, {}, at);
  }
  [[nodiscard]] Error cut_off() const { return fault("unexpected end", bytes_.size()); }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
};

}  // namespace quoin::store
