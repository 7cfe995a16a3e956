#include "scene/tracer/kept_trees.h"

#include <algorithm>
#include <utility>

namespace quoin {
namespace {

bool has_transparent_types(const Chunk* chunk, const VoxelRegistry& types) {
  if (chunk == nullptr || !types.has_transparent()) return false;
  const std::vector<VoxelType> all = chunk->types();
  return std::any_of(all.begin(), all.end(), [&](VoxelType type) { return types.is_transparent(type); });
}

}  // namespace

bool KeptTrees::update(const Grid& grid, const VoxelRegistry& types) {
  ChangeCursor now = followed_;
  const GridChanges changes = grid.changes_since(now);
  if (changes.empty()) return false;
  followed_ = {};  // stays so when memory runs out
  std::vector<IVec3> changed;
  if (changes.all) {
    opaque_ = OccupancyTree::build(grid, types, Occupancy::Opaque);
    transparent_.reset();
    changed = grid.chunks();
  } else {
    for (const ChunkChange& change : changes.items) changed.push_back(change.chunk);
    opaque_.update(grid, types, changed);
  }
  update_transparent(grid, types, changed);
  followed_ = now;
  return true;
}

void KeptTrees::update_transparent(const Grid& grid, const VoxelRegistry& types, const std::vector<IVec3>& changed) {
  if (transparent_) {
    transparent_->update(grid, types, changed);
    if (transparent_->bounds().empty()) transparent_.reset();
    return;
  }
  const bool has_transparent = std::any_of(changed.begin(), changed.end(), [&](IVec3 chunk) {
    return has_transparent_types(grid.find_chunk(chunk), types);
  });
  if (has_transparent) transparent_.emplace(OccupancyTree::build(grid, types, Occupancy::Transparent));
}

}  // namespace quoin
