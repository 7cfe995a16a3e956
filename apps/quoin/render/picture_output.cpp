#include "render/picture_output.h"

#include <CLI/CLI.hpp>

#include <quoin/io/picture_files.h>

namespace quoin::tool {

bool has_ending(const std::filesystem::path& path, const std::string& ending) {
  return CLI::detail::to_lower(path.extension().string()) == ending;
}

std::string fault_of_picture_name(const std::filesystem::path& path) {
  if (has_ending(path, ".png")) return "";
  const auto lacks = [&](const char* ending, const char* library) {
    return std::string("cannot write ") + ending + ": this build has no " + library;
  };
  if (has_ending(path, ".jpg")) return has_jpeg() ? "" : lacks(".jpg", "libjpeg");
  if (has_ending(path, ".webp")) return has_webp() ? "" : lacks(".webp", "libwebp");
  if (has_ending(path, ".exr")) return has_exr() ? "" : lacks(".exr", "OpenEXR");
  return "the image name must end in .png, .jpg, .webp or .exr, not \"" + path.string() + "\"";
}

Result<std::uint64_t> write_picture(const Image& picture, const std::filesystem::path& path) {
  if (has_ending(path, ".jpg")) return write_jpeg(picture, path);
  return has_ending(path, ".webp") ? write_webp(picture, path) : write_png(picture, path);
}

Result<std::uint64_t> write_picture(const AlphaImage& picture, const std::filesystem::path& path) {
  return has_ending(path, ".webp") ? write_webp(picture, path) : write_png(picture, path);
}

}  // namespace quoin::tool
