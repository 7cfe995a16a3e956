#pragma once

#include <optional>
#include <string_view>

#include <quoin/grid/voxel_registry.h>

namespace quoin::models {

/// The attribute of a node's type whose look is a guess, as that of a block of Minecraft's.
inline constexpr const char* kNodeGuessAttribute = "luanti.look";

/// The type of a node of Luanti's by its name ("default:stone"): by a table for the names of its own game, else by the
/// words of the name. Nothing for "air" and for "ignore", which was never made.
[[nodiscard]] std::optional<VoxelProperties> node_properties(std::string_view name);

}  // namespace quoin::models
