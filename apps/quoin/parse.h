#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include <quoin/core/vec.h>

namespace quoin::tool {

/// The finite number that all of `text` spells, whatever the locale; nothing when it is none.
[[nodiscard]] std::optional<double> parse_number(std::string_view text);

/// The whole number of at least 0 that all of `text` spells.
[[nodiscard]] std::optional<std::uint64_t> parse_unsigned(std::string_view text);

/// "x,y,z": three finite numbers.
[[nodiscard]] std::optional<DVec3> parse_triple(std::string_view text);

/// Width and height of a picture.
struct PictureSize {
  int width = 0;
  int height = 0;
};

/// "1280x720": two positive whole numbers.
[[nodiscard]] std::optional<PictureSize> parse_size(std::string_view text);

/// "4x2x4": three whole numbers.
[[nodiscard]] std::optional<IVec3> parse_box_size(std::string_view text);

}  // namespace quoin::tool
