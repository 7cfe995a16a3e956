#pragma once

#include <optional>
#include <string_view>

#include <quoin/core/vec.h>

namespace quoin::tool {

/// The finite number that all of `text` spells, whatever the locale; nothing when it is none.
[[nodiscard]] std::optional<double> parse_number(std::string_view text);

/// "x,y,z": three such numbers.
[[nodiscard]] std::optional<DVec3> parse_triple(std::string_view text);

/// Width and height of a picture.
struct PictureSize {
  int width = 0;
  int height = 0;
};

/// "1280x720": two positive whole numbers.
[[nodiscard]] std::optional<PictureSize> parse_size(std::string_view text);

}  // namespace quoin::tool
