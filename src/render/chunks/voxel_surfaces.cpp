#include "render/chunks/voxel_surfaces.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include <glm/common.hpp>
#include <quoin/core/assert.h>

#include "core/coordinates/chunk_order.h"
#include "grid/chunk/chunk_storage.h"

namespace quoin {
namespace {

bool has_solid_first_layer(const Chunk* chunk, std::size_t axis) {
  if (chunk == nullptr) return false;
  if (const auto uniform = chunk->uniform()) return *uniform != kAir;
  return ChunkStorage::of(*chunk)->layer_counts[axis][0] != 0;
}

// The voxels of a chunk whose data no surface of another chunk reads.
constexpr IBox kInnerVoxels{IVec3(kShapeReach), IVec3(kChunkEdge - kShapeReach)};

// Reach of light: a voxel's light affects that of shapes' faces at most this many voxels away (SurfaceLight::read).
constexpr int kShapeLightReach = 3;

// Partial grids: the densities of a chunk depend on the chunk and its 26 neighbours.
constexpr int kSmoothDistance = 2;

// Quads belong to the chunk in which their lattice edge starts: it, or the next one along the edge, has a solid sample.
bool can_own_smooth_quads(const Grid& grid, IVec3 chunk) {
  if (!grid.is_loaded_around(chunk, kSmoothDistance)) return false;
  return grid.find_chunk(chunk) != nullptr || has_solid_first_layer(grid.find_chunk(chunk + IVec3{1, 0, 0}), 0) ||
         has_solid_first_layer(grid.find_chunk(chunk + IVec3{0, 1, 0}), 1) ||
         has_solid_first_layer(grid.find_chunk(chunk + IVec3{0, 0, 1}), 2);
}

}  // namespace

VoxelSurfaces::VoxelSurfaces(GridHandle handle, const ChunkSurfaceOptions& options, SurfaceTotals& totals)
    : handle_(handle), options_(options), totals_(totals), densities_(reach_of(options.occlusion), totals.releases) {}

void VoxelSurfaces::follow(const SceneGrid& content, const VoxelRegistry& types, SurfaceClock::time_point now) {
  const Grid& grid = content.grid;
  PendingChanges changes(followed_, grid);
  if (changes->empty()) return;
  const bool is_load =
      totals_.loads_only || (changes->all && (grid.is_partial() || grid.chunk_count() > kMaxEpochChunks));
  const Cause cause = is_load ? Cause::Load : Cause::Edit;
  if (changes->all) begin_anew(cause);
  if (options_.style == SurfaceStyle::Blocky) {
    follow_blocky(grid, types, *changes, cause, now);
  } else {
    follow_smooth(grid, *changes, cause, now);
  }
  changes.commit();
}

// Corners of faces have the light of voxels in front of them: chunks that hold one of the 26 neighbours of a voxel
// whose light changed are meshed again.
void VoxelSurfaces::follow_light(const GridLight& light, const VoxelRegistry& types, SurfaceClock::time_point now) {
  if (options_.style != SurfaceStyle::Blocky) return;
  if (light.light == nullptr) {
    if (std::exchange(is_lit_, false)) mark_all(now);
    followed_light_ = {};
    return;
  }
  is_lit_ = true;
  PendingChanges changes(followed_light_, *light.light);
  if (changes->all) mark_all(now);
  for (const ChunkChange& change : changes->items_unless_all()) {
    for (int i = 0; i < 27; ++i) {
      const IVec3 offset = Neighbourhood::offset(i);
      if (change.affects(offset)) mark_for_look(change.chunk + offset, now);
    }
  }
  if (has_shapes(types)) {
    std::vector<IVec3> near;
    for (const ChunkChange& change : changes->items_unless_all()) {
      add_chunks_near(change.chunk, change.box, kShapeLightReach, near);
    }
    for (const IVec3 chunk : near) mark_for_look(chunk, now);
  }
  changes.commit();
}

void VoxelSurfaces::mark_data(const Grid& grid, const DataChanges& changes, const VoxelRegistry& types,
                              SurfaceClock::time_point now) {
  ChunkSet reached;
  visit_data_changes(*followed_voxels_, grid, changes, [&](IVec3 voxel, const VoxelData&, const VoxelData&) {
    if (!types.remeshes_on_data(grid.get(voxel))) return;
    reached.insert(chunk_of(voxel));
    if (kInnerVoxels.contains(local_of(voxel))) return;
    const int reach = has_shapes(types) && types.is_shaped(grid.get(voxel)) ? kShapeReach : 1;
    for (int i = 0; i < 27; ++i) reached.insert(chunk_of(voxel + reach * Neighbourhood::offset(i)));
  });
  for (const IVec3 chunk : reached) {
    mark_for_look(chunk, now);
    const auto found = chunks_.find(chunk);
    if (found != chunks_.end()) ++found->second.data_generation;
  }
}

void VoxelSurfaces::follow_data(const SceneGrid& content, const VoxelRegistry& types, SurfaceClock::time_point now) {
  if (!types.has_remesh_on_data()) {
    followed_voxels_ = nullptr;
    return;
  }
  const Grid& grid = content.grid;
  const bool is_first = followed_voxels_ == nullptr;
  // Any change renews the snapshot, which would keep the memory of unloaded chunks.
  if (!is_first && !grid.has_changed_since(followed_data_) && !grid.has_data_changed_since(followed_data_)) return;
  ChangeCursor end = followed_data_;
  const DataChanges changes = grid.data_changes_since(end);
  // The first time, `follow` or `mark_types` marks the chunks, because the grid or the property is new.
  if (!is_first) mark_data(grid, changes, types, now);
  followed_voxels_ = deferred(totals_.releases, std::make_shared<const Grid>(grid.snapshot()));
  followed_data_ = end;
}

// Marks all chunks, because their surfaces belong to another grid. `follow` removes those that are not in the new one.
void VoxelSurfaces::begin_anew(Cause cause) {
  densities_.clear();
  for (auto& [chunk, state] : chunks_) {
    if (state.is_gone && !state.is_edited && !state.is_in_epoch) continue;
    const Change change(totals_, state);
    state.last_stamps.reset();
    state.is_gone = false;
    if (cause == Cause::Load) {
      leave_epoch(chunk, state);
      edited_.erase(chunk);
      state.is_edited = false;
      state.surface.reset();
      state.is_ready = state.is_together = false;
      // It stays pending until the new grid is known to contain it or not.
      waiting_.insert(chunk);
      state.is_waiting = true;
    } else {
      note_edit(chunk, state);
    }
    if (state.is_in_epoch) continue;
    state.oldest = totals_.serial + 1;
    state.is_working = false;
  }
}

void VoxelSurfaces::leave() {
  std::vector<IVec3> all;
  for (const auto& [chunk, state] : chunks_) {
    if (!state.is_gone) all.push_back(chunk);
  }
  for (const IVec3 chunk : all) remove(chunk, Cause::Edit);
  followed_ = followed_light_ = {};
  followed_voxels_ = nullptr;
  densities_.clear();
}

void VoxelSurfaces::forget() {
  followed_ = followed_light_ = {};
  followed_voxels_ = nullptr;
  for (const auto& [chunk, member] : epoch_) {
    VoxelChunk& state = chunks_.at(chunk);
    const Change change(totals_, state);
    if (!member.is_done) --totals_.in_epoch;
    // If the chunk is gone, `follow` or `leave` finds out again.
    state.is_in_epoch = state.is_gone = false;
  }
  epoch_.clear();
}

void VoxelSurfaces::discard() {
  for (auto& [chunk, state] : chunks_) {
    state.region_hashes.clear();
    if (!state.is_ready) continue;
    const Change change(totals_, state);
    state.surface.reset();
    state.is_ready = state.is_together = false;
    state.is_gone = false;  // as in `forget`
  }
}

void VoxelSurfaces::follow_blocky(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes, Cause cause,
                                  SurfaceClock::time_point now) {
  const auto see = [&](const std::vector<IVec3>& chunks, Cause why) {
    for (const IVec3 chunk : chunks) {
      if (grid.find_chunk(chunk) != nullptr && grid.is_loaded_around(chunk)) {
        mark(chunk, chunks_[chunk], why, now);
      } else {
        remove_if_there(chunk, why);
      }
    }
  };
  if (changes.all) {
    std::vector<IVec3> all = grid.chunks();
    for (const auto& [chunk, state] : chunks_) all.push_back(chunk);
    return see(all, cause);
  }
  std::vector<ChunkChange> edits;
  std::vector<ChunkChange> loads;
  std::vector<IVec3> near_edits;
  std::vector<IVec3> near_loads;
  for (const ChunkChange& change : changes.items_unless_all()) {
    const bool is_edit = change.is_edit && cause == Cause::Edit;
    (is_edit ? edits : loads).push_back(change);
    if (!has_shapes(types)) continue;
    add_chunks_near(change.chunk, change.box, is_lit_ ? kShapeLightReach : kShapeReach,
                    is_edit ? near_edits : near_loads);
  }
  see(chunks_to_mesh(grid, GridChanges(std::move(edits))), Cause::Edit);
  see(chunks_to_mesh(grid, GridChanges(std::move(loads))), Cause::Load);
  for (const IVec3 chunk : near_edits) mark_if_there(chunk, Cause::Edit, now);
  for (const IVec3 chunk : near_loads) mark_if_there(chunk, Cause::Load, now);
}

// Adds chunks that may have waited for a chunk to load, or must be hidden without it.
void VoxelSurfaces::add_chunks_around(IVec3 chunk, int distance, std::vector<IVec3>& to) {
  for (int z = -distance; z <= distance; ++z) {
    for (int y = -distance; y <= distance; ++y) {
      for (int x = -distance; x <= distance; ++x) to.push_back(chunk + IVec3{x, y, z});
    }
  }
}

void VoxelSurfaces::remove_if_there(IVec3 chunk, Cause cause) {
  const auto found = chunks_.find(chunk);
  if (found != chunks_.end() && !found->second.is_gone) remove(chunk, cause);
}

void VoxelSurfaces::follow_smooth(const Grid& grid, const GridChanges& changes, Cause cause,
                                  SurfaceClock::time_point now) {
  std::vector<IVec3> changed;
  std::vector<IVec3> reached;
  densities_.follow(deferred(totals_.releases, std::make_shared<const Grid>(grid.snapshot())), changes, changed,
                    reached);
  std::vector<IVec3> asked;
  for (const IVec3 chunk : changed) {
    for (const IVec3 step : {IVec3{0}, IVec3{1, 0, 0}, IVec3{0, 1, 0}, IVec3{0, 0, 1}}) asked.push_back(chunk - step);
  }
  std::vector<IVec3> edited;
  for (const ChunkChange& change : changes.items_unless_all()) {
    if (!change.is_edit) add_chunks_around(change.chunk, kSmoothDistance, asked);
    if (change.is_edit && edited.size() < kMaxEpochChunks) edited.push_back(change.chunk);
  }
  if (changes.all) {
    for (const auto& [chunk, state] : chunks_) asked.push_back(chunk);
  }
  sort_and_unite(asked);
  const auto cause_of = [&](IVec3 chunk) {
    const auto is_near = [&](IVec3 edit) {
      const IVec3 away = glm::abs(chunk - edit);
      return std::max({away.x, away.y, away.z}) <= kSmoothDistance;
    };
    const bool is_edit = changes.all || std::any_of(edited.begin(), edited.end(), is_near);
    return is_edit ? cause : Cause::Load;
  };
  for (const IVec3 chunk : asked) see_whether_meshed(chunk, can_own_smooth_quads(grid, chunk), cause_of(chunk), now);
  for (const IVec3 chunk : reached) mark_if_there(chunk, cause_of(chunk), now);
}

void VoxelSurfaces::see_whether_meshed(IVec3 chunk, bool is_meshed, Cause cause, SurfaceClock::time_point now) {
  const auto found = chunks_.find(chunk);
  const bool is_there = found != chunks_.end() && !found->second.is_gone;
  if (is_meshed && !is_there) mark(chunk, chunks_[chunk], cause, now);
  if (!is_meshed && is_there) remove(chunk, cause);
}

void VoxelSurfaces::mark_types(const SceneGrid& content, const ChangedTypes& changed, SurfaceClock::time_point now) {
  const bool is_smooth = options_.style == SurfaceStyle::Smooth;
  if (changed.visibility.empty() && changed.data.empty() && (!is_smooth || changed.colour.empty())) return;
  for (const IVec3 chunk : content.grid.chunks()) {
    const std::vector<VoxelType> types = content.grid.find_chunk(chunk)->types();
    const auto is_in = [](const std::vector<bool>& set, VoxelType type) { return type < set.size() && set[type]; };
    const auto has_changed = [&](VoxelType type) {
      return is_in(changed.visibility, type) || is_in(changed.data, type) || (is_smooth && is_in(changed.colour, type));
    };
    if (std::none_of(types.begin(), types.end(), has_changed)) continue;
    for (int i = 0; i < 27; ++i) mark_for_look(chunk + Neighbourhood::offset(i), now);
  }
}

void VoxelSurfaces::mark_if_there(IVec3 chunk, Cause cause, SurfaceClock::time_point now) {
  const auto found = chunks_.find(chunk);
  if (found != chunks_.end() && !found->second.is_gone) mark(chunk, found->second, cause, now);
}

// Marks a chunk because light or types have changed. New surfaces do not have to match the visible ones.
void VoxelSurfaces::mark_for_look(IVec3 chunk, SurfaceClock::time_point now) {
  const auto found = chunks_.find(chunk);
  if (found == chunks_.end() || found->second.is_gone) return;
  const bool is_load = found->second.collected == 0 || totals_.loads_only;
  mark(chunk, found->second, is_load ? Cause::Load : Cause::Edit, now);
}

void VoxelSurfaces::mark_all(SurfaceClock::time_point now) {
  for (auto& [chunk, state] : chunks_) {
    if (!state.is_gone) mark(chunk, state, Cause::Load, now);
  }
}

// A chunk of an epoch is meshed again in the next one, so that no newer surface of it is shown first.
void VoxelSurfaces::mark(IVec3 chunk, VoxelChunk& state, Cause cause, SurfaceClock::time_point now) {
  const bool is_edit = cause == Cause::Edit || state.is_edited || state.is_in_epoch;
  if (!is_edit) waiting_.insert(chunk);
  box_ = unite(box_, {chunk, chunk + 1});
  const Change change(totals_, state);
  // Jobs of a chunk that was here before may still be running.
  if (state.oldest == 0) state.oldest = totals_.serial + 1;
  state.seen = now;
  if (is_edit) {
    note_edit(chunk, state);
  } else {
    // The chunk's removal need not be reported any more.
    if (state.is_gone && !state.is_together) state.is_ready = false;
    state.is_waiting = true;
    state.state = totals_.state;
  }
  state.is_gone = false;
}

// Requires: a CountedChange of the state.
void VoxelSurfaces::note_edit(IVec3 chunk, VoxelChunk& state) {
  edited_.insert(chunk);
  state.is_edited = true;
  waiting_.erase(chunk);
  state.is_waiting = false;
}

void VoxelSurfaces::remove(IVec3 chunk, Cause cause) {
  VoxelChunk& state = chunks_.at(chunk);
  {
    const Change change(totals_, state);
    state.last_stamps.reset();
    if (cause == Cause::Edit) {
      note_edit(chunk, state);
    } else {
      leave_epoch(chunk, state);
      waiting_.erase(chunk);
      edited_.erase(chunk);
      state.is_waiting = state.is_edited = false;
      state.is_ready = state.is_together = false;
      state.surface.reset();
      state.state = 0;
      if (state.is_shown) show(chunk, state, nullptr, false);
    }
    state.is_gone = true;
    if (!state.is_in_epoch) {
      state.oldest = totals_.serial + 1;
      state.is_working = false;
    }
  }
  erase_if_over(chunk);
}

// Requires: a CountedChange of the state.
void VoxelSurfaces::leave_epoch(IVec3 chunk, VoxelChunk& state) {
  if (!state.is_in_epoch) return;
  const auto member = epoch_.find(chunk);
  QUOIN_ASSERT(member != epoch_.end(), "a chunk of the epoch");
  if (!member->second.is_done) --totals_.in_epoch;
  epoch_.erase(member);
  state.is_in_epoch = false;
}

void VoxelSurfaces::erase_if_over(IVec3 chunk) {
  const auto found = chunks_.find(chunk);
  QUOIN_ASSERT(found != chunks_.end(), "a known chunk");
  const VoxelChunk& state = found->second;
  if (state.is_gone && !state.is_pending() && !state.is_listed) chunks_.erase(found);
}

// Replaces the surface that is to be taken.
void VoxelSurfaces::show(IVec3 chunk, VoxelChunk& state, std::shared_ptr<const ChunkSurface> surface,
                         bool is_together) {
  if (surface != nullptr && has_regions()) state.region_hashes.reserve(region_count());  // for `take`
  state.surface = std::move(surface);
  // A surface that replaces one of an epoch is taken in its place.
  state.is_together = is_together || (state.is_ready && state.is_together);
  state.is_ready = state.surface != nullptr || state.is_shown;
  if (!state.is_ready || state.is_listed) return;
  totals_.ready.push_back({{handle_, SurfaceContent::Voxels}, chunk});
  state.is_listed = true;
}

std::unique_ptr<SurfaceJob> VoxelSurfaces::make_job(SurfaceInputs& inputs, IVec3 chunk) {
  QUOIN_ASSERT(waiting_.contains(chunk) || edited_.contains(chunk), "a chunk that waits");
  const bool is_blocky = options_.style == SurfaceStyle::Blocky;
  return make_job(inputs.voxels(), chunk, *inputs.types, is_blocky ? inputs.light() : nullptr);
}

std::unique_ptr<SurfaceJob> VoxelSurfaces::make_job(const GridSnapshot& grid, IVec3 chunk, const SurfaceTypes& types,
                                                    const LightSnapshot& light) {
  QUOIN_ASSERT(types.registry != nullptr, "types to mesh with");
  const VoxelChunk& state = chunks_.at(chunk);
  auto job = std::make_unique<SurfaceJob>();
  job->source = {handle_, SurfaceContent::Voxels};
  job->chunk = chunk;
  job->types = types.registry;
  job->serial = ++totals_.serial;
  job->seen = state.seen;
  job->voxels = grid;
  if (options_.style == SurfaceStyle::Blocky) {
    job->light = light;
    return job;
  }
  job->densities = densities_.around(chunk, types.registry);
  job->materials = types.materials;
  job->type_generation = types.generation;
  job->last_collected = state.collected;
  job->data_generation = state.data_generation;
  const bool is_as_before = state.type_generation == types.generation && state.collected_data == state.data_generation;
  if (state.last_stamps != nullptr && is_as_before) job->last_stamps = *state.last_stamps;
  return job;
}

void VoxelSurfaces::hand_over(IVec3 chunk, std::uint64_t serial) {
  VoxelChunk& state = chunks_.at(chunk);
  QUOIN_ASSERT(state.is_waiting && !state.is_gone, "a chunk that waits");
  waiting_.erase(chunk);
  const Change change(totals_, state);
  state.is_waiting = false;
  state.is_working = true;
  state.serial = serial;
}

bool VoxelSurfaces::is_current(const SurfaceJob& job) const {
  const auto found = chunks_.find(job.chunk);
  if (found == chunks_.end()) return false;
  const VoxelChunk& state = found->second;
  if (state.is_in_epoch && epoch_.at(job.chunk).serial == job.serial) return true;
  const bool waits_again = state.is_waiting || state.is_edited;
  return !state.is_gone && !waits_again && state.serial == job.serial && job.serial >= state.oldest;
}

void VoxelSurfaces::withdrawn(const SurfaceJob& job) {
  const auto found = chunks_.find(job.chunk);
  if (found == chunks_.end() || found->second.serial != job.serial || found->second.is_gone) return;
  VoxelChunk& state = found->second;
  mark(job.chunk, state, Cause::Load, state.seen);
  const Change change(totals_, state);
  state.is_working = false;
}

// Updates the stamps of the surface if the new densities read the same as its old ones. Later
// densities are then compared with the new ones.
void VoxelSurfaces::keep_densities(const SurfaceJob& job) {
  const std::uint32_t kept = densities_.keep(job.chunk, job.densities);
  const int reach = reach_of(options_.occlusion);
  for (int i = 0; i < 27; ++i) {
    if ((kept >> i & 1U) == 0) continue;
    const VoxelDensity& density = *job.densities[static_cast<std::size_t>(i)];
    for (int n = 0; n < 27; ++n) {
      const auto found = chunks_.find(job.chunk + Neighbourhood::offset(i) + Neighbourhood::offset(n));
      if (found == chunks_.end() || found->second.last_stamps == nullptr) continue;
      std::uint64_t& stamp = (*found->second.last_stamps)[static_cast<std::size_t>(26 - n)];
      if (density.reads_as(stamp, reach, Neighbourhood::offset(n))) stamp = density.stamp();
    }
  }
}

void VoxelSurfaces::keep_stamps(const SurfaceJob& job, VoxelChunk& state) {
  if (state.last_stamps == nullptr) state.last_stamps = std::make_unique<DensityStamps>();
  for (std::size_t i = 0; i < 27; ++i) {
    (*state.last_stamps)[i] = job.densities[i] == nullptr ? 0 : job.densities[i]->stamp();
  }
  state.type_generation = job.type_generation;
  state.collected_data = job.data_generation;
}

void VoxelSurfaces::collect(SurfaceJob& job) {
  if (options_.style == SurfaceStyle::Smooth) keep_densities(job);
  const auto found = chunks_.find(job.chunk);
  if (found == chunks_.end()) return;
  VoxelChunk& state = found->second;
  const auto member = epoch_.find(job.chunk);
  if (member != epoch_.end() && member->second.serial == job.serial) return collect_member(job, state, member->second);
  // Smooth jobs of the epoch are compared with the surface that was collected last.
  if (state.is_gone || (state.is_in_epoch && options_.style == SurfaceStyle::Smooth)) return;
  const Change change(totals_, state);
  const bool is_newest = job.serial == state.serial;
  if (is_newest) state.is_working = false;
  if (job.serial < state.oldest || job.serial <= state.collected) return;
  // Another job's surface, collected in the meantime, may differ from the surface that this job was compared with.
  const bool is_void = job.outcome == SurfaceJob::Outcome::OutOfMemory ||
                       (job.outcome == SurfaceJob::Outcome::AsBefore && job.last_collected != state.collected);
  if (is_void) {
    if (is_newest && !state.is_edited) {
      waiting_.insert(job.chunk);
      state.is_waiting = true;
    }
    return;
  }
  state.collected = job.serial;
  if (options_.style == SurfaceStyle::Smooth) keep_stamps(job, state);
  if (job.outcome == SurfaceJob::Outcome::AsBefore) return;
  show(job.chunk, state, std::move(job.surface), false);
}

void VoxelSurfaces::collect_member(SurfaceJob& job, VoxelChunk& state, Member& member) {
  QUOIN_ASSERT(!member.is_done && totals_.in_epoch > 0, "an unfinished chunk of the epoch");
  QUOIN_ASSERT(job.outcome != SurfaceJob::Outcome::OutOfMemory, "jobs of an epoch are repeated");
  QUOIN_ASSERT(job.outcome != SurfaceJob::Outcome::AsBefore || job.last_collected == state.collected,
               "compared with the newest surface");
  const Change change(totals_, state);
  state.is_working = false;
  state.collected = job.serial;
  if (options_.style == SurfaceStyle::Smooth) keep_stamps(job, state);
  member.is_done = true;
  member.is_as_before = job.outcome == SurfaceJob::Outcome::AsBefore;
  member.surface = std::move(job.surface);
  --totals_.in_epoch;
}

std::size_t VoxelSurfaces::count_edited(bool& has_edits) const {
  has_edits |= !edited_.empty();
  return static_cast<std::size_t>(
      std::count_if(edited_.begin(), edited_.end(), [&](IVec3 chunk) { return !chunks_.at(chunk).is_gone; }));
}

void VoxelSurfaces::begin_epoch(SurfaceInputs* inputs, std::vector<std::unique_ptr<SurfaceJob>>& jobs) {
  QUOIN_ASSERT(epoch_.empty(), "no epoch is in progress");
  std::vector<IVec3> chunks(edited_.begin(), edited_.end());
  sort_and_unite(chunks);
  for (const IVec3 chunk : chunks) {
    VoxelChunk& state = chunks_.at(chunk);
    QUOIN_ASSERT(state.is_gone || inputs != nullptr, "a grid with the chunk");
    std::unique_ptr<SurfaceJob> job = state.is_gone ? nullptr : make_job(*inputs, chunk);
    if (job != nullptr) jobs.push_back(nullptr);
    Member& member = epoch_[chunk];
    const Change change(totals_, state);
    edited_.erase(chunk);
    state.is_edited = false;
    state.is_in_epoch = true;
    if (job == nullptr) {
      member.is_done = true;
      state.last_stamps.reset();
      continue;
    }
    member.serial = state.serial = job->serial;
    state.is_working = true;
    ++totals_.in_epoch;
    jobs.back() = std::move(job);
  }
}

void VoxelSurfaces::give_epoch() {
  QUOIN_ASSERT(totals_.in_epoch == 0, "all surfaces of the epoch are complete");
  while (!epoch_.empty()) {
    const auto member = epoch_.begin();
    const IVec3 chunk = member->first;
    VoxelChunk& state = chunks_.at(chunk);
    {
      const Change change(totals_, state);
      if (!member->second.is_as_before) show(chunk, state, std::move(member->second.surface), true);
      state.is_in_epoch = false;
    }
    epoch_.erase(member);
    erase_if_over(chunk);
  }
}

void VoxelSurfaces::release_edits() {
  for (const IVec3 chunk : std::exchange(edited_, {})) {
    VoxelChunk& state = chunks_.at(chunk);
    {
      const Change change(totals_, state);
      state.is_edited = false;
    }
    if (state.is_gone) {
      remove(chunk, Cause::Load);
    } else {
      mark(chunk, state, Cause::Load, state.seen);
    }
  }
}

// Returns the regions that differ from the ones taken last. Does not throw.
std::uint64_t VoxelSurfaces::note_regions(VoxelChunk& state) const {
  constexpr std::uint64_t kAll = ~std::uint64_t{0};
  if (!has_regions()) return kAll;
  if (state.surface == nullptr) {
    state.region_hashes = std::vector<std::uint64_t>();
    return kAll;
  }
  const int across = kChunkEdge / options_.region_edge;
  QUOIN_ASSERT(state.region_hashes.capacity() >= region_count(), "memory from `show`");
  std::array<std::uint64_t, kMaxRegions> now{};
  for (const SurfaceRegion& each : state.surface->regions) {
    const IVec3 at = each.region;
    QUOIN_ASSERT(at.x < across && at.y < across && at.z < across, "a region of the chunk");
    now[static_cast<std::size_t>(at.x + across * (at.y + across * at.z))] = each.hash;
  }
  if (state.region_hashes.empty()) {
    state.region_hashes.assign(now.begin(), now.begin() + static_cast<std::ptrdiff_t>(region_count()));
    return kAll;
  }
  QUOIN_ASSERT(state.region_hashes.size() == region_count(), "regions of one size");
  std::uint64_t changed = 0;
  for (std::size_t i = 0; i < state.region_hashes.size(); ++i) {
    changed |= std::uint64_t{std::exchange(state.region_hashes[i], now[i]) != now[i]} << i;
  }
  return changed;
}

SurfaceSource::Turn VoxelSurfaces::turn_of(IVec3 chunk) const {
  const auto found = chunks_.find(chunk);
  if (found == chunks_.end() || !found->second.is_ready || found->second.is_together) return Turn::Now;
  return found->second.state <= totals_.complete ? Turn::IfRoom : Turn::Later;
}

void VoxelSurfaces::take(IVec3 chunk, std::vector<SurfaceUpdate>& out) {
  const auto found = chunks_.find(chunk);
  if (found == chunks_.end()) return;
  VoxelChunk& state = found->second;
  {
    const Change change(totals_, state);
    state.is_listed = false;
    if (state.is_ready) {
      state.is_ready = state.is_together = false;
      state.is_shown = state.surface != nullptr;
      const std::uint64_t changed = note_regions(state);
      out.push_back({handle_, chunk, std::move(state.surface), SurfaceContent::Voxels, changed});
      state.surface.reset();
    }
  }
  erase_if_over(chunk);
}

}  // namespace quoin
