#include <quoin/core/assert.h>

#include "io/volume/header.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/matrix.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "io/byte_order.h"
#include "io/text.h"

namespace quoin::nifti {

namespace {

/// The offsets of a field in the headers of both versions.
struct Place {
  std::uint16_t in_1;
  std::uint16_t in_2;
};

inline constexpr Place kDim{40, 16};           ///< eight int16, int64
inline constexpr Place kDatatype{70, 12};      ///< int16 in both
inline constexpr Place kBitpix{72, 14};        ///< int16 in both
inline constexpr Place kPixdim{76, 104};       ///< eight float, double; the first is qfac
inline constexpr Place kVoxOffset{108, 168};   ///< float, int64
inline constexpr Place kSlope{112, 176};       ///< float, double
inline constexpr Place kIntercept{116, 184};   ///< float, double
inline constexpr Place kUnits{123, 500};       ///< one byte, int32
inline constexpr Place kQformCode{252, 344};   ///< int16, int32
inline constexpr Place kSformCode{254, 348};   ///< int16, int32
inline constexpr Place kQuaternion{256, 352};  ///< b, c, d: float, double
inline constexpr Place kQoffset{268, 376};     ///< three float, double
inline constexpr Place kSrow{280, 400};        ///< three rows of four float, double
inline constexpr Place kIntentName{328, 508};  ///< 16 characters

/// The fields of a header of either version and byte order.
class Fields {
 public:
  /// Requires: `bytes` holds the header of that version.
  Fields(std::span<const std::byte> bytes, bool is_second, std::endian order)
      : bytes_(bytes), is_second_(is_second), order_(order) {}

  [[nodiscard]] bool is_second() const { return is_second_; }
  [[nodiscard]] std::endian order() const { return order_; }
  /// Counted from the beginning of the header.
  [[nodiscard]] std::size_t offset(Place place) const { return is_second_ ? place.in_2 : place.in_1; }
  [[nodiscard]] std::size_t header_bytes() const { return is_second_ ? 540 : 348; }

  [[nodiscard]] std::int64_t dim(std::size_t i) const {
    return is_second_ ? at<std::int64_t>(kDim.in_2 + 8 * i) : at<std::int16_t>(kDim.in_1 + 2 * i);
  }
  [[nodiscard]] std::size_t dim_offset(std::size_t i) const { return offset(kDim) + (is_second_ ? 8 : 2) * i; }
  /// A number that is float in version 1 and double in version 2.
  [[nodiscard]] double real(Place place, std::size_t i = 0) const {
    return is_second_ ? at<double>(place.in_2 + 8 * i) : static_cast<double>(at<float>(place.in_1 + 4 * i));
  }
  /// A number that is int16 in both.
  [[nodiscard]] std::int16_t small(Place place) const { return at<std::int16_t>(offset(place)); }
  /// A number that is int16 in version 1 and int32 in version 2.
  [[nodiscard]] std::int32_t code(Place place) const {
    return is_second_ ? at<std::int32_t>(place.in_2) : at<std::int16_t>(place.in_1);
  }
  [[nodiscard]] std::int64_t vox_offset_of_second() const { return at<std::int64_t>(kVoxOffset.in_2); }
  [[nodiscard]] std::int32_t units() const {
    return is_second_ ? at<std::int32_t>(kUnits.in_2) : at<std::uint8_t>(kUnits.in_1);
  }
  /// Up to the first zero.
  [[nodiscard]] std::string_view intent_name() const {
    const std::string_view text(reinterpret_cast<const char*>(bytes_.data()) + offset(kIntentName), 16);
    return text.substr(0, text.find('\0'));
  }

 private:
  template <class T>
  [[nodiscard]] T at(std::size_t offset) const {
    return load<T>(bytes_.data() + offset, order_);
  }

  std::span<const std::byte> bytes_;
  bool is_second_;
  std::endian order_;
};

bool is_sound(const glm::dmat4& affine) {
  for (int column = 0; column < 4; ++column) {
    if (!is_finite(DVec3(affine[column]))) return false;
  }
  const double volume = std::abs(glm::determinant(glm::dmat3(affine)));
  const double box = glm::length(DVec3(affine[0])) * glm::length(DVec3(affine[1])) * glm::length(DVec3(affine[2]));
  constexpr double kFlattest = 1e-6;
  return std::isfinite(box) && box > 0.0 && volume > kFlattest * box;
}

/// Returns pixdim without the signs that some programs add; 1 for invalid values.
DVec3 spacing_of(const Fields& fields, std::vector<std::string>& warnings) {
  DVec3 spacing(1.0);
  bool is_amiss = false;
  for (int axis = 0; axis < 3; ++axis) {
    const double said = std::abs(fields.real(kPixdim, static_cast<std::size_t>(axis) + 1));
    const bool is_good = is_distance(said);
    if (is_good) spacing[axis] = said;
    // Axes with a single sample need no spacing.
    is_amiss |= !is_good && axis < fields.dim(0);
  }
  if (is_amiss) warnings.emplace_back("pixdim is not a valid distance; 1 is used");
  return spacing;
}

glm::dmat4 sform(const Fields& fields) {
  glm::dmat4 affine(1.0);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      affine[column][row] = fields.real(kSrow, static_cast<std::size_t>(4 * row + column));
    }
  }
  return affine;
}

glm::dmat4 qform(const Fields& fields, DVec3 spacing) {
  const DVec3 turn(fields.real(kQuaternion, 0), fields.real(kQuaternion, 1), fields.real(kQuaternion, 2));
  const double rest = 1.0 - glm::dot(turn, turn);
  // Rounding may make `rest` negative: a half turn.
  const DQuat quaternion = rest > 0.0 ? DQuat(std::sqrt(rest), turn) : DQuat(0.0, glm::normalize(turn));
  const double qfac = fields.real(kPixdim) < 0.0 ? -1.0 : 1.0;
  const glm::dmat3 rotation = glm::mat3_cast(quaternion);
  glm::dmat4 affine(1.0);
  affine[0] = glm::dvec4(rotation[0] * spacing.x, 0.0);
  affine[1] = glm::dvec4(rotation[1] * spacing.y, 0.0);
  affine[2] = glm::dvec4(rotation[2] * (spacing.z * qfac), 0.0);
  affine[3] = glm::dvec4(fields.real(kQoffset, 0), fields.real(kQoffset, 1), fields.real(kQoffset, 2), 1.0);
  return affine;
}

/// Programs that use the qform show the volume mirrored or rotated if the sform differs.
void compare_forms(const glm::dmat4& sform, const glm::dmat4& qform, std::vector<std::string>& warnings) {
  const glm::dmat3 a(sform);
  const glm::dmat3 b(qform);
  if (glm::determinant(a) * glm::determinant(b) < 0.0) {
    warnings.emplace_back("the sform and the qform disagree on left and right; the sform is used");
    return;
  }
  bool is_opposite = false;
  for (int axis = 0; axis < 3; ++axis) is_opposite |= glm::dot(a[axis], b[axis]) < 0.0;
  if (is_opposite) warnings.emplace_back("the sform and the qform orient the axes differently; the sform is used");
}

/// Returns the first of sform and qform that is present and invertible.
std::optional<glm::dmat4> given(const Fields& fields, DVec3 spacing, std::vector<std::string>& warnings) {
  if (fields.code(kSformCode) > 0) {
    const glm::dmat4 affine = sform(fields);
    const glm::dmat4 other = fields.code(kQformCode) > 0 ? qform(fields, spacing) : affine;
    if (is_sound(affine) && is_sound(other)) compare_forms(affine, other, warnings);
    if (is_sound(affine)) return affine;
    warnings.emplace_back("the sform is not invertible and is ignored");
  }
  if (fields.code(kQformCode) > 0) {
    const glm::dmat4 affine = qform(fields, spacing);
    if (is_sound(affine)) return affine;
    warnings.emplace_back("the qform is not invertible and is ignored");
  }
  return std::nullopt;
}

void place(const Fields& fields, Volume& volume) {
  volume.spacing = spacing_of(fields, volume.warnings);
  glm::dmat4 ras_from_voxel(1.0);
  if (const auto affine = given(fields, volume.spacing, volume.warnings)) {
    ras_from_voxel = *affine;
  } else {
    for (int axis = 0; axis < 3; ++axis) ras_from_voxel[axis][axis] = volume.spacing[axis];
  }
  for (int axis = 0; axis < 3; ++axis) {
    const double length = glm::length(DVec3(ras_from_voxel[axis]));
    constexpr double kRounding = 1e-3;
    // The transform takes precedence over pixdim.
    if (std::abs(length - volume.spacing[axis]) > kRounding * length) volume.spacing[axis] = length;
  }
  volume.world_from_voxel = quoin_from_space(VolumeSpace::RightFrontHead) * ras_from_voxel;
}

constexpr std::int32_t kFirstHeader = 348;
constexpr std::int32_t kSecondHeader = 540;
constexpr std::size_t kFirstMagicAt = 344;
constexpr std::size_t kSecondMagicAt = 4;
// Four bytes after the header, which announce extensions.
constexpr std::size_t kExtenderBytes = 4;

Error bad(std::string message, std::size_t at) {
  return make_error(ErrorCode::BadFormat, std::move(message), {}, at);
}

bool has_text(std::span<const std::byte> bytes, std::size_t at, std::string_view text) {
  return bytes.size() >= at + text.size() &&
         std::string_view(reinterpret_cast<const char*>(bytes.data()) + at, text.size()) == text;
}

bool has_size(std::span<const std::byte> bytes, std::int32_t size, std::endian order) {
  return bytes.size() >= 4 && load<std::int32_t>(bytes.data(), order) == size;
}

/// Returns true if a magic number has the letter for one file ('n': "n+1") or for a pair ('i': "ni1").
bool has_magic(std::span<const std::byte> bytes, bool is_second, bool is_pair) {
  if (is_second)
    return has_text(bytes, kSecondMagicAt, is_pair ? std::string_view("ni2\0", 4) : std::string_view("n+2\0", 4));
  return has_text(bytes, kFirstMagicAt, is_pair ? std::string_view("ni1\0", 4) : std::string_view("n+1\0", 4));
}

struct Kind {
  bool is_second = false;
  bool is_pair = false;
  std::endian order = std::endian::little;
};

std::optional<Kind> kind_of(std::span<const std::byte> bytes) {
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    for (const bool is_second : {false, true}) {
      if (!has_size(bytes, is_second ? kSecondHeader : kFirstHeader, order)) continue;
      for (const bool is_pair : {false, true}) {
        if (has_magic(bytes, is_second, is_pair)) return Kind{is_second, is_pair, order};
      }
    }
  }
  return std::nullopt;
}

std::optional<ScalarType> scalar_type(int datatype) {
  switch (datatype) {
    case 2:
      return ScalarType::UInt8;
    case 4:
      return ScalarType::Int16;
    case 8:
      return ScalarType::Int32;
    case 16:
      return ScalarType::Float32;
    case 64:
      return ScalarType::Float64;
    case 256:
      return ScalarType::Int8;
    case 512:
      return ScalarType::UInt16;
    case 768:
      return ScalarType::UInt32;
    case 1024:
      return ScalarType::Int64;
    case 1280:
      return ScalarType::UInt64;
    default:
      return std::nullopt;
  }
}

/// Returns the error for a datatype that is not a supported scalar.
Error refuse_type(int datatype, std::size_t at) {
  const char* what = nullptr;
  if (datatype == 1) what = "bits";
  if (datatype == 32 || datatype == 1792 || datatype == 2048) what = "complex numbers";
  if (datatype == 128 || datatype == 2304) what = "colours";
  if (datatype == 1536) what = "128-bit numbers";
  if (what == nullptr) return bad("datatype " + std::to_string(datatype) + " is not a NIfTI type", at);
  return make_error(ErrorCode::Unsupported,
                    std::string("the values are ") + what + ", and only plain numbers of up to 64 bits are supported",
                    {}, at);
}

Status read_type(const Fields& fields, Volume& volume) {
  const int datatype = fields.small(kDatatype);
  const auto type = scalar_type(datatype);
  if (!type) return refuse_type(datatype, fields.offset(kDatatype));
  volume.type = *type;
  const int bits = fields.small(kBitpix);
  if (bits != static_cast<int>(8 * size_of(*type))) {
    volume.warnings.push_back("bitpix is " + std::to_string(bits) + ", but the values are " +
                              std::string(name_of(*type)));
  }
  return {};
}

Status read_size(const Fields& fields, const VolumeOptions& options, Volume& volume) {
  const std::int64_t dimensions = fields.dim(0);
  if (dimensions < 1 || dimensions > 7) {
    return bad("dim[0] is " + std::to_string(dimensions) + "; it must be 1 to 7", fields.offset(kDim));
  }
  std::array<std::int64_t, 3> extents{1, 1, 1};
  bool has_more = false;
  for (std::size_t i = 1; i <= static_cast<std::size_t>(dimensions); ++i) {
    const std::int64_t extent = fields.dim(i);
    // Some programs set the dimensions beyond space to 0.
    if (extent < 0 || (extent == 0 && i <= 3)) {
      return bad("dim[" + std::to_string(i) + "] is " + std::to_string(extent), fields.dim_offset(i));
    }
    if (i <= 3) extents[i - 1] = extent;
    has_more |= i > 3 && extent > 1;
  }
  if (has_more) {
    volume.warnings.push_back("it has " + std::to_string(dimensions) + " dimensions; the first volume is read");
  }
  return set_size(extents, options, fields.offset(kDim), volume);
}

Status read_scale(const Fields& fields, VolumeHeader& header) {
  const double slope = fields.real(kSlope);
  const double intercept = fields.real(kIntercept);
  if (slope == 0.0) return {};
  if (!std::isfinite(slope)) {
    header.volume.warnings.emplace_back("scl_slope is not a finite number; the values are not scaled");
    return {};
  }
  if (!std::isfinite(intercept)) return bad("scl_inter is not a finite number", fields.offset(kIntercept));
  header.slope = slope;
  header.intercept = intercept;
  return {};
}

Status read_data_place(const Fields& fields, bool is_pair, VolumeHeader& header) {
  const std::size_t at = fields.offset(kVoxOffset);
  const std::uint64_t least = is_pair ? 0 : fields.header_bytes() + kExtenderBytes;
  // Larger than any file, and exact in a double.
  constexpr double kMost = 1LL << 50;
  const double said = fields.is_second() ? static_cast<double>(fields.vox_offset_of_second()) : fields.real(kVoxOffset);
  if (!(said >= 0.0 && said <= kMost) || said != std::floor(said)) {
    return bad("vox_offset is " + to_text(static_cast<float>(said)), at);
  }
  header.is_data_elsewhere = is_pair;
  header.data_at = static_cast<std::uint64_t>(said);
  if (header.data_at >= least) return {};
  // Some files have no extender.
  if (header.data_at == fields.header_bytes()) return {};
  if (header.data_at != 0) return bad("vox_offset is " + std::to_string(header.data_at) + ", within the header", at);
  header.data_at = least;
  // Two statements: GCC 12 gives a false warning about a single concatenation.
  std::string& warning = header.volume.warnings.emplace_back("vox_offset is 0; the values are read from byte ");
  warning += std::to_string(least);
  return {};
}

std::string units_of(const Fields& fields) {
  switch (fields.units() & 7) {
    case 1:
      return "m";
    case 2:
      return "mm";
    case 3:
      return "um";
    default:
      return {};
  }
}

}  // namespace

bool is_header(std::span<const std::byte> bytes) {
  return kind_of(bytes).has_value();
}

Result<VolumeHeader> read_header(std::span<const std::byte> bytes, const VolumeOptions& options) {
  QUOIN_ASSERT(is_header(bytes), "a header begins here");
  const Kind kind = kind_of(bytes).value();
  const Fields fields(bytes, kind.is_second, kind.order);
  if (bytes.size() < fields.header_bytes()) return bad("the header is cut off", bytes.size());
  VolumeHeader header;
  header.order = kind.order;
  header.volume.format = "nifti";
  header.volume.name = printable(fields.intent_name());
  header.volume.units = units_of(fields);
  Status status = read_size(fields, options, header.volume);
  if (status) status = read_type(fields, header.volume);
  if (status) status = read_data_place(fields, kind.is_pair, header);
  if (status) status = read_scale(fields, header);
  if (!status) return status.error();
  place(fields, header.volume);
  return header;
}

}  // namespace quoin::nifti
