#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <glm/matrix.hpp>
#include <quoin/core/assert.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "io/format_driver.h"
#include "io/volume/volume_file.h"
#include "io/whole_file.h"

#ifdef QUOIN_HAVE_BZIP2
#include <bzlib.h>
#endif

namespace quoin::nrrd {

// Encodings other than raw bytes: http://teem.sourceforge.net/nrrd/format.html#encoding.
namespace {

Error bad(std::string message, std::size_t at) {
  return make_error(ErrorCode::BadFormat, std::move(message), {}, at);
}

/// Returns a text, shortened for a message, in quotation marks.
std::string shortened(std::string_view text) {
  constexpr std::size_t kMost = 40;
  // Appended piece by piece: GCC 12 warns of operator+ here.
  std::string shown = "\"";
  return shown.append(printable(text.substr(0, kMost))).append("\"");
}

template <class T>
void append(T value, std::endian order, std::vector<std::byte>& out) {
  std::array<std::byte, sizeof(T)> raw{};
  std::memcpy(raw.data(), &value, sizeof(T));
  if (order != std::endian::native) std::ranges::reverse(raw);
  out.insert(out.end(), raw.begin(), raw.end());
}

/// Appends a number of a text. Returns false for a word that is not a number, or out of the type's range.
template <class T>
bool append_number(std::string_view word, std::endian order, std::vector<std::byte>& out) {
  if (word.starts_with('+')) word.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || word.empty()) return false;
  append(value, order, out);
  return true;
}

using Append = bool (*)(std::string_view, std::endian, std::vector<std::byte>&);

Append appender(ScalarType type) {
  switch (type) {
    case ScalarType::UInt8:
      return append_number<std::uint8_t>;
    case ScalarType::Int8:
      return append_number<std::int8_t>;
    case ScalarType::UInt16:
      return append_number<std::uint16_t>;
    case ScalarType::Int16:
      return append_number<std::int16_t>;
    case ScalarType::UInt32:
      return append_number<std::uint32_t>;
    case ScalarType::Int32:
      return append_number<std::int32_t>;
    case ScalarType::UInt64:
      return append_number<std::uint64_t>;
    case ScalarType::Int64:
      return append_number<std::int64_t>;
    case ScalarType::Float32:
      return append_number<float>;
    case ScalarType::Float64:
      return append_number<double>;
  }
  return nullptr;
}

/// Reads numbers separated by blanks or commas.
Result<std::vector<std::byte>> decode_ascii(std::string_view text, std::size_t begin, const VolumeHeader& header) {
  constexpr std::string_view kBetween = " \t\r\n,";
  const Append append_one = appender(header.volume.type);
  QUOIN_ASSERT(append_one != nullptr && begin <= text.size(), "a known type, and values in the file");
  const std::uint64_t wanted = bytes_of_values(header);
  std::vector<std::byte> out;
  for (std::size_t at = text.find_first_not_of(kBetween, begin); at != std::string_view::npos && out.size() < wanted;) {
    const std::size_t end = std::min(text.find_first_of(kBetween, at), text.size());
    const std::string_view word = text.substr(at, end - at);
    if (!append_one(word, header.order, out)) {
      return bad(shortened(word).append(" is not a value of type ").append(name_of(header.volume.type)), at);
    }
    at = text.find_first_not_of(kBetween, end);
  }
  return out;
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// Reads two digits per byte; blanks may be anywhere.
Result<std::vector<std::byte>> decode_hex(std::string_view text, std::size_t begin, const VolumeHeader& header) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::uint64_t wanted = bytes_of_values(header);
  std::vector<std::byte> out;
  int high = -1;
  for (std::size_t at = begin; at < text.size() && out.size() < wanted; ++at) {
    if (kBlanks.find(text[at]) != std::string_view::npos) continue;
    const int digit = hex_digit(text[at]);
    if (digit < 0) return bad(shortened(text.substr(at, 1)).append(" is not a hexadecimal digit"), at);
    if (high >= 0) out.push_back(static_cast<std::byte>(high << 4 | digit));
    high = high >= 0 ? -1 : digit;
  }
  return out;
}

#ifdef QUOIN_HAVE_BZIP2

/// Ends a bzip2 stream at the end of its scope.
struct Decompressor {
  bz_stream state{};
  Decompressor() {
    if (BZ2_bzDecompressInit(&state, 0, 0) != BZ_OK) throw std::bad_alloc();
  }
  ~Decompressor() { BZ2_bzDecompressEnd(&state); }
  Decompressor(const Decompressor&) = delete;
  Decompressor& operator=(const Decompressor&) = delete;
};

Result<std::vector<std::byte>> decode_bzip2(std::span<const std::byte> bytes, std::size_t begin,
                                            const VolumeHeader& header) {
  constexpr std::size_t kMaxAtOnce = std::size_t{1} << 30;
  const std::uint64_t wanted = header.skip + bytes_of_values(header);
  Decompressor decompressor;
  bz_stream& state = decompressor.state;
  std::vector<std::byte> out;
  std::size_t at = begin;
  for (int outcome = BZ_OK; out.size() < wanted && outcome != BZ_STREAM_END;) {
    constexpr std::size_t kStep = std::size_t{1} << 18;
    const std::size_t filled = out.size();
    out.resize(filled + static_cast<std::size_t>(std::min<std::uint64_t>(wanted - filled, std::max(kStep, filled))));
    const std::size_t offered = std::min(bytes.size() - at, kMaxAtOnce);
    const std::size_t room = std::min(out.size() - filled, kMaxAtOnce);
    // bzip2 only reads through this pointer.
    state.next_in = const_cast<char*>(reinterpret_cast<const char*>(bytes.data() + at));  // NOLINT
    state.avail_in = static_cast<unsigned>(offered);
    state.next_out = reinterpret_cast<char*>(out.data() + filled);
    state.avail_out = static_cast<unsigned>(room);
    outcome = BZ2_bzDecompress(&state);
    const std::size_t written = room - state.avail_out;
    const std::size_t taken = offered - state.avail_in;
    out.resize(filled + written);
    at += taken;
    QUOIN_ASSERT(written <= room && at <= bytes.size(), "no more than was offered");
    if (outcome != BZ_OK && outcome != BZ_STREAM_END) return bad("the compressed data is damaged", at);
    if (outcome == BZ_OK && written == 0 && taken == 0) return bad("the compressed data is cut off", at);
  }
  return out;
}

#else

Result<std::vector<std::byte>> decode_bzip2(std::span<const std::byte>, std::size_t begin, const VolumeHeader&) {
  return make_error(ErrorCode::Unsupported, "cannot read bzip2: Quoin was built without it (Debian: libbz2-dev)", {},
                    begin);
}

#endif

}  // namespace

Result<std::vector<std::byte>> decode_values(std::span<const std::byte> bytes, std::size_t begin,
                                             const VolumeHeader& header) {
  QUOIN_ASSERT(begin <= bytes.size(), "the values begin in the file");
  if (header.data_encoding == DataEncoding::Bzip2) return decode_bzip2(bytes, begin, header);
  const std::uint64_t skipped = begin + header.skip;
  if (skipped > bytes.size()) {
    return bad(
        "the values begin at byte " + std::to_string(skipped) + ", but the file has " + std::to_string(bytes.size()),
        begin);
  }
  const std::string_view text = text_of(bytes);
  return header.data_encoding == DataEncoding::Ascii ? decode_ascii(text, static_cast<std::size_t>(skipped), header)
                                                     : decode_hex(text, static_cast<std::size_t>(skipped), header);
}

namespace {

/// The text after a field's colon, and its offset in the file.
struct Field {
  std::string_view text;
  std::size_t at = 0;
};

/// The fields of a header by lower-case names without blanks ("spacedirections"), which view `bytes`.
struct Fields {
  std::map<std::string, Field, std::less<>> all;
  std::size_t end = 0;   ///< end of the empty line after the header
  bool has_end = false;  ///< true if there is such a line

  /// Returns null if the header has no such field.
  [[nodiscard]] const Field* find(std::string_view name) const;
};

constexpr std::string_view kBlanks = " \t\r";

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

std::string key_of(std::string_view text) {
  std::string key;
  for (const char c : text) {
    if (kBlanks.find(c) == std::string_view::npos) key += lower(c);
  }
  return key;
}

/// Returns `text`, shortened for a message, on one line in quotation marks.
std::string quoted(std::string_view text) {
  constexpr std::size_t kMost = 40;
  // Appended piece by piece: GCC 12 gives a false warning about operator+ here.
  std::string shown = "\"";
  shown.append(printable(text.substr(0, kMost)));
  if (text.size() > kMost) shown.append("...");
  return shown.append("\"");
}

/// Returns `text` without leading and trailing blanks.
std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

Status add_line(std::string_view line, std::size_t at, Fields& fields) {
  QUOIN_ASSERT(!line.empty(), "a line with text");
  if (line.front() == '#') return {};
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos || colon + 1 == line.size()) {
    return bad("the line " + quoted(line) + " is not a NRRD header field", at);
  }
  if (line[colon + 1] == '=') return {};
  const Field field{trimmed(line.substr(colon + 1)), at};
  if (fields.all.emplace(key_of(line.substr(0, colon)), field).second) return {};
  return bad("the field " + quoted(line.substr(0, colon)) + " is a duplicate", at);
}

const Field* Fields::find(std::string_view name) const {
  const auto found = all.find(name);
  return found == all.end() ? nullptr : &found->second;
}

/// Splits a header into its fields; skips comments and key/value pairs.
/// Errors: BadFormat for other lines and for duplicate fields.
Result<Fields> split_header(std::string_view bytes) {
  Fields fields;
  // The first line is the magic number.
  std::size_t at = bytes.find('\n');
  while (at != std::string_view::npos && at + 1 < bytes.size()) {
    const std::size_t begin = at + 1;
    at = bytes.find('\n', begin);
    std::string_view line = bytes.substr(begin, at == std::string_view::npos ? at : at - begin);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty()) {
      fields.has_end = at != std::string_view::npos;
      fields.end = fields.has_end ? at + 1 : bytes.size();
      return fields;
    }
    if (auto status = add_line(line, begin, fields); !status) return status.error();
  }
  fields.end = bytes.size();
  return fields;
}

/// Returns the words between blanks.
std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  for (std::size_t at = text.find_first_not_of(kBlanks); at != std::string_view::npos;) {
    const std::size_t end = text.find_first_of(kBlanks, at);
    words.push_back(text.substr(at, end == std::string_view::npos ? end : end - at));
    at = end == std::string_view::npos ? end : text.find_first_not_of(kBlanks, end);
  }
  return words;
}

/// Returns `text` in lower case with one blank between words.
std::string normalised(std::string_view text) {
  std::string words;
  for (const std::string_view word : words_of(text)) {
    if (!words.empty()) words += ' ';
    for (const char c : word) words += lower(c);
  }
  return words;
}

/// Parses a finite number, "nan" or an infinity in any case; nullopt for other text.
std::optional<double> parse_number(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Parses a list of vectors like "(1,0,0) none (0,0,2.5)": the numbers of each vector, none for "none". Returns nullopt
/// for other text.
std::optional<std::vector<std::vector<double>>> parse_vectors(std::string_view text) {
  std::vector<std::vector<double>> vectors;
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    if (text.starts_with("none")) {
      vectors.emplace_back();
      text.remove_prefix(4);
      continue;
    }
    const std::size_t close = text.find(')');
    if (text.front() != '(' || close == std::string_view::npos) return std::nullopt;
    std::string_view inner = text.substr(1, close - 1);
    std::vector<double>& vector = vectors.emplace_back();
    while (true) {
      const std::size_t comma = inner.find(',');
      const auto number = parse_number(trimmed(inner.substr(0, comma)));
      if (!number) return std::nullopt;
      vector.push_back(*number);
      if (comma == std::string_view::npos) break;
      inner.remove_prefix(comma + 1);
    }
    text.remove_prefix(close + 1);
  }
  return vectors;
}

Error bad(std::string message, const Field& field) {
  return make_error(ErrorCode::BadFormat, std::move(message), {}, field.at);
}

Error unsupported(std::string message, const Field& field) {
  return make_error(ErrorCode::Unsupported, std::move(message), {}, field.at);
}

Result<VolumeSpace> space_of(const Fields& fields) {
  if (const Field* dimension = fields.find("spacedimension"); dimension != nullptr && dimension->text != "3") {
    return unsupported("the space has " + printable(dimension->text) + " dimensions; only 3 are read", *dimension);
  }
  const Field* field = fields.find("space");
  if (field == nullptr) return VolumeSpace::RightHanded;
  const std::string space = normalised(field->text);
  if (space == "right-anterior-superior" || space == "ras") return VolumeSpace::RightFrontHead;
  if (space == "left-anterior-superior" || space == "las") return VolumeSpace::LeftFrontHead;
  if (space == "left-posterior-superior" || space == "lps") return VolumeSpace::LeftBackHead;
  if (space == "scanner-xyz" || space == "3d-right-handed") return VolumeSpace::RightHanded;
  if (space == "3d-left-handed") return VolumeSpace::LeftHanded;
  return unsupported("the space is \"" + printable(field->text) + "\", which is not a known space of 3 dimensions",
                     *field);
}

/// Returns true for kinds of spatial axes.
bool is_spatial(std::string_view kind) {
  const std::string name = normalised(kind);
  return name == "domain" || name == "space" || name == "???" || name == "none";
}

/// The axes of a file: their number, and the first spatial one.
struct Axes {
  std::size_t count = 0;
  std::size_t first = 0;  ///< 1: axis 1 counts components of a value, or slices in time
};

/// In some files, components of a value or slices in time come before the spatial axes.
Result<Axes> read_axes(const Fields& fields, std::size_t dimensions) {
  Axes axes{dimensions, 0};
  const Field* const directions = fields.find("spacedirections");
  if (directions != nullptr && dimensions > 3 && directions->text.starts_with("none")) axes.first = 1;
  const Field* field = fields.find("kinds");
  if (field == nullptr) return axes;
  const auto kinds = words_of(field->text);
  if (dimensions > 3 && !kinds.empty() && !is_spatial(kinds[0])) axes.first = 1;
  for (std::size_t axis = axes.first; axis < kinds.size() && axis < axes.first + 3; ++axis) {
    if (!is_spatial(kinds[axis])) {
      return unsupported("axis " + std::to_string(axis + 1) + " is of kind \"" + printable(kinds[axis]) +
                             "\"; the three spatial axes must come first, or after one other axis",
                         *field);
    }
  }
  return axes;
}

bool is_vector(const std::vector<double>& numbers) {
  return numbers.size() == 3 && is_finite({numbers[0], numbers[1], numbers[2]});
}

Status read_directions(const Field& field, const Axes& axes, glm::dmat4& space_from_voxel) {
  const auto vectors = parse_vectors(field.text);
  if (!vectors || vectors->size() != axes.count) {
    return bad("the space directions are not " + std::to_string(axes.count) + " vectors", field);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t place = axes.first + static_cast<std::size_t>(axis);
    QUOIN_ASSERT(place < vectors->size(), "three axes from the first spatial one");
    const std::vector<double>& v = (*vectors)[place];
    if (v.empty()) {
      return unsupported("axis " + std::to_string(place + 1) +
                             " has no direction; the three spatial axes must come first, or after one other axis",
                         field);
    }
    if (!is_vector(v)) return bad("a space direction is not a vector of 3 finite numbers", field);
    space_from_voxel[axis] = glm::dvec4(v[0], v[1], v[2], 0.0);
  }
  const glm::dmat3 turn(space_from_voxel);
  const double box = glm::length(turn[0]) * glm::length(turn[1]) * glm::length(turn[2]);
  constexpr double kFlattest = 1e-6;
  if (std::isfinite(box) && std::abs(glm::determinant(turn)) > kFlattest * box) return {};
  return bad("the space directions are linearly dependent", field);
}

Status read_origin(const Fields& fields, glm::dmat4& space_from_voxel) {
  const Field* field = fields.find("spaceorigin");
  if (field == nullptr) return {};
  const auto vectors = parse_vectors(field->text);
  if (!vectors || vectors->size() != 1 || !is_vector(vectors->front())) {
    return bad("the space origin is not a vector of 3 finite numbers", *field);
  }
  const std::vector<double>& v = vectors->front();
  space_from_voxel[3] = glm::dvec4(v[0], v[1], v[2], 1.0);
  return {};
}

Status read_spacings(const Field& field, const Axes& axes, Volume& volume) {
  const auto words = words_of(field.text);
  if (words.size() != axes.count) {
    return bad("the spacings are not " + std::to_string(axes.count) + " numbers", field);
  }
  bool is_amiss = false;
  bool is_turned = false;
  for (int axis = 0; axis < 3; ++axis) {
    const auto number = parse_number(words[axes.first + static_cast<std::size_t>(axis)]);
    if (!number) return bad("the spacings are not " + std::to_string(axes.count) + " numbers", field);
    const double spacing = std::abs(*number);
    const bool is_good = is_distance(spacing);
    volume.spacing[axis] = is_good ? spacing : 1.0;
    is_amiss |= !is_good;
    is_turned |= is_good && *number < 0.0;
  }
  if (is_turned) volume.warnings.emplace_back("a spacing is negative; its absolute value is used");
  if (is_amiss) volume.warnings.emplace_back("a spacing is not a valid distance; 1 is used");
  return {};
}

/// Returns "mm" for "\"mm\" \"mm\" \"mm\"".
std::string units_of(const Fields& fields) {
  const Field* field = fields.find("spaceunits");
  if (field == nullptr) field = fields.find("units");
  if (field == nullptr) return {};
  const std::size_t open = field->text.find('"');
  if (open == std::string_view::npos) return {};
  const std::size_t close = field->text.find('"', open + 1);
  if (close == std::string_view::npos) return {};
  return printable(field->text.substr(open + 1, close - open - 1));
}

Status place(const Fields& fields, const Axes& axes, Volume& volume) {
  const auto space = space_of(fields);
  if (!space) return space.error();
  glm::dmat4 space_from_voxel(1.0);
  if (const Field* directions = fields.find("spacedirections")) {
    if (auto status = read_directions(*directions, axes, space_from_voxel); !status) return status;
    for (int axis = 0; axis < 3; ++axis) volume.spacing[axis] = glm::length(DVec3(space_from_voxel[axis]));
  } else {
    if (const Field* spacings = fields.find("spacings")) {
      if (auto status = read_spacings(*spacings, axes, volume); !status) return status;
    }
    for (int axis = 0; axis < 3; ++axis) space_from_voxel[axis][axis] = volume.spacing[axis];
  }
  if (auto status = read_origin(fields, space_from_voxel); !status) return status;
  volume.world_from_voxel = quoin_from_space(*space) * space_from_voxel;
  volume.units = units_of(fields);
  return {};
}

constexpr std::string_view kMagic = "NRRD000";
constexpr std::int64_t kMaxDimensions = 16;

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

Error unsupported(std::string message, std::size_t at) {
  return make_error(ErrorCode::Unsupported, std::move(message), {}, at);
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
  if (!type) return type.error();
  const auto scalar = scalar_type(type->text);
  if (!scalar && normalised(type->text) == "block")
    return unsupported("the values are blocks, and only numbers are supported", type->at);
  if (!scalar) return bad("unknown type " + quoted(type->text), type->at);
  header.volume.type = *scalar;
  if (size_of(*scalar) == 1) return {};
  const auto endian = required(fields, "endian");
  if (!endian) return endian.error();
  const std::string order = normalised(endian->text);
  if (order != "little" && order != "big") return bad("unknown endian " + quoted(endian->text), endian->at);
  header.order = order == "big" ? std::endian::big : std::endian::little;
  return {};
}

Result<std::size_t> read_dimensions(const Fields& fields) {
  const auto field = required(fields, "dimension");
  if (!field) return field.error();
  const auto dimensions = parse_integer(field->text);
  if (!dimensions || *dimensions < 1 || *dimensions > kMaxDimensions) {
    return bad("invalid dimension " + quoted(field->text), field->at);
  }
  if (*dimensions >= 3) return static_cast<std::size_t>(*dimensions);
  return unsupported("it has " + std::to_string(*dimensions) + " dimensions; a volume has 3", field->at);
}

/// Returns the kind of an axis as named in the file.
std::string kind_of(const Fields& fields, std::size_t axis) {
  const Field* const field = fields.find("kinds");
  const auto kinds = field != nullptr ? words_of(field->text) : std::vector<std::string_view>();
  return axis < kinds.size() ? printable(kinds[axis]) : "none";
}

Status take_components(const Fields& fields, std::int64_t count, std::size_t at, VolumeHeader& header) {
  constexpr std::int64_t kMost = 1 << 20;
  if (count > kMost) return bad("axis 1 has " + std::to_string(count) + " values per voxel", at);
  header.components = static_cast<std::size_t>(count);
  if (count == 1) return {};
  header.volume.warnings.push_back("axis 1 (kind " + kind_of(fields, 0) + ") has " + std::to_string(count) +
                                   " values per voxel; only the first is read");
  return {};
}

Status read_sizes(const Fields& fields, const Axes& axes, const VolumeOptions& options, VolumeHeader& header) {
  const auto field = required(fields, "sizes");
  if (!field) return field.error();
  const auto words = words_of(field->text);
  if (words.size() != axes.count) return bad("the sizes are not " + std::to_string(axes.count) + " numbers", field->at);
  std::array<std::int64_t, 3> extents{};
  bool has_more = false;
  for (std::size_t axis = 0; axis < axes.count; ++axis) {
    const auto extent = parse_integer(words[axis]);
    if (!extent || *extent < 1) return bad("invalid size " + quoted(words[axis]), field->at);
    if (axis < axes.first) {
      if (auto taken = take_components(fields, *extent, field->at, header); !taken) return taken;
    } else if (axis < axes.first + 3) {
      extents[axis - axes.first] = *extent;
    } else {
      has_more |= *extent > 1;
    }
  }
  if (has_more) {
    header.volume.warnings.push_back("it has " + std::to_string(axes.count) + " dimensions; the first volume is read");
  }
  return set_size(extents, options, field->at, header.volume);
}

Status read_encoding(const Fields& fields, VolumeHeader& header) {
  const auto field = required(fields, "encoding");
  if (!field) return field.error();
  const std::string encoding = normalised(field->text);
  using Names = std::pair<std::string_view, DataEncoding>;
  constexpr std::array<Names, 9> kNames = {{{"raw", DataEncoding::Raw},
                                            {"gzip", DataEncoding::Gzip},
                                            {"gz", DataEncoding::Gzip},
                                            {"bzip2", DataEncoding::Bzip2},
                                            {"bz2", DataEncoding::Bzip2},
                                            {"txt", DataEncoding::Ascii},
                                            {"text", DataEncoding::Ascii},
                                            {"ascii", DataEncoding::Ascii},
                                            {"hex", DataEncoding::Hex}}};
  const Names* const end = kNames.data() + kNames.size();
  const Names* const known = std::ranges::find(kNames.data(), end, encoding, &Names::first);
  if (known == end) {
    return unsupported(
        "unsupported encoding " + quoted(field->text) + " (raw, gzip, bzip2, ascii and hex are supported)", field->at);
  }
  header.data_encoding = known->second;
  return {};
}

/// Reads a whole number of at least `least`; 0 if the field is absent.
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
  if (!lines) return lines.error();
  const auto skip = read_count(fields, "byteskip", -1);
  if (!skip) return skip.error();
  std::size_t at = fields.end;
  if (header.is_data_elsewhere) {
    header.lines_to_skip = static_cast<std::uint64_t>(*lines);
    at = 0;
  }
  for (std::int64_t line = 0; line < *lines && !header.is_data_elsewhere; ++line) {
    const std::size_t end = bytes.find('\n', at);
    if (end == std::string_view::npos) return bad("the lines to skip are too long", at);
    at = end + 1;
  }
  header.data_at = at;
  header.is_data_at_end = *skip == -1;
  if (header.is_data_at_end && header.data_encoding != DataEncoding::Raw) {
    return bad("the byte skip is -1, which only raw data may have", fields.find("byteskip")->at);
  }
  header.skip = header.is_data_at_end ? 0 : static_cast<std::uint64_t>(*skip);
  return {};
}

/// The values are in the file itself, or in a file next to it. Files in other folders are not opened.
Status read_data_file(const Fields& fields, VolumeHeader& header) {
  const Field* const file = fields.find("datafile");
  if (file == nullptr) {
    if (!fields.has_end) return bad("the header does not end with an empty line", fields.end);
    return {};
  }
  std::string_view name = file->text;
  if (name.starts_with("./")) name.remove_prefix(2);
  if (name.starts_with("LIST") || name.find('%') != std::string_view::npos) {
    return unsupported("the values are in several files (" + quoted(file->text) + "); only one is supported", file->at);
  }
  const bool is_plain =
      !name.empty() && name != "." && name != ".." && name.find_first_of("/\\:") == std::string_view::npos;
  if (!is_plain) {
    return unsupported(
        "the data file is " + quoted(file->text) + "; it must be in the header's folder and named without a folder",
        file->at);
  }
  header.is_data_elsewhere = true;
  header.data_file = name;
  return {};
}

}  // namespace

bool is_header(std::span<const std::byte> bytes) {
  const std::string_view text = text_of(bytes);
  return text.size() > kMagic.size() && text.starts_with(kMagic) && text[kMagic.size()] >= '0' &&
         text[kMagic.size()] <= '9';
}

Result<VolumeHeader> read_header(std::span<const std::byte> bytes, const VolumeOptions& options) {
  QUOIN_ASSERT(is_header(bytes), "a header begins here");
  const std::string_view text = text_of(bytes.first(std::min(bytes.size(), kMaxHeaderBytes)));
  if (text[kMagic.size()] < '1' || text[kMagic.size()] > '5') {
    return unsupported("NRRD version " + std::string(1, text[kMagic.size()]) + " is not supported (1 to 5 are)", 0);
  }
  const auto fields = split_header(text);
  if (!fields) return fields.error();
  VolumeHeader header;
  header.volume.format = "nrrd";
  if (const Field* content = fields->find("content")) header.volume.name = printable(content->text);
  if (auto status = read_data_file(*fields, header); !status) return status.error();
  const auto dimensions = read_dimensions(*fields);
  if (!dimensions) return dimensions.error();
  const auto axes = read_axes(*fields, *dimensions);
  if (!axes) return axes.error();
  Status status = read_sizes(*fields, *axes, options, header);
  if (status) status = read_type(*fields, header);
  if (status) status = read_encoding(*fields, header);
  if (status) status = read_skips(*fields, text, header);
  if (status) status = place(*fields, *axes, header.volume);
  if (!status) return status.error();
  return header;
}

}  // namespace quoin::nrrd

namespace quoin {

extern constinit const FormatDriver kNrrdFormat = {
    .info = {FileFormat::Nrrd, ".nrrd", "NRRD volumes, also .nhdr with a data file",
             FormatCapability::Read | FormatCapability::Volume, ".nhdr"},
    .detect =
        [](std::span<const std::byte> beginning) {
          const auto first = first_bytes(beginning, nifti::kMaxHeaderBytes);
          return first && nrrd::is_header(*first);
        },
    .source = FormatDriver::Source::File,
    .read = read_volume_scene,
    .sidecar_files = files_of_pair,
};

}  // namespace quoin
