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

void FieldSurfaces::follow(const SceneGrid& content, SurfaceClock::time_point now) {
  PendingChanges changes(followed_, content.field);
  if (changes->empty()) return;
  if (changes->all) {
    begin_anew(content.field, now);
  } else {
    follow_changes(content.field, *changes, now);
  }
  changes.commit();
}

// Discards all surfaces and jobs, because they belong to another field.
void FieldSurfaces::begin_anew(const DensityGrid& field, SurfaceClock::time_point now) {
  abandon_groups();
  bodies_.clear();
  const bool replaces =
      std::any_of(chunks_.begin(), chunks_.end(), [](const auto& each) { return each.second.was_given; });
  Members all;
  for (const IVec3 chunk : field.chunks()) {
    for (int i = 0; i < 8; ++i) all.push_back(cell_chunk(chunk, i));
  }
  for (const auto& [chunk, state] : chunks_) all.push_back(chunk);
  sort_and_unite(all);
  for (const IVec3 chunk : all) {
    see_whether_there(field, chunk, replaces, now);
    if (chunks_.contains(chunk)) mark(chunk, replaces, now);
  }
}

void FieldSurfaces::follow_changes(const DensityGrid& field, const DensityChanges& changes,
                                   SurfaceClock::time_point now) {
  for (const DensityChange& change : changes.items) {
    bodies_.erase(change.chunk);
    // A loaded chunk completes surfaces that did not exist before, and unloading removes the neighbours' surfaces.
    // Neither has to match the visible surfaces.
    if (!change.is_edit) {
      for (int i = 0; i < 27; ++i) see_whether_there(field, change.chunk + Neighbourhood::offset(i), false, now);
      continue;
    }
    for (int i = 0; i < 8; ++i) see_whether_there(field, cell_chunk(change.chunk, i), true, now);
  }
  for (const DensityChange& change : changes.items) {
    if (!change.is_edit) continue;
    for (int i = 0; i < 27; ++i) {
      const IVec3 offset = Neighbourhood::offset(i);
      const IVec3 chunk = change.chunk + offset;
      if (chunks_.contains(chunk) && change.affects(offset, reach_at(chunk))) mark(chunk, true, now);
    }
  }
}

void FieldSurfaces::see_whether_there(const DensityGrid& field, IVec3 chunk, bool is_bound,
                                      SurfaceClock::time_point now) {
  const auto found = chunks_.find(chunk);
  const bool was_there = found != chunks_.end() && !found->second.is_gone;
  if (is_there(field, chunk) == was_there) return;
  if (!was_there) wants_levels_ = true;
  mark(chunk, is_bound, now);
  FieldChunk& state = chunks_.at(chunk);
  state.is_gone = was_there;
  if (was_there) set_level(chunk, state, 0, now);
}

void FieldSurfaces::mark(IVec3 chunk, bool is_bound, SurfaceClock::time_point now) {
  FieldChunk& state = chunks_[chunk];
  stale_.insert(chunk);
  box_ = unite(box_, {chunk, chunk + 1});
  const Change change(totals_, state);
  state.is_stale = true;
  state.is_bound |= is_bound;
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
    mark(adjacent, true, now);
    is_seen = true;
  }
  if (is_seen) mark(chunk, true, now);
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
      mark(adjacent->first, is_other_surface && !adjacent->second.is_new(), now);
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

void FieldSurfaces::prepare(const SceneGrid& content, const VoxelRegistry& types) {
  if (is_prepared_) return;
  is_blocked_ = false;
  ChunkSet seen;
  const Members stale(stale_.begin(), stale_.end());
  for (const IVec3 chunk : stale) {
    if (seen.contains(chunk)) continue;
    const Members members = members_with(chunk);
    seen.insert(members.begin(), members.end());
    const bool begins = may_begin(members);
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
    if (begins && is_empty) begin_group(members);
  }
  is_prepared_ = true;
}

std::shared_ptr<FieldSurfaces::Group> FieldSurfaces::begin_group(const Members& members) {
  auto group = std::make_shared<Group>();
  group->chunks = members;
  group->unfinished = members.size();
  for (const IVec3 chunk : members) {
    FieldChunk& state = chunks_.at(chunk);
    const std::array<std::uint8_t, 27> levels = levels_around(chunk);
    stale_.erase(chunk);
    const Change change(totals_, state);
    state.is_stale = state.is_bound = false;
    state.is_working = state.is_done = false;
    state.serial = 0;
    state.levels = levels;
    state.group = group;
  }
  for (const IVec3 chunk : members) {
    FieldChunk& state = chunks_.at(chunk);
    if (state.is_empty) finish_chunk(state, nullptr);
  }
  if (group->unfinished == 0) give(members);
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

// The whole group is done.
void FieldSurfaces::give(const Members& members) {
  for (const IVec3 chunk : members) {
    FieldChunk& state = chunks_.at(chunk);
    QUOIN_ASSERT(state.group != nullptr && state.is_done, "a finished chunk of the group");
    {
      const Change change(totals_, state);
      state.group.reset();
      state.is_done = false;
      state.was_given = true;
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
  abandon_groups();
  bodies_.clear();
  stale_.clear();
  Members all;
  for (auto& [chunk, state] : chunks_) {
    all.push_back(chunk);
    const Change change(totals_, state);
    state.is_stale = state.is_bound = false;
    state.is_ready = false;
    state.is_gone = true;
    state.surface.reset();
    if (state.is_shown) make_ready(chunk, state);
  }
  for (const IVec3 chunk : all) erase_if_over(chunk);
  followed_ = {};
}

void FieldSurfaces::make_ready(IVec3 chunk, FieldChunk& state) {
  state.is_ready = true;
  if (state.is_listed) return;
  totals_.ready.push_back({{handle_, SurfaceContent::Field}, chunk});
  state.is_listed = true;
}

std::unique_ptr<SurfaceJob> FieldSurfaces::make_job(SurfaceInputs& inputs, IVec3 chunk) {
  QUOIN_ASSERT(waiting_.contains(chunk), "a chunk that waits");
  if (chunks_.at(chunk).group == nullptr) {
    const Members members = members_with(chunk);
    const std::shared_ptr<Group> group = begin_group(members);
    group->field = inputs.field();
    group->types = inputs.types->registry;
    if (group->types->has_transparent()) group->bodies = bodies_around(members, *group->field);
  }
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
  give(group->chunks);
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
