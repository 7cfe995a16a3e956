#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include <quoin/core/vec.h>

namespace quoin::tool {

/// Parses all of `text` as a finite number, independent of the locale. Returns nullopt if it is not one.
[[nodiscard]] std::optional<double> parse_number(std::string_view text);

/// Parses all of `text` as a whole number of at least 0.
[[nodiscard]] std::optional<std::uint64_t> parse_unsigned(std::string_view text);

/// Parses three finite numbers: "x,y,z".
[[nodiscard]] std::optional<DVec3> parse_triple(std::string_view text);

/// Width and height of an image.
struct ImageSize {
  int width = 0;
  int height = 0;
};

/// Parses two positive whole numbers: "1280x720".
[[nodiscard]] std::optional<ImageSize> parse_size(std::string_view text);

/// Parses three whole numbers: "4x2x4".
[[nodiscard]] std::optional<IVec3> parse_box_size(std::string_view text);

}  // namespace quoin::tool
