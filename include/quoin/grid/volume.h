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

namespace [[gnu::visibility("default")]] quoin {

/// The type in which a file or an array stores its values.
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

/// Returns the name of a type, for example "uint8" or "float64".
[[nodiscard]] std::string_view name_of(ScalarType type);
/// Returns the size of a value in bytes: 1, 2, 4 or 8.
[[nodiscard]] std::size_t size_of(ScalarType type);

/// Scalar samples on a regular lattice: a CT scan or a simulation.
struct Volume {
  IVec3 size{0};              ///< samples along i, j and k, the axes of the file
  std::vector<float> values;  ///< sample (i, j, k) at i + size.x * (j + size.y * k), scaled as the file specifies
  DVec3 spacing{1.0};         ///< distance between samples along i, j and k, in `units`

  /// Transforms sample (i, j, k) to Quoin's axes, in `units`: rotation, shear and scale, with the file's origin.
  ///
  /// The scanned body is rotated, never mirrored. Many files store it mirrored (from right to left). The determinant is
  /// then negative, and a mesh in (i, j, k) needs its triangles flipped.
  glm::dmat4 world_from_voxel{1.0};

  float min = 0.0F;  ///< smallest and largest finite value; both 0 if there is none
  float max = 0.0F;
  std::int64_t nan_count = 0;
  std::int64_t infinite_count = 0;  ///< of either sign, including values too large for a float

  std::string format;                   ///< "nifti", "nrrd" or "raw"
  ScalarType type = ScalarType::UInt8;  ///< as stored
  std::string units;                    ///< "mm"; empty if the file has none
  std::string name;
  std::vector<std::string> warnings;  ///< one line each
};

/// Returns the number of metres per unit of length, or nullopt for an unknown unit. Known units are "m", "cm", "mm",
/// "um" and "nm", also spelt out.
[[nodiscard]] std::optional<double> metres_of_unit(std::string_view unit);

/// Returns the value of the surface to extract: `iso` if given, otherwise the threshold that best separates the finite
/// values into two groups. It has the least variance within the groups, from a histogram of 1,024 bins. If there is a
/// gap between the groups, the threshold lies in its middle. If all values are equal, returns that value.
///
/// Source: N. Otsu, "A Threshold Selection Method from Gray-Level Histograms" (1979).
/// Errors: InvalidArgument if every value is NaN, or if `iso` is not given and no value is finite. Uses the counts
///         stored in the volume.
[[nodiscard]] Result<float> surface_value(const Volume& volume, std::optional<float> iso = {});

struct VolumeFieldOptions {
  float iso = 0.0F;        ///< greater values are solid
  VoxelType material = 1;  ///< of all solid samples
};

/// Converts a volume to a density field whose surface lies at the value `iso`.
///
/// Space:     sample (i, j, k) is the sample of the volume. Outside the volume is far air, so the surface is closed at
///            its boundary.
/// Density:   (iso - value) / slope, within a band of 8. `slope` is the median steepness of the volume at the lattice
///            edges that cross the surface, so densities approximate distances in samples. If no edge crosses, `slope`
///            maps the range of the volume to 8; it is 1 if that range is 0. The value `iso` itself is air with a
///            density of 1/256; this avoids triangles without area.
/// Values:    NaN is air. Infinities are far air and deep solid.
/// Order:     the densities are the same at any thread count.
/// Errors:    InvalidArgument if `iso` is NaN, a size is not positive, or the number of values does not match the size;
///            Cancelled. A volume that never crosses `iso` gives an empty or a solid field.
/// Memory:    2 bytes per sample near the surface or with a density within the band; none far from it.
[[nodiscard]] Result<DensityGrid> field_from_volume(const Volume& volume, const VolumeFieldOptions& options = {},
                                                    Threads threads = {}, const Progress& progress = {});

/// A non-owning view of a dense array of numbers on a regular lattice, as in NumPy, ITK and simulations.
///
/// Lifetime: the array must outlive the view and must not change while it is read.
///
/// Sample (i, j, k) is stored at `data` + i * strides[0] + j * strides[1] + k * strides[2], in native byte order. Its
/// position is `origin` + `spacing` * (i, j, k). Axes 0, 1 and 2 become x, y and z, in any memory order.
struct ArrayView {
  const void* data = nullptr;
  ScalarType type = ScalarType::Float32;
  std::array<std::int64_t, 3> size{};  ///< samples along each axis
  /// Distance between samples in bytes, of either sign. Samples need not be aligned. The default of 0 repeats a single
  /// sample: set the strides, for example with `strides_of_last_fastest`.
  std::array<std::int64_t, 3> strides{};
  DVec3 spacing{1.0};  ///< between samples, in the caller's unit; of either sign, not 0
  DVec3 origin{0.0};   ///< position of sample (0, 0, 0)
};

/// Returns the strides of a packed array in C order: the last axis varies fastest, as in NumPy.
[[nodiscard]] inline std::array<std::int64_t, 3> strides_of_last_fastest(const std::array<std::int64_t, 3>& size,
                                                                         ScalarType type) {
  const auto bytes = static_cast<std::int64_t>(size_of(type));
  return {bytes * size[2] * size[1], bytes * size[2], bytes};
}

/// Returns the strides of a packed array in Fortran order: the first axis varies fastest, as in NIfTI and Volume.
[[nodiscard]] inline std::array<std::int64_t, 3> strides_of_first_fastest(const std::array<std::int64_t, 3>& size,
                                                                          ScalarType type) {
  const auto bytes = static_cast<std::int64_t>(size_of(type));
  return {bytes, bytes * size[0], bytes * size[0] * size[1]};
}

/// Returns a view of a volume's values and spacing, without its `world_from_voxel`. Lifetime: the volume must outlive
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
