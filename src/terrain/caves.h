#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>

namespace quoin::terrain {

/// Which voxels of a chunk tunnels pass through, as rows along x.
struct CaveMasks {
  std::array<std::uint64_t, kChunkEdge * kChunkEdge> rows{};  ///< [z][y]

  [[nodiscard]] std::uint64_t row(int y, int z) const { return rows[static_cast<std::size_t>(z * kChunkEdge + y)]; }
};

/// Tunnels run where two noises are both near zero. The noises are taken at every fourth voxel and interpolated.
///
/// `height`: up to which layer of the chunk to look.
void find_caves(std::uint32_t seed, IVec3 chunk, int height, CaveMasks& out);

}  // namespace quoin::terrain
