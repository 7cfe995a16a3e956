// Words side by side: four, or eight with AVX-512. Part of the mesher's kernel.

#define QUOIN_INLINE inline __attribute__((always_inline))
#define QUOIN_STAGE inline __attribute__((noinline))  // stands apart in a profile

inline constexpr int kLanes = QUOIN_KERNEL_AVX512 ? 8 : 4;

using Words __attribute__((vector_size(8 * kLanes))) = std::uint64_t;
using UnalignedWords __attribute__((vector_size(8 * kLanes), aligned(8))) = std::uint64_t;

QUOIN_INLINE Words load(const std::uint64_t* p) {
  return *reinterpret_cast<const UnalignedWords*>(p);
}
QUOIN_INLINE void store(std::uint64_t* p, Words v) {
  *reinterpret_cast<UnalignedWords*>(p) = v;
}

constexpr int rounded_down(int row) {
  return row & -kLanes;
}
constexpr int rounded_up(int row) {
  return (row + kLanes - 1) & -kLanes;
}

#if QUOIN_KERNEL_AVX512

QUOIN_INLINE __m512i bits_of(Words v) {
  return reinterpret_cast<__m512i>(v);
}

// Any function of three bits: `kTable` has the answer for (a, b, c) at bit 4a + 2b + c.
template <int kTable>
QUOIN_INLINE Words ternary(Words a, Words b, Words c) {
  return reinterpret_cast<Words>(_mm512_ternarylogic_epi64(bits_of(a), bits_of(b), bits_of(c), kTable));
}

QUOIN_INLINE std::uint8_t lanes_with_bits(Words v) {
  return _mm512_test_epi64_mask(bits_of(v), bits_of(v));
}
QUOIN_INLINE bool any(Words v) {
  return lanes_with_bits(v) != 0;
}
QUOIN_INLINE Words or_difference(Words so_far, Words a, Words b) {
  return ternary<0xF6>(so_far, a, b);
}
QUOIN_INLINE Words and_not(Words a, Words but_not, Words b) {
  return ternary<0x20>(a, but_not, b);
}
QUOIN_INLINE Words choose(Words mask, Words where_set, Words where_not) {
  return ternary<0xCA>(mask, where_set, where_not);
}
QUOIN_INLINE Words and_same(Words so_far, Words a, Words b) {
  return ternary<0x90>(so_far, a, b);
}
QUOIN_INLINE Words level_low(Words side1, Words side2, Words corner) {
  return ternary<0xD6>(side1, side2, corner);
}
QUOIN_INLINE Words level_high(Words side1, Words side2, Words corner) {
  return ternary<0xE8>(side1, side2, corner);
}

#else

QUOIN_INLINE bool any(Words v) {
#if QUOIN_KERNEL_AVX2
  const __m256i bits = reinterpret_cast<__m256i>(v);
  return _mm256_testz_si256(bits, bits) == 0;
#else
  return (v[0] | v[1] | v[2] | v[3]) != 0;
#endif
}
QUOIN_INLINE Words or_difference(Words so_far, Words a, Words b) {
  return so_far | (a ^ b);
}
QUOIN_INLINE Words and_not(Words a, Words but_not, Words b) {
  return a & ~but_not & b;
}
QUOIN_INLINE Words and_same(Words so_far, Words a, Words b) {
  return so_far & ~(a ^ b);
}
// The two bits of a corner's level: how many of the three are set, but 3 where both sides are.
QUOIN_INLINE Words level_low(Words side1, Words side2, Words corner) {
  return (side1 ^ side2 ^ corner) | (side1 & side2);
}
QUOIN_INLINE Words level_high(Words side1, Words side2, Words corner) {
  return (side1 & side2) | ((side1 ^ side2) & corner);
}

#endif

// Position of the lowest bit. Requires: there is one.
QUOIN_INLINE std::uint64_t lowest_bit(std::uint64_t w) {
#if QUOIN_KERNEL_AVX2
  return _tzcnt_u64(w);
#else
  return static_cast<std::uint64_t>(__builtin_ctzll(w));
#endif
}

struct Range {
  int begin;
  int end;
};
