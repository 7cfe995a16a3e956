#include <quoin/core/assert.h>

#include "io/volume/header.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/bytes/bytes.h"

namespace quoin {

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
