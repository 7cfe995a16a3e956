#include "io/nrrd.h"

#include <array>
#include <optional>
#include <string>
#include <utility>

#include "io/nrrd_fields.h"
#include "io/nrrd_placement.h"
#include "io/text.h"

namespace quoin::nrrd {

namespace {

constexpr std::string_view kMagic = "NRRD000";
constexpr std::int64_t kMostDimensions = 16;

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

tl::unexpected<Error> bad(std::string message, std::size_t at) {
  return fail(ErrorCode::BadFormat, std::move(message), {}, at);
}

tl::unexpected<Error> unsupported(std::string message, std::size_t at) {
  return fail(ErrorCode::Unsupported, std::move(message), {}, at);
}

/// The names that the format gives each type.
std::optional<ScalarType> scalar_type(std::string_view name) {
  using Names = std::pair<std::string_view, ScalarType>;
  static constexpr std::array<Names, 10> kNames = {{
      {"|uchar|unsigned char|uint8|uint8_t|", ScalarType::UInt8},
      {"|signed char|int8|int8_t|", ScalarType::Int8},
      {"|ushort|unsigned short|unsigned short int|uint16|uint16_t|", ScalarType::UInt16},
      {"|short|short int|signed short|signed short int|int16|int16_t|", ScalarType::Int16},
      {"|uint|unsigned int|uint32|uint32_t|", ScalarType::UInt32},
      {"|int|signed int|int32|int32_t|", ScalarType::Int32},
      {"|ulonglong|unsigned long long|unsigned long long int|uint64|uint64_t|", ScalarType::UInt64},
      {"|longlong|long long|long long int|signed long long|signed long long int|int64|int64_t|", ScalarType::Int64},
      {"|float|", ScalarType::Float32},
      {"|double|", ScalarType::Float64},
  }};
  std::string wanted = "|";
  wanted.append(normalised(name)).append("|");
  if (wanted.find('|', 1) != wanted.size() - 1) return std::nullopt;
  for (const auto& [names, type] : kNames) {
    if (names.find(wanted) != std::string_view::npos) return type;
  }
  return std::nullopt;
}

Result<Field> required(const Fields& fields, const char* name) {
  if (const Field* field = fields.find(name)) return *field;
  return bad(std::string("the header has no field \"") + name + "\"", fields.end);
}

Status read_type(const Fields& fields, VolumeHeader& header) {
  const auto type = required(fields, "type");
  if (!type) return tl::unexpected<Error>(type.error());
  const auto scalar = scalar_type(type->text);
  if (!scalar && normalised(type->text) == "block") return unsupported("the values are blocks, not numbers", type->at);
  if (!scalar) return bad("the type is " + quoted(type->text), type->at);
  header.volume.type = *scalar;
  if (bytes_of(*scalar) == 1) return {};
  const auto endian = required(fields, "endian");
  if (!endian) return tl::unexpected<Error>(endian.error());
  const std::string order = normalised(endian->text);
  if (order != "little" && order != "big") return bad("the endian is " + quoted(endian->text), endian->at);
  header.order = order == "big" ? std::endian::big : std::endian::little;
  return {};
}

Result<std::size_t> read_dimensions(const Fields& fields) {
  const auto field = required(fields, "dimension");
  if (!field) return tl::unexpected<Error>(field.error());
  const auto dimensions = parse_integer(field->text);
  if (!dimensions || *dimensions < 1 || *dimensions > kMostDimensions) {
    return bad("the dimension is " + quoted(field->text), field->at);
  }
  if (*dimensions >= 3) return static_cast<std::size_t>(*dimensions);
  return unsupported("it has " + std::to_string(*dimensions) + " dimensions; a volume has 3", field->at);
}

Status read_sizes(const Fields& fields, std::size_t dimensions, const VolumeOptions& options, Volume& volume) {
  const auto field = required(fields, "sizes");
  if (!field) return tl::unexpected<Error>(field.error());
  const auto words = words_of(field->text);
  if (words.size() != dimensions) return bad("the sizes are not " + std::to_string(dimensions) + " numbers", field->at);
  std::array<std::int64_t, 3> extents{};
  bool has_more = false;
  for (std::size_t axis = 0; axis < dimensions; ++axis) {
    const auto extent = parse_integer(words[axis]);
    if (!extent || *extent < 1) return bad("a size is " + quoted(words[axis]), field->at);
    if (axis < 3) extents[axis] = *extent;
    has_more |= axis >= 3 && *extent > 1;
  }
  if (has_more) {
    volume.warnings.push_back("it has " + std::to_string(dimensions) + " dimensions; the first volume is taken");
  }
  return set_size(extents, options, field->at, volume);
}

Status read_encoding(const Fields& fields, VolumeHeader& header) {
  const auto field = required(fields, "encoding");
  if (!field) return tl::unexpected<Error>(field.error());
  const std::string encoding = normalised(field->text);
  if (encoding == "raw") return {};
  if (encoding != "gzip" && encoding != "gz") {
    return unsupported("the encoding is " + quoted(field->text) + "; only raw and gzip are read", field->at);
  }
  header.data_compression = Compression::Gzip;
  return {};
}

/// A whole number of at least `least`; 0 when the field is not there.
Result<std::int64_t> read_count(const Fields& fields, const char* name, std::int64_t least) {
  const Field* field = fields.find(name);
  if (field == nullptr) return 0;
  const auto count = parse_integer(field->text);
  constexpr std::int64_t kMost = std::int64_t{1} << 50;
  if (count && *count >= least && *count <= kMost) return *count;
  return bad(std::string("the ") + name + " is " + quoted(field->text), field->at);
}

Status read_skips(const Fields& fields, std::string_view bytes, VolumeHeader& header) {
  const auto lines = read_count(fields, "lineskip", 0);
  if (!lines) return tl::unexpected<Error>(lines.error());
  const auto skip = read_count(fields, "byteskip", -1);
  if (!skip) return tl::unexpected<Error>(skip.error());
  std::size_t at = fields.end;
  for (std::int64_t line = 0; line < *lines; ++line) {
    const std::size_t end = bytes.find('\n', at);
    if (end == std::string_view::npos) return bad("the lines to skip do not end soon enough", at);
    at = end + 1;
  }
  header.data_at = at;
  header.is_data_at_end = *skip == -1;
  if (header.is_data_at_end && header.data_compression != Compression::None) {
    return bad("the byte skip is -1, which only raw data may have", fields.find("byteskip")->at);
  }
  header.skip = header.is_data_at_end ? 0 : static_cast<std::uint64_t>(*skip);
  return {};
}

Status check_attached(const Fields& fields) {
  if (const Field* file = fields.find("datafile")) {
    return unsupported("a detached header, whose values are in a file of their own (" + quoted(file->text) + ")",
                       file->at);
  }
  if (!fields.has_end) return bad("no empty line ends the header", fields.end);
  return {};
}

}  // namespace

bool is_header(std::span<const std::byte> bytes) {
  const std::string_view text = text_of(bytes);
  return text.size() > kMagic.size() && text.starts_with(kMagic) && text[kMagic.size()] >= '0' &&
         text[kMagic.size()] <= '9';
}

Result<VolumeHeader> read_header(std::span<const std::byte> bytes, const VolumeOptions& options) {
  const std::string_view text = text_of(bytes.first(std::min(bytes.size(), kMostHeaderBytes)));
  if (text[kMagic.size()] < '1' || text[kMagic.size()] > '5') {
    return unsupported("a NRRD of version " + std::string(1, text[kMagic.size()]) + "; 1 to 5 are read", 0);
  }
  const auto fields = split_header(text);
  if (!fields) return tl::unexpected<Error>(fields.error());
  VolumeHeader header;
  header.volume.format = "nrrd";
  if (const Field* content = fields->find("content")) header.volume.name = printable(content->text);
  if (auto status = check_attached(*fields); !status) return tl::unexpected<Error>(status.error());
  const auto dimensions = read_dimensions(*fields);
  if (!dimensions) return tl::unexpected<Error>(dimensions.error());
  Status status = read_sizes(*fields, *dimensions, options, header.volume);
  if (status) status = read_type(*fields, header);
  if (status) status = read_encoding(*fields, header);
  if (status) status = read_skips(*fields, text, header);
  if (status) status = place(*fields, *dimensions, header.volume);
  if (!status) return tl::unexpected<Error>(status.error());
  return header;
}

}  // namespace quoin::nrrd
