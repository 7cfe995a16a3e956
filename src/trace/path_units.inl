// What the walks of trace/path_walk.inl know of the 64 units of a block, x + 4 y + 16 z. For processors with BMI2.

struct alignas(64) UnitTables {
  float corner[64][4];
  std::uint64_t from[64];  // units that are nowhere before this one
};

constexpr UnitTables make_unit_tables() {
  UnitTables tables{};
  for (int i = 0; i < 64; ++i) {
    for (int axis = 0; axis < 3; ++axis) tables.corner[i][axis] = static_cast<float>(i >> (2 * axis) & 3);
    for (int j = 0; j < 64; ++j) {
      const bool is_from = (j & 3) >= (i & 3) && (j & 12) >= (i & 12) && (j & 48) >= (i & 48);
      if (is_from) tables.from[i] |= std::uint64_t{1} << j;
    }
  }
  return tables;
}

constexpr UnitTables kUnits = make_unit_tables();

inline F4 corner_of(int unit) {
  F4 corner;
  std::memcpy(&corner, kUnits.corner[unit], sizeof corner);
  return corner;
}

// What turns the index of a unit into that of the unit that it is mirrored to.
inline int flip_of(int octant) {
  return (octant & 1) * 3 + (octant & 2) * 6 + (octant & 4) * 12;
}

// How the bits of blocks are mirrored: bytes change places, then each half of a byte is looked up.
struct alignas(16) MirrorTables {
  std::uint8_t bytes[8][16];
  std::uint8_t low[8][16];
  std::uint8_t high[8][16];
};

constexpr MirrorTables make_mirror_tables() {
  MirrorTables tables{};
  for (int octant = 0; octant < 8; ++octant) {
    const bool x = (octant & 1) != 0;
    const bool y = (octant & 2) != 0;
    const bool z = (octant & 4) != 0;
    for (int i = 0; i < 16; ++i) {
      tables.bytes[octant][i] = static_cast<std::uint8_t>(i < 8 ? i ^ (y ? 1 : 0) ^ (z ? 6 : 0) : 0x80);
      const int row = x ? (i & 1) << 3 | (i & 2) << 1 | (i & 4) >> 1 | i >> 3 : i;
      tables.low[octant][i] = static_cast<std::uint8_t>(y ? row << 4 : row);
      tables.high[octant][i] = static_cast<std::uint8_t>(y ? row : row << 4);
    }
  }
  return tables;
}

constexpr MirrorTables kMirrors = make_mirror_tables();

// Mirrors the 64 bits of blocks along the axes of an octant.
class Mirror {
 public:
  explicit Mirror(int octant)
      : bytes_(row(kMirrors.bytes[octant])), low_(row(kMirrors.low[octant])), high_(row(kMirrors.high[octant])) {}
  std::uint64_t operator()(const void* word) const {
    const __m128i v = _mm_shuffle_epi8(_mm_loadl_epi64(static_cast<const __m128i*>(word)), bytes_);
    const __m128i halves = _mm_set1_epi8(15);
    const __m128i low = _mm_shuffle_epi8(low_, _mm_and_si128(v, halves));
    const __m128i high = _mm_shuffle_epi8(high_, _mm_and_si128(_mm_srli_epi16(v, 4), halves));
    return static_cast<std::uint64_t>(_mm_cvtsi128_si64(_mm_or_si128(low, high)));
  }

 private:
  static __m128i row(const std::uint8_t* at) { return _mm_load_si128(reinterpret_cast<const __m128i*>(at)); }

  __m128i bytes_;
  __m128i low_;
  __m128i high_;
};

// Just below zero: puts planes on which a ray starts, and which it therefore never crosses, before all others.
constexpr float kNudge = 1e-30F;
