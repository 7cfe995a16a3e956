#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <quoin/core/assert.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/volume.h>

namespace quoin::array {

// An array with its axes in the order of access: axis 0 along rows, 1 from row to row within a slice, 2 from slice to
// slice.
//
// Cell c of an axis spans samples c - 1 and c: cells 0 and n, at its ends, have a sample on one side only. A bit row of
// samples or cells has `words` words, with sample or cell c at bit c. Bits beyond the last are 0.
struct Lattice {
  const std::byte* data = nullptr;  // sample (0, 0, 0) in the access order
  ScalarType type = ScalarType::Float32;
  std::array<std::int64_t, 3> size{};
  std::array<std::ptrdiff_t, 3> stride{};  // bytes; of axis 0 never negative
  std::array<int, 3> view_axis{};          // the view's axis of each axis
  DVec3 origin{0.0};                       // position of sample (0, 0, 0), by the axes here
  DVec3 spacing{1.0};
  bool is_mirrored = false;  // the axes here are left-handed in space
  std::size_t words = 0;

  [[nodiscard]] std::size_t item_bytes() const { return size_of(type); }
  [[nodiscard]] bool has_packed_rows() const {
    return stride[0] == static_cast<std::ptrdiff_t>(item_bytes()) || size[0] == 1;
  }
  [[nodiscard]] const std::byte* row(std::int64_t y, std::int64_t z) const {
    QUOIN_ASSERT(y >= 0 && y < size[1] && z >= 0 && z < size[2], "a row of the array");
    return data + y * stride[1] + z * stride[2];
  }
  [[nodiscard]] std::size_t rows() const { return static_cast<std::size_t>(size[1]); }
  [[nodiscard]] std::size_t slices() const { return static_cast<std::size_t>(size[2]); }
  // The number of words in a slice of samples, and in a slice of cells.
  [[nodiscard]] std::size_t slice_words() const { return rows() * words; }
  [[nodiscard]] std::size_t cell_slice_words() const { return (rows() + 1) * words; }
};

// Returns the access order of an array, or an error.
[[nodiscard]] Result<Lattice> lattice_of(const ArrayView& array);

// Copies a row to contiguous memory.
void pack_row(const Lattice& lattice, std::int64_t y, std::int64_t z, std::byte* to);

// Maps the axes of the access order to the view's axes, in space.
struct Placement {
  double origin[3];  // by walked axis
  double spacing[3];
  int view_axis[3];
  float gradient_scale[3];  // from a gradient per sample to a gradient in space, except for its length
};

[[nodiscard]] inline Placement placement_of(const Lattice& lattice) {
  Placement placement{};
  const DVec3 s = lattice.spacing;
  const double least = std::min({std::abs(s.x), std::abs(s.y), std::abs(s.z)});
  QUOIN_ASSERT(least > 0.0 && std::isfinite(least), "a spacing that is finite and not 0");
  for (int i = 0; i < 3; ++i) {
    placement.origin[i] = lattice.origin[i];
    placement.spacing[i] = s[i];
    placement.view_axis[i] = lattice.view_axis[static_cast<std::size_t>(i)];
    placement.gradient_scale[i] = static_cast<float>(least / s[i]);
  }
  return placement;
}

// Returns a coordinate of a vertex in space. Rounds once; intermediate values are double.
[[gnu::always_inline]] inline float in_space(const Placement& placement, int axis, std::int32_t cell, float fraction) {
  const double sample = (static_cast<double>(cell) - 1.0) + static_cast<double>(fraction);
  return static_cast<float>(placement.origin[axis] + placement.spacing[axis] * sample);
}

}  // namespace quoin::array
