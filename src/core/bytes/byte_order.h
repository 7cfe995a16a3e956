#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include <quoin/core/assert.h>

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

}  // namespace quoin
