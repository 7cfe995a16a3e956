#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "io/byte_order.h"

namespace quoin::nifti {

/// Where a field lies in the headers of both versions.
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

}  // namespace quoin::nifti
