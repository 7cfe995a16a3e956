#include "io/image/image_codecs.h"

#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>

#include <quoin/io/image_files.h>

#include "core/bytes/bytes.h"
#include "io/whole_file.h"

#ifdef QUOIN_HAVE_JPEG
#include <jpeglib.h>
#endif

#ifdef QUOIN_HAVE_WEBP
#include <webp/decode.h>
#include <webp/encode.h>
#endif

namespace quoin {

Result<AlphaImage> read_alpha_image(std::span<const std::byte> bytes) {
  const std::string_view text = text_of(bytes);
  if (text.starts_with("\x89PNG")) {
    auto decoded = decode_png(bytes);
    if (!decoded) return decoded.error();
    return AlphaImage{static_cast<int>(decoded->width), static_cast<int>(decoded->height), std::move(decoded->pixels)};
  }
  if (text.starts_with("\xFF\xD8\xFF")) return decode_jpeg(bytes);
  if (text.starts_with("RIFF") && text.substr(0, 12).ends_with("WEBP")) return decode_webp(bytes);
  return make_error(ErrorCode::Unsupported, "not a PNG, JPEG or WebP image");
}

Result<AlphaImage> read_alpha_image(const std::filesystem::path& path) {
  return read_whole(path, [](std::span<const std::byte> bytes) { return read_alpha_image(bytes); });
}

namespace {

Status check(const Image& image, int quality) {
  const auto refuse = [](const char* message) { return make_error(ErrorCode::InvalidArgument, message); };
  if (quality < 1 || quality > 100) return refuse("the quality must be 1 to 100");
  const bool fits = image.width > 0 && image.height > 0 &&
                    image.rgb.size() ==
                        std::size_t{3} * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  return fits ? Status() : refuse("the number of pixels is not width x height");
}

#ifdef QUOIN_HAVE_JPEG

// libjpeg's error handler, which must not return.
struct Failure {
  jpeg_error_mgr errors;
  std::jmp_buf back;
};

[[noreturn]] void jump_back(j_common_ptr info) {
  std::longjmp(reinterpret_cast<Failure*>(info->err)->back, 1);
}

void stay_silent(j_common_ptr) {}

// Contains everything that libjpeg may jump out of. Nothing here needs a destructor.
bool encode(const Image& image, int quality, jpeg_compress_struct& info, Failure& failure, unsigned char** bytes,
            unsigned long* size) {
  info.err = jpeg_std_error(&failure.errors);
  failure.errors.error_exit = jump_back;
  failure.errors.output_message = stay_silent;
  if (setjmp(failure.back) != 0) return false;
  jpeg_create_compress(&info);
  jpeg_mem_dest(&info, bytes, size);
  info.image_width = static_cast<JDIMENSION>(image.width);
  info.image_height = static_cast<JDIMENSION>(image.height);
  info.input_components = 3;
  info.in_color_space = JCS_RGB;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, quality, TRUE);
  // Voxels have coloured edges, which halved chroma resolution would blur.
  info.comp_info[0].h_samp_factor = info.comp_info[0].v_samp_factor = 1;
  info.dct_method = JDCT_ISLOW;  // the same bytes on every machine
  jpeg_start_compress(&info, TRUE);
  while (info.next_scanline < info.image_height) {
    const auto at = std::size_t{3} * info.image_width * info.next_scanline;
    auto* row = const_cast<JSAMPLE*>(image.rgb.data() + at);  // NOLINT: it is only read
    jpeg_write_scanlines(&info, &row, 1);
  }
  jpeg_finish_compress(&info);
  return true;
}

#endif

}  // namespace

#ifdef QUOIN_HAVE_JPEG

bool has_jpeg() {
  return true;
}

Result<std::vector<std::byte>> write_jpeg(const Image& image, int quality) {
  if (Status status = check(image, quality); !status) return status.error();
  if (image.width > JPEG_MAX_DIMENSION || image.height > JPEG_MAX_DIMENSION) {
    return make_error(ErrorCode::LimitExceeded, "the image is larger than the 65,500 pixels per side of a JPEG");
  }
  jpeg_compress_struct info{};
  Failure failure{};
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const bool done = encode(image, quality, info, failure, &bytes, &size);
  std::vector<std::byte> out;
  if (done) {
    const auto* const first = reinterpret_cast<const std::byte*>(bytes);
    out.assign(first, first + size);
  }
  jpeg_destroy_compress(&info);
  std::free(bytes);  // NOLINT: libjpeg's malloc
  if (!done) return make_error(ErrorCode::LimitExceeded, "cannot encode the image as JPEG");
  return out;
}

#else

bool has_jpeg() {
  return false;
}

Result<std::vector<std::byte>> write_jpeg(const Image& image, int quality) {
  if (Status status = check(image, quality); !status) return status.error();
  return make_error(ErrorCode::Unsupported, "cannot write JPEG: Quoin was built without libjpeg" QUOIN_IMAGES_OPTION);
}

#endif

#ifdef QUOIN_HAVE_JPEG

namespace {

// Contains everything that libjpeg may jump out of: first the size, then the pixels. Nothing here needs a destructor.
bool read_header(std::span<const std::byte> bytes, jpeg_decompress_struct& info, Failure& failure) {
  info.err = jpeg_std_error(&failure.errors);
  failure.errors.error_exit = jump_back;
  failure.errors.output_message = stay_silent;
  if (setjmp(failure.back) != 0) return false;
  jpeg_create_decompress(&info);
  jpeg_mem_src(&info, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&info, TRUE);
  info.out_color_space = JCS_EXT_RGBA;
  info.dct_method = JDCT_ISLOW;
  return true;
}

bool read_pixels(jpeg_decompress_struct& info, Failure& failure, std::uint8_t* pixels) {
  if (setjmp(failure.back) != 0) return false;
  jpeg_start_decompress(&info);
  while (info.output_scanline < info.output_height) {
    JSAMPROW row = pixels + std::size_t{4} * info.output_scanline * info.output_width;
    jpeg_read_scanlines(&info, &row, 1);
  }
  jpeg_finish_decompress(&info);
  return true;
}

}  // namespace

Result<AlphaImage> decode_jpeg(std::span<const std::byte> bytes) {
  jpeg_decompress_struct info{};
  Failure failure{};
  AlphaImage image;
  bool done = read_header(bytes, info, failure);
  const std::size_t pixels = std::size_t{info.image_width} * info.image_height;
  // A block takes at least half a bit, which limits the number of pixels by the file size.
  const bool is_small = pixels <= kMostImagePixels && pixels / 1024 <= bytes.size();
  if (done && is_small) {
    image = {static_cast<int>(info.image_width), static_cast<int>(info.image_height), {}};
    image.rgba.resize(4 * pixels);
    done = read_pixels(info, failure, image.rgba.data());
  }
  jpeg_destroy_decompress(&info);
  if (!done) return make_error(ErrorCode::BadFormat, "the JPEG cannot be decoded");
  if (!is_small) return make_error(ErrorCode::LimitExceeded, "the JPEG has too many pixels for its file size");
  return image;
}

#else

Result<AlphaImage> decode_jpeg(std::span<const std::byte>) {
  return make_error(ErrorCode::Unsupported, "cannot read JPEG: Quoin was built without libjpeg" QUOIN_IMAGES_OPTION);
}

#endif

Result<std::uint64_t> write_jpeg(const Image& image, const std::filesystem::path& path, int quality) {
  return write_whole(path, write_jpeg(image, quality));
}

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

Result<std::vector<std::byte>> encoded_quickly(const AlphaImage& image) {
  const auto failed = [] { return make_error(ErrorCode::LimitExceeded, "cannot encode the image as WebP"); };
  WebPConfig config;
  WebPPicture frame;
  if (WebPConfigInit(&config) == 0 || WebPPictureInit(&frame) == 0) return failed();
  config.lossless = 1;
  config.exact = 1;
  // These settings gave the smallest maps of all methods and qualities, in a sixtieth of the default's time.
  config.method = 0;
  config.quality = 75.0F;
  frame.use_argb = 1;
  frame.width = image.width;
  frame.height = image.height;
  std::vector<std::byte> out;
  frame.custom_ptr = &out;
  frame.writer = [](const std::uint8_t* bytes, std::size_t size, const WebPPicture* of) {
    auto* const to = static_cast<std::vector<std::byte>*>(of->custom_ptr);
    const auto* const first = reinterpret_cast<const std::byte*>(bytes);
    try {
      to->insert(to->end(), first, first + size);
    } catch (const std::bad_alloc&) {
      return 0;  // the encoder is C
    }
    return 1;
  };
  const bool is_done =
      WebPPictureImportRGBA(&frame, image.rgba.data(), 4 * image.width) != 0 && WebPEncode(&config, &frame) != 0;
  WebPPictureFree(&frame);
  if (!is_done) return failed();
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
  return make_error(ErrorCode::Unsupported, "cannot write WebP: Quoin was built without libwebp" QUOIN_IMAGES_OPTION);
#endif
}

Result<std::vector<std::byte>> write_webp(const AlphaImage& image, WebPEffort effort) {
  if (Status status = check(image.width, image.height, image.rgba.size(), 4); !status) return status.error();
#ifdef QUOIN_HAVE_WEBP
  if (effort == WebPEffort::Quick) return encoded_quickly(image);
  return encoded(image.rgba, image.width, image.height, 4, WebPEncodeLosslessRGBA);
#else
  (void)effort;
  return make_error(ErrorCode::Unsupported, "cannot write WebP: Quoin was built without libwebp" QUOIN_IMAGES_OPTION);
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
  return make_error(ErrorCode::Unsupported, "cannot read WebP: Quoin was built without libwebp" QUOIN_IMAGES_OPTION);
#endif
}

Result<std::uint64_t> write_webp(const Image& image, const std::filesystem::path& path) {
  return write_whole(path, write_webp(image));
}
Result<std::uint64_t> write_webp(const AlphaImage& image, const std::filesystem::path& path, WebPEffort effort) {
  return write_whole(path, write_webp(image, effort));
}

}  // namespace quoin
