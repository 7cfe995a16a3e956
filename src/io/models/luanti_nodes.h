#pragma once

#include <optional>
#include <string_view>

#include <quoin/grid/voxel_registry.h>

namespace quoin::models {

/// The attribute of node types with a guessed look, as for Minecraft blocks.
inline constexpr const char* kNodeGuessAttribute = "luanti.look";

/// The type of a node of Luanti's by its name ("default:stone"): by a table for the names of its own game, else by the
/// words of the name. Nothing for "air" and for "ignore", which was never made.
[[nodiscard]] std::optional<VoxelProperties> node_properties(std::string_view name);

}  // namespace quoin::models
