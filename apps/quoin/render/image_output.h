#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <quoin/core/image.h>
#include <quoin/core/result.h>

#include "options.h"

namespace quoin {
struct RenderedImage;
}

namespace quoin::tool {

class PathImages;
struct RenderArguments;

/// Adds the options under the heading of output.
void add_output_options(CLI::App& command, RenderArguments& arguments);

/// Returns the rules for these options.
[[nodiscard]] std::vector<OptionRule> output_rules(const RenderArguments& arguments);

/// Files that were written.
struct WrittenFiles {
  std::vector<std::filesystem::path> paths;  ///< the image first
  std::uint64_t bytes = 0;
};

/// Writes an image in the format of `path`, and its depth with --depth.
/// `path_traced`: the renderer of the image if it is the path tracer, else null.
[[nodiscard]] Result<WrittenFiles> write_outputs(const RenderArguments& arguments, const RenderedImage& image,
                                                 const PathImages* path_traced, const std::filesystem::path& path);

/// Returns true if the file name has this extension (".png"), ignoring case.
[[nodiscard]] bool has_ending(const std::filesystem::path& path, const std::string& ending);

/// Fails unless the extension is that of an image format this build can write.
[[nodiscard]] Status check_image_name(const std::filesystem::path& path);

/// Writes an image in the format of its extension: .png, .jpg or .webp. Returns the file size.
/// Requires: `check_image_name` succeeds; an image with alpha is not .jpg.
[[nodiscard]] Result<std::uint64_t> write_image_file(const Image& image, const std::filesystem::path& path);
[[nodiscard]] Result<std::uint64_t> write_image_file(const AlphaImage& image, const std::filesystem::path& path);

}  // namespace quoin::tool
