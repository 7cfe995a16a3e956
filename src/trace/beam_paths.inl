// Which units of a block any of several mirrored rays may pass: as the class of the single ray in trace/path_avx2.inl,
// but with the earliest and the latest time at which they cross a plane. Rounding keeps the order of products and
// differences, so these times bound those of every ray.

struct Beam {
  F4 least_origin, greatest_origin;
  F4 least_inverse, greatest_inverse;
  float end;  // no ray goes further
};

struct alignas(32) BeamTables {
  float unit[4][4][8];  // lower planes of units of 1, 4, 16 and 64 voxels, twice, by where the block lies along an axis
};

constexpr BeamTables make_beam_tables() {
  BeamTables tables{};
  for (int level = 0; level < 4; ++level) {
    for (int at = 0; at < 4; ++at) {
      for (int i = 0; i < 8; ++i) tables.unit[level][at][i] = static_cast<float>(((i & 3) + 4 * at) << (2 * level));
    }
  }
  return tables;
}

constexpr BeamTables kBeam = make_beam_tables();

class BeamPaths {
 public:
  explicit BeamPaths(const Beam& beam) : end_(_mm256_set1_ps(beam.end)) {
    for (int axis = 0; axis < 3; ++axis) {
      axes_[axis] = {_mm256_set1_ps(beam.least_origin[axis]), _mm256_set1_ps(beam.greatest_origin[axis]),
                     _mm256_set1_ps(beam.least_inverse[axis]), _mm256_set1_ps(beam.greatest_inverse[axis])};
    }
  }
  // The units of 4^kLevel voxels of the block with these lower planes.
  template <int kLevel>
  [[nodiscard]] std::uint64_t units(F4 block) const {
    const Times x = times<kLevel>(block[0], axes_[0]);
    const Times y = times<kLevel>(block[1], axes_[1]);
    const Times z = times<kLevel>(block[2], axes_[2]);
    const int low = _mm256_movemask_ps(overlaps(x, rows(y, false)));
    const int high = _mm256_movemask_ps(overlaps(x, rows(y, true)));
    const std::uint64_t xy = static_cast<std::uint64_t>(low | high << 8) * 0x0001'0001'0001'0001U;
    return xy & (layers(x, y, rows(z, false)) | layers(x, y, rows(z, true)) << 32);
  }

 private:
  struct Bounds {
    __m256 least_origin, greatest_origin, least_inverse, greatest_inverse;
  };
  struct Times {
    __m256 lower, upper;
  };
  template <int kLevel>
  [[nodiscard]] Times times(float block, const Bounds& axis) const {
    const __m256 lower = _mm256_add_ps(_mm256_set1_ps(block), _mm256_load_ps(kBeam.unit[kLevel][0]));
    const __m256 upper = _mm256_add_ps(lower, _mm256_set1_ps(1 << (2 * kLevel)));
    const __m256 to_lower = _mm256_sub_ps(lower, axis.greatest_origin);
    const __m256 to_upper = _mm256_sub_ps(upper, axis.least_origin);
    const __m256 first =
        _mm256_min_ps(_mm256_mul_ps(to_lower, axis.least_inverse), _mm256_mul_ps(to_lower, axis.greatest_inverse));
    const __m256 last =
        _mm256_max_ps(_mm256_mul_ps(to_upper, axis.least_inverse), _mm256_mul_ps(to_upper, axis.greatest_inverse));
    return {_mm256_max_ps(first, _mm256_setzero_ps()), _mm256_min_ps(last, end_)};
  }
  static Times rows(const Times& t, bool is_second) {
    const __m256i which =
        is_second ? _mm256_setr_epi32(2, 2, 2, 2, 3, 3, 3, 3) : _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1);
    return {_mm256_permutevar_ps(t.lower, which), _mm256_permutevar_ps(t.upper, which)};
  }
  static __m256 overlaps(const Times& a, const Times& b) {
    return _mm256_and_ps(_mm256_cmp_ps(a.lower, b.upper, _CMP_LE_OQ), _mm256_cmp_ps(b.lower, a.upper, _CMP_LE_OQ));
  }
  static std::uint64_t layers(const Times& x, const Times& y, const Times& z) {
    const __m256i xz = _mm256_castps_si256(overlaps(x, z));
    const __m256i words = _mm256_packs_epi32(xz, xz);
    const __m256i yz = _mm256_castps_si256(overlaps(y, z));
    return static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_and_si256(_mm256_packs_epi16(words, words), yz)));
  }

  Bounds axes_[3];
  __m256 end_;
};
