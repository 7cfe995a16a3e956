#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <quoin/core/progress.h>
#include <quoin/io/volume.h>

#include "io/byte_stream.h"

namespace quoin {

struct FormatInput;
struct LoadedScene;

/// Encodings of the values of a volume, apart from a compression of the whole file.
enum class DataEncoding : std::uint8_t { Raw, Gzip, Bzip2, Ascii, Hex };

/// The header of a volume: its properties except the values, and the position and format of the stored values.
struct VolumeHeader {
  Progress progress;  ///< progress of reading the values
  Volume volume;
  std::endian order = std::endian::little;
  double slope = 1.0;  ///< value = slope * stored value + intercept
  double intercept = 0.0;

  std::uint64_t data_at = 0;                       ///< offset of the values, or of their encoded form
  DataEncoding data_encoding = DataEncoding::Raw;  ///< encoding of the values
  std::size_t components = 1;                      ///< values per voxel; the first is read
  std::uint64_t lines_to_skip = 0;                 ///< lines to skip in `data_file`, before `skip`
  std::uint64_t skip = 0;                          ///< bytes to skip before the values, after decompression
  bool is_data_at_end = false;                     ///< the values are the file's last bytes, wherever they begin
  bool is_data_elsewhere = false;                  ///< in another file: `data_file`, or the other of a NIfTI pair
  std::string data_file{};                         ///< a plain name: it lies next to the header
};

/// The frames in which files give positions.
enum class VolumeSpace : std::uint8_t { RightFrontHead, LeftFrontHead, LeftBackHead, RightHanded, LeftHanded };

/// Returns the rotation that `read_volume` documents, as a linear map.
[[nodiscard]] glm::dmat4 quoin_from_space(VolumeSpace space);

/// Sets `size` if Quoin supports it.
/// Errors: LimitExceeded. Requires: every extent is positive.
[[nodiscard]] Status set_size(const std::array<std::int64_t, 3>& extents, const VolumeOptions& options,
                              std::optional<std::uint64_t> byte_offset, Volume& volume);

/// Returns true for a valid distance: positive, and neither so small nor so large that products overflow.
[[nodiscard]] inline bool is_distance(double distance) {
  constexpr double kSmallest = 1e-30;
  constexpr double kLargest = 1e30;
  return distance >= kSmallest && distance <= kLargest;
}

/// "64 x 33 x 32".
[[nodiscard]] std::string text_of_size(IVec3 size);

/// Reads the values announced by a header into its volume, with their range and counts; warns of non-finite values.
///
/// Requires: `stream` is at the first value. `offset` is reported in errors about its length.
/// Errors:   BadFormat if there are fewer values than `size` requires.
[[nodiscard]] Status read_values(ByteStream& stream, VolumeHeader& header, std::uint64_t offset);

/// Reads a volume, or raw values if the options ask for them, and makes a field of it.
[[nodiscard]] Result<LoadedScene> read_volume_scene(const FormatInput& input);

/// Returns the number of bytes of a header's values, with all components.
[[nodiscard]] std::uint64_t bytes_of_values(const VolumeHeader& header);

}  // namespace quoin

namespace quoin::nifti {

/// The maximum number of bytes that `read_header` needs.
inline constexpr std::size_t kMaxHeaderBytes = 540;

/// Returns true if a NIfTI-1 or -2 header of either byte order begins here, for a single file or a pair.
[[nodiscard]] bool is_header(std::span<const std::byte> bytes);

/// Reads a header; sources as in read_volume. Requires: is_header(bytes). Offsets in errors count from `bytes`.
[[nodiscard]] Result<VolumeHeader> read_header(std::span<const std::byte> bytes, const VolumeOptions& options);

}  // namespace quoin::nifti

namespace quoin::nrrd {

/// The maximum size of a header; a few dozen lines have some thousand bytes.
inline constexpr std::size_t kMaxHeaderBytes = std::size_t{1} << 16;

/// Returns true if a NRRD header begins here.
[[nodiscard]] bool is_header(std::span<const std::byte> bytes);

/// Reads a header; sources as in read_volume. `bytes` may be the file's first kMaxHeaderBytes.
/// Requires: is_header(bytes). Offsets in errors count from `bytes`.
[[nodiscard]] Result<VolumeHeader> read_header(std::span<const std::byte> bytes, const VolumeOptions& options);

/// Decodes values of other encodings than raw and gzip (ascii, hex, bzip2), from `begin` on, to raw bytes in the
/// header's byte order. For bzip2 it decodes as many bytes as the header needs, including the bytes to skip before
/// them.
/// Memory: the decoded bytes. Requires: begin <= bytes.size().
/// Errors: BadFormat, with the offset; Unsupported for bzip2 in builds without it.
[[nodiscard]] Result<std::vector<std::byte>> decode_values(std::span<const std::byte> bytes, std::size_t begin,
                                                           const VolumeHeader& header);

}  // namespace quoin::nrrd
