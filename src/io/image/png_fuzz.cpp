#include <quoin/io/image_files.h>

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <span>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

namespace {

/// Gives each complete chunk its checksum. A chunk: length, name, content, checksum.
void repair_checksums(std::span<std::uint8_t> png) {
  constexpr std::size_t kSignature = 8;
  constexpr std::size_t kFrame = 12;
  std::span<std::uint8_t> left = png.subspan(std::min(kSignature, png.size()));
  const auto number_at = [](const std::uint8_t* at) {
    return std::uint32_t{at[0]} << 24 | std::uint32_t{at[1]} << 16 | std::uint32_t{at[2]} << 8 | at[3];
  };
  while (left.size() >= kFrame && number_at(left.data()) <= left.size() - kFrame) {
    const std::size_t content = number_at(left.data());
    const uLong checksum = crc32(0, left.data() + 4, static_cast<uInt>(content + 4));
    for (std::size_t i = 0; i < 4; ++i) left[content + 8 + i] = static_cast<std::uint8_t>(checksum >> (24 - 8 * i));
    left = left.subspan(content + kFrame);
  }
}

}  // namespace

/// Repairs the checksums after most mutations: readers see no content of a chunk with a wrong one.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  const std::size_t mutated = LLVMFuzzerMutate(data, size, most);
  if (seed % 16 != 0) repair_checksums({data, mutated});
  return mutated;
}

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
