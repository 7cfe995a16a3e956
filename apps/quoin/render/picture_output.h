#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <quoin/core/image.h>
#include <quoin/core/result.h>

namespace quoin::tool {

/// Whether a file's name has that ending, in any case of letters: ".png".
[[nodiscard]] bool has_ending(const std::filesystem::path& path, const std::string& ending);

/// What is wrong with a picture's name, or "": it must have the ending of a kind that this build can write.
[[nodiscard]] std::string fault_of_picture_name(const std::filesystem::path& path);

/// Writes a picture as its name says: .png, .jpg or .webp. Returns the file's size.
/// Requires: `fault_of_picture_name` finds nothing; with alpha no .jpg.
[[nodiscard]] Result<std::uint64_t> write_picture(const Image& picture, const std::filesystem::path& path);
[[nodiscard]] Result<std::uint64_t> write_picture(const AlphaImage& picture, const std::filesystem::path& path);

}  // namespace quoin::tool
