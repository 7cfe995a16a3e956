#pragma once

#include <vector>

#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/terrain/terrain.h>

#include "terrain/landform.h"

namespace quoin::terrain {

/// One chunk of stone, soil, cover and water, with caves where asked for.
///
/// `columns`: the chunk's 64x64, x fastest. `part`: what of the chunk lies in the world, in the chunk's coordinates.
[[nodiscard]] Chunk make_ground(const Landform& land, const std::vector<Column>& columns, const TerrainTypes& types,
                                IVec3 chunk, const IBox& part, bool has_caves);

}  // namespace quoin::terrain
