#pragma once

#include <zlib.h>

#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include <quoin/io/volume.h>

#include "core/bytes/bytes.h"
#include "io/byte_stream.h"

/// Shared by the tests and the fuzz target of volumes.
namespace quoin::volume_test {

using Bytes = std::vector<std::byte>;

/// The content of most test files: 3 x 2 x 2 samples.
inline const std::vector<double> kTwelve = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
inline const std::vector<float> kTwelveFloats(kTwelve.begin(), kTwelve.end());

/// Returns the world position of a sample.
inline DVec3 position_of(const Volume& volume, DVec3 voxel) {
  return DVec3(volume.world_from_voxel * glm::dvec4(voxel, 1.0));
}

/// Writes a number of either byte order at `at`. Requires: there is room.
template <class T>
void put(Bytes& bytes, std::size_t at, T value, std::endian order = std::endian::little) {
  std::array<std::byte, sizeof(T)> raw{};
  std::memcpy(raw.data(), &value, sizeof(T));
  // Reading in another order than one's own is the swap that writing needs.
  const T swapped = load<T>(raw.data(), order);
  std::memcpy(bytes.data() + at, &swapped, sizeof(T));
}

template <class T>
void append(Bytes& bytes, T value, std::endian order = std::endian::little) {
  bytes.resize(bytes.size() + sizeof(T));
  put(bytes, bytes.size() - sizeof(T), value, order);
}

inline void append_text(Bytes& bytes, std::string_view text) {
  for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
}

/// Numbers of one type in one order, as bytes.
inline Bytes encode(const std::vector<double>& values, ScalarType type, std::endian order = std::endian::little) {
  Bytes bytes;
  for (const double v : values) {
    switch (type) {
      case ScalarType::UInt8:
        append(bytes, static_cast<std::uint8_t>(v), order);
        break;
      case ScalarType::Int8:
        append(bytes, static_cast<std::int8_t>(v), order);
        break;
      case ScalarType::UInt16:
        append(bytes, static_cast<std::uint16_t>(v), order);
        break;
      case ScalarType::Int16:
        append(bytes, static_cast<std::int16_t>(v), order);
        break;
      case ScalarType::UInt32:
        append(bytes, static_cast<std::uint32_t>(v), order);
        break;
      case ScalarType::Int32:
        append(bytes, static_cast<std::int32_t>(v), order);
        break;
      case ScalarType::UInt64:
        append(bytes, static_cast<std::uint64_t>(v), order);
        break;
      case ScalarType::Int64:
        append(bytes, static_cast<std::int64_t>(v), order);
        break;
      case ScalarType::Float32:
        append(bytes, static_cast<float>(v), order);
        break;
      case ScalarType::Float64:
        append(bytes, v, order);
        break;
    }
  }
  return bytes;
}

inline Bytes gzipped(std::span<const std::byte> bytes) {
  return quoin::gzipped(bytes, 9);
}

/// A NIfTI header; its field offsets are repeated here, by the specification.
struct NiftiFile {
  bool is_second = false;
  std::endian order = std::endian::little;
  std::array<std::int64_t, 8> dim{3, 3, 2, 2, 1, 1, 1, 1};
  int datatype = 2;
  int bitpix = 8;
  std::array<double, 8> pixdim{1, 1, 1, 1, 1, 1, 1, 1};
  double vox_offset = -1;  ///< -1: right behind header and extender
  double slope = 0;
  double intercept = 0;
  int units = 2;
  int qform_code = 0;
  int sform_code = 0;
  std::array<double, 6> quaternion{};  ///< b, c, d, and the offset
  std::array<double, 12> srow{};
  std::string magic{};  ///< "n+1" or "n+2" when empty

  [[nodiscard]] Bytes bytes(const Bytes& values) const {
    Bytes out(is_second ? 544 : 352);
    const double begin = vox_offset < 0 ? static_cast<double>(out.size()) : vox_offset;
    if (is_second) {
      fill_second(out, begin);
    } else {
      fill_first(out, begin);
    }
    if (begin > static_cast<double>(out.size()) && begin < 4096) out.resize(static_cast<std::size_t>(begin));
    out.insert(out.end(), values.begin(), values.end());
    return out;
  }

 private:
  void text(Bytes& out, std::size_t at, std::string_view content) const {
    for (const char c : content) out[at++] = static_cast<std::byte>(c);
  }
  void fill_first(Bytes& out, double begin) const {
    put(out, 0, std::int32_t{348}, order);
    for (std::size_t i = 0; i < 8; ++i) {
      put(out, 40 + 2 * i, static_cast<std::int16_t>(dim[i]), order);
      put(out, 76 + 4 * i, static_cast<float>(pixdim[i]), order);
    }
    put(out, 70, static_cast<std::int16_t>(datatype), order);
    put(out, 72, static_cast<std::int16_t>(bitpix), order);
    put(out, 108, static_cast<float>(begin), order);
    put(out, 112, static_cast<float>(slope), order);
    put(out, 116, static_cast<float>(intercept), order);
    out[123] = static_cast<std::byte>(units);
    put(out, 252, static_cast<std::int16_t>(qform_code), order);
    put(out, 254, static_cast<std::int16_t>(sform_code), order);
    for (std::size_t i = 0; i < 6; ++i) put(out, 256 + 4 * i, static_cast<float>(quaternion[i]), order);
    for (std::size_t i = 0; i < 12; ++i) put(out, 280 + 4 * i, static_cast<float>(srow[i]), order);
    text(out, 344, magic.empty() ? "n+1" : magic);
  }
  void fill_second(Bytes& out, double begin) const {
    put(out, 0, std::int32_t{540}, order);
    text(out, 4, magic.empty() ? "n+2" : magic);
    text(out, 8, "\r\n\x1A\n");
    put(out, 12, static_cast<std::int16_t>(datatype), order);
    put(out, 14, static_cast<std::int16_t>(bitpix), order);
    for (std::size_t i = 0; i < 8; ++i) {
      put(out, 16 + 8 * i, dim[i], order);
      put(out, 104 + 8 * i, pixdim[i], order);
    }
    put(out, 168, static_cast<std::int64_t>(begin), order);
    put(out, 176, slope, order);
    put(out, 184, intercept, order);
    put(out, 344, qform_code, order);
    put(out, 348, sform_code, order);
    for (std::size_t i = 0; i < 6; ++i) put(out, 352 + 8 * i, quaternion[i], order);
    for (std::size_t i = 0; i < 12; ++i) put(out, 400 + 8 * i, srow[i], order);
    put(out, 500, units, order);
  }
};

/// The datatype numbers of NIfTI, by ScalarType.
inline constexpr std::array<int, 10> kNiftiTypes = {2, 256, 512, 4, 768, 8, 1280, 1024, 16, 64};

/// Reads arbitrary bytes; returns a fault of the result, or "".
inline std::string wrong_with(std::span<const std::byte> bytes) {
  constexpr std::int64_t kMost = 1 << 20;
  const Result<Volume> volume = read_volume(bytes, {.max_values = kMost});
  if (!volume) {
    const std::string text = to_string(volume.error());
    return text.empty() || text.find('\n') != std::string::npos ? "the error is not one line: " + text : "";
  }
  const std::int64_t count = std::int64_t{volume->size.x} * volume->size.y * volume->size.z;
  if (count < 1 || count > kMost) return "the size is beyond the limit";
  if (static_cast<std::size_t>(count) != volume->values.size()) return "the values are not as many as the size says";
  if (!(volume->min <= volume->max)) return "the range is none";
  std::int64_t nans = 0;
  std::int64_t infinities = 0;
  for (const float value : volume->values) {
    nans += std::isnan(value) ? 1 : 0;
    infinities += std::isinf(value) ? 1 : 0;
    if (std::isfinite(value) && (value < volume->min || value > volume->max)) return "a value is beyond the range";
  }
  if (nans != volume->nan_count || infinities != volume->infinite_count) return "the counts are wrong";
  for (int axis = 0; axis < 3; ++axis) {
    if (!(volume->spacing[axis] > 0.0) || !std::isfinite(volume->spacing[axis])) return "a spacing is no distance";
    if (!is_finite(DVec3(volume->world_from_voxel[axis]))) return "an axis is not finite";
  }
  return is_finite(DVec3(volume->world_from_voxel[3])) ? "" : "the origin is not finite";
}

}  // namespace quoin::volume_test
