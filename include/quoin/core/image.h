#pragma once

#include <cstdint>
#include <vector>

namespace [[gnu::visibility("default")]] quoin {

/// An 8-bit sRGB image as stored in files. Rows run from the top, pixels from the left; channels are interleaved.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;  ///< 3 * width * height
};

/// An 8-bit sRGB image with linear alpha, not premultiplied. The layout is the same as in Image.
struct AlphaImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba;  ///< 4 * width * height
};

/// An image with one float per pixel, such as a depth buffer. Rows run from the top, pixels from the left.
struct FloatImage {
  int width = 0;
  int height = 0;
  std::vector<float> values;  ///< width * height
};

/// An image of linear light with three floats per pixel. Rows run from the top, pixels from the left; channels are
/// interleaved.
struct RadianceImage {
  int width = 0;
  int height = 0;
  std::vector<float> rgb;  ///< 3 * width * height
};

}  // namespace quoin
