// Which units of a block a mirrored ray passes, in sixteen lanes: one for each plane, then one for each pair of units
// along two axes. Three intervals of a line that overlap two by two have a point in common (Helly), so the units
// passed are those whose x and y, x and z, y and z overlap. Crossings at the same t are ordered by axis.

struct alignas(64) PathTables {
  std::int32_t axis[kWidth];        // five planes of x, of y, of z
  float number[kWidth];             // of the plane
  float unit[64][kWidth];           // the same, plus four times where a unit lies
  std::int32_t pattern[8][kWidth];  // pairs: lower and upper planes of x, y (first), y, z (second)
};

constexpr PathTables make_path_tables() {
  PathTables tables{};
  for (int i = 0; i < kWidth; ++i) {
    const int axis = i < 5 ? 0 : i < 10 ? 1 : 2;
    const int number = i < 15 ? i % 5 : 0;
    tables.axis[i] = axis;
    tables.number[i] = static_cast<float>(number);
    for (int unit = 0; unit < 64; ++unit)
      tables.unit[unit][i] = static_cast<float>(number + 4 * (unit >> (2 * axis) & 3));
    for (int upper = 0; upper < 2; ++upper) {
      tables.pattern[0 + upper][i] = (i & 3) + upper;
      tables.pattern[2 + upper][i] = 5 + (i & 3) + upper;
      tables.pattern[4 + upper][i] = 5 + (i >> 2) + upper;
      tables.pattern[6 + upper][i] = 10 + (i >> 2) + upper;
    }
  }
  return tables;
}

constexpr PathTables kPath = make_path_tables();

class Paths {
 public:
  // The lower planes of a block.
  using Block = __m512;

  Paths(const PathRay& ray, float end)
      : origin_(block(ray.origin)), inverse_(block(ray.inverse)), end_(_mm512_set1_ps(end)), nudges_(ray.is_on_plane) {
    if (nudges_) nudge_ = block(ray.forward ? all4(kNudge) : all4(0.0F));
  }
  static Block block(F4 lower) {
    return _mm512_permutexvar_ps(_mm512_load_si512(kPath.axis),
                                 _mm512_castps128_ps512(reinterpret_cast<__m128>(lower)));
  }
  template <int kAxis>
  static Block next_chunk(Block chunk) {
    return _mm512_mask_add_ps(chunk, 0x1F << (5 * kAxis), chunk, _mm512_set1_ps(kChunkSize));
  }
  static Block brick_of(Block chunk, int brick) {
    const __m512 lower = _mm512_sub_ps(_mm512_load_ps(kPath.unit[brick]), _mm512_load_ps(kPath.number));
    return _mm512_fmadd_ps(lower, _mm512_set1_ps(4.0F), chunk);
  }
  // Products and sums of whole numbers: nothing is rounded.
  [[nodiscard]] std::uint64_t bricks(Block chunk) const {
    return through(_mm512_fmadd_ps(_mm512_load_ps(kPath.number), _mm512_set1_ps(16.0F), chunk));
  }
  [[nodiscard]] std::uint64_t cells(Block chunk, int brick) const {
    return through(_mm512_fmadd_ps(_mm512_load_ps(kPath.unit[brick]), _mm512_set1_ps(4.0F), chunk));
  }
  [[nodiscard]] std::uint64_t voxels(Block brick, int cell) const {
    return through(_mm512_add_ps(brick, _mm512_load_ps(kPath.unit[cell])));
  }

 private:
  static __m512 pairs(int pattern, __m512 t) {
    return _mm512_permutexvar_ps(_mm512_load_si512(kPath.pattern[pattern]), t);
  }
  // Pairs of units of two axes, of which `a` goes first, that overlap.
  static std::uint32_t overlaps(__m512 a_lower, __m512 a_upper, __m512 b_lower, __m512 b_upper) {
    const __mmask16 is_before_end = _mm512_cmp_ps_mask(a_lower, b_upper, _CMP_LE_OQ);
    return _mm512_mask_cmp_ps_mask(is_before_end, b_lower, a_upper, _CMP_LT_OQ);
  }
  [[nodiscard]] std::uint64_t through(__m512 planes) const {
    __m512 t = _mm512_mul_ps(_mm512_sub_ps(planes, origin_), inverse_);
    if (nudges_) [[unlikely]]
      t = _mm512_sub_ps(t, nudge_);
    const __m512 until = _mm512_min_ps(t, end_);
    const __m512 x_lower = pairs(0, t);
    const __m512 x_upper = pairs(1, until);
    const __m512 z_lower = pairs(6, t);
    const __m512 z_upper = pairs(7, until);
    const std::uint64_t xy = overlaps(x_lower, x_upper, pairs(4, t), pairs(5, until));
    const std::uint64_t xz = overlaps(x_lower, x_upper, z_lower, z_upper);
    const std::uint64_t yz = overlaps(pairs(2, t), pairs(3, until), z_lower, z_upper);
    return xy * 0x0001'0001'0001'0001U & _pdep_u64(xz, 0x000F'000F'000F'000FU) * 0x1111U &
           _pdep_u64(yz, 0x1111'1111'1111'1111U) * 15U;
  }

  __m512 origin_;
  __m512 inverse_;
  __m512 end_;
  __m512 nudge_;
  bool nudges_;
};
