#include "live/body_chunks.h"

#include <utility>

#include "mesh/surface/bodies.h"

namespace quoin {

std::vector<VoxelType> transparent_of(const DensityChunk* chunk, const VoxelRegistry& types) {
  if (chunk == nullptr || !types.has_transparent()) return {};
  std::vector<VoxelType> found = chunk->materials().types();
  std::erase_if(found, [&](VoxelType type) { return !types.is_transparent(type); });
  return found;
}

std::shared_ptr<const DensityChunk> BodyChunks::of(const DensityChunk* whole, const VoxelRegistry& types,
                                                   std::uint32_t body) {
  if (whole == nullptr) return nullptr;
  if (!smooth::holds_others(*whole, types, body)) return {std::shared_ptr<void>(), whole};
  const std::lock_guard lock(mutex_);
  std::vector<VoxelType> transparent = transparent_of(whole, types);
  if (transparent != transparent_) {
    made_.clear();
    transparent_ = std::move(transparent);
  }
  std::shared_ptr<const DensityChunk>& known = made_[body];
  if (known == nullptr) known = std::make_shared<const DensityChunk>(smooth::without_others(*whole, types, body));
  return known;
}

}  // namespace quoin
