#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include <quoin/grid/density_chunk.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// The types of a chunk's samples that are transparent, in their order; none of null.
[[nodiscard]] std::vector<VoxelType> transparent_of(const DensityChunk* chunk, const VoxelRegistry& types);

/// What single bodies have of one chunk of densities (smooth::without_others), made by the worker that needs one first,
/// and kept.
///
/// Threads: any.
class BodyChunks {
 public:
  /// Null where all is far air. `whole` is always the same chunk, or a copy of it; it must outlive the result, which is
  /// it where there are no other bodies.
  [[nodiscard]] std::shared_ptr<const DensityChunk> of(const DensityChunk* whole, const VoxelRegistry& types,
                                                       std::uint32_t body);

 private:
  std::mutex mutex_;
  std::vector<VoxelType> transparent_;  // those that were when `made_` was
  std::map<std::uint32_t, std::shared_ptr<const DensityChunk>> made_;
};

}  // namespace quoin
