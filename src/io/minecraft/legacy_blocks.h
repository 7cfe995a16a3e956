#pragma once

#include <string>
#include <utility>
#include <vector>

#include "io/minecraft/block_states.h"

namespace quoin::minecraft {

/// Converts a block of a world before 1.13 to later names: its name, and the kind, rotation and height in its data.
/// Other data becomes the property "data". Unknown block numbers become "legacy:NUMBER". Requires: 0 <= id < 4096, 0 <=
/// data < 16.
[[nodiscard]] std::pair<std::string, std::vector<Property>> legacy_block(int id, int data);

}  // namespace quoin::minecraft
