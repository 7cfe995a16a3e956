#pragma once
#include <span>
#include <vector>
#include <quoin/store/world_store.h>
namespace quoin::store {
struct ChunkLimits {
  const VoxelRegistry* types = nullptr;
  float band = 8.0F;
};
class ChunkEncoder {
 public:
  void encode(const ChunkPlace&, std::uint64_t revision, const Chunk& voxels, const DensityChunk* densities,
              std::vector<std::byte>& out);
};
class ChunkDecoder {
 public:
  Result<StoredChunk> decode(const ChunkPlace&, std::span<const std::byte>, const ChunkLimits&);
};
}  // namespace quoin::store
