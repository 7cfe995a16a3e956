#include "io/image/image_codecs.h"

#include <cstdlib>

/// Any bytes must give an image of the declared size, or an error of one line.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto image = quoin::read_pfm({reinterpret_cast<const std::byte*>(data), size});
  if (!image) {
    if (quoin::to_string(image.error()).find('\n') != std::string::npos) std::abort();
    return 0;
  }
  const auto pixels = static_cast<std::size_t>(image->width) * static_cast<std::size_t>(image->height);
  if (image->values.size() != pixels || 4 * pixels > size) std::abort();
  return 0;
}
