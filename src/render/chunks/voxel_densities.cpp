#include "render/chunks/voxel_densities.h"

#include <algorithm>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/grid/voxel_field.h>

#include "core/coordinates/chunk_order.h"
#include "core/coordinates/long_box.h"
#include "mesh/surface/voxel_surface.h"

namespace quoin {
namespace {

// Maximum number of chunks per update that are compared voxel by voxel. Larger edits reach most neighbours anyway.
constexpr std::size_t kMaxCompared = 32;

std::uint64_t next_stamp() {
  static std::atomic<std::uint64_t> count{0};
  return count.fetch_add(1, std::memory_order_relaxed) + 1;
}

ChunkDifference everything() {
  ChunkDifference all;
  all.solid.add_all();
  all.types.add_all();
  return all;
}

// Returns the samples that differ in the rows of a box; null is far air.
ChangeReach density_difference(const DensityChunk* before, const DensityChunk* after, const IBox& within) {
  static const DensityChunk far_air(DensityNeighbourhood{}.outside);
  const DensityChunk& a = before == nullptr ? far_air : *before;
  const DensityChunk& b = after == nullptr ? far_air : *after;
  ChangeReach found;
  std::array<Half, kChunkEdge> old_row;
  std::array<Half, kChunkEdge> new_row;
  for (int z = within.min.z; z < within.max.z; ++z) {
    for (int y = within.min.y; y < within.max.y; ++y) {
      a.read_row(y, z, old_row);
      b.read_row(y, z, new_row);
      if (old_row == new_row) continue;
      std::uint64_t changed = 0;
      for (std::size_t x = 0; x < kChunkEdge; ++x) changed |= std::uint64_t{old_row[x] != new_row[x]} << x;
      found.add(y, z, changed);
    }
  }
  return found;
}

const Chunk* materials_of(const DensityChunk* chunk) {
  return chunk == nullptr ? nullptr : &chunk->materials();
}

}  // namespace

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

VoxelDensity::VoxelDensity(GridSnapshot voxels, IVec3 chunk, std::shared_ptr<const VoxelDensity> base,
                           const IBox& changed, std::shared_ptr<const VoxelRegistry> types)
    : stamp_(next_stamp()),
      chunk_(chunk),
      voxels_(std::move(voxels)),
      base_(std::move(base)),
      changed_(changed),
      types_(std::move(types)) {
  QUOIN_ASSERT(voxels_ != nullptr && types_ != nullptr, "voxels and their types");
  QUOIN_ASSERT(base_ == nullptr || base_->is_made(), "a base that was made");
}

void VoxelDensity::try_to_make() {
  if (is_made()) return;
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (lock.owns_lock() && !is_made()) make_locked();
}

void VoxelDensity::make() {
  if (is_made()) return;
  const std::lock_guard lock(mutex_);
  if (!is_made()) make_locked();
}

void VoxelDensity::make_locked() {
  const Neighbourhood voxels = voxels_->neighbourhood(chunk_);
  std::unique_ptr<DensityChunk> made;
  const IVec3 origin = chunk_ * kChunkEdge;
  const IBox changed = changed_.empty() ? IBox{} : IBox{changed_.min - origin, changed_.max - origin};
  if (base_ != nullptr && base_->densities() != nullptr) {
    made = std::make_unique<DensityChunk>(*base_->densities());
    update_density_of_voxels(voxels, changed, *made);
  } else {
    made = std::make_unique<DensityChunk>(density_of_voxels(voxels));
  }
  if (made->uniform() == DensityNeighbourhood{}.outside) made.reset();
  if (base_ != nullptr) {
    IBox reached;
    if (!changed.empty())
      reached = intersect({changed.min - kVoxelFieldReach, changed.max + kVoxelFieldReach}, kWholeChunk);
    changed_densities_ = density_difference(base_->densities(), made.get(), reached);
    changed_types_ = difference(materials_of(base_->densities()), materials_of(made.get()), kWholeChunk).types;
    may_change_bodies_ =
        !transparent_of(base_->densities(), *types_).empty() || !transparent_of(made.get(), *types_).empty();
    base_stamp_ = base_->stamp();
    has_base_ = true;
  }
  densities_ = std::move(made);
  is_made_.store(true, std::memory_order_release);
  voxels_.reset();
  base_.reset();
  types_.reset();
}

bool VoxelDensity::reads_as(std::uint64_t stamp, int reach, IVec3 offset) const {
  QUOIN_ASSERT(is_made(), "densities that were made");
  if (stamp == stamp_) return true;
  if (!has_base_ || base_stamp_ != stamp) return false;
  // Vertices take the materials of their cells' corners, which end one sample past the chunk. Solid of one body is air
  // to other bodies.
  return !changed_densities_.is_within(reach, offset.x, offset.y, offset.z) &&
         !changed_types_.is_within(may_change_bodies_ ? reach : 1, offset.x, offset.y, offset.z);
}

// Returns the differences between the edited chunks and their former states, as far as they are compared.
std::vector<DensityCache::Change> DensityCache::changes_of(const Grid& grid, const GridChanges& edits) const {
  QUOIN_ASSERT(edits.all || edits.items_unless_all().empty() || seen_ != nullptr, "a grid that was followed before");
  std::vector<Change> changes;
  if (edits.all) {
    for (const IVec3 chunk : grid.chunks()) changes.push_back({chunk, everything()});
  }
  for (const ChunkChange& edit : edits.items_unless_all()) {
    if (changes.size() >= kMaxCompared) {
      changes.push_back({edit.chunk, everything()});
    } else {
      changes.push_back({edit.chunk, difference(seen_->find_chunk(edit.chunk), grid.find_chunk(edit.chunk), edit.box)});
    }
  }
  return changes;
}

void DensityCache::follow(GridSnapshot grid, const GridChanges& edits, std::vector<IVec3>& changed,
                          std::vector<IVec3>& reached) {
  const std::vector<Change> changes = changes_of(*grid, edits);
  seen_ = std::move(grid);
  for (const Change& change : changes) {
    changed.push_back(change.chunk);
    reach_from(change, reached);
  }
  sort_and_unite(reached);
  drop_what_is_gone(changed);
}

void DensityCache::reach_from(const Change& change, std::vector<IVec3>& reached) {
  const IVec3 origin = change.chunk * kChunkEdge;
  IBox changed = change.difference.solid.change(change.chunk).box;
  changed = {changed.min + origin, changed.max + origin};
  for (int i = 0; i < 27; ++i) {
    const IVec3 at = change.chunk + Neighbourhood::offset(i);
    const IVec3 offset = at - change.chunk;
    const auto is_within = [&](const ChangeReach& reach, int samples) {
      return reach.is_within(samples, offset.x, offset.y, offset.z);
    };
    if (is_within(change.difference.solid, kVoxelFieldReach)) {
      invalidate(at, true, changed);
    } else if (i == 13 && change.difference.types.samples != 0) {
      invalidate(at, false, {});
    }
    // Types matter only next to the chunk. The body of a sample can matter further away; VoxelDensity checks that.
    if (is_within(change.difference.solid, kVoxelFieldReach + reach_) || is_within(change.difference.types, reach_)) {
      reached.push_back(at);
    }
  }
}

void DensityCache::drop_what_is_gone(const std::vector<IVec3>& changed) {
  for (const IVec3 chunk : changed) {
    if (seen_->find_chunk(chunk) != nullptr) continue;
    for (int i = 0; i < 27; ++i) {
      if (!has_voxels_near(chunk + Neighbourhood::offset(i))) slots_.erase(chunk + Neighbourhood::offset(i));
    }
  }
}

void DensityCache::invalidate(IVec3 chunk, bool solid, const IBox& changed) {
  Slot& slot = slots_[chunk];
  slot.under_way.reset();
  (solid ? slot.is_solid_stale : slot.is_type_stale) = true;
  if (solid) slot.changed = unite(slot.changed, changed);
}

bool DensityCache::has_voxels_near(IVec3 chunk) const {
  QUOIN_ASSERT(seen_ != nullptr, "a grid that was followed before");
  for (int i = 0; i < 27; ++i) {
    if (seen_->find_chunk(chunk + Neighbourhood::offset(i)) != nullptr) return true;
  }
  return false;
}

VoxelDensities DensityCache::around(IVec3 chunk, const std::shared_ptr<const VoxelRegistry>& types) {
  VoxelDensities all;
  for (int i = 0; i < 27; ++i) all[static_cast<std::size_t>(i)] = density(chunk + Neighbourhood::offset(i), types);
  return all;
}

std::shared_ptr<VoxelDensity> DensityCache::density(IVec3 chunk, const std::shared_ptr<const VoxelRegistry>& types) {
  // The outermost chunks stay air, as in a DensityGrid.
  if (!is_inside_world(chunk) || !has_voxels_near(chunk)) return nullptr;
  Slot& slot = slots_[chunk];
  if (slot.kept != nullptr && !slot.is_solid_stale && !slot.is_type_stale) return slot.kept;
  if (std::shared_ptr<VoxelDensity> under_way = slot.under_way.lock()) return under_way;
  auto made = deferred(releases_, std::make_shared<VoxelDensity>(seen_, chunk, slot.kept, slot.changed, types));
  slot.under_way = made;
  return made;
}

std::uint32_t DensityCache::keep(IVec3 chunk, const VoxelDensities& made) {
  std::uint32_t kept = 0;
  for (int i = 0; i < 27; ++i) {
    const std::shared_ptr<VoxelDensity>& each = made[static_cast<std::size_t>(i)];
    if (each == nullptr || !each->is_made()) continue;
    const auto found = slots_.find(chunk + Neighbourhood::offset(i));
    if (found == slots_.end() || found->second.under_way.lock() != each) continue;
    found->second = Slot{each, {}, false, {}, false};
    kept |= std::uint32_t{1} << i;
  }
  return kept;
}

}  // namespace quoin
