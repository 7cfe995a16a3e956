#pragma once

#include "command_files.h"
#include "commands.h"

namespace quoin::tool {

/// Runs `quoin info` on a volume. Returns the exit status, or the error of the reader.
[[nodiscard]] Result<int> run_volume_info(const CommonOptions& options, const StandardStreams& streams);

}  // namespace quoin::tool
