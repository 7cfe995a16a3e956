#pragma once

#include <cstdint>
#include <vector>

namespace quoin {

/// A picture as files hold it: 8-bit sRGB, rows from the top, pixels from the left, channels interleaved.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;  ///< 3 * width * height
};

/// A picture with alpha: 8-bit sRGB and linear coverage, not multiplied by it; as Image else.
struct AlphaImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba;  ///< 4 * width * height
};

/// One float a pixel, rows from the top, pixels from the left; pictures have their depth so.
struct FloatImage {
  int width = 0;
  int height = 0;
  std::vector<float> values;  ///< width * height
};

/// Linear light, three floats a pixel, rows from the top, pixels from the left, channels interleaved.
struct RadianceImage {
  int width = 0;
  int height = 0;
  std::vector<float> rgb;  ///< 3 * width * height
};

}  // namespace quoin
