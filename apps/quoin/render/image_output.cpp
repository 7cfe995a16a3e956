#include "render/image_output.h"

#include <CLI/CLI.hpp>

#include <quoin/io/image_files.h>

namespace quoin::tool {

bool has_ending(const std::filesystem::path& path, const std::string& ending) {
  return CLI::detail::to_lower(path.extension().string()) == ending;
}

std::string find_image_name_error(const std::filesystem::path& path) {
  if (has_ending(path, ".png")) return "";
  const auto lacks = [&](const char* ending, const char* library) {
    return std::string("cannot write ") + ending + ": this build has no " + library;
  };
  if (has_ending(path, ".jpg")) return has_jpeg() ? "" : lacks(".jpg", "libjpeg");
  if (has_ending(path, ".webp")) return has_webp() ? "" : lacks(".webp", "libwebp");
  if (has_ending(path, ".exr")) return has_exr() ? "" : lacks(".exr", "OpenEXR");
  return "the image name must end in .png, .jpg, .webp or .exr, not \"" + path.string() + "\"";
}

Result<std::uint64_t> write_image_file(const Image& image, const std::filesystem::path& path) {
  if (has_ending(path, ".jpg")) return write_jpeg(image, path);
  return has_ending(path, ".webp") ? write_webp(image, path) : write_png(image, path);
}

Result<std::uint64_t> write_image_file(const AlphaImage& image, const std::filesystem::path& path) {
  return has_ending(path, ".webp") ? write_webp(image, path) : write_png(image, path);
}

}  // namespace quoin::tool
