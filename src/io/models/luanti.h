#pragma once

#include <optional>
#include <string_view>

#include <quoin/grid/voxel_registry.h>

namespace quoin::models {

/// The attribute of node types with a guessed look, as for Minecraft blocks.
inline constexpr const char* kNodeGuessAttribute = "luanti.look";

/// Returns the type of a Luanti node by its name ("default:stone"): from a table for the names of Luanti's own game,
/// otherwise by the words of the name. Returns nullopt for "air" and for "ignore" (not generated).
[[nodiscard]] std::optional<VoxelProperties> node_properties(std::string_view name);

}  // namespace quoin::models
