#include "render/image_output.h"

#include <CLI/CLI.hpp>

#include <quoin/io/image_files.h>

namespace quoin::tool {

bool has_ending(const std::filesystem::path& path, const std::string& ending) {
  return CLI::detail::to_lower(path.extension().string()) == ending;
}

Status check_image_name(const std::filesystem::path& path) {
  if (has_ending(path, ".png")) return {};
  const auto check = [](bool is_supported, const char* ending, const char* library) -> Status {
    if (is_supported) return {};
    return make_error(ErrorCode::Unsupported, std::string("cannot write ") + ending + ": this build has no " + library);
  };
  if (has_ending(path, ".jpg")) return check(has_jpeg(), ".jpg", "libjpeg");
  if (has_ending(path, ".webp")) return check(has_webp(), ".webp", "libwebp");
  if (has_ending(path, ".exr")) return check(has_exr(), ".exr", "OpenEXR");
  return make_error(ErrorCode::InvalidArgument,
                    "the image name must end in .png, .jpg, .webp or .exr, not \"" + path.string() + "\"");
}

Result<std::uint64_t> write_image_file(const Image& image, const std::filesystem::path& path) {
  if (has_ending(path, ".jpg")) return write_jpeg(image, path);
  return has_ending(path, ".webp") ? write_webp(image, path) : write_png(image, path);
}

Result<std::uint64_t> write_image_file(const AlphaImage& image, const std::filesystem::path& path) {
  return has_ending(path, ".webp") ? write_webp(image, path) : write_png(image, path);
}

}  // namespace quoin::tool
