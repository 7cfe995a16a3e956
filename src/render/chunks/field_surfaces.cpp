#include "render/chunks/field_surfaces.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <quoin/core/assert.h>

#include "core/coordinates/chunk_order.h"

namespace quoin {
namespace {

// Maximum number of chunks whose levels change at a time, so that edits near them need not wait long.
constexpr std::size_t kMaxLevelChanges = 32;

// Returns the chunks that contain corners of a chunk's cells: the chunk and those after it.
IVec3 corner_chunk(IVec3 chunk, int i) {
  return chunk + IVec3{i & 1, i >> 1 & 1, i >> 2};
}

// Returns the chunks with cells that have samples of a chunk as corners: the chunk and those before it.
IVec3 cell_chunk(IVec3 chunk, int i) {
  return chunk - IVec3{i & 1, i >> 1 & 1, i >> 2};
}

bool is_there(const DensityGrid& field, IVec3 chunk) {
  if (!field.is_loaded_around(chunk)) return false;
  for (int i = 0; i < 8; ++i) {
    if (field.find_chunk(corner_chunk(chunk, i)) != nullptr) return true;
  }
  return false;
}

// The signs of the samples of row y + 64 z; null is far air.
std::uint64_t signs_of(const DensityChunk* samples, int row) {
  QUOIN_ASSERT(row >= 0 && row < kChunkEdge * kChunkEdge, "a row of the chunk");
  return samples == nullptr ? 0 : samples->solid_row(row % kChunkEdge, row / kChunkEdge);
}

// Surfaces are owned by where their lattice edges start: these end in the chunk, or in the first layer of the next one
// along an axis.
bool has_changes_of_sign(const DensityGrid& field, IVec3 chunk) {
  const DensityChunk* const own = field.find_chunk(chunk);
  const std::uint64_t sign = signs_of(own, 0);
  if (sign != 0 && ~sign != 0) return true;
  constexpr int kRows = kChunkEdge * kChunkEdge;
  for (int row = 0; row < kRows; ++row) {
    if (signs_of(own, row) != sign) return true;
  }
  const DensityChunk* const after_x = field.find_chunk(chunk + IVec3{1, 0, 0});
  const DensityChunk* const after_y = field.find_chunk(chunk + IVec3{0, 1, 0});
  const DensityChunk* const after_z = field.find_chunk(chunk + IVec3{0, 0, 1});
  for (int row = 0; row < kRows; ++row) {
    if (((signs_of(after_x, row) ^ sign) & 1) != 0) return true;
  }
  for (int i = 0; i < kChunkEdge; ++i) {
    if (signs_of(after_y, i * kChunkEdge) != sign || signs_of(after_z, i) != sign) return true;
  }
  return false;
}

// Touching bodies have surfaces without a change of sign.
bool may_have_surface(const DensityGrid& field, const VoxelRegistry& types, IVec3 chunk) {
  if (has_changes_of_sign(field, chunk)) return true;
  if (!types.has_transparent()) return false;
  std::vector<VoxelType> materials;
  for (int i = 0; i < 8; ++i) {
    const DensityChunk* const samples = field.find_chunk(corner_chunk(chunk, i));
    if (samples == nullptr) continue;
    const std::vector<VoxelType> some = samples->materials().types();
    materials.insert(materials.end(), some.begin(), some.end());
  }
  const auto is_opaque = [&](VoxelType type) { return !types.is_transparent(type); };
  const bool is_all_opaque = std::all_of(materials.begin(), materials.end(), is_opaque);
  return !is_all_opaque &&
         std::any_of(materials.begin(), materials.end(), [&](VoxelType type) { return type != materials.front(); });
}

// `present`: the level it has; -1: none.
int level_for(double distance, int present, double step) {
  const double first = std::isnan(step) ? std::numeric_limits<double>::infinity() : step > 0.0 ? step : 1.0;
  const auto level_at = [&](double samples) {
    int level = 0;
    while (level < kMaxSmoothLevel && samples > std::ldexp(first, level)) ++level;
    return level;
  };
  constexpr double kRoom = 1.1;
  if (present < 0) return level_at(distance);
  return std::clamp(present, level_at(distance / kRoom), level_at(distance * kRoom));
}

}  // namespace

FieldSurfaces::FieldSurfaces(GridHandle handle, const ChunkSurfaceOptions& options, SurfaceTotals& totals)
    : handle_(handle), options_(options), totals_(totals) {}

void FieldSurfaces::follow(const SceneGrid& content, const VoxelRegistry& /*types*/, SurfaceClock::time_point now) {
  has_left_ = false;
  PendingChanges changes(followed_, content.field);
  if (changes->empty()) return;
  if (changes->all) {
    begin_anew(content.field, now);
  } else {
    follow_changes(content.field, *changes, now);
  }
  changes.commit();
}

// Marks all chunks, because their surfaces belong to another field. The epoch in progress shows the former field.
void FieldSurfaces::begin_anew(const DensityGrid& field, SurfaceClock::time_point now) {
  const bool is_load = totals_.loads_only || field.is_partial() || field.chunk_count() > kMaxEpochChunks;
  if (is_load || is_forgotten_) abandon_groups();
  is_forgotten_ = false;
  bodies_.clear();
  const bool replaces =
      std::any_of(chunks_.begin(), chunks_.end(), [](const auto& each) { return each.second.was_given; });
  const Cause cause = !is_load ? Cause::Edit : replaces ? Cause::Level : Cause::Load;
  Members all;
  for (const IVec3 chunk : field.chunks()) {
    for (int i = 0; i < 8; ++i) all.push_back(cell_chunk(chunk, i));
  }
  for (const auto& [chunk, state] : chunks_) all.push_back(chunk);
  sort_and_unite(all);
  for (const IVec3 chunk : all) {
    see_whether_there(field, chunk, cause, now);
    if (chunks_.contains(chunk)) mark(chunk, cause, now);
  }
}

void FieldSurfaces::follow_changes(const DensityGrid& field, const DensityChanges& changes,
                                   SurfaceClock::time_point now) {
  const Cause edit = totals_.loads_only ? Cause::Level : Cause::Edit;
  for (const DensityChange& change : changes.items_unless_all()) {
    bodies_.erase(change.chunk);
    // A loaded chunk completes surfaces that did not exist before, and unloading removes the neighbours' surfaces.
    // Neither has to match the visible surfaces.
    if (!change.is_edit) {
      for (int i = 0; i < 27; ++i) see_whether_there(field, change.chunk + Neighbourhood::offset(i), Cause::Load, now);
      continue;
    }
    for (int i = 0; i < 8; ++i) see_whether_there(field, cell_chunk(change.chunk, i), edit, now);
  }
  for (const DensityChange& change : changes.items_unless_all()) {
    if (!change.is_edit) continue;
    for (int i = 0; i < 27; ++i) {
      const IVec3 offset = Neighbourhood::offset(i);
      const IVec3 chunk = change.chunk + offset;
      if (chunks_.contains(chunk) && change.affects(offset, reach_at(chunk))) mark(chunk, edit, now);
    }
  }
}

void FieldSurfaces::see_whether_there(const DensityGrid& field, IVec3 chunk, Cause cause,
                                      SurfaceClock::time_point now) {
  const auto found = chunks_.find(chunk);
  const bool was_there = found != chunks_.end() && !found->second.is_gone;
  if (is_there(field, chunk) == was_there) return;
  if (!was_there) wants_levels_ = true;
  mark(chunk, cause, now);
  FieldChunk& state = chunks_.at(chunk);
  state.is_gone = was_there;
  if (was_there) set_level(chunk, state, 0, now);
}

void FieldSurfaces::mark(IVec3 chunk, Cause cause, SurfaceClock::time_point now) {
  FieldChunk& state = chunks_[chunk];
  stale_.insert(chunk);
  if (cause == Cause::Edit) edited_.insert(chunk);
  box_ = unite(box_, {chunk, chunk + 1});
  const Change change(totals_, state);
  state.is_stale = true;
  state.is_bound |= cause != Cause::Load;
  state.is_edited |= cause == Cause::Edit;
  state.seen = now;
  is_prepared_ = false;
}

// Neighbours depend on each other's levels.
void FieldSurfaces::set_level(IVec3 chunk, FieldChunk& state, int level, SurfaceClock::time_point now) {
  QUOIN_ASSERT(level >= 0 && level <= kMaxSmoothLevel, "a level of detail");
  if (state.level == level) return;
  state.level = static_cast<std::uint8_t>(level);
  bool is_seen = !state.is_new();
  for (int i = 0; i < 27; ++i) {
    const IVec3 adjacent = chunk + Neighbourhood::offset(i);
    const auto found = chunks_.find(adjacent);
    if (i == 13 || found == chunks_.end() || found->second.is_new()) continue;
    mark(adjacent, Cause::Level, now);
    is_seen = true;
  }
  if (is_seen) mark(chunk, Cause::Level, now);
}

void FieldSurfaces::choose_levels(const ChunkDistances& distances, SurfaceClock::time_point now) {
  std::erase_if(changing_levels_, [&](IVec3 chunk) {
    const auto found = chunks_.find(chunk);
    return found == chunks_.end() || !found->second.is_unfinished();
  });
  struct LevelRequest {
    double distance;
    IVec3 chunk;
    int level;
  };
  std::vector<LevelRequest> requests;
  for (auto& [chunk, state] : chunks_) {
    if (state.is_gone) continue;
    const double distance = distances.in_voxels(chunk);
    const int level = level_for(distance, state.is_new() ? -1 : state.level, options_.detail_distance);
    if (level == state.level) continue;
    if (state.is_new()) {
      set_level(chunk, state, level, now);
    } else {
      requests.push_back({distance, chunk, level});
    }
  }
  wants_levels_ = !requests.empty();
  if (requests.empty() || !changing_levels_.empty()) return;
  const std::size_t count = std::min(requests.size(), kMaxLevelChanges);
  std::partial_sort(requests.begin(), requests.begin() + static_cast<std::ptrdiff_t>(count), requests.end(),
                    [](const LevelRequest& a, const LevelRequest& b) {
                      return a.distance != b.distance ? a.distance < b.distance : by_zyx(a.chunk, b.chunk);
                    });
  requests.resize(count);
  for (const LevelRequest& request : requests) {
    set_level(request.chunk, chunks_.at(request.chunk), request.level, now);
    changing_levels_.push_back(request.chunk);
  }
}

std::array<std::uint8_t, 27> FieldSurfaces::levels_around(IVec3 chunk) const {
  std::array<std::uint8_t, 27> levels{};
  for (std::size_t i = 0; i < 27; ++i) {
    const auto found = chunks_.find(chunk + Neighbourhood::offset(static_cast<int>(i)));
    if (found != chunks_.end()) levels[i] = found->second.level;
  }
  return levels;
}

int FieldSurfaces::reach_at(IVec3 chunk) const {
  const std::array<std::uint8_t, 27> levels = levels_around(chunk);
  return reach_of(options_.occlusion, *std::max_element(levels.begin(), levels.end()));
}

// Types that become transparent, or no longer are, make other surfaces, which chunks have in common.
void FieldSurfaces::mark_types(const SceneGrid& content, const ChangedTypes& changed, SurfaceClock::time_point now) {
  if (changed.colour.empty() && changed.visibility.empty()) return;
  for (const IVec3 chunk : content.field.chunks()) {
    const std::vector<VoxelType> types = content.field.find_chunk(chunk)->materials().types();
    const auto has_any = [&](const std::vector<bool>& set) {
      return std::any_of(types.begin(), types.end(), [&](VoxelType type) { return type < set.size() && set[type]; });
    };
    const bool is_other_surface = has_any(changed.visibility);
    if (!is_other_surface && !has_any(changed.colour)) continue;
    for (int i = 0; i < 27; ++i) {
      const auto adjacent = chunks_.find(chunk + Neighbourhood::offset(i));
      if (adjacent == chunks_.end()) continue;
      const Cause edit = totals_.loads_only ? Cause::Level : Cause::Edit;
      mark(adjacent->first, is_other_surface && !adjacent->second.is_new() ? edit : Cause::Load, now);
    }
  }
}

// The chunks that have to be given together with a stale one.
FieldSurfaces::Members FieldSurfaces::members_with(IVec3 chunk) const {
  Members members{chunk};
  if (!chunks_.at(chunk).is_bound) return members;
  ChunkSet seen{chunk};
  for (std::size_t next = 0; next < members.size(); ++next) {
    for (int i = 0; i < 27; ++i) {
      const IVec3 adjacent = members[next] + Neighbourhood::offset(i);
      if (!stale_.contains(adjacent) || !chunks_.at(adjacent).is_bound || !seen.insert(adjacent).second) continue;
      members.push_back(adjacent);
    }
  }
  return members;
}

bool FieldSurfaces::may_begin(const Members& members) const {
  return std::none_of(members.begin(), members.end(), [&](IVec3 chunk) { return chunks_.at(chunk).group != nullptr; });
}

bool FieldSurfaces::is_edited(const Members& members) const {
  return std::any_of(members.begin(), members.end(), [&](IVec3 chunk) { return edited_.contains(chunk); });
}

void FieldSurfaces::prepare(const SceneGrid& content, const VoxelRegistry& types) {
  if (is_prepared_) return;
  is_blocked_ = false;
  ChunkSet seen;
  const Members stale(stale_.begin(), stale_.end());
  for (const IVec3 chunk : stale) {
    if (seen.contains(chunk)) continue;
    const Members members = members_with(chunk);
    seen.insert(members.begin(), members.end());
    // Groups with edits begin with their epoch.
    const bool begins = may_begin(members) && !is_edited(members);
    bool is_empty = true;
    for (const IVec3 each : members) {
      FieldChunk& state = chunks_.at(each);
      if (state.group != nullptr) continue;  // its present group contains the chunks it waits for
      state.is_empty = state.is_gone || !may_have_surface(content.field, types, each);
      is_empty &= state.is_empty;
      if (begins && !state.is_empty) {
        waiting_.insert(each);
      } else {
        waiting_.erase(each);
      }
    }
    is_blocked_ |= !begins;
    if (begins && is_empty) begin_group(members, false);
  }
  is_prepared_ = true;
}

std::shared_ptr<FieldSurfaces::Group> FieldSurfaces::begin_group(const Members& members, bool is_in_epoch) {
  auto group = std::make_shared<Group>();
  group->chunks = members;
  group->unfinished = members.size();
  group->is_in_epoch = is_in_epoch;
  group->state = totals_.state;
  for (const IVec3 chunk : members) {
    FieldChunk& state = chunks_.at(chunk);
    const std::array<std::uint8_t, 27> levels = levels_around(chunk);
    stale_.erase(chunk);
    edited_.erase(chunk);
    const Change change(totals_, state);
    state.is_stale = state.is_bound = state.is_edited = false;
    state.is_working = state.is_done = false;
    state.serial = 0;
    state.levels = levels;
    state.group = group;
  }
  for (const IVec3 chunk : members) {
    FieldChunk& state = chunks_.at(chunk);
    if (state.is_empty) finish_chunk(state, nullptr);
  }
  if (group->unfinished == 0 && !is_in_epoch) give(*group);
  return group;
}

std::shared_ptr<const FieldBodies> FieldSurfaces::bodies_around(const Members& members, const DensityGrid& field) {
  auto around = std::make_shared<FieldBodies>();
  for (const IVec3 chunk : members) {
    for (int i = 0; i < 27; ++i) {
      const IVec3 at = chunk + Neighbourhood::offset(i);
      if (field.find_chunk(at) == nullptr) continue;
      std::shared_ptr<BodyChunks>& bodies = bodies_[at];
      if (bodies == nullptr) bodies = std::make_shared<BodyChunks>();
      around->emplace(at, bodies);
    }
  }
  return around;
}

void FieldSurfaces::finish_chunk(FieldChunk& state, std::shared_ptr<const ChunkSurface> surface) {
  QUOIN_ASSERT(state.group != nullptr && state.group->unfinished > 0 && !state.is_done,
               "an unfinished chunk of a group");
  state.is_working = false;
  state.is_done = true;
  state.result = std::move(surface);
  --state.group->unfinished;
}

// The whole group is done. It can be taken as soon as any surface that it replaces before that was taken: an epoch
// must not lose a part, and a group must not be divided.
void FieldSurfaces::give(const Group& group) {
  std::uint64_t shown_from = group.is_in_epoch ? 0 : group.state;
  for (const IVec3 chunk : group.chunks) {
    const FieldChunk& state = chunks_.at(chunk);
    if (state.is_ready) shown_from = std::min(shown_from, state.state);
  }
  for (const IVec3 chunk : group.chunks) {
    FieldChunk& state = chunks_.at(chunk);
    QUOIN_ASSERT(state.group.get() == &group && state.is_done, "a finished chunk of the group");
    {
      const Change change(totals_, state);
      state.group.reset();
      state.is_done = false;
      state.was_given = true;
      state.state = shown_from;
      state.surface = std::move(state.result);
      state.result.reset();
      state.is_ready = false;
      if (state.surface != nullptr || state.is_shown) make_ready(chunk, state);
    }
    erase_if_over(chunk);
  }
  if (is_blocked_) is_prepared_ = false;
}

void FieldSurfaces::erase_if_over(IVec3 chunk) {
  const auto found = chunks_.find(chunk);
  QUOIN_ASSERT(found != chunks_.end(), "a known chunk");
  const FieldChunk& state = found->second;
  if (state.is_gone && !state.is_pending() && !state.is_listed) chunks_.erase(found);
}

void FieldSurfaces::abandon_groups() {
  for (const std::shared_ptr<Group>& group : epoch_) totals_.in_epoch -= group->unfinished != 0 ? 1 : 0;
  epoch_.clear();
  for (auto& [chunk, state] : chunks_) {
    if (state.group == nullptr) continue;
    stale_.insert(chunk);
    const Change change(totals_, state);
    state.group.reset();
    state.is_stale = true;
    state.is_working = state.is_done = false;
    state.result.reset();
    state.serial = 0;
  }
  waiting_.clear();
  is_prepared_ = false;
}

void FieldSurfaces::leave() {
  has_left_ = true;
  bodies_.clear();
  Members all;
  for (auto& [chunk, state] : chunks_) {
    const bool is_in_group = state.group != nullptr && !state.group->is_in_epoch;
    if (!state.is_gone || state.is_stale || is_in_group) all.push_back(chunk);
  }
  for (const IVec3 chunk : all) {
    FieldChunk& state = chunks_.at(chunk);
    mark(chunk, Cause::Edit, state.seen);
    waiting_.erase(chunk);
    state.is_gone = state.is_empty = true;
    // Ends a group of another level. Chunks of an epoch in progress are shown before they are removed.
    if (state.group == nullptr || state.group->is_in_epoch) continue;
    const Change change(totals_, state);
    state.group.reset();
    state.is_working = state.is_done = false;
    state.result.reset();
    state.serial = 0;
  }
  followed_ = {};
}

void FieldSurfaces::forget() {
  followed_ = {};
  is_forgotten_ = true;
  for (const std::shared_ptr<Group>& group : epoch_) {
    totals_.in_epoch -= group->unfinished != 0 ? 1 : 0;
  }
  epoch_.clear();
  for (auto& [chunk, state] : chunks_) {
    if (state.group != nullptr) state.group->is_in_epoch = false;
  }
}

void FieldSurfaces::discard() {
  for (auto& [chunk, state] : chunks_) {
    state.result.reset();
    if (!state.is_ready) continue;
    const Change change(totals_, state);
    state.surface.reset();
    state.is_ready = false;
    // If the chunk is gone, `follow` or `leave` finds out again.
    state.is_gone = false;
  }
}

void FieldSurfaces::make_ready(IVec3 chunk, FieldChunk& state) {
  state.is_ready = true;
  if (state.is_listed) return;
  totals_.ready.push_back({{handle_, SurfaceContent::Field}, chunk});
  state.is_listed = true;
}

std::unique_ptr<SurfaceJob> FieldSurfaces::make_job(SurfaceInputs& inputs, IVec3 chunk) {
  QUOIN_ASSERT(waiting_.contains(chunk), "a chunk that waits");
  if (chunks_.at(chunk).group == nullptr) set_inputs(*begin_group(members_with(chunk), false), inputs);
  return job_of(inputs, chunk);
}

void FieldSurfaces::set_inputs(Group& group, SurfaceInputs& inputs) {
  group.field = inputs.field();
  group.types = inputs.types->registry;
  if (group.types->has_transparent()) group.bodies = bodies_around(group.chunks, *group.field);
}

std::unique_ptr<SurfaceJob> FieldSurfaces::job_of(const SurfaceInputs& inputs, IVec3 chunk) {
  const FieldChunk& state = chunks_.at(chunk);
  auto job = std::make_unique<SurfaceJob>();
  job->source = {handle_, SurfaceContent::Field};
  job->chunk = chunk;
  job->serial = ++totals_.serial;
  job->seen = state.seen;
  job->field = state.group->field;
  job->bodies = state.group->bodies;
  job->levels = state.levels;
  job->types = state.group->types;
  job->materials = inputs.types->materials;
  return job;
}

void FieldSurfaces::hand_over(IVec3 chunk, std::uint64_t serial) {
  FieldChunk& state = chunks_.at(chunk);
  QUOIN_ASSERT(state.group != nullptr && !state.is_working, "a chunk whose group has begun");
  waiting_.erase(chunk);
  state.is_working = true;
  state.serial = serial;
}

bool FieldSurfaces::is_current(const SurfaceJob& job) const {
  const auto found = chunks_.find(job.chunk);
  return found != chunks_.end() && found->second.group != nullptr && found->second.serial == job.serial;
}

void FieldSurfaces::withdrawn(const SurfaceJob& job) {
  if (!is_current(job)) return;
  waiting_.insert(job.chunk);
  chunks_.at(job.chunk).is_working = false;
}

void FieldSurfaces::collect(SurfaceJob& job) {
  if (!is_current(job)) return;
  FieldChunk& state = chunks_.at(job.chunk);
  if (job.outcome == SurfaceJob::Outcome::OutOfMemory) return withdrawn(job);
  finish_chunk(state, std::move(job.surface));
  if (state.group->unfinished != 0) return;
  const std::shared_ptr<Group> group = state.group;
  if (group->is_in_epoch) {
    QUOIN_ASSERT(totals_.in_epoch > 0, "an unfinished group of the epoch");
    --totals_.in_epoch;
  } else {
    give(*group);
  }
}

std::size_t FieldSurfaces::count_edited(bool& has_edits) const {
  has_edits |= !edited_.empty();
  return static_cast<std::size_t>(
      std::count_if(edited_.begin(), edited_.end(), [&](IVec3 chunk) { return !chunks_.at(chunk).is_gone; }));
}

// Returns the connected groups that contain an edited chunk.
std::vector<FieldSurfaces::Members> FieldSurfaces::edited_groups() const {
  std::vector<Members> groups;
  ChunkSet seen;
  for (const IVec3 chunk : edited_) {
    if (seen.contains(chunk)) continue;
    groups.push_back(members_with(chunk));
    seen.insert(groups.back().begin(), groups.back().end());
  }
  return groups;
}

bool FieldSurfaces::may_begin_epoch() {
  bool may_begin = true;
  for (const Members& members : edited_groups()) {
    for (const IVec3 chunk : members) {
      const std::shared_ptr<Group>& group = chunks_.at(chunk).group;
      if (group == nullptr) continue;
      group->is_urgent = true;
      may_begin = false;
    }
  }
  return may_begin;
}

bool FieldSurfaces::is_urgent(IVec3 chunk) const {
  const auto found = chunks_.find(chunk);
  return found != chunks_.end() && found->second.group != nullptr && found->second.group->is_urgent;
}

void FieldSurfaces::begin_epoch(SurfaceInputs* inputs, std::vector<std::unique_ptr<SurfaceJob>>& jobs) {
  QUOIN_ASSERT(epoch_.empty(), "no epoch is in progress");
  std::vector<Members> groups = edited_groups();
  epoch_.reserve(groups.size());
  for (Members& members : groups) {
    sort_and_unite(members);
    const std::shared_ptr<Group>& group = epoch_.emplace_back(begin_group(members, true));
    if (group->unfinished == 0) continue;
    ++totals_.in_epoch;
    QUOIN_ASSERT(inputs != nullptr, "a field with the chunks");
    set_inputs(*group, *inputs);
    for (const IVec3 chunk : members) {
      if (chunks_.at(chunk).is_done) continue;
      jobs.push_back(job_of(*inputs, chunk));
      hand_over(chunk, jobs.back()->serial);
    }
  }
}

void FieldSurfaces::give_epoch() {
  QUOIN_ASSERT(totals_.in_epoch == 0, "all surfaces of the epoch are complete");
  for (const std::shared_ptr<Group>& group : std::exchange(epoch_, {})) give(*group);
}

void FieldSurfaces::release_edits() {
  for (const IVec3 chunk : edited_) chunks_.at(chunk).is_edited = false;
  edited_.clear();
  is_prepared_ = false;
  if (!has_left_) return;
  // Without a field there is nothing to mesh or to wait for.
  for (const IVec3 chunk : Members(stale_.begin(), stale_.end())) {
    if (chunks_.at(chunk).group == nullptr) begin_group({chunk}, false);
  }
}

SurfaceSource::Turn FieldSurfaces::turn_of(IVec3 chunk) const {
  const auto found = chunks_.find(chunk);
  const bool waits = found != chunks_.end() && found->second.is_ready && found->second.state > totals_.complete;
  return waits ? Turn::Later : Turn::Now;
}

void FieldSurfaces::take(IVec3 chunk, std::vector<SurfaceUpdate>& out) {
  const auto found = chunks_.find(chunk);
  if (found == chunks_.end()) return;
  FieldChunk& state = found->second;
  {
    const Change change(totals_, state);
    state.is_listed = false;
    if (state.is_ready) {
      state.is_ready = false;
      state.is_shown = state.surface != nullptr;
      out.push_back({handle_, chunk, std::move(state.surface), SurfaceContent::Field, ~std::uint64_t{0}});
      state.surface.reset();
    }
  }
  erase_if_over(chunk);
}

}  // namespace quoin
