// As trace/path_avx512.inl, in eight lanes: two rows of four pairs each.

struct alignas(32) PathTables {
  float unit[3][4][8];  // lower planes of units of 1, 4 and 16 voxels, twice, by where the block lies along an axis
};

constexpr PathTables make_path_tables() {
  PathTables tables{};
  for (int level = 0; level < 3; ++level) {
    for (int at = 0; at < 4; ++at) {
      for (int i = 0; i < 8; ++i) tables.unit[level][at][i] = static_cast<float>(((i & 3) + 4 * at) << (2 * level));
    }
  }
  return tables;
}

constexpr PathTables kPath = make_path_tables();

class Paths {
 public:
  // The lower planes of a block, the same in all lanes.
  struct Block {
    __m256 x, y, z;
  };

  Paths(const PathRay& ray, float end)
      : origin_(block(ray.origin)), inverse_(block(ray.inverse)), end_(_mm256_set1_ps(end)), nudges_(ray.is_on_plane) {
    if (nudges_) nudge_ = block(ray.forward ? all4(kNudge) : all4(0.0F));
  }
  static Block block(F4 lower) {
    const auto v = reinterpret_cast<__m128>(lower);
    return {_mm256_broadcastss_ps(v), _mm256_broadcastss_ps(_mm_movehdup_ps(v)),
            _mm256_broadcastss_ps(_mm_movehl_ps(v, v))};
  }
  template <int kAxis>
  static Block next_chunk(Block chunk) {
    __m256& plane = kAxis == 0 ? chunk.x : kAxis == 1 ? chunk.y : chunk.z;
    plane = _mm256_add_ps(plane, _mm256_set1_ps(kChunkSize));
    return chunk;
  }
  static Block brick_of(const Block& chunk, int brick) {
    const auto lower = [](int at) { return _mm256_broadcast_ss(kPath.unit[1][at]); };
    return {_mm256_add_ps(chunk.x, lower(brick & 3)), _mm256_add_ps(chunk.y, lower(brick >> 2 & 3)),
            _mm256_add_ps(chunk.z, lower(brick >> 4))};
  }
  [[nodiscard]] std::uint64_t bricks(const Block& chunk) const { return through<2>(chunk, 0); }
  [[nodiscard]] std::uint64_t cells(const Block& chunk, int brick) const { return through<1>(chunk, brick); }
  [[nodiscard]] std::uint64_t voxels(const Block& brick, int cell) const { return through<0>(brick, cell); }

 private:
  // When the lower and the upper planes of the four units along an axis are crossed, twice.
  struct Times {
    __m256 lower, upper;
  };
  template <int kLevel>
  [[nodiscard]] Times times(__m256 block, int at, __m256 origin, __m256 inverse, const __m256& nudge) const {
    const __m256 lower = _mm256_add_ps(block, _mm256_load_ps(kPath.unit[kLevel][at]));
    const __m256 upper = _mm256_add_ps(lower, _mm256_set1_ps(1 << (2 * kLevel)));
    Times t = {_mm256_mul_ps(_mm256_sub_ps(lower, origin), inverse),
               _mm256_mul_ps(_mm256_sub_ps(upper, origin), inverse)};
    if (nudges_) [[unlikely]]
      t = {_mm256_sub_ps(t.lower, nudge), _mm256_sub_ps(t.upper, nudge)};
    return {t.lower, _mm256_min_ps(t.upper, end_)};
  }
  // Units 0 and 1, or 2 and 3, each in four lanes.
  static Times rows(const Times& t, bool is_second) {
    const __m256i which =
        is_second ? _mm256_setr_epi32(2, 2, 2, 2, 3, 3, 3, 3) : _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1);
    return {_mm256_permutevar_ps(t.lower, which), _mm256_permutevar_ps(t.upper, which)};
  }
  // Of two axes, of which `a` goes first.
  static __m256 overlaps(const Times& a, const Times& b) {
    return _mm256_and_ps(_mm256_cmp_ps(a.lower, b.upper, _CMP_LE_OQ), _mm256_cmp_ps(b.lower, a.upper, _CMP_LT_OQ));
  }
  // Two layers of z, 32 bits: bytes x + 4 y, from pairs (x, z) and (y, z).
  static std::uint64_t layers(const Times& x, const Times& y, const Times& z) {
    const __m256i xz = _mm256_castps_si256(overlaps(x, z));
    const __m256i words = _mm256_packs_epi32(xz, xz);
    const __m256i yz = _mm256_castps_si256(overlaps(y, z));
    return static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_and_si256(_mm256_packs_epi16(words, words), yz)));
  }
  template <int kLevel>
  [[nodiscard]] std::uint64_t through(const Block& block, int at) const {
    const Times x = times<kLevel>(block.x, at & 3, origin_.x, inverse_.x, nudge_.x);
    const Times y = times<kLevel>(block.y, at >> 2 & 3, origin_.y, inverse_.y, nudge_.y);
    const Times z = times<kLevel>(block.z, at >> 4, origin_.z, inverse_.z, nudge_.z);
    const int low = _mm256_movemask_ps(overlaps(x, rows(y, false)));
    const int high = _mm256_movemask_ps(overlaps(x, rows(y, true)));
    const std::uint64_t xy = static_cast<std::uint64_t>(low | high << 8) * 0x0001'0001'0001'0001U;
    return xy & (layers(x, y, rows(z, false)) | layers(x, y, rows(z, true)) << 32);
  }

  Block origin_;
  Block inverse_;
  __m256 end_;
  Block nudge_;
  bool nudges_;
};
