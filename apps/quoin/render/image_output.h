#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <quoin/core/image.h>
#include <quoin/core/result.h>

namespace quoin::tool {

/// Returns true if the file name has this extension (".png"), ignoring case.
[[nodiscard]] bool has_ending(const std::filesystem::path& path, const std::string& ending);

/// Fails unless the extension is that of an image format this build can write.
[[nodiscard]] Status check_image_name(const std::filesystem::path& path);

/// Writes an image in the format of its extension: .png, .jpg or .webp. Returns the file size.
/// Requires: `check_image_name` succeeds; an image with alpha is not .jpg.
[[nodiscard]] Result<std::uint64_t> write_image_file(const Image& image, const std::filesystem::path& path);
[[nodiscard]] Result<std::uint64_t> write_image_file(const AlphaImage& image, const std::filesystem::path& path);

}  // namespace quoin::tool
