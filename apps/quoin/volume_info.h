#pragma once

#include <filesystem>

#include "commands.h"

namespace quoin::tool {

/// Whether a file is read by read_volume. One that cannot be read is not, and fails in the words of its reader.
[[nodiscard]] bool holds_volume(const std::filesystem::path& path);

/// `quoin info` of a file that holds a volume; returns the exit status.
[[nodiscard]] int run_volume_info(const CommonOptions& options);

}  // namespace quoin::tool
