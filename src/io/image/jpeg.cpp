#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <quoin/io/image_files.h>

#include "io/image/decode.h"
#include "io/whole_file.h"

#ifdef QUOIN_HAVE_JPEG
#include <jpeglib.h>
#endif

namespace quoin {
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
  return make_error(ErrorCode::Unsupported, "cannot write JPEG: Quoin was built without libjpeg");
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
  return make_error(ErrorCode::Unsupported, "cannot read JPEG: Quoin was built without libjpeg");
}

#endif

Result<std::uint64_t> write_jpeg(const Image& image, const std::filesystem::path& path, int quality) {
  return write_whole(path, write_jpeg(image, quality));
}

}  // namespace quoin
