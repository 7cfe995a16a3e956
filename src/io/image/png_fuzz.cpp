#include <quoin/io/image_files.h>

#include <cstdlib>

/// Any bytes must give an image of the declared size, or an error of one line.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto image = quoin::read_png({reinterpret_cast<const std::byte*>(data), size});
  if (!image) {
    if (quoin::to_string(image.error()).find('\n') != std::string::npos) std::abort();
    return 0;
  }
  if (image->width <= 0 || image->height <= 0) std::abort();
  if (image->rgb.size() !=
      std::size_t{3} * static_cast<std::size_t>(image->width) * static_cast<std::size_t>(image->height)) {
    std::abort();
  }
  return 0;
}
