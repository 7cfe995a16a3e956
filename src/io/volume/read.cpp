#include <quoin/core/assert.h>
#include <quoin/io/volume.h>

#include <algorithm>
#include <optional>

#include <quoin/io/formats.h>
#include <quoin/scene/volume_scene.h>

#include "core/bytes/text.h"
#include "io/format_driver.h"
#include "io/volume/header.h"
#include "io/whole_file.h"

namespace quoin {

namespace {

/// The decompressed beginning of a file, and its compression.
struct Beginning {
  std::vector<std::byte> bytes;
  Compression compression = Compression::None;
};

Result<Beginning> beginning_of(std::span<const std::byte> bytes) {
  auto first = first_bytes(bytes, std::max(nifti::kMaxHeaderBytes, nrrd::kMaxHeaderBytes));
  // Damage farther on is reported when the values are read. The bytes before it may still contain the header.
  if (!first) first = first_bytes(bytes, nifti::kMaxHeaderBytes);
  if (!first) return first.error();
  return Beginning{std::move(*first), begins_gzip(bytes) ? Compression::Gzip : Compression::None};
}

Result<VolumeHeader> header_of(const Beginning& beginning, const VolumeOptions& options) {
  auto header = nifti::is_header(beginning.bytes) ? nifti::read_header(beginning.bytes, options)
                : nrrd::is_header(beginning.bytes)
                    ? nrrd::read_header(beginning.bytes, options)
                    : make_error(ErrorCode::BadFormat, "neither a NIfTI nor a NRRD file");
  if (!header && header.error().byte_offset && beginning.compression != Compression::None) {
    header.error().message += " (counted after decompression)";
  }
  return header;
}

Status skip(ByteStream& stream, std::uint64_t count, std::uint64_t byte_offset) {
  const auto skipped = stream.skip(count);
  if (!skipped) return skipped.error();
  if (*skipped == count) return {};
  return make_error(ErrorCode::BadFormat,
                    "the values begin at byte " + std::to_string(count) + ", but there are " + std::to_string(*skipped),
                    {}, byte_offset);
}

/// Reads one more byte, so that a checksum at the end is verified.
Status check_end(ByteStream& stream) {
  if (!stream.is_compressed()) return {};
  const auto skipped = stream.skip(1);
  if (!skipped) return skipped.error();
  return {};
}

Result<Volume> read_stream(ByteStream& stream, std::uint64_t skipped, VolumeHeader& header) {
  if (auto status = skip(stream, skipped, stream.position()); !status) return status.error();
  const std::size_t begin = stream.position();
  if (auto status = read_values(stream, header, begin); !status) return status.error();
  if (auto status = check_end(stream); !status) return status.error();
  return std::move(header.volume);
}

/// Skips to values that are at the end of the file.
Result<Volume> read_from_end(std::span<const std::byte> bytes, VolumeHeader& header) {
  const std::uint64_t taken = bytes_of_values(header);
  QUOIN_ASSERT(header.data_at <= bytes.size(), "values that begin in the file");
  const std::uint64_t room = bytes.size() - header.data_at;
  ByteStream stream(bytes, 0, Compression::None);
  return read_stream(stream, header.data_at + (room > taken ? room - taken : 0), header);
}

Result<Volume> read_data(std::span<const std::byte> bytes, Compression compression, VolumeHeader& header) {
  if (header.data_encoding == DataEncoding::Raw) {
    if (header.is_data_at_end && compression == Compression::None) return read_from_end(bytes, header);
    ByteStream stream(bytes, 0, compression);
    return read_stream(stream, header.data_at + header.skip, header);
  }
  const auto begin = static_cast<std::size_t>(header.data_at);
  if (header.data_encoding != DataEncoding::Gzip) {
    const auto raw = nrrd::decode_values(bytes, begin, header);
    if (!raw) return raw.error();
    ByteStream stream(*raw, 0, Compression::None);
    const std::uint64_t skipped = header.data_encoding == DataEncoding::Bzip2 ? header.skip : 0;
    auto volume = read_stream(stream, skipped, header);
    if (!volume) volume.error().byte_offset = begin;
    return volume;
  }
  if (!begins_gzip(bytes.subspan(begin))) {
    return make_error(ErrorCode::BadFormat, "the encoding is gzip, but the data is not gzip", {}, begin);
  }
  ByteStream stream(bytes, begin, Compression::Gzip);
  return read_stream(stream, header.skip, header);
}

Status check_combination(const VolumeHeader& header, Compression compression) {
  if (compression == Compression::None) return {};
  if (header.data_encoding == DataEncoding::Raw && !header.is_data_at_end) return {};
  return make_error(ErrorCode::Unsupported, "a gzip-compressed NRRD must store its data raw and from the start");
}

std::filesystem::path image_beside(const std::filesystem::path& header_path) {
  std::filesystem::path stem = header_path;
  if (stem.extension() == ".gz") stem.replace_extension();
  std::filesystem::path image = stem.replace_extension(".img");
  std::error_code ignored;
  if (std::filesystem::exists(image, ignored)) return image;
  std::filesystem::path compressed = image;
  compressed += ".gz";
  return std::filesystem::exists(compressed, ignored) ? compressed : image;
}

/// Returns the file with the values of a header. Requires: they are in another file.
Result<std::filesystem::path> data_file_of(const std::filesystem::path& header_path, const VolumeHeader& header,
                                           const VolumeOptions& options) {
  QUOIN_ASSERT(header.is_data_elsewhere, "values in another file");
  const std::string name = header.data_file.empty() ? image_beside(header_path).filename().string() : header.data_file;
  return sidecar_path(header_path, name, options.sidecar_files);
}

Status skip_lines(std::span<const std::byte> bytes, VolumeHeader& header) {
  for (; header.lines_to_skip > 0; --header.lines_to_skip) {
    const auto first = bytes.begin() + static_cast<std::ptrdiff_t>(header.data_at);
    const auto end = std::find(first, bytes.end(), std::byte{'\n'});
    if (end == bytes.end()) {
      return make_error(ErrorCode::BadFormat, "the lines to skip are too long", {}, header.data_at);
    }
    header.data_at = static_cast<std::uint64_t>(end - bytes.begin()) + 1;
  }
  return {};
}

Result<Volume> read_pair(const std::filesystem::path& header_path, const VolumeOptions& options, VolumeHeader& header) {
  const auto path = data_file_of(header_path, header, options);
  if (!path) return path.error();
  const auto bytes = read_file(*path);
  if (!bytes) return bytes.error();
  const auto read = [&]() -> Result<Volume> {
    if (auto done = skip_lines(*bytes, header); !done) return done.error();
    const bool is_nifti = header.data_file.empty();
    return read_data(*bytes, is_nifti && begins_gzip(*bytes) ? Compression::Gzip : Compression::None, header);
  };
  auto volume = read();
  if (!volume) volume.error().path = path->string();
  return volume;
}

/// `path` is empty if it is unknown.
Result<Volume> decode(std::span<const std::byte> bytes, const std::filesystem::path& path, const VolumeOptions& options,
                      const Progress& progress) {
  const auto beginning = beginning_of(bytes);
  if (!beginning) return beginning.error();
  auto header = header_of(*beginning, options);
  if (!header) return header.error();
  header->progress = progress;
  if (auto status = check_combination(*header, beginning->compression); !status) {
    return status.error();
  }
  if (!header->is_data_elsewhere) return read_data(bytes, beginning->compression, *header);
  if (!path.empty()) return read_pair(path, options, *header);
  const std::string name = header->data_file.empty() ? std::string(".img") : printable(header->data_file);
  return make_error(ErrorCode::Unsupported,
                    "the header of a file pair, whose values are in a second file (" + name + ")");
}

std::string name_from(const std::filesystem::path& path) {
  return printable(stem_of_file(path));
}

}  // namespace

Result<Volume> read_volume(std::span<const std::byte> bytes, const VolumeOptions& options, const Progress& progress) {
  return decode(bytes, {}, options, progress);
}

Result<Volume> read_volume(const std::filesystem::path& path, const VolumeOptions& options, const Progress& progress) {
  return read_whole(path, [&](std::span<const std::byte> bytes) {
    auto volume = decode(bytes, path, options, progress);
    if (volume && volume->name.empty()) volume->name = name_from(path);
    return volume;
  });
}

std::vector<std::filesystem::path> files_of_pair(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  const auto beginning = bytes ? beginning_of(*bytes) : Result<Beginning>(bytes.error());
  if (!beginning) return {};
  const auto header = header_of(*beginning, {});
  if (!header || !header->is_data_elsewhere) return {};
  const auto data = data_file_of(path, *header, {});
  return data ? std::vector{*data} : std::vector<std::filesystem::path>();
}

Result<Volume> read_raw_volume(std::span<const std::byte> bytes, const RawVolume& raw, const VolumeOptions& options,
                               const Progress& progress) {
  if (raw.size.x < 1 || raw.size.y < 1 || raw.size.z < 1) {
    return make_error(ErrorCode::InvalidArgument, "invalid volume size " + text_of_size(raw.size));
  }
  VolumeHeader header;
  header.progress = progress;
  header.order = raw.order;
  header.volume.format = "raw";
  header.volume.type = raw.type;
  header.volume.world_from_voxel = quoin_from_space(VolumeSpace::RightHanded);
  if (auto status = set_size({raw.size.x, raw.size.y, raw.size.z}, options, std::nullopt, header.volume); !status) {
    return status.error();
  }
  ByteStream stream(bytes, 0, Compression::None);
  auto volume = read_stream(stream, 0, header);
  if (volume && stream.remaining() > 0) {
    return make_error(
        ErrorCode::BadFormat,
        "the values end here, but " + std::to_string(stream.remaining()) + " bytes follow; check the size", {},
        stream.position());
  }
  return volume;
}

Result<Volume> read_raw_volume(const std::filesystem::path& path, const RawVolume& raw, const VolumeOptions& options,
                               const Progress& progress) {
  return read_whole(path, [&](std::span<const std::byte> bytes) {
    auto volume = read_raw_volume(bytes, raw, options, progress);
    if (volume) volume->name = name_from(path);
    return volume;
  });
}

Result<LoadedScene> read_volume_scene(const FormatInput& input) {
  const Progress reading = part_of(input.progress, 0.0, 0.5);
  VolumeOptions allowed;
  allowed.sidecar_files = input.options.sidecar_files;
  const auto read = [&](const auto& source) {
    return input.options.raw ? read_raw_volume(source, *input.options.raw, allowed, reading)
                             : read_volume(source, allowed, reading);
  };
  const auto volume = input.path.empty() ? read(input.bytes) : read(input.path);
  if (!volume) return volume.error();
  const auto iso = surface_value(*volume, input.options.iso);
  if (!iso) return iso.error();
  VolumeSceneOptions wanted;
  wanted.iso = *iso;
  auto scene = scene_from_volume(*volume, wanted, input.threads, part_of(input.progress, 0.5, 1.0));
  if (!scene) return scene.error();
  LoadedScene loaded;
  loaded.scene = std::move(*scene);
  loaded.format = volume->format;
  loaded.warnings = volume->warnings;
  return loaded;
}

}  // namespace quoin
