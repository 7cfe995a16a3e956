#include "io/nifti.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "io/nifti_fields.h"
#include "io/nifti_placement.h"
#include "io/text.h"

namespace quoin::nifti {

namespace {

constexpr std::int32_t kFirstHeader = 348;
constexpr std::int32_t kSecondHeader = 540;
constexpr std::size_t kFirstMagicAt = 344;
constexpr std::size_t kSecondMagicAt = 4;
// Four bytes behind the header say whether extensions follow.
constexpr std::size_t kExtenderBytes = 4;

tl::unexpected<Error> bad(std::string message, std::size_t at) {
  return fail(ErrorCode::BadFormat, std::move(message), {}, at);
}

bool has_text(std::span<const std::byte> bytes, std::size_t at, std::string_view text) {
  return bytes.size() >= at + text.size() &&
         std::string_view(reinterpret_cast<const char*>(bytes.data()) + at, text.size()) == text;
}

bool has_size(std::span<const std::byte> bytes, std::int32_t size, std::endian order) {
  return bytes.size() >= 4 && load<std::int32_t>(bytes.data(), order) == size;
}

/// Whether a magic number has this letter, 'n' for one file or 'i' for a pair: "n+1", "ni1".
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

/// Why a datatype that is no scalar of ours is refused.
tl::unexpected<Error> refuse_type(int datatype, std::size_t at) {
  const char* what = nullptr;
  if (datatype == 1) what = "bits";
  if (datatype == 32 || datatype == 1792 || datatype == 2048) what = "complex numbers";
  if (datatype == 128 || datatype == 2304) what = "colours";
  if (datatype == 1536) what = "128-bit numbers";
  if (what == nullptr) return bad("datatype " + std::to_string(datatype) + " is none of NIfTI's", at);
  return fail(ErrorCode::Unsupported, std::string("the values are ") + what + ", not plain numbers of up to 64 bits",
              {}, at);
}

Status read_type(const Fields& fields, Volume& volume) {
  const int datatype = fields.small(kDatatype);
  const auto type = scalar_type(datatype);
  if (!type) return refuse_type(datatype, fields.offset(kDatatype));
  volume.type = *type;
  const int bits = fields.small(kBitpix);
  if (bits != static_cast<int>(8 * bytes_of(*type))) {
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
    // Some programs leave the dimensions beyond space at 0.
    if (extent < 0 || (extent == 0 && i <= 3)) {
      return bad("dim[" + std::to_string(i) + "] is " + std::to_string(extent), fields.dim_offset(i));
    }
    if (i <= 3) extents[i - 1] = extent;
    has_more |= i > 3 && extent > 1;
  }
  if (has_more) {
    volume.warnings.push_back("it has " + std::to_string(dimensions) + " dimensions; the first volume is taken");
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
  // Farther than any file reaches, and exact in a double.
  constexpr double kMost = 1LL << 50;
  const double said = fields.is_second() ? static_cast<double>(fields.vox_offset_of_second()) : fields.real(kVoxOffset);
  if (!(said >= 0.0 && said <= kMost) || said != std::floor(said)) {
    return bad("vox_offset is " + to_text(static_cast<float>(said)), at);
  }
  header.is_data_elsewhere = is_pair;
  header.data_at = static_cast<std::uint64_t>(said);
  if (header.data_at >= least) return {};
  // Files without an extender exist.
  if (header.data_at == fields.header_bytes()) return {};
  if (header.data_at != 0) return bad("vox_offset is " + std::to_string(header.data_at) + ", within the header", at);
  header.data_at = least;
  header.volume.warnings.push_back("vox_offset is 0; the values are taken from byte " + std::to_string(least));
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
  if (!status) return tl::unexpected<Error>(status.error());
  place(fields, header.volume);
  return header;
}

}  // namespace quoin::nifti
