#pragma once

#include <string>
#include <vector>

#include <quoin/scene/scene.h>

namespace quoin::tool {

/// Adds a warning when hidden instances are left out because `hidden` is false.
void warn_of_left_out(const Scene& scene, bool hidden, std::vector<std::string>& warnings);

}  // namespace quoin::tool
