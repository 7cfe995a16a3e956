#pragma once

#include "commands.h"

namespace quoin::tool {

/// `quoin info` of a file that holds a volume; returns the exit status.
[[nodiscard]] int run_volume_info(const CommonOptions& options);

}  // namespace quoin::tool
