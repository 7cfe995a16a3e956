#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace quoin {

/// Multiplies and folds, as hash functions of the family of wyhash and xxHash do.
inline std::uint64_t mixed_with(std::uint64_t hash, std::uint64_t value) {
  hash = (hash ^ value) * 0x9E37'79B9'7F4A'7C15U;
  return hash ^ hash >> 29;
}

inline constexpr std::uint64_t kHashSeed = 0x2D35'8DCC'AA6C'78A5U;

/// Hashes a row of 64 types or half floats.
inline std::uint64_t hash_of_row(const std::array<std::uint16_t, 64>& row) {
  std::uint64_t hash = kHashSeed;
  for (std::size_t x = 0; x < row.size(); x += 4) {
    const std::uint64_t four = std::uint64_t{row[x]} | std::uint64_t{row[x + 1]} << 16 |
                               std::uint64_t{row[x + 2]} << 32 | std::uint64_t{row[x + 3]} << 48;
    hash = mixed_with(hash, four);
  }
  return hash;
}

}  // namespace quoin
