#include <quoin/io/picture_files.h>

#include <quoin/io/file.h>

#include "io/png.h"

namespace quoin {

Result<std::uint64_t> write_png(const Image& picture, const std::filesystem::path& path) {
  const auto width = static_cast<std::uint32_t>(picture.width);
  const auto height = static_cast<std::uint32_t>(picture.height);
  if (picture.width <= 0 || picture.height <= 0 || picture.rgb.size() != std::size_t{3} * width * height) {
    return fail(ErrorCode::InvalidArgument, "the picture's size is not that of its pixels", path.string());
  }
  auto bytes = encode_png({width, height, 3, picture.rgb}, PngEffort::Quick);
  if (!bytes) {
    bytes.error().path = path.string();
    return tl::unexpected<Error>(bytes.error());
  }
  if (auto written = write_file(path, *bytes); !written) return tl::unexpected<Error>(written.error());
  return bytes->size();
}

Result<Image> read_png(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return tl::unexpected<Error>(bytes.error());
  auto decoded = decode_png(*bytes);
  if (!decoded) {
    decoded.error().path = path.string();
    return tl::unexpected<Error>(decoded.error());
  }
  const std::size_t pixels = decoded->pixels.size() / 4;
  Image picture{static_cast<int>(decoded->width), static_cast<int>(decoded->height), {}};
  picture.rgb.resize(3 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    for (std::size_t c = 0; c < 3; ++c) picture.rgb[3 * i + c] = decoded->pixels[4 * i + c];
  }
  return picture;
}

}  // namespace quoin
