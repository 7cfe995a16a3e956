#include <cstddef>

#include <quoin/io/image_files.h>

#include "io/image/decode.h"
#include "io/whole_file.h"

#ifdef QUOIN_HAVE_WEBP
#include <webp/decode.h>
#include <webp/encode.h>
#endif

namespace quoin {
namespace {

Status check(int width, int height, std::size_t bytes, std::size_t channels) {
  if (width <= 0 || height <= 0 ||
      bytes != channels * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    return make_error(ErrorCode::InvalidArgument, "the number of pixels is not width x height");
  }
  constexpr int kMostPixels = 16'383;
  if (width > kMostPixels || height > kMostPixels) {
    return make_error(ErrorCode::LimitExceeded, "the image is larger than the 16,383 pixels per side of a WebP");
  }
  return {};
}

#ifdef QUOIN_HAVE_WEBP
using Encode = std::size_t (*)(const std::uint8_t*, int, int, int, std::uint8_t**);

Result<std::vector<std::byte>> encoded(const std::vector<std::uint8_t>& pixels, int width, int height, int channels,
                                       Encode encode) {
  std::uint8_t* bytes = nullptr;
  const std::size_t size = encode(pixels.data(), width, height, channels * width, &bytes);
  if (size == 0) return make_error(ErrorCode::LimitExceeded, "cannot encode the image as WebP");
  const auto* const first = reinterpret_cast<const std::byte*>(bytes);
  std::vector<std::byte> out(first, first + size);
  WebPFree(bytes);
  return out;
}
#endif

}  // namespace

bool has_webp() {
#ifdef QUOIN_HAVE_WEBP
  return true;
#else
  return false;
#endif
}

Result<std::vector<std::byte>> write_webp(const Image& image) {
  if (Status status = check(image.width, image.height, image.rgb.size(), 3); !status) return status.error();
#ifdef QUOIN_HAVE_WEBP
  return encoded(image.rgb, image.width, image.height, 3, WebPEncodeLosslessRGB);
#else
  return make_error(ErrorCode::Unsupported, "cannot write WebP: Quoin was built without libwebp");
#endif
}

Result<std::vector<std::byte>> write_webp(const AlphaImage& image) {
  if (Status status = check(image.width, image.height, image.rgba.size(), 4); !status) return status.error();
#ifdef QUOIN_HAVE_WEBP
  return encoded(image.rgba, image.width, image.height, 4, WebPEncodeLosslessRGBA);
#else
  return make_error(ErrorCode::Unsupported, "cannot write WebP: Quoin was built without libwebp");
#endif
}

Result<AlphaImage> decode_webp(std::span<const std::byte> bytes) {
#ifdef QUOIN_HAVE_WEBP
  const auto* const data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  AlphaImage image;
  if (WebPGetInfo(data, bytes.size(), &image.width, &image.height) == 0) {
    return make_error(ErrorCode::BadFormat, "the WebP cannot be decoded");
  }
  const std::size_t size =
      std::size_t{4} * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  if (size / 4 > kMostImagePixels) return make_error(ErrorCode::LimitExceeded, "the WebP has more than 2^28 pixels");
  image.rgba.resize(size);
  if (WebPDecodeRGBAInto(data, bytes.size(), image.rgba.data(), size, 4 * image.width) == nullptr) {
    return make_error(ErrorCode::BadFormat, "the WebP cannot be decoded");
  }
  return image;
#else
  (void)bytes;
  return make_error(ErrorCode::Unsupported, "cannot read WebP: Quoin was built without libwebp");
#endif
}

Result<std::uint64_t> write_webp(const Image& image, const std::filesystem::path& path) {
  return write_whole(path, write_webp(image));
}
Result<std::uint64_t> write_webp(const AlphaImage& image, const std::filesystem::path& path) {
  return write_whole(path, write_webp(image));
}

}  // namespace quoin
