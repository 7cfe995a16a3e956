// Writes one header, then the samples: i runs along x, j along z, k along y.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <glm/matrix.hpp>

#include <quoin/core/assert.h>

#include "core/bytes/bytes.h"
#include "core/bytes/text.h"
#include "core/work/progress_steps.h"
#include "io/format_driver.h"
#include "io/placed_grids.h"
#include "io/volume/volume_file.h"
#include "io/whole_file.h"

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

namespace quoin {

namespace {

constexpr models::FormatHolds kHolds = {.extension = ".nii", .colours = false, .place_in_units = true};
constexpr int kMaxEdge = 32'767;
constexpr std::int64_t kMaxSamples = std::int64_t{1} << 30;
constexpr std::int16_t kUInt8 = 2;
constexpr std::int16_t kUInt16 = 512;
constexpr std::int16_t kFloat32 = 16;
constexpr std::int16_t kIntentLabel = 1002;
constexpr std::int16_t kScanner = 1;
constexpr std::size_t kLongestName = 15;

/// The content of the file except its samples.
struct Header {
  IBox box{};  ///< box of the samples, in the grid
  glm::dmat4 world_from_grid{1.0};
  std::int16_t datatype = kUInt8;
  int bytes = 1;  ///< bytes per sample
  std::int16_t intent = 0;
  std::string_view description{};
  std::string name{};
};

Status check_size(const IBox& box) {
  const IVec3 size = box.size();
  if (std::max({size.x, size.y, size.z}) <= kMaxEdge &&
      std::int64_t{size.x} * size.y <= kMaxSamples / std::max(size.z, 1))
    return {};
  return make_error(ErrorCode::LimitExceeded, "more than 32,767 samples per side, or 2^30 in total");
}

void write_header(const Header& header, ByteWriter& out) {
  constexpr std::size_t kHeaderBytes = 348;
  constexpr std::size_t kExtenderBytes = 4;
  const IVec3 size = header.box.size();
  QUOIN_ASSERT(std::max({size.x, size.y, size.z}) <= kMaxEdge, "edges of 16 bits");
  // Maps (i, j, k) to samples of the grid, whose axes are (i, k, j).
  glm::dmat4 grid_from_file(0.0);
  grid_from_file[0][0] = grid_from_file[1][2] = grid_from_file[2][1] = 1.0;
  grid_from_file[3] = glm::dvec4(DVec3(header.box.min), 1.0);
  const glm::dmat4 affine =
      glm::inverse(glm::dmat4(quoin_from_space(VolumeSpace::RightFrontHead))) * header.world_from_grid * grid_from_file;
  const auto pad_to = [&](std::size_t at) {
    QUOIN_ASSERT(at >= out.size(), "fields in the order of their places");
    out.leave(at - out.size());
  };
  const auto small = [&](std::int16_t value) { out.u16(static_cast<std::uint16_t>(value)); };
  const auto text = [&](std::string_view value, std::size_t room) {
    QUOIN_ASSERT(room > 0, "room for the zero at the end");
    value = value.substr(0, room - 1);
    out.text(value);
    out.leave(room - value.size());
  };
  out.u32(kHeaderBytes);
  pad_to(40);
  for (const int extent : {3, size.x, size.z, size.y, 1, 1, 1, 1}) small(static_cast<std::int16_t>(extent));
  pad_to(68);
  small(header.intent);
  small(header.datatype);
  small(static_cast<std::int16_t>(8 * header.bytes));
  pad_to(76);
  out.f32(glm::determinant(glm::dmat3(affine)) < 0.0 ? -1.0F : 1.0F);
  for (int axis = 0; axis < 3; ++axis) out.f32(static_cast<float>(glm::length(DVec3(affine[axis]))));
  pad_to(108);
  out.f32(static_cast<float>(kHeaderBytes + kExtenderBytes));
  out.f32(1.0F);  // values are not scaled
  pad_to(148);
  text(header.description, 80);
  pad_to(252);
  small(0);
  small(kScanner);
  pad_to(280);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) out.f32(static_cast<float>(affine[column][row]));
  }
  text(header.name, 16);
  out.text({"n+1\0", 4});
  out.leave(kExtenderBytes);
}

/// Calls `row(first)` for each row of the samples, in the file's order.
template <class Row>
Status for_each_row(const IBox& box, const Progress& progress, Row row) {
  ProgressSteps steps(progress, static_cast<std::size_t>(box.size().y));
  for (int y = box.min.y; y < box.max.y; ++y) {
    for (int z = box.min.z; z < box.max.z; ++z) row(IVec3(box.min.x, y, z));
    steps.step();
    if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  }
  return {};
}

Result<EncodedFile> write_labels(const Scene& scene, const Progress& progress) {
  auto merged = models::merge_grids(scene, kHolds);
  if (!merged) return merged.error();
  if (merged->box.empty())
    return make_error(ErrorCode::Unsupported, "the scene has no voxels, and .nii needs at least one");
  if (auto sound = check_size(merged->box); !sound) return sound.error();
  const std::vector<VoxelType> types = merged->voxels.types();
  const bool is_wide = !types.empty() && *std::ranges::max_element(types) > 0xFF;
  Header header{merged->box};
  const double size = merged->voxel_size;
  for (int axis = 0; axis < 3; ++axis) header.world_from_grid[axis][axis] = size;
  header.world_from_grid[3] = glm::dvec4(DVec3(0.5 * size), 1.0);  // samples are at voxel centres
  header.datatype = is_wide ? kUInt16 : kUInt8;
  header.bytes = is_wide ? 2 : 1;
  header.intent = kIntentLabel;
  header.description = "Quoin: the numbers of voxels' types";
  header.name = models::cut_name(merged->name, kLongestName, merged->warnings);
  ByteWriter out;
  write_header(header, out);
  std::vector<VoxelType> row(static_cast<std::size_t>(merged->box.size().x));
  auto done = for_each_row(merged->box, progress, [&](IVec3 first) {
    models::read_voxels(merged->voxels, first, row);
    for (const VoxelType type : row) {
      QUOIN_ASSERT(is_wide || type <= 0xFF, "a type of one byte");
      if (is_wide) {
        out.u16(type);
      } else {
        out.u8(static_cast<std::uint8_t>(type));
      }
    }
  });
  if (!done) return done.error();
  return EncodedFile{out.take(), std::move(merged->warnings)};
}

Result<EncodedFile> write_densities(const Instance& instance, const SceneGrid& grid, const Progress& progress) {
  IBox box = grid.field.bounds();
  if (box.empty()) return make_error(ErrorCode::Unsupported, "the field is empty, and .nii needs samples");
  const IVec3 around(static_cast<int>(std::ceil(grid.field.band())));
  box = {box.min - around, box.max + around};
  if (auto sound = check_size(box); !sound) return sound.error();
  Header header{box, world_from_grid(instance, grid)};
  header.datatype = kFloat32;
  header.bytes = 4;
  header.description = "Quoin: densities, solid above 0";
  EncodedFile file;
  header.name = models::cut_name(instance.name.empty() ? grid.name : instance.name, kLongestName, file.warnings);
  ByteWriter out;
  write_header(header, out);
  auto done = for_each_row(box, progress, [&](IVec3 first) {
    for (; first.x < box.max.x; ++first.x) out.f32(-grid.field.density(first));
  });
  if (!done) return done.error();
  file.bytes = out.take();
  file.warnings.emplace_back("materials, colours, hidden instances and lamps left out, not supported by .nii");
  file.warnings.push_back("values are densities within " + std::to_string(around.x) +
                          " samples of the surface, without a unit, not the values of the input file");
  return file;
}

/// Writes a NIfTI-1 file, at the scene's position and size in the world. Voxels become their type numbers (8 or 16
/// bits, intent LABEL), 0 for air. A field becomes its negated densities, so that values above 0 are solid (32-bit
/// floats, within its band). read_volume restores the same positions.
Result<EncodedFile> write_nifti(const FormatOutput& output) {
  const Scene& scene = output.scene;
  std::int64_t fields = 0;
  std::int64_t others = 0;
  const Instance* shown = nullptr;
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    const SceneGrid* const grid = scene.grids().find(instance.grid);
    if (grid == nullptr || !has_valid_transform(instance) || !is_shown(scene, instance)) return;
    const bool is_field = grid->field.chunk_count() != 0;
    if (is_field) shown = &instance;
    fields += is_field ? 1 : 0;
    others += grid->grid.chunk_count() != 0 ? 1 : 0;
  });
  if (fields == 0) return write_labels(scene, output.progress);
  if (fields > 1 || others > 0) {
    return make_error(ErrorCode::Unsupported,
                      "several density fields, or a density field and voxels: .nii stores one volume");
  }
  return write_densities(*shown, scene.grids()[shown->grid], output.progress);
}

}  // namespace

extern constinit const FormatDriver kNiftiFormat = {
    .info = {FileFormat::Nifti, ".nii", "NIfTI-1 and -2 volumes, also .nii.gz",
             FormatCapability::Read | FormatCapability::Write | FormatCapability::Volume},
    .detect =
        [](std::span<const std::byte> beginning) {
          const auto first = first_bytes(beginning, nifti::kMaxHeaderBytes);
          return first && nifti::is_header(*first);
        },
    .source = FormatDriver::Source::File,
    .read = read_volume_scene,
    .sidecar_files = files_of_pair,
    .encode = write_nifti,
};

}  // namespace quoin
