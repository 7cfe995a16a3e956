#pragma once

// Converts values of any type to signs (solid or air) and to distances from the surface.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

namespace quoin::array {

struct SolidRule {
  double iso = 0.0;
  bool is_below = false;  // values below iso are solid
};

// The limit of a comparison: v > value, or v < value.
template <class T>
struct SolidLimit {
  T value{};
  bool takes_all = false;  // every value is solid
};

// Returns the largest T that is not above `x`, including infinities.
template <class T>
T not_above(double x) {
  if constexpr (std::is_same_v<T, double>) {
    return x;
  } else {
    if (x > double{std::numeric_limits<T>::max()}) {
      return std::isinf(x) ? std::numeric_limits<T>::infinity() : std::numeric_limits<T>::max();
    }
    if (x < double{std::numeric_limits<T>::lowest()}) return -std::numeric_limits<T>::infinity();
    const T near = static_cast<T>(x);
    return double{near} > x ? std::nextafter(near, -std::numeric_limits<T>::infinity()) : near;
  }
}

template <class T>
SolidLimit<T> limit_of(const SolidRule& rule) {
  if constexpr (std::is_floating_point_v<T>) {
    return {rule.is_below ? -not_above<T>(-rule.iso) : not_above<T>(rule.iso), false};
  } else {
    const double lowest = static_cast<double>(std::numeric_limits<T>::lowest());
    // One more than the maximum: a power of two, so it is exact.
    const double beyond = std::ldexp(1.0, std::numeric_limits<T>::digits);
    const double whole = rule.is_below ? std::ceil(rule.iso) : std::floor(rule.iso);
    if (whole >= beyond) return {std::numeric_limits<T>::max(), rule.is_below};
    if (whole < lowest) return {std::numeric_limits<T>::lowest(), !rule.is_below};
    return {static_cast<T>(whole), false};
  }
}

// Computes the distance of values from the surface, negative for solid values; NaN stays NaN.
template <class T>
class Densities {
 public:
  explicit Densities(const SolidRule& rule)
      : iso_(rule.iso),
        float_iso_(static_cast<float>(rule.iso)),
        is_below_(rule.is_below),
        is_float_(std::is_same_v<T, float> && static_cast<double>(static_cast<float>(rule.iso)) == rule.iso) {
    if constexpr (kIsLong) {
      const double whole = std::floor(rule.iso);
      is_inside_ = whole >= static_cast<double>(std::numeric_limits<T>::lowest()) &&
                   whole < std::ldexp(1.0, std::numeric_limits<T>::digits);
      if (is_inside_) whole_ = static_cast<T>(whole);
      part_ = rule.iso - whole;
    }
  }

  // Returns true if single precision gives the same bits: a difference of floats, rounded first to double, is rounded
  // correctly.
  [[nodiscard]] bool is_single() const { return is_float_; }
  [[nodiscard]] float iso() const { return float_iso_; }
  [[nodiscard]] bool is_below() const { return is_below_; }

  [[nodiscard]] float operator()(T value) const { return rounded(difference(value)); }
  // Returns the distance before rounding.
  [[nodiscard]] double difference(T value) const {
    double above = 0.0;  // the surface's value minus `value`
    if constexpr (kIsLong) {
      using Unsigned = std::make_unsigned_t<T>;
      const auto distance = [](T more, T less) {
        return static_cast<double>(static_cast<Unsigned>(static_cast<Unsigned>(more) - static_cast<Unsigned>(less)));
      };
      above = !is_inside_      ? iso_ - static_cast<double>(value)
              : value > whole_ ? part_ - distance(value, whole_)
                               : distance(whole_, value) + part_;
    } else {
      above = iso_ - static_cast<double>(value);
    }
    return is_below_ ? -above : above;
  }
  // Solid values stay negative, and 0 has no sign.
  [[nodiscard]] static float rounded(double difference) {
    constexpr float kLeast = std::numeric_limits<float>::min();
    const float density = static_cast<float>(difference);
    return difference < 0.0 ? std::min(density, -kLeast) : density + 0.0F;
  }

 private:
  static constexpr bool kIsLong = std::is_integral_v<T> && sizeof(T) == 8;

  double iso_;
  float float_iso_;
  bool is_below_;
  bool is_float_;
  T whole_{};  // for 64-bit integers: the surface's value in two parts
  double part_ = 0.0;
  bool is_inside_ = false;
};

}  // namespace quoin::array
