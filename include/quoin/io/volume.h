#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/mat4x4.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>

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
/// 1, 2, 4 or 8.
[[nodiscard]] std::size_t bytes_of(ScalarType type);

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

struct VolumeOptions {
  /// More values than this are refused; 2^30 take 4 GiB. A few megabytes of gzip can hold that many.
  std::int64_t most_values = std::int64_t{1} << 30;
};

/// Reads a volume: NIfTI-1 and -2, NRRD, each of them also within gzip; recognised by content.
///
/// Sources: nifti1.h and nifti2.h of the NIfTI Data Format Working Group; "Definition of NRRD File Format" (Teem);
///          RFC 1952 for gzip.
/// Axes:    the body's left, back and head point towards Quoin's +X, -Z and +Y, so that it faces the front view. The
///          file's (x, y, z) become (-x, z, y) where they mean right, front, head (NIfTI, NRRD's RAS), (x, z, -y) in
///          NRRD's LPS. Axes without such a meaning become (x, z, -y), as those of .vox do; of NRRD's left-handed
///          ones, LAS becomes (x, z, y), and so does 3D-left-handed.
/// NIfTI:   the sform where sform_code is positive, else the qform where qform_code is, else the spacing alone. Values
///          are scaled by scl_slope and scl_inter unless the slope is 0 or no finite number.
/// NRRD:    attached headers, raw or gzip encoding, `space directions` and `space origin`, else `spacings`.
/// Values:  NaN and infinities are kept, counted and warned of. Beyond three dimensions the first volume is taken, with
///          a warning.
/// Errors:  BadFormat with the byte offset, which counts decompressed bytes where the message says so; Unsupported for
///          colours, complex and 128-bit numbers, other NRRD encodings, detached NRRD headers, NIfTI pairs (only
///          `read_volume` knows where their other half lies); LimitExceeded beyond `most_values`.
/// Memory:  4 bytes a value, and a value must be there before it is paid for: without compression that is at most four
///          times the file's size, with it what 1 byte of gzip can hold, 1,032 values, within `most_values`.
[[nodiscard]] Result<Volume> decode_volume(std::span<const std::byte> bytes, const VolumeOptions& options = {});

/// As `decode_volume`, also of a NIfTI pair by its .hdr, with the .img or .img.gz beside it. A volume that has no name
/// gets that of the file. Errors: also CannotRead; `path` is set in all.
[[nodiscard]] Result<Volume> read_volume(const std::filesystem::path& path, const VolumeOptions& options = {});

/// What a file of values alone holds.
struct RawVolume {
  IVec3 size{0};
  ScalarType type = ScalarType::UInt8;
  std::endian order = std::endian::little;
};

/// Reads a file that holds nothing but values, i fastest; its axes become (x, z, -y), the spacing is 1.
///
/// Errors: InvalidArgument when a size is not positive; BadFormat when the file has not exactly as many bytes as that
///         takes; LimitExceeded, CannotRead.
[[nodiscard]] Result<Volume> read_raw_volume(const std::filesystem::path& path, const RawVolume& raw,
                                             const VolumeOptions& options = {});

}  // namespace quoin
