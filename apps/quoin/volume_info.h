#pragma once

#include <filesystem>

#include "commands.h"
#include "standard_streams.h"

namespace quoin::tool {

/// Whether a file is read by read_volume. One that cannot be read is not, and fails in the words of its reader.
[[nodiscard]] bool holds_volume(const std::filesystem::path& path);

/// `quoin info` of a file that holds a volume; the error of its reader, or the exit status.
[[nodiscard]] Result<int> run_volume_info(const CommonOptions& options, const StandardStreams& streams);

}  // namespace quoin::tool
