#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <glm/mat4x4.hpp>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// How a file stores one value.
enum class ScalarType : std::uint8_t {
  UInt8,
  Int8,
  UInt16,
  Int16,
  UInt32,
  Int32,
  UInt64,
  Int64,
  Float32,
  Float64,
};

/// "uint8", "float64".
[[nodiscard]] std::string_view name_of(ScalarType type);
/// Bytes a value: 1, 2, 4 or 8.
[[nodiscard]] std::size_t size_of(ScalarType type);

/// Samples of a scalar on a regular lattice: a CT scan, a simulation.
struct Volume {
  IVec3 size{0};              ///< samples along i, j and k, the axes in which the file stores them
  std::vector<float> values;  ///< sample (i, j, k) at i + size.x * (j + size.y * k), scaled as the file says
  DVec3 spacing{1.0};         ///< distance of neighbours along i, j and k, in `units`

  /// Where sample (i, j, k) lies in Quoin's axes, in `units`; a rotation, shear and scale with the file's origin.
  ///
  /// The body that was scanned is turned, never mirrored. Many files store it mirrored (from right to left): the
  /// determinant is negative then, and what is meshed in (i, j, k) needs its triangles turned round.
  glm::dmat4 world_from_voxel{1.0};

  float min = 0.0F;  ///< the smallest and largest finite value; both 0 when there is none
  float max = 0.0F;
  std::int64_t nan_count = 0;
  std::int64_t infinite_count = 0;  ///< of either sign, values too large for a float among them

  std::string format;                   ///< "nifti", "nrrd" or "raw"
  ScalarType type = ScalarType::UInt8;  ///< as stored
  std::string units;                    ///< "mm"; empty where the file does not say
  std::string name;
  std::vector<std::string> warnings;  ///< one line each
};

/// How many metres a unit of length has: "m", "cm", "mm", "um" and "nm", also spelt out; nothing for others.
[[nodiscard]] std::optional<double> metres_of_unit(std::string_view unit);

/// A threshold between the two groups into which the finite values part best: the one that leaves the least variance
/// within the groups, by a histogram of 1,024 bins; amid the gap where there is one. The value itself where all are the
/// same.
///
/// Source: N. Otsu, "A Threshold Selection Method from Gray-Level Histograms" (1979).
[[nodiscard]] float volume_threshold(const Volume& volume);

/// The value whose surface a volume is to show: `iso`, or without it volume_threshold.
///
/// Errors: InvalidArgument where there can be none: no value is a number, or none is finite and `iso` is not given. It
///         goes by the counts that the volume has of them.
[[nodiscard]] Result<float> surface_value(const Volume& volume, std::optional<float> iso = {});

struct VolumeFieldOptions {
  float iso = 0.0F;        ///< what has a greater value is solid
  VoxelType material = 1;  ///< of all that is solid
};

/// The density whose surface is where a volume has the value `iso`.
///
/// Space:     sample (i, j, k) is the volume's; beyond the volume is far air, so that what it cuts off is closed there.
/// Density:   (iso - value) / slope within a band of 8, where `slope` is the median steepness of the volume where
///            the surface crosses its edges, so that densities are about distances in samples; where nothing is
///            crossed, the slope is that which takes the volume's range, or 1 where that is 0, to 8. The value `iso`
///            itself is air, at a density of 1/256, so that no triangles of the surface are points.
/// Values:    NaN is air; infinities are far air and deep solid.
/// Order:     the same densities at any thread count.
/// Errors:    InvalidArgument when `iso` is NaN, a size is not positive or there are not as many values as the size
///            says; Cancelled. A volume that never crosses `iso` gives an empty or a solid field.
/// Memory:    2 bytes a sample near the surface or where the volume is within the band, none where it is far from it.
[[nodiscard]] Result<DensityGrid> field_from_volume(const Volume& volume, const VolumeFieldOptions& options = {},
                                                    Threads threads = {}, const Progress& progress = {});

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
  std::array<std::int64_t, 3> size{};  ///< samples along each axis
  /// Bytes from a sample to the next, of any sign; samples need not be aligned. 0, as they are by default, repeats the
  /// same ones: set them, by `strides_of_last_fastest` for one.
  std::array<std::int64_t, 3> strides{};
  DVec3 spacing{1.0};  ///< of neighbours, in the caller's unit; of either sign, not 0
  DVec3 origin{0.0};   ///< where sample (0, 0, 0) lies
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
