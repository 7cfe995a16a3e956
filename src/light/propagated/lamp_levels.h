#pragma once

#include <quoin/grid/voxel_registry.h>
#include <quoin/light/propagated_light.h>

namespace quoin {

/// Returns the lamp light that a type emits; 0 for most types. An `emission` of 1 or more gives level 15 in the
/// brightest channel of the type's colour, and the other channels in proportion to their sRGB values. A lower emission
/// scales the levels. `sky` is 0.
[[nodiscard]] LightLevels lamp_levels(const VoxelProperties& properties);

}  // namespace quoin
