#include "live/mesh_scheduler.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/live/live_meshes.h>

#include "core/coordinates/chunk_order.h"
#include "core/memory/make_room.h"
#include "core/work/workers.h"

namespace quoin {
namespace {

double seconds(SurfaceClock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

constexpr double kEpochDistance = -1.0;  // of jobs that come before all others

// Returns true for the jobs of edits.
bool is_first(const SurfaceJob& job) {
  return job.distance <= kEpochDistance;
}

// Releases the inputs of a job. Copies of chunks are freed as early as possible.
void drop_inputs(SurfaceJob& job) {
  job.voxels = {};
  job.light.reset();
  job.field.reset();
  job.bodies.reset();
  job.types.reset();
  job.materials.reset();
}

}  // namespace

MeshJobQueue::MeshJobQueue(unsigned workers, Work work, std::function<void()> on_ready)
    : work_(std::move(work)), on_ready_(std::move(on_ready)), workspaces_(workers) {
  QUOIN_ASSERT(workers > 0 && *work_.use() != nullptr, "workers with a function");
  workers_.start(workers, [this](Workers::Lock& lock, unsigned worker) { return step(lock, workspaces_[worker]); },
                 {.name = "mesh"});
}

void MeshJobQueue::replace_work(Work work) {
  QUOIN_ASSERT(work != nullptr, "a function");
  work_.replace(std::move(work));
  const std::lock_guard lock(mutex_);
  done_.clear();
}

void MeshJobQueue::call_on_ready() const {
  const auto on_ready = on_ready_.use();
  if (*on_ready) (*on_ready)();
}

void MeshJobQueue::push(std::unique_ptr<SurfaceJob> job) {
  QUOIN_ASSERT(job != nullptr && !std::isnan(job->distance), "a job with a distance");
  {
    const std::lock_guard lock(mutex_);
    const std::size_t wanted = done_.size() + queue_.size() + running_ + 1;
    // Reserves memory here, so that workers cannot fail when they report a failure.
    make_room(done_, wanted - done_.size(), wanted);
    if (is_first(*job)) workers_.set_priority(JobPriority::High);
    queue_.push_back(std::move(job));
  }
  workers_.wake_one();
}

std::vector<std::unique_ptr<SurfaceJob>> MeshJobQueue::withdraw(FunctionRef<bool(const SurfaceJob&)> is_unwanted) {
  std::vector<std::unique_ptr<SurfaceJob>> taken;
  const std::lock_guard lock(mutex_);
  std::erase_if(queue_, [&](std::unique_ptr<SurfaceJob>& job) {
    if (!is_unwanted(*job)) return false;
    if (taken.empty()) taken.reserve(queue_.size());  // before the first job moves; later steps cannot fail
    taken.push_back(std::move(job));
    return true;
  });
  return taken;
}

std::vector<double> MeshJobQueue::measure(FunctionRef<double(const SurfaceJob&)> distance) {
  std::vector<double> distances;
  const std::lock_guard lock(mutex_);
  distances.reserve(queue_.size());
  for (const std::unique_ptr<SurfaceJob>& job : queue_) distances.push_back(job->distance = distance(*job));
  std::sort(distances.begin(), distances.end());
  return distances;
}

void MeshJobQueue::renew(FunctionRef<void(SurfaceJob&)> renew) {
  const std::lock_guard lock(mutex_);
  for (const std::unique_ptr<SurfaceJob>& job : queue_) {
    if (job->voxels != nullptr && !job->is_in_epoch) renew(*job);
  }
}

std::vector<std::unique_ptr<SurfaceJob>> MeshJobQueue::collect() {
  std::vector<std::unique_ptr<SurfaceJob>> taken;
  const std::lock_guard lock(mutex_);
  taken.reserve(done_.size());
  for (std::unique_ptr<SurfaceJob>& job : done_) taken.push_back(std::move(job));
  done_.clear();
  return taken;
}

void MeshJobQueue::wait(std::size_t waiting) {
  std::unique_lock lock(mutex_);
  workers_.wait(lock, [&] { return queue_.size() <= waiting && (waiting != 0 || running_ == 0); });
}

std::exception_ptr MeshJobQueue::take_failure() {
  const std::lock_guard lock(mutex_);
  return workers_.take_failure();
}

LiveMeshes::Stats MeshJobQueue::stats() const {
  const std::lock_guard lock(mutex_);
  return stats_;
}

std::unique_ptr<SurfaceJob> MeshJobQueue::take_nearest() {
  QUOIN_ASSERT(!queue_.empty(), "a job waits");
  const auto nearest = std::min_element(queue_.begin(), queue_.end(), [](const auto& a, const auto& b) {
    return a->distance != b->distance ? a->distance < b->distance : a->serial < b->serial;
  });
  std::unique_ptr<SurfaceJob> job = std::move(*nearest);
  queue_.erase(nearest);
  return job;
}

Workers::Clock::time_point MeshJobQueue::step(Workers::Lock& lock, SurfaceWorkspace& workspace) {
  if (queue_.empty()) return Workers::kWhenWoken;
  std::unique_ptr<SurfaceJob> job = take_nearest();
  const bool is_edit_waiting = std::ranges::any_of(queue_, [](const auto& each) { return is_first(*each); });
  workers_.set_priority(is_edit_waiting ? JobPriority::High : JobPriority::Normal);
  ++running_;
  bool is_reported = false;
  {
    const auto work = work_.use();  // until the result is listed: `replace_work` drops it then
    lock.unlock();
    const SurfaceClock::time_point start = SurfaceClock::now();
    std::exception_ptr failure = work_on(*work, *job, workspace);
    // Failures are not reported to the callback: an immediate retry would fail again.
    is_reported = job->outcome != SurfaceJob::Outcome::OutOfMemory;
    if (is_reported || !job->is_in_epoch) drop_inputs(*job);
    lock.lock();
    workers_.keep_failure(std::move(failure));
    finish(std::move(job), start);
  }
  lock.unlock();
  if (is_reported) call_on_ready();
  lock.lock();
  return Workers::kAgain;
}

// Sets the job's outcome and surface. Returns an exception of a callback, or null.
std::exception_ptr MeshJobQueue::work_on(const Work& work, SurfaceJob& job, SurfaceWorkspace& workspace) {
  std::exception_ptr failure;
  try {
    try {
      work(job, workspace);
    } catch (const std::bad_alloc&) {
      throw;
    } catch (...) {
      failure = std::current_exception();
    }
    if (job.surface != nullptr) {
      job.surface->converted = releases()->defer(std::move(job.surface->converted), job.surface->converted_bytes);
      const std::size_t bytes = job.surface->bytes();
      job.surface = releases()->defer(std::move(job.surface), bytes);
    }
  } catch (const std::bad_alloc&) {
    job.outcome = SurfaceJob::Outcome::OutOfMemory;
    job.surface.reset();
    workspace = {};
  }
  return failure;
}

// Requires: the lock is held.
void MeshJobQueue::finish(std::unique_ptr<SurfaceJob> job, SurfaceClock::time_point start) {
  const SurfaceClock::time_point now = SurfaceClock::now();
  if (job->outcome == SurfaceJob::Outcome::Meshed) {
    ++stats_.chunks_meshed;
    stats_.last_mesh_seconds = seconds(now - start);
    stats_.last_latency_seconds = seconds(now - job->seen);
  } else if (job->outcome == SurfaceJob::Outcome::OutOfMemory) {
    ++stats_.out_of_memory;
  }
  QUOIN_ASSERT(running_ != 0 && done_.size() < done_.capacity(), "room was made when the job came");
  done_.push_back(std::move(job));
  --running_;
  workers_.notify();
}

LiveMeshOptions without_callbacks(const LiveMeshOptions& options) {
  LiveMeshOptions plain = options;
  plain.convert = {};
  plain.on_ready = {};
  return plain;
}

ChunkSurfaceOptions surface_options(const LiveMeshOptions& options) {
  return {.style = options.style,
          .merge = options.merge,
          .shapes = options.shapes,
          .region_edge = options.region_edge,
          .light_merging = options.light_merging,
          .occlusion = options.occlusion,
          .colours = options.colours,
          .detail_distance = options.detail_distance};
}

void make_live_surface(const LiveMeshOptions& options, SurfaceJob& job, SurfaceWorkspace& workspace) {
  make_chunk_surface(surface_options(options), job, workspace);
  if (options.convert && job.surface != nullptr) {
    ConvertedSurface converted =
        options.convert({job.source.grid, job.chunk, job.surface, job.source.content, ~std::uint64_t{0}},
                        surface_context(job, workspace));
    job.surface->converted_bytes = converted.data == nullptr ? 0 : converted.bytes;
    job.surface->converted = std::move(converted.data);
  }
}

namespace {

// A smooth chunk takes a worker milliseconds, and its job the copies of up to 125 chunks.
std::size_t jobs_ahead(SurfaceStyle style, unsigned workers) {
  constexpr std::size_t kBlocky = 64;
  return style == SurfaceStyle::Blocky ? kBlocky : std::clamp<std::size_t>(4 * std::size_t{workers}, 8, kBlocky);
}

bool is_placed(const Scene& scene, const Instance& instance, InstanceFilter filter) {
  return is_drawn(scene, instance, filter) && has_valid_transform(instance);
}

}  // namespace

// A chunk that waits for a job.
struct MeshScheduler::Candidate {
  double distance = 0.0;
  SurfaceSource* live = nullptr;
  SurfaceKey source;
  IVec3 chunk{0};
};

MeshScheduler::MeshScheduler(const LiveMeshOptions& options, MeshJobQueue::Work work)
    : options_(without_callbacks(options)),
      surface_options_(surface_options(options)),
      workers_(worker_count(options.workers)),
      max_ahead_(jobs_ahead(options.style, workers_)),
      placed_(options.instances, SceneFollower::Transforms::Valid),
      drawn_(options.instances, SceneFollower::Transforms::Valid),
      queue_(workers_, std::move(work), options.on_ready) {
  totals_.releases = queue_.releases();
}

void MeshScheduler::throw_failure() {
  if (const std::exception_ptr failure = queue_.take_failure()) std::rethrow_exception(failure);
  const std::lock_guard lock(mutex_);
  if (receive_failure_ != nullptr) std::rethrow_exception(std::exchange(receive_failure_, nullptr));
}

void MeshScheduler::use_light(const SceneLight* light, std::shared_ptr<LightWorker> worker) {
  QUOIN_ASSERT(light == nullptr || worker == nullptr, "light from one source");
  if (worker != nullptr && worker == light_worker_) return;
  // The worker may be calling `receive`, which needs the mutex.
  if (light_worker_ != nullptr) light_worker_->detach();
  {
    const std::lock_guard lock(mutex_);
    light_ = light;
    light_worker_ = std::move(worker);
    lit_ = followed_lit_ = epoch_lit_ = complete_lit_ = nullptr;
    must_follow_light_ = true;
    placed_.forget();
  }
  if (light_worker_ != nullptr) {
    light_worker_->attach([this](std::shared_ptr<LitState> lit) { receive(std::move(lit)); });
  }
}

void MeshScheduler::replace_work(MeshJobQueue::Work work) {
  queue_.replace_work(std::move(work));
  {
    const std::lock_guard lock(mutex_);
    for (auto& [key, source] : sources_) source->discard();
    forget();
    // The edits of the dropped surfaces were not shown.
    complete(shown_, nullptr);
  }
  queue_.releases()->finish();
}

void MeshScheduler::stop() {
  if (light_worker_ != nullptr) light_worker_->detach();
  queue_.stop();
}

std::uint64_t MeshScheduler::update(const Scene& scene, DVec3 eye, std::span<const DVec3> other_eyes) {
  throw_failure();
  const std::lock_guard lock(mutex_);
  try {
    next_eyes_.assign(other_eyes.begin(), other_eyes.end());
    next_eyes_.push_back(eye);
    std::erase_if(next_eyes_, [](DVec3 each) { return !is_finite(each); });
    are_places_new_ |= next_eyes_ != eyes_;
    std::swap(next_eyes_, eyes_);
    ++updates_;
    update_or_throw(scene);
    must_restart_ = false;
  } catch (...) {
    forget();
    throw;
  }
  return updates_;
}

// Memory ran out during an update. Starting from scratch recovers all lost changes.
void MeshScheduler::forget() {
  for (auto& [key, source] : sources_) source->forget();
  drawn_.forget();
  placed_.forget();
  must_follow_light_ = true;
  is_epoch_open_ = false;
  epoch_lit_ = nullptr;
  retries_.clear();
  forgotten_ = totals_.serial;
  must_restart_ = true;
}

void MeshScheduler::update_or_throw(const Scene& scene) {
  if (light_worker_ == nullptr) return follow({&scene, light_, updates_, SurfaceClock::now()}, scene);
  SceneFollower::Update placed(placed_, scene);
  are_places_new_ |= placed.has_other_instances();
  light_worker_->update_for_receiver(scene, updates_, placed.has_other_placements());
  placed.commit();
  if (lit_ == nullptr) return;
  if (!light_worker_->is_state_pending()) lit_number_ = updates_;
  follow({lit_->lit.scene.get(), &lit_->lit.light, lit_number_, SurfaceClock::now()}, scene);
}

// Called by the worker of the light. Does what `update` does, so that the surfaces need not wait for it.
void MeshScheduler::receive(std::shared_ptr<LitState> lit) {
  {
    const std::lock_guard lock(mutex_);
    light_worker_->note_received();
    try {
      // The calls that drop it hold the mutex, and one of them is `take`.
      lit_ = queue_.releases()->defer(std::move(lit));
      const Scene& scene = *lit_->lit.scene;
      // Later updates without a change are in the same state.
      lit_number_ = light_worker_->is_state_pending() ? lit_->number : updates_;
      follow({&scene, &lit_->lit.light, lit_number_, lit_->asked}, scene);
      are_places_new_ = true;  // levels were chosen for the places of the snapshot
    } catch (...) {
      forget();
      receive_failure_ = std::current_exception();
    }
  }
  try {
    queue_.call_on_ready();
  } catch (...) {
    const std::lock_guard lock(mutex_);
    if (receive_failure_ == nullptr) receive_failure_ = std::current_exception();
  }
}

// Takes over the changes up to a state, and gives jobs to the workers. `places`: the scene with the newest positions of
// instances.
void MeshScheduler::follow(const State& state, const Scene& places) {
  const SurfaceClock::time_point now = state.seen;
  collect();
  totals_.state = state.number;
  followed_lit_ = lit_;
  totals_.loads_only = false;  // it is still true after a failure
  const ChangedTypes changed_types = follow_types(state.scene->types);
  follow_scene(*state.scene);
  for (const GridHandle handle : changed_) follow_grid(*state.scene, handle, now);
  follow_light(state.light, state.scene->types, now);
  choose_levels(places, now);
  if (!changed_types.empty()) mark_types(*state.scene, changed_types, now);
  withdraw([&](const SurfaceJob& job) {
    const SurfaceSource* live = find(job.source);
    return live == nullptr || !live->is_current(job);
  });
  // A frame without changes visits no grid: the rest is for unfinished chunks.
  if (totals_.unfinished == 0 && !is_epoch_open_) return complete(state.number, followed_lit_);
  prepare(*state.scene);
  push_retries();
  begin_epoch(state);
  renew_jobs(state, SurfaceClock::now());
  if (totals_.unfinished != 0) hand_over(state, places);
}

void MeshScheduler::mark_types(const Scene& scene, const ChangedTypes& changed, SurfaceClock::time_point now) {
  for (auto& [key, live] : sources_) {
    const SceneGrid* const grid = scene.grids().find(key.grid);
    if (grid == nullptr || !drawn_.places(key.grid)) continue;
    live->mark_types(*grid, changed, now);
    if (!changed.data.empty()) live->follow_data(*grid, scene.types, now);
  }
}

void MeshScheduler::prepare(const Scene& scene) {
  for (auto& [key, live] : sources_) {
    if (const SceneGrid* const grid = scene.grids().find(key.grid)) live->prepare(*grid, scene.types);
  }
}

void MeshScheduler::push_retries() {
  for (std::unique_ptr<SurfaceJob>& job : retries_) {
    const SurfaceSource* const live = find(job->source);
    if (live != nullptr && live->is_current(*job)) queue_.push(std::move(job));
  }
  retries_.clear();
}

// Begins an epoch with all edits up to the state, unless one is in progress.
void MeshScheduler::begin_epoch(const State& state) {
  if (is_epoch_open_) return;
  const auto [edited, has_edits] = count_edited();
  if (edited > kMaxEpochChunks) release_edits(state);
  if (!has_edits || edited > kMaxEpochChunks) return complete(state.number, followed_lit_);
  bool may_begin = true;
  for (const auto& [key, live] : sources_) may_begin &= live->may_begin_epoch();
  if (!may_begin) return;
  QUOIN_ASSERT(totals_.in_epoch == 0, "one epoch at a time");
  is_epoch_open_ = true;
  epoch_state_ = state.number;
  epoch_lit_ = followed_lit_;
  std::vector<std::unique_ptr<SurfaceJob>> jobs;
  for (auto& [key, live] : sources_) {
    bool is_edited = false;
    (void)live->count_edited(is_edited);
    if (!is_edited) continue;
    const SceneGrid* const grid = state.scene->grids().find(key.grid);
    std::optional<SurfaceInputs> inputs;
    if (grid != nullptr)
      inputs.emplace(*grid, types_, state.light == nullptr ? GridLight{} : state.light->of(key.grid),
                     queue_.releases());
    live->begin_epoch(inputs ? &*inputs : nullptr, jobs);
  }
  for (std::unique_ptr<SurfaceJob>& job : jobs) {
    job->is_in_epoch = true;
    job->distance = kEpochDistance;
    queue_.push(std::move(job));
  }
  end_epoch();
}

// Ends the epoch in progress if all of its surfaces are complete.
void MeshScheduler::end_epoch() {
  if (!is_epoch_open_ || totals_.in_epoch != 0) return;
  for (auto& [key, live] : sources_) live->give_epoch();
  is_epoch_open_ = false;
  const bool has_edits = count_edited().second;
  complete(has_edits ? epoch_state_ : totals_.state, has_edits ? epoch_lit_ : followed_lit_);
  epoch_lit_ = nullptr;
}

void MeshScheduler::complete(std::uint64_t state, const std::shared_ptr<LitState>& lit) {
  totals_.complete = state;
  complete_lit_ = lit;
}

std::pair<std::size_t, bool> MeshScheduler::count_edited() const {
  std::size_t edited = 0;
  bool has_edits = false;
  for (const auto& [key, live] : sources_) edited += live->count_edited(has_edits);
  return {edited, has_edits};
}

// Too many chunks are edited to wait for all of them.
void MeshScheduler::release_edits(const State& state) {
  for (auto& [key, live] : sources_) live->release_edits();
  prepare(*state.scene);
}

void MeshScheduler::follow_grid(const Scene& scene, GridHandle handle, SurfaceClock::time_point now) {
  const SceneGrid& grid = scene.grids()[handle];
  const auto [voxels, is_new] = sources_.try_emplace({handle, SurfaceContent::Voxels});
  if (voxels->second == nullptr) voxels->second = make_surface_source(voxels->first, surface_options_, totals_);
  SurfaceSource* field = find({handle, SurfaceContent::Field});
  if (field == nullptr && grid.field.chunk_count() != 0) {
    const SurfaceKey key{handle, SurfaceContent::Field};
    field = (sources_[key] = make_surface_source(key, surface_options_, totals_)).get();
  }
  totals_.loads_only = is_all_new_ && is_new;
  voxels->second->follow(grid, scene.types, now);
  voxels->second->follow_data(grid, scene.types, now);
  if (field != nullptr) field->follow(grid, scene.types, now);
  totals_.loads_only = false;
}

void MeshScheduler::follow_light(const SceneLight* light, const VoxelRegistry& types, SurfaceClock::time_point now) {
  // The light of a worker's state does not change, that of the caller may.
  const bool may_change = light != nullptr && light_worker_ == nullptr;
  if (light == followed_light_ && !must_follow_light_ && !may_change) return;
  followed_light_ = light;
  must_follow_light_ = false;
  for (auto& [key, live] : sources_) {
    live->follow_light(light == nullptr ? GridLight{} : light->of(key.grid), types, now);
  }
}

// Chooses levels of fields if eyes or instances moved, or if some levels are still to be chosen.
void MeshScheduler::choose_levels(const Scene& scene, SurfaceClock::time_point now) {
  if (options_.detail_distance == std::numeric_limits<double>::infinity()) return;
  const auto chooses = [&](const SurfaceSource& field) { return are_places_new_ || field.wants_levels(); };
  std::erase_if(level_distances_, [&](const auto& each) {
    const SurfaceSource* const field = find({each.first, SurfaceContent::Field});
    return field == nullptr || !chooses(*field);
  });
  for (const auto& [key, live] : sources_) {
    if (key.content != SurfaceContent::Field || !chooses(*live)) continue;
    level_distances_.try_emplace(key.grid, IBox{}, eyes_).first->second.restart({}, eyes_);
  }
  add_places(scene, level_distances_);
  for (const auto& [handle, places] : level_distances_) {
    find({handle, SurfaceContent::Field})->choose_levels(places, now);
  }
  are_places_new_ = false;
}

// Lists the drawn grids that may have changed.
void MeshScheduler::follow_scene(const Scene& scene) {
  SceneFollower::Update update(drawn_, scene);
  is_all_new_ = update.all();
  changed_.clear();
  std::copy_if(update.touched().begin(), update.touched().end(), std::back_inserter(changed_),
               [&](GridHandle handle) { return drawn_.places(handle); });
  if (update.has_other_instances()) {
    are_places_new_ = true;
    for (auto& [key, source] : sources_) {
      if (!drawn_.places(key.grid)) source->leave();
    }
    std::erase_if(sources_,
                  [&](const auto& each) { return !each.second->has_chunks() && !drawn_.places(each.first.grid); });
  }
  update.commit();
}

namespace {

// Returns the types whose data changes meshes now, but did not with the former registry, which may be null; empty if
// there are none.
std::vector<bool> types_with_new_data(const VoxelRegistry* former, const VoxelRegistry& types) {
  std::vector<bool> found;
  if (!types.has_remesh_on_data()) return found;
  for (std::size_t i = 0; i < types.size(); ++i) {
    const auto type = static_cast<VoxelType>(i);
    if (!types.remeshes_on_data(type) || (former != nullptr && former->remeshes_on_data(type))) continue;
    found.resize(types.size());
    found[type] = true;
  }
  return found;
}

}  // namespace

// Follows the type registry. If the registry is new, all types count as changed, including types it does not contain.
ChangedTypes MeshScheduler::follow_types(const VoxelRegistry& types) {
  PendingChanges changes(followed_types_, types);
  ChangedTypes changed;
  if (changes->empty()) return changed;
  const auto add = [&](std::vector<bool>& to, bool TypeChange::*matters) {
    if (changes->all) to.assign(kMaxVoxelTypes + 1, true);
    for (const TypeChange& change : changes->items_unless_all()) {
      if (!(change.*matters)) continue;
      to.resize(types.size());
      to[change.type] = true;
    }
  };
  add(changed.visibility, &TypeChange::visibility_changed);
  // Other orientations give other quads.
  add(changed.visibility, &TypeChange::shape_changed);
  add(changed.colour, &TypeChange::colour_changed);
  // So do other faces that a voxel's state turns: quads tell orientations apart only if they look different.
  for (const TypeChange& change : changes->items_unless_all()) {
    if (!change.colour_changed || !types.is_turned_by_state(change.type) || types.is_shaped(change.type)) continue;
    changed.visibility.resize(types.size());
    changed.visibility[change.type] = true;
  }
  changed.data = types_with_new_data(types_.registry.get(), types);
  types_.registry = std::make_shared<const VoxelRegistry>(types);
  if (!changed.colour.empty()) types_.materials = std::make_shared<const SurfaceMaterials>(types);
  if (!changed.empty()) ++types_.generation;
  changes.commit();
  return changed;
}

void MeshScheduler::collect() {
  for (std::unique_ptr<SurfaceJob>& job : queue_.collect()) {
    SurfaceSource* const live = find(job->source);
    if (live == nullptr || job->serial <= forgotten_) continue;
    const bool is_retried = job->outcome == SurfaceJob::Outcome::OutOfMemory && job->is_in_epoch && is_epoch_open_;
    if (!is_retried) {
      live->collect(*job);
    } else if (live->is_current(*job)) {
      job->outcome = SurfaceJob::Outcome::Meshed;
      retries_.push_back(std::move(job));
    }
  }
  end_epoch();
}

void MeshScheduler::withdraw(FunctionRef<bool(const SurfaceJob&)> is_unwanted) {
  for (const std::unique_ptr<SurfaceJob>& job : queue_.withdraw(is_unwanted)) {
    if (SurfaceSource* live = find(job->source)) live->withdrawn(*job);
  }
}

SurfaceSource* MeshScheduler::find(SurfaceKey source) {
  const auto found = sources_.find(source);
  return found == sources_.end() ? nullptr : found->second.get();
}

void MeshScheduler::add_places(const Scene& scene, std::map<GridHandle, ChunkDistances>& distances) const {
  if (distances.empty()) return;
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    const auto found = distances.find(instance.grid);
    if (found == distances.end() || !is_placed(scene, instance, options_.instances)) return;
    found->second.add(instance, scene.grids()[instance.grid]);
  });
  for (auto& [handle, places] : distances) places.sort();
}

std::map<GridHandle, ChunkDistances> MeshScheduler::distances_of_grids(const Scene& scene) const {
  std::map<GridHandle, IBox> boxes;
  for (const auto& [key, live] : sources_) boxes[key.grid] = unite(boxes[key.grid], live->box());
  std::map<GridHandle, ChunkDistances> distances;
  for (const auto& [handle, box] : boxes) distances.try_emplace(handle, box, eyes_);
  add_places(scene, distances);
  return distances;
}

bool MeshScheduler::has_waiting() const {
  return std::any_of(sources_.begin(), sources_.end(),
                     [](const auto& each) { return !each.second->waiting().empty(); });
}

// Returns the chunks that may get a job now, nearest first.
std::vector<MeshScheduler::Candidate> MeshScheduler::candidates(const std::map<GridHandle, ChunkDistances>& distances) {
  std::vector<Candidate> all;
  std::size_t count = 0;
  for (const auto& [key, live] : sources_) count += live->waiting().size();
  all.reserve(count);
  for (auto& [key, live] : sources_) {
    const ChunkDistances& places = distances.at(key.grid);
    for (const IVec3 chunk : live->waiting()) {
      all.push_back({live->is_urgent(chunk) ? kEpochDistance : places.to(chunk), live.get(), key, chunk});
    }
  }
  const auto comes_before = [](const Candidate& a, const Candidate& b) {
    if (a.distance != b.distance) return a.distance < b.distance;
    return a.source == b.source ? by_zyx(a.chunk, b.chunk) : a.source < b.source;
  };
  const std::size_t most = std::min(all.size(), max_ahead_);
  std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(most), all.end(), comes_before);
  all.resize(most);
  return all;
}

void MeshScheduler::renew_jobs(const State& state, SurfaceClock::time_point now) {
  constexpr auto kOld = std::chrono::milliseconds(250);
  if (now - renewed_ < kOld) return;
  renewed_ = now;
  std::map<GridHandle, SurfaceInputs> inputs;
  queue_.renew([&](SurfaceJob& job) {
    const GridHandle grid = job.source.grid;
    const GridLight light = state.light == nullptr ? GridLight{} : state.light->of(grid);
    SurfaceInputs& input =
        inputs.try_emplace(grid, state.scene->grids()[grid], types_, light, queue_.releases()).first->second;
    if (job.light != nullptr && input.light() == nullptr) return;
    if (job.light != nullptr) job.light = input.light();
    job.voxels = input.voxels();
  });
}

// Gives jobs to the workers. Waiting jobs that are farther away than the new ones wait longer.
void MeshScheduler::hand_over(const State& state, const Scene& places) {
  if (!has_waiting()) return;
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const std::map<GridHandle, ChunkDistances> distances = distances_of_grids(places);
  std::map<GridHandle, SurfaceInputs> inputs;
  std::vector<double> queued = queue_.measure([&](const SurfaceJob& job) {
    if (job.is_in_epoch || find(job.source)->is_urgent(job.chunk)) return kEpochDistance;
    return distances.at(job.source.grid).to(job.chunk);
  });
  double farthest = kNone;  // waiting jobs from this distance on are withdrawn
  for (const Candidate& each : candidates(distances)) {
    if (queued.size() >= max_ahead_) {
      if (queued.back() <= each.distance) break;
      farthest = queued.back();
      queued.pop_back();
    }
    const GridHandle grid = each.source.grid;
    const GridLight light = state.light == nullptr ? GridLight{} : state.light->of(grid);
    SurfaceInputs& input =
        inputs.try_emplace(grid, state.scene->grids()[grid], types_, light, queue_.releases()).first->second;
    std::unique_ptr<SurfaceJob> job = each.live->make_job(input, each.chunk);
    job->distance = each.distance;
    const std::uint64_t serial = job->serial;
    queue_.push(std::move(job));
    each.live->hand_over(each.chunk, serial);
    queued.insert(std::upper_bound(queued.begin(), queued.end(), each.distance), each.distance);
  }
  if (farthest != kNone) withdraw([&](const SurfaceJob& job) { return job.distance >= farthest; });
}

std::vector<SurfaceUpdate> MeshScheduler::take(std::size_t max_bytes) {
  const std::lock_guard lock(mutex_);
  std::vector<SurfaceUpdate> taken;
  std::vector<ReadyChunk> left;
  try {
    collect();
    taken.reserve(totals_.ready.size());
    left.reserve(totals_.ready.size());
  } catch (...) {
    forget();
    throw;
  }
  // The rest cannot fail, so that no surface is lost.
  std::size_t bytes = 0;
  for (const ReadyChunk& ready : totals_.ready) {
    SurfaceSource* const live = find(ready.source);
    if (live == nullptr) continue;
    const SurfaceSource::Turn turn = live->turn_of(ready.chunk);
    if (turn == SurfaceSource::Turn::Later || (turn == SurfaceSource::Turn::IfRoom && bytes >= max_bytes)) {
      left.push_back(ready);
      continue;
    }
    const std::size_t before = taken.size();
    live->take(ready.chunk, taken);
    if (taken.size() == before || ready.source.content != SurfaceContent::Voxels) continue;
    if (const auto& surface = taken.back().surface) bytes += surface->upload_bytes();
  }
  totals_.ready = std::move(left);
  shown_ = totals_.complete;
  if (complete_lit_ != nullptr && light_worker_ != nullptr) light_worker_->show(*complete_lit_);
  complete_lit_ = nullptr;
  return taken;
}

std::size_t MeshScheduler::pending() const {
  const std::lock_guard lock(mutex_);
  const bool is_light_late = light_worker_ != nullptr && light_worker_->is_state_pending();
  return totals_.pending + (is_light_late || must_restart_ ? 1 : 0);
}

void MeshScheduler::finish(const Scene& scene, DVec3 eye, std::span<const DVec3> other_eyes) {
  for (;;) {
    const LiveMeshes::Stats before = stats();
    update(scene, eye, other_eyes);
    std::unique_lock lock(mutex_);
    const bool is_light_late = light_worker_ != nullptr && light_worker_->is_state_pending();
    const bool is_done = totals_.unfinished == 0 && !is_light_late;
    const std::size_t left = !is_done && has_waiting() ? max_ahead_ / 2 : 0;
    // A free worker may take a job.
    lock.unlock();
    if (is_light_late) light_worker_->wait();
    queue_.wait(left);  // finally waits for jobs of removed grids
    if (is_done) return throw_failure();
    const LiveMeshes::Stats after = stats();
    if (is_light_late) continue;
    // If all jobs failed, throws instead of retrying without end.
    if (after.out_of_memory != before.out_of_memory && after.chunks_meshed == before.chunks_meshed) {
      throw std::bad_alloc();
    }
  }
}

LiveMeshes::Stats MeshScheduler::stats() const {
  return queue_.stats();
}

struct LiveMeshes::Impl {
  explicit Impl(const LiveMeshOptions& wanted)
      : options(without_callbacks(wanted)), scheduler(wanted, work_with(wanted.convert)) {}
  [[nodiscard]] MeshJobQueue::Work work_with(SurfaceConverter convert) const {
    LiveMeshOptions all = options;
    all.convert = std::move(convert);
    return [all = std::move(all)](SurfaceJob& job, SurfaceWorkspace& workspace) {
      make_live_surface(all, job, workspace);
    };
  }
  const LiveMeshOptions options;
  MeshScheduler scheduler;
};

LiveMeshes::LiveMeshes(const LiveMeshOptions& options) {
  QUOIN_ASSERT(options.region_edge == 16 || options.region_edge == 32 || options.region_edge == 64,
               "regions are 16, 32 or 64 voxels wide");
  impl_ = std::make_unique<Impl>(options);
}
// Workers may call the callback until they have stopped.
LiveMeshes::~LiveMeshes() {
  impl_->scheduler.stop();
}

std::uint64_t LiveMeshes::update(const Scene& scene, DVec3 eye, std::span<const DVec3> other_eyes) {
  return impl_->scheduler.update(scene, eye, other_eyes);
}
void LiveMeshes::use_light(const SceneLight* light) {
  impl_->scheduler.use_light(light, nullptr);
}
void LiveMeshes::use_light(LiveLight& light) {
  impl_->scheduler.use_light(nullptr, light.worker_);
}
void LiveMeshes::set_convert(SurfaceConverter convert) {
  impl_->scheduler.replace_work(impl_->work_with(std::move(convert)));
}
void LiveMeshes::set_on_ready(std::function<void()> on_ready) {
  impl_->scheduler.replace_on_ready(std::move(on_ready));
}
std::uint64_t LiveMeshes::shown_update() const {
  return impl_->scheduler.shown_update();
}
std::vector<SurfaceUpdate> LiveMeshes::take(std::size_t max_bytes) {
  return impl_->scheduler.take(max_bytes);
}
std::size_t LiveMeshes::pending() const {
  return impl_->scheduler.pending();
}
void LiveMeshes::finish(const Scene& scene, DVec3 eye, std::span<const DVec3> other_eyes) {
  impl_->scheduler.finish(scene, eye, other_eyes);
}
LiveMeshes::Stats LiveMeshes::stats() const {
  return impl_->scheduler.stats();
}

}  // namespace quoin
