#include "scene/tracer/tree_cache.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "mesh/surface/voxel_surface.h"
#include "trace/cell_rows.h"

namespace quoin {
namespace {

constexpr std::uint32_t kOpaqueBody = 0;

bool has_transparent_types(const Chunk* chunk, const VoxelRegistry& types) {
  if (chunk == nullptr || !types.has_transparent()) return false;
  const std::vector<VoxelType> all = chunk->types();
  return std::any_of(all.begin(), all.end(), [&](VoxelType type) { return types.is_transparent(type); });
}

}  // namespace

SplitField::SplitField(const DensityGrid& whole, const VoxelRegistry& types)
    : whole_(&whole),
      opaque_field_(smooth::field_of_body(whole, types, kOpaqueBody, Threads{1})),
      glass_(whole, types) {
  (void)opaque_field_.changes_since(followed_opaque_);
  opaque_.emplace(opaque_field_);
}

void SplitField::update(const VoxelRegistry& types, const DensityChanges& changes) {
  for (const DensityChange& change : changes.items) {
    const DensityChunk* const chunk = whole_->find_chunk(change.chunk);
    const DensityChunk air(stored_density(opaque_field_.band(), opaque_field_.band()));
    opaque_field_.put_chunk(change.chunk, chunk == nullptr ? air : smooth::chunk_of_body(*chunk, types, kOpaqueBody));
  }
  opaque_->update(opaque_field_.changes_since(followed_opaque_));
  glass_.update(types, changes);
}

bool has_glass(const DensityGrid& field, const VoxelRegistry& types) {
  if (!types.has_transparent()) return false;
  const std::vector<IVec3> chunks = field.chunks();
  return std::any_of(chunks.begin(), chunks.end(),
                     [&](IVec3 chunk) { return trace::has_glass(*field.find_chunk(chunk), types); });
}

bool has_glass(const DensityGrid& field, const VoxelRegistry& types, const DensityChanges& changes) {
  return std::any_of(changes.items.begin(), changes.items.end(), [&](const DensityChange& change) {
    const DensityChunk* const chunk = field.find_chunk(change.chunk);
    return chunk != nullptr && trace::has_glass(*chunk, types);
  });
}

bool TreeCache::update(const Grid& grid, const VoxelRegistry& types) {
  ChangeCursor now = followed_;
  const GridChanges changes = grid.changes_since(now);
  if (changes.empty()) return false;
  followed_ = {};  // stays empty if memory runs out
  if (changes.all) transparent_.reset();
  opaque_.update(grid, types, changes);
  update_transparent(grid, types, changes);
  followed_ = now;
  return true;
}

bool TreeCache::update(const DensityGrid& field, const VoxelRegistry& types) {
  ChangeCursor now = followed_field_;
  const bool is_known = field_ && &field_->field() == &field;
  if (!is_known && field.chunk_count() == 0) {
    field_.reset();
    split_.reset();
    return false;
  }
  DensityChanges changes = field.changes_since(now);
  if (is_known && changes.empty()) return false;
  changes.all |= !is_known;
  followed_field_ = {};  // stays empty if memory runs out
  if (is_known) {
    field_->update(changes);
  } else {
    field_.emplace(field);
  }
  update_split(field, types, changes);
  followed_field_ = now;
  return true;
}

// If there was no transparent material, only the changed chunks can contain some.
void TreeCache::update_split(const DensityGrid& field, const VoxelRegistry& types, const DensityChanges& changes) {
  if (changes.all) split_.reset();
  if (split_ != nullptr) {
    split_->update(types, changes);
  } else if (changes.all ? has_glass(field, types) : has_glass(field, types, changes)) {
    split_ = std::make_unique<SplitField>(field, types);
  }
  if (split_ != nullptr && split_->glass().cells().bounds().empty()) split_.reset();
}

// If there was no tree, only the changed chunks can contain transparent voxels.
void TreeCache::update_transparent(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes) {
  if (!transparent_) {
    const auto holds_some = [&](IVec3 chunk) { return has_transparent_types(grid.find_chunk(chunk), types); };
    const std::vector<IVec3> present = changes.all ? grid.chunks() : std::vector<IVec3>();
    const bool has_transparent = std::any_of(present.begin(), present.end(), holds_some) ||
                                 std::any_of(changes.items.begin(), changes.items.end(),
                                             [&](const ChunkChange& change) { return holds_some(change.chunk); });
    if (!has_transparent) return;
    transparent_.emplace(Occupancy::Transparent);
  }
  transparent_->update(grid, types, changes);
  if (transparent_->bounds().empty()) transparent_.reset();
}

}  // namespace quoin
