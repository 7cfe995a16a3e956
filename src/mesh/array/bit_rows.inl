// Samples as bits, rows of crossed edges, and the cells that touch them.
//
//   samples   bit x                  | 0 | 1 | ... | n - 1 |
//   cells     bit c      | 0 | 1 |  ...  | n - 1 | n |            c lies between samples c - 1 and c
//   edges     along rows: bit c, as cells; from row to row and from slice to slice: bit x, as samples

#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#ifdef QUOIN_KERNEL_AVX2
#include <immintrin.h>
#endif

#include "mesh/array/array_kernel.h"

namespace quoin::array {
namespace {

constexpr std::size_t kWordBits = 64;

// Bit i represents flag i; flags are all ones or 0.
inline std::uint64_t bits_of_flags(const std::uint8_t* flags) {
#ifdef QUOIN_KERNEL_AVX2
  const auto half = [flags](int first) {
    const __m256i bytes = _mm256_load_si256(reinterpret_cast<const __m256i*>(flags + first));
    return std::uint64_t{static_cast<std::uint32_t>(_mm256_movemask_epi8(bytes))};
  };
  return half(0) | half(32) << 32;
#else
  std::uint64_t bits = 0;
  for (int i = 0; i < 8; ++i) {
    std::uint64_t eight = 0;
    // The first flag becomes the lowest bit, independent of byte order.
    for (int k = 0; k < 8; ++k) eight |= std::uint64_t{flags[8 * i + k]} << (8 * k);
    bits |= ((eight & 0x0101'0101'0101'0101U) * 0x0102'0408'1020'4080U >> 56) << (8 * i);
  }
  return bits;
#endif
}

template <class T>
[[gnu::always_inline]] inline T value_at(const std::byte* row, std::size_t i) {
  T value;
  std::memcpy(&value, row + i * sizeof(T), sizeof(T));
  return value;
}

// Writes one word per 64 of `count` indices, with the bits where `is_set` returns true.
template <class IsSet>
[[gnu::always_inline]] inline void collect_bits(std::size_t count, std::uint64_t* out, IsSet is_set) {
  alignas(64) std::uint8_t flags[kWordBits];
  std::size_t first = 0;
  for (; first + kWordBits <= count; first += kWordBits) {
    for (std::size_t i = 0; i < kWordBits; ++i)
      flags[i] = static_cast<std::uint8_t>(-static_cast<int>(is_set(first + i)));
    *out++ = bits_of_flags(flags);
  }
  std::memset(flags, 0, sizeof(flags));
  for (std::size_t i = 0; first + i < count; ++i) {
    flags[i] = static_cast<std::uint8_t>(-static_cast<int>(is_set(first + i)));
  }
  *out = bits_of_flags(flags);
}

template <class T, bool kBelow>
void solid_row(const std::byte* row, std::size_t count, const std::byte* limit_bytes, std::uint64_t* out) {
  const T limit = value_at<T>(limit_bytes, 0);
  collect_bits(count, out, [&](std::size_t i) {
    const T value = value_at<T>(row, i);
    return kBelow ? value < limit : value > limit;
  });
}

template <class T>
void differing(const std::byte* row, const std::byte* other, std::uint64_t value, std::size_t count,
               std::uint64_t* out) {
  if (other != nullptr) {
    return collect_bits(count, out, [&](std::size_t i) { return value_at<T>(row, i) != value_at<T>(other, i); });
  }
  const T same = static_cast<T>(value);
  collect_bits(count, out, [&](std::size_t i) { return value_at<T>(row, i) != same; });
}

// The last bit of a row is never a sample. No bit carries from row to row, so rows need no separation.

void differences(const std::uint64_t* a, const std::uint64_t* b, std::size_t words, std::uint64_t* out) {
  for (std::size_t w = 0; w < words; ++w) out[w] = a[w] ^ b[w];
}

void differences_along(const std::uint64_t* a, std::size_t words, std::uint64_t* out) {
  out[0] = a[0] ^ a[0] << 1;
  for (std::size_t w = 1; w < words; ++w) out[w] = a[w] ^ (a[w] << 1 | a[w - 1] >> 63);
}

inline std::uint32_t count_of(std::uint64_t bits) {
#ifdef QUOIN_KERNEL_AVX2
  return static_cast<std::uint32_t>(_mm_popcnt_u64(bits));
#else
  bits -= bits >> 1 & 0x5555'5555'5555'5555U;
  bits = (bits & 0x3333'3333'3333'3333U) + (bits >> 2 & 0x3333'3333'3333'3333U);
  bits = (bits + (bits >> 4)) & 0x0F0F'0F0F'0F0F'0F0FU;
  return static_cast<std::uint32_t>(bits * 0x0101'0101'0101'0101U >> 56);
#endif
}

std::uint64_t count_bits(const std::uint64_t* words, std::size_t count) {
  std::uint64_t sums[4] = {};
  std::size_t i = 0;
  for (; i + 4 <= count; i += 4) {
    for (std::size_t k = 0; k < 4; ++k) sums[k] += count_of(words[i + k]);
  }
  for (; i < count; ++i) sums[0] += count_of(words[i]);
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

// The edges around a row of cells.
struct RowEdges {
  const std::uint64_t* along[4];    // rows of samples before and after: in the slice before, then in the slice after
  const std::uint64_t* between[2];  // in the slice before and after
  const std::uint64_t* across[2];   // in the row before and after
};

inline RowEdges edges_of_row(const CellSlice& slice, std::size_t row) {
  const std::size_t words = slice.words;
  const bool is_first = row == 0;
  const bool is_last = row == slice.rows;
  const auto before = [&](const std::uint64_t* plane) { return is_first ? slice.no_edges : plane + (row - 1) * words; };
  const auto after = [&](const std::uint64_t* plane) { return is_last ? slice.no_edges : plane + row * words; };
  return {{before(slice.low.along_rows), after(slice.low.along_rows), before(slice.high.along_rows),
           after(slice.high.along_rows)},
          {slice.low.between_rows + row * words, slice.high.between_rows + row * words},
          {before(slice.between_slices), after(slice.between_slices)}};
}

inline std::uint64_t edges_at_samples(const RowEdges& e, std::size_t w) {
  return e.between[0][w] | e.between[1][w] | e.across[0][w] | e.across[1][w];
}

// Returns a word of cells: those at crossed edges along rows, and the cells before and after crossed edges at samples.
inline std::uint64_t active_word(const RowEdges& e, std::size_t w, std::uint64_t last_at_samples) {
  const std::uint64_t at_samples = edges_at_samples(e, w);
  return e.along[0][w] | e.along[1][w] | e.along[2][w] | e.along[3][w] | at_samples | at_samples << 1 |
         last_at_samples >> 63;
}

void find_active(const CellSlice& slice, std::uint64_t* active, std::uint32_t* count) {
  const std::size_t words = slice.words;
  const auto find = [&](std::size_t row, std::size_t length) {
    const RowEdges e = edges_of_row(slice, row);
    std::uint64_t* const out = active + row * words;
    out[0] = active_word(e, 0, 0);
    for (std::size_t w = 1; w < length; ++w) out[w] = active_word(e, w, edges_at_samples(e, w - 1));
  };
  find(0, words);
  find(slice.rows, words);
  // All inner rows are processed as one long row.
  if (slice.rows > 1) find(1, (slice.rows - 1) * words);
  for (std::size_t row = 0; row <= slice.rows; ++row) {
    std::uint32_t sum = 0;
    for (std::size_t w = 0; w < words; ++w) sum += count_of(active[row * words + w]);
    count[row] = sum;
  }
}

}  // namespace
}  // namespace quoin::array
