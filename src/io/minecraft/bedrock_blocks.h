#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/minecraft/block_types.h"

// Blocks of the Bedrock edition as blocks of the Java edition.

namespace quoin::minecraft {

/// Returns the Java block of a Bedrock block and its states, by a table of rules (bedrock_blocks.cpp). Numbers and
/// switches are texts: "3", "0", "1". States without a rule keep their name, without a namespace.
/// `is_waterlogged`: true if water fills the rest of the block; nullopt: no such property.
/// Source: the Minecraft Wiki, "Block states" (https://minecraft.wiki/w/Block_states).
[[nodiscard]] BlockText java_block(std::string_view name, const std::vector<Property>& states,
                                   std::optional<bool> is_waterlogged = std::nullopt);

}  // namespace quoin::minecraft
