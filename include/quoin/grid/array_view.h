#pragma once

#include <array>
#include <cstdint>

#include <quoin/core/vec.h>
#include <quoin/grid/volume.h>

namespace quoin {

/// A caller's dense array of numbers on a regular lattice, as NumPy, ITK and simulations hold them.
///
/// Lifetime: owns nothing; the array must outlive it, unchanged while it is read.
///
/// Sample (i, j, k) is at `data` + i * strides[0] + j * strides[1] + k * strides[2], in the machine's byte order, and
/// lies at `origin` + `spacing` * (i, j, k). The axes 0, 1 and 2 are x, y and z of what is made of it, whichever of
/// them the memory runs along.
struct ArrayView {
  const void* data = nullptr;
  ScalarType type = ScalarType::Float32;
  std::array<std::int64_t, 3> size{};     ///< samples along each axis
  std::array<std::int64_t, 3> strides{};  ///< bytes from a sample to the next, of any sign; 0 repeats the same ones;
                                          ///< samples need not be aligned
  DVec3 spacing{1.0};                     ///< of neighbours, in the caller's unit; of either sign, not 0
  DVec3 origin{0.0};                      ///< where sample (0, 0, 0) lies
};

/// The strides of a packed array whose last axis runs through neighbouring bytes, as C and NumPy lay it out.
[[nodiscard]] inline std::array<std::int64_t, 3> strides_of_last_fastest(const std::array<std::int64_t, 3>& size,
                                                                         ScalarType type) {
  const auto bytes = static_cast<std::int64_t>(size_of(type));
  return {bytes * size[2] * size[1], bytes * size[2], bytes};
}

/// The same where the first axis does, as Fortran, NIfTI and Volume lay it out.
[[nodiscard]] inline std::array<std::int64_t, 3> strides_of_first_fastest(const std::array<std::int64_t, 3>& size,
                                                                          ScalarType type) {
  const auto bytes = static_cast<std::int64_t>(size_of(type));
  return {bytes, bytes * size[0], bytes * size[0] * size[1]};
}

/// A volume's values, with its spacing; its `world_from_voxel` is left to the caller. Lifetime: the volume must outlive
/// the view, unchanged.
[[nodiscard]] inline ArrayView view_of(const Volume& volume) {
  ArrayView view;
  view.data = volume.values.data();
  view.size = {volume.size.x, volume.size.y, volume.size.z};
  view.strides = strides_of_first_fastest(view.size, view.type);
  view.spacing = volume.spacing;
  return view;
}

}  // namespace quoin
