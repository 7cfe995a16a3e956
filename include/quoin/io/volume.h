#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/volume.h>
#include <quoin/io/sidecar_file.h>

namespace quoin {

struct VolumeOptions {
  /// More values than this are refused; 2^30 take 4 GiB. A few megabytes of gzip can hold that many.
  std::int64_t max_values = std::int64_t{1} << 30;
  /// The files that a header may name for its values.
  SidecarFiles sidecar_files = SidecarFiles::WithinFolder;
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
///          `read_volume` knows where their other half lies); LimitExceeded beyond `max_values`; Cancelled.
/// Memory:  4 bytes a value, and a value must be there before it is paid for: without compression that is at most four
///          times the file's size, with it what 1 byte of gzip can hold, 1,032 values, within `max_values`.
[[nodiscard]] Result<Volume> read_volume(std::span<const std::byte> bytes, const VolumeOptions& options = {},
                                         const Progress& progress = {});

/// The same of a file, also of a NIfTI pair by its .hdr, with the .img or .img.gz beside it. A volume that has no name
/// gets that of the file. Errors: also CannotRead; they name the file.
[[nodiscard]] Result<Volume> read_volume(const std::filesystem::path& path, const VolumeOptions& options = {},
                                         const Progress& progress = {});

/// What a file of values alone holds.
struct RawVolume {
  IVec3 size{0};
  ScalarType type = ScalarType::UInt8;
  std::endian order = std::endian::little;
};

/// Reads what holds nothing but values, i fastest; its axes become (x, z, -y), the spacing is 1.
///
/// Errors: InvalidArgument when a size is not positive; BadFormat when there are not exactly as many bytes as that
///         takes; LimitExceeded.
[[nodiscard]] Result<Volume> read_raw_volume(std::span<const std::byte> bytes, const RawVolume& raw,
                                             const VolumeOptions& options = {}, const Progress& progress = {});
/// The same of a file, whose name the volume gets. Errors: also CannotRead; they name the file.
[[nodiscard]] Result<Volume> read_raw_volume(const std::filesystem::path& path, const RawVolume& raw,
                                             const VolumeOptions& options = {}, const Progress& progress = {});

}  // namespace quoin
