#include "io/volume/volume_file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include <quoin/core/assert.h>
#include <quoin/io/formats.h>
#include <quoin/io/volume.h>
#include <quoin/scene/volume_scene.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "io/format_driver.h"
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

#ifdef QUOIN_WITHOUT_VOLUMES

// Only raw volumes are left.
Result<VolumeHeader> header_of(const Beginning&, const VolumeOptions&) {
  return make_error(ErrorCode::Unsupported,
                    "cannot read volumes with headers: Quoin was built with QUOIN_WITH_VOLUMES=OFF");
}

Result<std::vector<std::byte>> decode_values(std::span<const std::byte>, std::size_t, const VolumeHeader&) {
  return make_error(ErrorCode::Unsupported, "cannot read NRRD values: Quoin was built with QUOIN_WITH_VOLUMES=OFF");
}

#else

using nrrd::decode_values;

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

#endif

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
    const auto raw = decode_values(bytes, begin, header);
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
  const auto file = InputFile::open(path);
  return file ? read_volume(*file, options, progress) : Result<Volume>(file.error());
}

Result<Volume> read_volume(const InputFile& file, const VolumeOptions& options, const Progress& progress) {
  return read_whole(file, [&](std::span<const std::byte> bytes) {
    auto volume = decode(bytes, file.path(), options, progress);
    if (volume && volume->name.empty()) volume->name = name_from(file.path());
    return volume;
  });
}

std::vector<std::filesystem::path> files_of_pair(const DetectedFile& file, SidecarFiles allowed) {
  const auto opened = file.open();
  const auto bytes = opened ? opened->read() : Result<std::vector<std::byte>>(opened.error());
  const auto beginning = bytes ? beginning_of(*bytes) : Result<Beginning>(bytes.error());
  if (!beginning) return {};
  const auto header = header_of(*beginning, {});
  if (!header || !header->is_data_elsewhere) return {};
  VolumeOptions options;
  options.sidecar_files = allowed;
  const auto data = data_file_of(file.path, *header, options);
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
  const auto read = [&] {
    if (const auto& raw = input.options.raw) {
      return input.path.empty() ? read_raw_volume(input.bytes, *raw, allowed, reading)
                                : read_raw_volume(input.path, *raw, allowed, reading);
    }
    return input.file == nullptr ? read_volume(input.bytes, allowed, reading)
                                 : read_volume(*input.file, allowed, reading);
  };
  const auto volume = read();
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

namespace {

glm::dmat4 from_columns(DVec3 x, DVec3 y, DVec3 z) {
  return {glm::dvec4(x, 0), glm::dvec4(y, 0), glm::dvec4(z, 0), glm::dvec4(0, 0, 0, 1)};
}

}  // namespace

glm::dmat4 quoin_from_space(VolumeSpace space) {
  switch (space) {
    case VolumeSpace::RightFrontHead:
      return from_columns({-1, 0, 0}, {0, 0, 1}, {0, 1, 0});
    case VolumeSpace::LeftFrontHead:
    case VolumeSpace::LeftHanded:
      return from_columns({1, 0, 0}, {0, 0, 1}, {0, 1, 0});
    case VolumeSpace::LeftBackHead:
    case VolumeSpace::RightHanded:
      break;
  }
  return from_columns({1, 0, 0}, {0, 0, -1}, {0, 1, 0});
}

std::string text_of_size(IVec3 size) {
  return std::to_string(size.x) + " x " + std::to_string(size.y) + " x " + std::to_string(size.z);
}

Status set_size(const std::array<std::int64_t, 3>& extents, const VolumeOptions& options,
                std::optional<std::uint64_t> byte_offset, Volume& volume) {
  QUOIN_ASSERT(std::ranges::all_of(extents, [](std::int64_t extent) { return extent > 0; }), "positive extents");
  std::int64_t room = std::min<std::int64_t>(options.max_values, std::numeric_limits<std::int64_t>::max() / 8);
  std::string text;
  for (const std::int64_t extent : extents) {
    text += (text.empty() ? "" : " x ") + std::to_string(extent);
    // Dividing step by step rounds like one division.
    room = extent > std::numeric_limits<std::int32_t>::max() ? 0 : room / extent;
  }
  if (room < 1) {
    return make_error(
        ErrorCode::LimitExceeded,
        "the header claims " + text + " values, more than the limit of " + std::to_string(options.max_values), {},
        byte_offset);
  }
  for (int axis = 0; axis < 3; ++axis) {
    volume.size[axis] = static_cast<std::int32_t>(extents[static_cast<std::size_t>(axis)]);
  }
  return {};
}

namespace {

// Values decoded at a time; they fit the CPU cache.
constexpr std::size_t kValuesAtOnce = std::size_t{1} << 14;

float to_float(double value) {
  constexpr double kMost = std::numeric_limits<float>::max();
  if (std::abs(value) > kMost)
    return std::copysign(std::numeric_limits<float>::infinity(), static_cast<float>(value > 0 ? 1 : -1));
  return static_cast<float>(value);
}

struct Scale {
  double slope;
  double intercept;
  [[nodiscard]] bool is_identity() const { return slope == 1.0 && intercept == 0.0; }
};

template <class T, std::endian Order>
void decode_in_order(const std::byte* bytes, Scale scale, std::span<float> out) {
  if (!scale.is_identity()) {
    for (float& value : out) {
      value = to_float(static_cast<double>(load<T>(bytes, Order)) * scale.slope + scale.intercept);
      bytes += sizeof(T);
    }
    return;
  }
  for (float& value : out) {
    if constexpr (std::is_same_v<T, double>) {
      value = to_float(load<T>(bytes, Order));
    } else {
      value = static_cast<float>(load<T>(bytes, Order));
    }
    bytes += sizeof(T);
  }
}

template <class T>
void decode_as(const std::byte* bytes, std::endian order, Scale scale, std::span<float> out) {
  if (order == std::endian::little) {
    decode_in_order<T, std::endian::little>(bytes, scale, out);
  } else {
    decode_in_order<T, std::endian::big>(bytes, scale, out);
  }
}

void decode(ScalarType type, const std::byte* bytes, std::endian order, Scale scale, std::span<float> out) {
  switch (type) {
    case ScalarType::UInt8:
      return decode_as<std::uint8_t>(bytes, order, scale, out);
    case ScalarType::Int8:
      return decode_as<std::int8_t>(bytes, order, scale, out);
    case ScalarType::UInt16:
      return decode_as<std::uint16_t>(bytes, order, scale, out);
    case ScalarType::Int16:
      return decode_as<std::int16_t>(bytes, order, scale, out);
    case ScalarType::UInt32:
      return decode_as<std::uint32_t>(bytes, order, scale, out);
    case ScalarType::Int32:
      return decode_as<std::int32_t>(bytes, order, scale, out);
    case ScalarType::UInt64:
      return decode_as<std::uint64_t>(bytes, order, scale, out);
    case ScalarType::Int64:
      return decode_as<std::int64_t>(bytes, order, scale, out);
    case ScalarType::Float32:
      return decode_as<float>(bytes, order, scale, out);
    case ScalarType::Float64:
      return decode_as<double>(bytes, order, scale, out);
  }
}

/// The range of the finite values, and counts of the others.
struct Survey {
  float min = std::numeric_limits<float>::infinity();
  float max = -std::numeric_limits<float>::infinity();
  std::int64_t nans = 0;
  std::int64_t infinities = 0;

  void add(std::span<const float> values) {
    float low = min;
    float high = max;
    bool is_finite = true;
    for (const float value : values) {
      // NaN fails both comparisons.
      is_finite &= std::abs(value) <= std::numeric_limits<float>::max();
      low = value < low ? value : low;
      high = value > high ? value : high;
    }
    if (!is_finite) return add_with_care(values);
    min = low;
    max = high;
  }

  void add_with_care(std::span<const float> values) {
    for (const float value : values) {
      if (std::isnan(value)) {
        ++nans;
      } else if (std::isinf(value)) {
        ++infinities;
      } else {
        min = std::min(min, value);
        max = std::max(max, value);
      }
    }
  }
};

void report(const Survey& survey, Volume& volume) {
  if (survey.min <= survey.max) {
    volume.min = survey.min;
    volume.max = survey.max;
  }
  volume.nan_count = survey.nans;
  volume.infinite_count = survey.infinities;
  const auto warn = [&](std::int64_t count, const char* what) {
    if (count > 0) volume.warnings.push_back(std::string("values that are ") + what + ": " + std::to_string(count));
  };
  warn(survey.nans, "not a number");
  warn(survey.infinities, "infinite or too large for a float");
  if (survey.min > survey.max) volume.warnings.emplace_back("no value is finite");
}

std::string claim(const Volume& volume, std::uint64_t bytes) {
  return text_of_size(volume.size) + " values of " + std::string(name_of(volume.type)) + " take " +
         std::to_string(bytes) + " bytes";
}

}  // namespace

std::uint64_t bytes_of_values(const VolumeHeader& header) {
  const IVec3 size = header.volume.size;
  QUOIN_ASSERT(size.x > 0 && size.y > 0 && size.z > 0 && header.components > 0, "positive sizes");
  return static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y) * static_cast<std::uint64_t>(size.z) *
         size_of(header.volume.type) * header.components;
}

Status read_values(ByteStream& stream, VolumeHeader& header, std::uint64_t offset) {
  Volume& volume = header.volume;
  const auto count = static_cast<std::size_t>(volume.size.x) * static_cast<std::size_t>(volume.size.y) *
                     static_cast<std::size_t>(volume.size.z);
  const std::size_t width = size_of(volume.type);
  const std::size_t stride = width * header.components;
  QUOIN_ASSERT(stride > 0, "at least one byte per voxel");
  const auto cut_off = [&](std::uint64_t held, const char* how) {
    return make_error(ErrorCode::BadFormat,
                      claim(volume, bytes_of_values(header)) + ", but there are " + how + std::to_string(held), {},
                      offset);
  };
  const std::uint64_t most = stream.is_compressed() ? stream.max_bytes() : stream.remaining();
  if (count > most / stride) return cut_off(most, stream.is_compressed() ? "at most " : "");
  const std::size_t at_once = std::max<std::size_t>(kValuesAtOnce / header.components, 1);
  std::vector<std::byte> piece(std::min(count, at_once) * stride);
  // Reserved memory costs nothing until values fill it.
  volume.values.reserve(count);
  Survey survey;
  for (std::size_t done = 0; done < count;) {
    const std::size_t now = std::min(count - done, at_once);
    const auto read = stream.read(std::span(piece).first(now * stride));
    if (!read) return read.error();
    if (*read < now * stride) return cut_off(done * stride + *read, "");
    for (std::size_t i = 1; i < now && stride > width; ++i) {
      std::copy_n(piece.begin() + static_cast<std::ptrdiff_t>(i * stride), width,
                  piece.begin() + static_cast<std::ptrdiff_t>(i * width));
    }
    volume.values.resize(done + now);
    QUOIN_ASSERT(now > 0 && piece.size() >= now * width, "bytes of the values");
    const std::span<float> values = std::span(volume.values).subspan(done, now);
    decode(volume.type, piece.data(), header.order, {header.slope, header.intercept}, values);
    survey.add(values);
    done += now;
    if (header.progress && !header.progress(static_cast<double>(done) / static_cast<double>(count))) {
      return make_error(ErrorCode::Cancelled, "cancelled");
    }
  }
  report(survey, volume);
  return {};
}

}  // namespace quoin
