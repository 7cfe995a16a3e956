#pragma once

#include <array>
#include <cstdint>

#include <quoin/grid/chunk.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// The solid voxels of a chunk: bit x of word y + 64 z.
using SolidRows = std::array<std::uint64_t, std::size_t{kChunkEdge} * kChunkEdge>;

/// Whether voxels of a type are solid.
[[nodiscard]] inline bool is_solid(const VoxelRegistry& types, VoxelType type) {
  return type != kAir && (type >= types.size() || types[type].collides);
}

/// Null: nothing of it is solid. False where nothing is; the rows are then not set.
bool read_solid_rows(const Chunk* chunk, const VoxelRegistry& types, SolidRows& rows);

}  // namespace quoin
