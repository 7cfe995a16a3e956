// The samples of an array: values of any type, their signs (solid or air), and their distances from the surface.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

#include <quoin/core/buffer.h>
#include <quoin/core/parallel.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/volume.h>
#include <quoin/mesh/array_surface.h>

#include "core/work/progress_steps.h"
#include "mesh/array/array_kernel.h"
#include "mesh/array/array_lattice.h"

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

// The rows of samples at the corners of a row of cells, (y, z) before both, after in y, in z, in both. Beyond the
// array, the adjacent row is repeated as air at the same distance from the surface.
struct CornerRows {
  const std::byte* rows[4];
  bool is_beyond[4];
  const std::byte* next;  // after in y, in the slice after both; null if there is none
  std::ptrdiff_t stride;
  std::int64_t size;  // samples of a row
};

// Returns the rows of samples around a row of cells.
[[nodiscard]] CornerRows corner_rows(const Lattice& lattice, std::int64_t row, std::int64_t slice);

// The raw values at cells' corners, [x + 2 y + 4 z][cell], and the corners beyond the array.
struct RawCorners {
  alignas(64) std::byte values[8 * kBatch * 8];
  std::uint8_t is_beyond[kBatch];
  bool has_beyond = false;
};

struct CornerReader {
  // Reads the corners of cells of a row into `out`, starting at index `at`.
  void (*read)(const CornerRows& rows, const std::int32_t* cells, std::size_t count, std::size_t at, RawCorners& out);
  // Converts the first `count` corners to densities.
  void (*convert)(const RawCorners& raw, const SolidRule& rule, std::size_t count, CornerBatch& out);
};

[[nodiscard]] CornerReader corner_reader(ScalarType type);

// Writes the limit that kernels compare values with. Returns true if all values are solid; the limit has no effect
// then.
[[nodiscard]] bool write_limit(ScalarType type, const SolidRule& rule, std::byte (&limit)[8]);

// The signs of an array's samples, and the edges that get quads.
class Signs {
 public:
  Signs(const Lattice& lattice, const ArraySurfaceOptions& options);

  [[nodiscard]] const SolidRule& rule() const { return rule_; }
  [[nodiscard]] bool is_open() const { return is_open_; }

  Status find(Threads threads, ProgressSteps& steps);

  // Returns a slice of signs; null beyond the array.
  [[nodiscard]] const std::uint64_t* slice(std::size_t z) const {
    return z < lattice_.slices() ? bits_.data() + z * lattice_.slice_words() : nullptr;
  }
  // Returns the solid corners of a cell, by x + 2 y + 4 z.
  [[nodiscard]] std::uint32_t solid_corners(IVec3 cell) const;

  // The functions of a source for EdgeWindow.
  void within(std::size_t z, std::uint64_t* along_rows, std::uint64_t* between_rows) const;
  void between(std::size_t slice_of_cells, std::uint64_t* out) const;

 private:
  void find_row(std::size_t y, std::size_t z, const std::byte* limit, std::vector<std::byte>& packed);
  void keep_inner(std::uint64_t* rows, std::size_t count, const std::vector<std::uint64_t>& mask) const;

  const Lattice& lattice_;
  SolidRule rule_;
  bool is_open_;
  std::vector<std::uint64_t> along_mask_;  // for an open border
  std::vector<std::uint64_t> sample_mask_;
  Buffer<std::uint64_t> bits_;  // [slice][row][word]
};

}  // namespace quoin::array
