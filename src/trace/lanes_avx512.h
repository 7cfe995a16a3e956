// Sixteen lanes in AVX-512 registers. Included within a namespace and a target region.

constexpr int kWidth = 16;

struct Mask {
  __mmask16 m;
};
struct F {
  __m512 v;
};
struct I {
  __m512i v;
};

inline Mask operator&(Mask a, Mask b) {
  return {static_cast<__mmask16>(a.m & b.m)};
}
inline Mask operator|(Mask a, Mask b) {
  return {static_cast<__mmask16>(a.m | b.m)};
}
inline Mask operator~(Mask a) {
  return {static_cast<__mmask16>(~a.m)};
}
inline bool any(Mask a) {
  return a.m != 0;
}
inline std::uint32_t bits(Mask a) {
  return a.m;
}
inline Mask mask_of(std::uint32_t b) {
  return {static_cast<__mmask16>(b)};
}

inline F all(float x) {
  return {_mm512_set1_ps(x)};
}
inline I all(int x) {
  return {_mm512_set1_epi32(x)};
}
inline F operator+(F a, F b) {
  return {_mm512_add_ps(a.v, b.v)};
}
inline F operator-(F a, F b) {
  return {_mm512_sub_ps(a.v, b.v)};
}
inline F operator*(F a, F b) {
  return {_mm512_mul_ps(a.v, b.v)};
}
inline F operator/(F a, F b) {
  return {_mm512_div_ps(a.v, b.v)};
}
inline F min(F a, F b) {
  return {_mm512_min_ps(a.v, b.v)};
}
inline F max(F a, F b) {
  return {_mm512_max_ps(a.v, b.v)};
}
inline F abs(F a) {
  return {_mm512_abs_ps(a.v)};
}
inline F floor(F a) {
  return {_mm512_roundscale_ps(a.v, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC)};
}
inline Mask operator<(F a, F b) {
  return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ)};
}
inline Mask operator<=(F a, F b) {
  return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LE_OQ)};
}
inline Mask operator==(F a, F b) {
  return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_EQ_OQ)};
}
inline F select(Mask m, F a, F b) {
  return {_mm512_mask_blend_ps(m.m, b.v, a.v)};
}
inline F add_if(Mask m, F a, F b) {
  return {_mm512_mask_add_ps(a.v, m.m, a.v, b.v)};
}

inline I operator+(I a, I b) {
  return {_mm512_add_epi32(a.v, b.v)};
}
inline I operator-(I a, I b) {
  return {_mm512_sub_epi32(a.v, b.v)};
}
inline Mask equals(I a, int b) {
  return {_mm512_cmpeq_epi32_mask(a.v, _mm512_set1_epi32(b))};
}
inline I operator*(I a, I b) {
  return {_mm512_mullo_epi32(a.v, b.v)};
}
inline I operator&(I a, I b) {
  return {_mm512_and_si512(a.v, b.v)};
}
template <int kBits>
inline I shift_left(I a) {
  return {_mm512_slli_epi32(a.v, kBits)};
}
template <int kBits>
inline I shift_right(I a) {
  return {_mm512_srli_epi32(a.v, kBits)};
}
template <int kBits>
inline I shift_right_signed(I a) {
  return {_mm512_srai_epi32(a.v, kBits)};
}
inline I min_unsigned(I a, I b) {
  return {_mm512_min_epu32(a.v, b.v)};
}
inline I select(Mask m, I a, I b) {
  return {_mm512_mask_blend_epi32(m.m, b.v, a.v)};
}
inline I add_if(Mask m, I a, I b) {
  return {_mm512_mask_add_epi32(a.v, m.m, a.v, b.v)};
}
// Whether any of `b`'s bits is set in `a`.
inline Mask test(I a, I b) {
  return {_mm512_test_epi32_mask(a.v, b.v)};
}
// Bit `at % 32` of each lane.
inline Mask test_bit(I a, I at) {
  return test(a, I{_mm512_sllv_epi32(_mm512_set1_epi32(1), _mm512_and_si512(at.v, _mm512_set1_epi32(31)))});
}
inline I gather(const std::uint32_t* base, I at) {
  return {_mm512_i32gather_epi32(at.v, base, 4)};
}
inline I to_int(F a) {
  return {_mm512_cvttps_epi32(a.v)};
}
inline F to_float(I a) {
  return {_mm512_cvtepi32_ps(a.v)};
}
inline void store(std::int32_t* to, I a) {
  _mm512_storeu_si512(to, a.v);
}
inline I load(const std::int32_t* from) {
  return {_mm512_loadu_si512(from)};
}

inline __m512 join(__m256 low, __m256 high) {
  return _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
}

inline F narrow(const double* from) {
  return {join(_mm512_cvtpd_ps(_mm512_loadu_pd(from)), _mm512_cvtpd_ps(_mm512_loadu_pd(from + 8)))};
}

// Positions as multiples of 64 and what is left of them, and the whole number below what is left.
inline void split(const double* from, I& base, F& rest, F& whole) {
  __m256i b[2];
  __m256 r[2];
  __m256 w[2];
  for (int half = 0; half < 2; ++half) {
    const __m512d x = _mm512_loadu_pd(from + 8 * half);
    const __m512d v = _mm512_floor_pd(x);
    const __m512d start =
        _mm512_mul_pd(_mm512_floor_pd(_mm512_mul_pd(x, _mm512_set1_pd(0.015625))), _mm512_set1_pd(64.0));
    b[half] = _mm512_cvttpd_epi32(start);
    r[half] = _mm512_cvtpd_ps(_mm512_sub_pd(x, start));
    w[half] = _mm512_cvtpd_ps(_mm512_sub_pd(v, start));
  }
  base.v = _mm512_inserti64x4(_mm512_castsi256_si512(b[0]), b[1], 1);
  rest.v = join(r[0], r[1]);
  whole.v = join(w[0], w[1]);
}

inline I or_of(I a, I b) {
  return {_mm512_or_si512(a.v, b.v)};
}
// `a` where `which` has bits, else `b`.
inline I merge(I which, I a, I b) {
  return {_mm512_ternarylogic_epi32(which.v, a.v, b.v, 0xCA)};
}

// The indices of 4^3 bricks.
class BrickWindow {
 public:
  BrickWindow(const TreeView& tree, const IVec3& origin) {
    const std::uint32_t* corner =
        tree.bricks + (origin.x >> 4) + (origin.y >> 4) * tree.brick_strides.y + (origin.z >> 4) * tree.brick_strides.z;
    for (int z = 0; z < 4; ++z) {
      const auto row = [&](int y) {
        return _mm_loadu_si128(
            reinterpret_cast<const __m128i*>(corner + y * tree.brick_strides.y + z * tree.brick_strides.z));
      };
      const __m256i low = _mm256_inserti128_si256(_mm256_castsi128_si256(row(0)), row(1), 1);
      const __m256i high = _mm256_inserti128_si256(_mm256_castsi128_si256(row(2)), row(3), 1);
      layers_[z] = _mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1);
    }
  }
  // By x + 4 y + 16 z.
  [[nodiscard]] I brick(I place) const {
    const __m512i low = _mm512_permutex2var_epi32(layers_[0], place.v, layers_[1]);
    const __m512i high = _mm512_permutex2var_epi32(layers_[2], place.v, layers_[3]);
    return select(test(place, all(32)), I{high}, I{low});
  }

 private:
  __m512i layers_[4];
};
