// Lanes of 64 bits, as vectors of the compiler: four, eight with AVX-512, and in plain C++ two or four.
//
//   WordVector<4>::Type   | 0 | 1 | 2 | 3 |

#pragma once

#include <cstdint>

#ifdef QUOIN_KERNEL_AVX2
#include <immintrin.h>
#endif

namespace quoin::words {
namespace {

// One type per number, since GCC 12 omits the attribute if it depends on a template argument.
template <int kLanes>
struct WordVector;
template <>
struct WordVector<1> {
  using Type = std::uint64_t;
  using Unaligned = std::uint64_t;
};
template <>
struct WordVector<2> {
  using Type __attribute__((vector_size(16))) = std::uint64_t;
  using Unaligned __attribute__((vector_size(16), aligned(8))) = std::uint64_t;
};
template <>
struct WordVector<4> {
  using Type __attribute__((vector_size(32))) = std::uint64_t;
  using Unaligned __attribute__((vector_size(32), aligned(8))) = std::uint64_t;
};
template <>
struct WordVector<8> {
  using Type __attribute__((vector_size(64))) = std::uint64_t;
  using Unaligned __attribute__((vector_size(64), aligned(8))) = std::uint64_t;
};

// Loads and stores a vector, or one word. Memory is accessed as words: a copy of bytes could change any object, and the
// compiler would load its registers again.
template <class Words>
[[gnu::always_inline]] inline Words load_as(const std::uint64_t* from) {
  return *reinterpret_cast<const typename WordVector<sizeof(Words) / sizeof(std::uint64_t)>::Unaligned*>(from);
}
template <class Words>
[[gnu::always_inline]] inline void store(std::uint64_t* to, const Words& words) {
  *reinterpret_cast<typename WordVector<sizeof(Words) / sizeof(std::uint64_t)>::Unaligned*>(to) = words;
}

// Returns bit i for each lane i that is not 0.
template <class Words>
[[gnu::always_inline]] inline unsigned lanes_with_bits(Words words) {
  constexpr unsigned kLanes = sizeof(words) / sizeof(std::uint64_t);
#if defined(QUOIN_KERNEL_AVX512)
  static_assert(kLanes == 8, "one register");
  return _mm512_test_epi64_mask(reinterpret_cast<__m512i>(words), reinterpret_cast<__m512i>(words));
#elif defined(QUOIN_KERNEL_AVX2)
  static_assert(kLanes == 4, "one register");
  const __m256i zero = _mm256_cmpeq_epi64(reinterpret_cast<__m256i>(words), _mm256_setzero_si256());
  return static_cast<unsigned>(_mm256_movemask_pd(_mm256_castsi256_pd(zero))) ^ 15U;
#else
  unsigned lanes = 0;
  for (unsigned i = 0; i < kLanes; ++i) lanes |= static_cast<unsigned>(words[i] != 0) << i;
  return lanes;
#endif
}

template <class Words>
[[gnu::always_inline]] inline bool any(Words words) {
#if defined(QUOIN_KERNEL_AVX512)
  return lanes_with_bits(words) != 0;
#elif defined(QUOIN_KERNEL_AVX2)
  return _mm256_testz_si256(reinterpret_cast<__m256i>(words), reinterpret_cast<__m256i>(words)) == 0;
#else
  std::uint64_t all = words[0];
  for (unsigned i = 1; i < sizeof(words) / sizeof(std::uint64_t); ++i) all |= words[i];
  return all != 0;
#endif
}

}  // namespace
}  // namespace quoin::words
