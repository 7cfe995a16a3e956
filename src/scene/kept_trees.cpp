#include "scene/kept_trees.h"

#include <algorithm>
#include <utility>

#include "grid/chunk_order.h"

namespace quoin {
namespace {

bool has_transparent_types(const Chunk& chunk, const VoxelRegistry& types) {
  if (!types.has_transparent()) return false;
  const std::vector<VoxelType> all = chunk.types();
  return std::any_of(all.begin(), all.end(), [&](VoxelType type) { return types.is_transparent(type); });
}

}  // namespace

// What the trees are to be made of, and the chunks in which that differs from what they are made of.
std::vector<KeptTrees::MadeOf> KeptTrees::look_at(const Grid& grid, const VoxelRegistry& types,
                                                  std::vector<IVec3>& changed) const {
  std::vector<MadeOf> now;
  now.reserve(made_of_.size());
  auto last = made_of_.begin();
  for (const IVec3 chunk : grid.chunks()) {
    for (; last != made_of_.end() && by_zyx(last->chunk, chunk); ++last) changed.push_back(last->chunk);
    const std::uint64_t version = grid.version(chunk);
    const bool was_there = last != made_of_.end() && last->chunk == chunk;
    if (was_there && last->version == version) {
      now.push_back(*last);
    } else {
      changed.push_back(chunk);
      now.push_back({chunk, version, has_transparent_types(*grid.find_chunk(chunk), types)});
    }
    if (was_there) ++last;
  }
  for (; last != made_of_.end(); ++last) changed.push_back(last->chunk);
  return now;
}

bool KeptTrees::update(const Grid& grid, const VoxelRegistry& types) {
  if (identity_ == grid.identity() && version_ == grid.version()) return false;
  const bool is_new = identity_ != grid.identity();
  if (is_new) forget();
  std::vector<IVec3> changed;
  std::vector<MadeOf> now = look_at(grid, types, changed);
  const bool has_transparent =
      std::any_of(now.begin(), now.end(), [](const MadeOf& each) { return each.is_transparent; });
  if (is_new) {
    opaque_ = OccupancyTree::build(grid, types, Occupancy::Opaque);
  } else {
    opaque_.update(grid, types, changed);
  }
  if (!has_transparent) {
    transparent_.reset();
  } else if (transparent_) {
    transparent_->update(grid, types, changed);
  } else {
    transparent_.emplace(OccupancyTree::build(grid, types, Occupancy::Transparent));
  }
  made_of_ = std::move(now);
  identity_ = grid.identity();
  version_ = grid.version();
  return true;
}

}  // namespace quoin
