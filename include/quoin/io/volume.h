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
#include <quoin/io/file.h>

namespace [[gnu::visibility("default")]] quoin {

struct VolumeOptions {
  /// Maximum number of values; 2^30 values take 4 GiB. A few megabytes of gzip can hold that many.
  std::int64_t max_values = std::int64_t{1} << 30;
  /// The files that a header may name for its values.
  SidecarFiles sidecar_files = SidecarFiles::WithinFolder;
};

/// Reads a volume: NIfTI-1, NIfTI-2 or NRRD, also inside gzip, detected by content.
///
/// Sources: nifti1.h and nifti2.h of the NIfTI Data Format Working Group; "Definition of NRRD File Format" (Teem); RFC
///          1952 for gzip.
/// Axes:    the body's left, back and head point towards Quoin's +X, -Z and +Y, so that the body faces the front view.
///          The file's (x, y, z) become (-x, z, y) for right, front, head (NIfTI, NRRD's RAS) and (x, z, -y) for NRRD's
///          LPS. Axes without an anatomical meaning become (x, z, -y), like those of .vox. NRRD's left-handed spaces
///          LAS and 3D-left-handed become (x, z, y).
/// NIfTI:   uses the sform if sform_code is positive, else the qform if qform_code is positive, else only the spacing.
///          Values are scaled by scl_slope and scl_inter unless the slope is 0 or not finite.
/// NRRD:    the encodings raw, gzip, bzip2, ascii and hex; `space directions` and `space origin`, else `spacings`. A
///          header without values (.nhdr) needs the overload for paths.
/// Values:  NaN and infinities are kept, counted and reported in a warning. From more than three dimensions, only the
///          first volume is read, with a warning.
/// Errors:  BadFormat with the byte offset, which counts decompressed bytes if the message says so; Unsupported for
///          colours, complex and 128-bit numbers, other NRRD encodings, NRRD headers without values, and NIfTI pairs
///          (use the overload for paths); LimitExceeded beyond `max_values`; Cancelled.
/// Memory:  4 bytes per value, allocated only for values present in the file: at most four times the size of an
///          uncompressed file, and 1,032 values per byte of gzip, within `max_values`.
[[nodiscard]] Result<Volume> read_volume(std::span<const std::byte> bytes, const VolumeOptions& options = {},
                                         const Progress& progress = {});

/// Reads a volume from a file, a NIfTI pair from its .hdr with the .img or .img.gz next to it, or an .nhdr with its
/// data file. A volume without a name gets the file's name. Errors: also CannotRead; errors name the file.
[[nodiscard]] Result<Volume> read_volume(const std::filesystem::path& path, const VolumeOptions& options = {},
                                         const Progress& progress = {});
/// Reads a volume from a file that is open, as for its path.
[[nodiscard]] Result<Volume> read_volume(const InputFile& file, const VolumeOptions& options = {},
                                         const Progress& progress = {});

/// The layout of a file of raw values.
struct RawVolume {
  IVec3 size{0};
  ScalarType type = ScalarType::UInt8;
  std::endian order = std::endian::little;
};

/// Reads raw values, with i varying fastest. The axes become (x, z, -y) and the spacing is 1.
///
/// Errors: InvalidArgument if a size is not positive; BadFormat if the number of bytes does not match exactly;
///         LimitExceeded.
[[nodiscard]] Result<Volume> read_raw_volume(std::span<const std::byte> bytes, const RawVolume& raw,
                                             const VolumeOptions& options = {}, const Progress& progress = {});
/// Reads raw values from a file; the volume gets the file's name. Errors: also CannotRead; errors name the file.
[[nodiscard]] Result<Volume> read_raw_volume(const std::filesystem::path& path, const RawVolume& raw,
                                             const VolumeOptions& options = {}, const Progress& progress = {});

}  // namespace quoin
