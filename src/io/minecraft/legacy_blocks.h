#pragma once

#include <string>
#include <utility>
#include <vector>

#include "io/minecraft/block_states.h"

namespace quoin::minecraft {

/// A block as worlds before 1.13 had it, by the names of later ones: the name, and what its data says of kind, turn and
/// height. Data that says something else is the property "data". A number that no block of the game had is
/// "legacy:NUMBER". Requires: 0 <= id < 4096, 0 <= data < 16.
[[nodiscard]] std::pair<std::string, std::vector<Property>> legacy_block(int id, int data);

}  // namespace quoin::minecraft
