#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include <quoin/core/axis_orientation.h>

#include "io/minecraft/block_types.h"

// Directions in the properties of blocks.

namespace quoin::minecraft {

/// Returns the properties of a block after a rotation or mirror, in the same order: facing, axis, rotation, sides,
/// halves, hinges, corners of stairs, rails and the like. Other properties stay. Returns nullopt if the block has no
/// such state: doors and torches that lie or hang upside down, or stairs on their sides.
/// `name`: with or without a namespace.
[[nodiscard]] std::optional<std::vector<Property>> turned_properties(std::string_view name,
                                                                     std::vector<Property> properties,
                                                                     const AxisOrientation& turn);

/// Returns the state of a type that was made by `block_state`, after a rotation or mirror of its block; nullopt as
/// turned_properties, for types of other formats, and if a property without bits would change.
[[nodiscard]] std::optional<std::uint32_t> turned_state(const VoxelProperties& type, std::uint32_t state,
                                                        const AxisOrientation& turn);

}  // namespace quoin::minecraft
