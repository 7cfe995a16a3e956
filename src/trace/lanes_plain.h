// One lane in plain C++. Included within a namespace.

constexpr int kWidth = 1;

struct Mask {
  bool m;
};
struct F {
  float v;
};
struct I {
  std::int32_t v;
};

inline Mask operator&(Mask a, Mask b) {
  return {a.m && b.m};
}
inline Mask operator|(Mask a, Mask b) {
  return {a.m || b.m};
}
inline Mask operator~(Mask a) {
  return {!a.m};
}
inline std::uint32_t bits(Mask a) {
  return a.m ? 1 : 0;
}
inline bool any(Mask a) {
  return a.m;
}
inline Mask mask_of(std::uint32_t b) {
  return {(b & 1U) != 0};
}

inline F all(float x) {
  return {x};
}
inline I all(int x) {
  return {x};
}
inline F operator+(F a, F b) {
  return {a.v + b.v};
}
inline F operator-(F a, F b) {
  return {a.v - b.v};
}
inline F operator*(F a, F b) {
  return {a.v * b.v};
}
inline F operator/(F a, F b) {
  return {a.v / b.v};
}
inline F min(F a, F b) {
  return {a.v < b.v ? a.v : b.v};
}
inline F max(F a, F b) {
  return {a.v > b.v ? a.v : b.v};
}
inline F abs(F a) {
  return {std::abs(a.v)};
}
// Of numbers that an int can hold, and beyond them themselves.
inline F floor(F a) {
  if (!(std::abs(a.v) < 8'388'608.0F)) return a;
  const auto whole = static_cast<float>(static_cast<std::int32_t>(a.v));
  return {whole > a.v ? whole - 1.0F : whole};
}
inline Mask operator<(F a, F b) {
  return {a.v < b.v};
}
inline Mask operator<=(F a, F b) {
  return {a.v <= b.v};
}
inline Mask operator==(F a, F b) {
  return {a.v == b.v};
}
inline F select(Mask m, F a, F b) {
  return {m.m ? a.v : b.v};
}
inline F add_if(Mask m, F a, F b) {
  return {m.m ? a.v + b.v : a.v};
}

inline std::uint32_t as_unsigned(I a) {
  return static_cast<std::uint32_t>(a.v);
}
inline I as_lane(std::uint32_t a) {
  return {static_cast<std::int32_t>(a)};
}
inline I operator+(I a, I b) {
  return as_lane(as_unsigned(a) + as_unsigned(b));
}
inline I operator-(I a, I b) {
  return as_lane(as_unsigned(a) - as_unsigned(b));
}
inline Mask equals(I a, int b) {
  return {a.v == b};
}
inline I operator*(I a, I b) {
  return as_lane(as_unsigned(a) * as_unsigned(b));
}
inline I operator&(I a, I b) {
  return as_lane(as_unsigned(a) & as_unsigned(b));
}
template <int kBits>
inline I shift_left(I a) {
  return as_lane(as_unsigned(a) << kBits);
}
template <int kBits>
inline I shift_right(I a) {
  return as_lane(as_unsigned(a) >> kBits);
}
template <int kBits>
inline I shift_right_signed(I a) {
  return {a.v >> kBits};
}
inline I min_unsigned(I a, I b) {
  return as_unsigned(a) < as_unsigned(b) ? a : b;
}
inline I select(Mask m, I a, I b) {
  return m.m ? a : b;
}
inline I add_if(Mask m, I a, I b) {
  return m.m ? a + b : a;
}
// Whether any of `b`'s bits is set in `a`.
inline Mask test(I a, I b) {
  return {(as_unsigned(a) & as_unsigned(b)) != 0};
}
// Bit `at % 32` of each lane.
inline Mask test_bit(I a, I at) {
  return {(as_unsigned(a) >> (as_unsigned(at) & 31U) & 1U) != 0};
}
inline I gather(const std::uint32_t* base, I at) {
  return as_lane(base[as_unsigned(at)]);
}
inline I to_int(F a) {
  return {std::abs(a.v) < 1e9F ? static_cast<std::int32_t>(a.v) : 0};
}
inline F to_float(I a) {
  return {static_cast<float>(a.v)};
}
inline void store(std::int32_t* to, I a) {
  *to = a.v;
}
inline I load(const std::int32_t* from) {
  return {*from};
}

inline F narrow(const double* from) {
  return {static_cast<float>(*from)};
}

// Positions as multiples of 64 and what is left of them, and the whole number below what is left.
inline void split(const double* from, I& base, F& rest, F& whole) {
  const double start = std::floor(*from * 0.015625) * 64.0;
  base.v = static_cast<std::int32_t>(start);
  rest.v = static_cast<float>(*from - start);
  whole.v = static_cast<float>(std::floor(*from) - start);
}

inline I or_of(I a, I b) {
  return as_lane(as_unsigned(a) | as_unsigned(b));
}
// `a` where `which` has bits, else `b`.
inline I merge(I which, I a, I b) {
  return as_lane((as_unsigned(which) & as_unsigned(a)) | (~as_unsigned(which) & as_unsigned(b)));
}

// The indices of 4^3 bricks.
class BrickWindow {
 public:
  BrickWindow(const TreeView& tree, const IVec3& origin)
      : corner_(tree.bricks + (origin.x >> 4) + (origin.y >> 4) * tree.brick_strides.y +
                (origin.z >> 4) * tree.brick_strides.z),
        strides_(tree.brick_strides) {}
  // By x + 4 y + 16 z; further bits do not count.
  [[nodiscard]] I brick(I place) const {
    const int p = place.v;
    return as_lane(corner_[(p & 3) + (p >> 2 & 3) * strides_.y + (p >> 4 & 3) * strides_.z]);
  }

 private:
  const std::uint32_t* corner_;
  IVec3 strides_;
};
