#pragma once

#include "commands.h"
#include "standard_streams.h"

namespace quoin::tool {

/// `quoin info` of a file that holds a volume; the error of its reader, or the exit status.
[[nodiscard]] Result<int> run_volume_info(const CommonOptions& options, const StandardStreams& streams);

}  // namespace quoin::tool
