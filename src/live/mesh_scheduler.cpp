#include "live/mesh_scheduler.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <new>
#include <utility>

#include "core/worker_count.h"
#include "grid/chunk_order.h"
#include "scene/instance_axes.h"

namespace quoin {
namespace {

// A smooth chunk takes a worker milliseconds, and its job the copies of up to 125 chunks.
std::size_t jobs_ahead(SurfaceStyle style, unsigned workers) {
  constexpr std::size_t kBlocky = 64;
  return style == SurfaceStyle::Blocky ? kBlocky : std::clamp<std::size_t>(4 * std::size_t{workers}, 8, kBlocky);
}

bool is_placed(const Scene& scene, const Instance& instance, InstanceFilter filter) {
  return is_drawn(scene, instance, filter) && has_place(instance);
}

}  // namespace

// A chunk that waits for a job.
struct MeshScheduler::Candidate {
  double distance = 0.0;
  LiveGrid* live = nullptr;
  GridHandle handle;
  IVec3 chunk{0};
};

MeshScheduler::MeshScheduler(const LiveMeshOptions& options, MeshJobQueue::Work work)
    : options_(options),
      workers_(worker_count(options.threads)),
      max_ahead_(jobs_ahead(options.style, workers_)),
      queue_(workers_, std::move(work), options.on_ready) {}

void MeshScheduler::update(const Scene& scene, DVec3 eye) {
  try {
    update_or_throw(scene, eye);
  } catch (...) {
    forget();
    throw;
  }
}

// Memory ran out in the middle: whatever was lost is found by beginning anew.
void MeshScheduler::forget() {
  for (auto& [handle, grid] : grids_) grid.forget();
  followed_scene_ = {};
}

void MeshScheduler::update_or_throw(const Scene& scene, DVec3 eye) {
  const LiveClock::time_point now = LiveClock::now();
  collect();
  const std::vector<bool> changed_types = follow_types(scene.types);
  for (const GridHandle handle : follow_scene(scene)) {
    LiveGrid& live = grids_.try_emplace(handle, handle, options_, totals_).first->second;
    live.follow(scene.grids()[handle].grid, now);
  }
  if (!changed_types.empty()) {
    for (const GridHandle handle : drawn_) find(handle)->mark_types(scene.grids()[handle].grid, changed_types, now);
  }
  withdraw([&](const LiveJob& job) {
    const LiveGrid* live = find(job.grid);
    return live == nullptr || !live->is_current(job);
  });
  if (totals_.unfinished != 0) hand_over(scene, eye);
}

// The drawn grids that may have changed.
std::vector<GridHandle> MeshScheduler::follow_scene(const Scene& scene) {
  ChangeCursor now = followed_scene_;
  const SceneChanges changes = scene.changes_since(now);
  followed_scene_ = now;
  const auto is_gone = [&](GridHandle handle) { return scene.grids().find(handle) == nullptr; };
  const bool may_draw_others =
      changes.all || !changes.instances.empty() || std::any_of(changes.grids.begin(), changes.grids.end(), is_gone);
  if (!may_draw_others) {
    std::vector<GridHandle> changed;
    std::set_intersection(changes.grids.begin(), changes.grids.end(), drawn_.begin(), drawn_.end(),
                          std::back_inserter(changed));
    return changed;
  }
  drawn_ = drawn_grids(scene);
  for (auto& [handle, grid] : grids_) {
    if (!std::binary_search(drawn_.begin(), drawn_.end(), handle)) grid.leave();
  }
  std::erase_if(grids_, [&](const auto& each) {
    return !each.second.has_chunks() && !std::binary_search(drawn_.begin(), drawn_.end(), each.first);
  });
  return drawn_;
}

// Which types look otherwise than before, by type; empty when none does.
std::vector<bool> MeshScheduler::follow_types(const VoxelRegistry& types) {
  ChangeCursor now = followed_types_;
  const TypeChanges changes = types.changes_since(now);
  const bool is_blocky = options_.style == SurfaceStyle::Blocky;
  const auto matters = [&](const TypeChange& change) { return is_blocky ? change.visibility : change.colour; };
  if (!changes.all && std::none_of(changes.items.begin(), changes.items.end(), matters)) {
    followed_types_ = now;
    return {};
  }
  // Of another registry all types look otherwise, those that it does not have included.
  std::vector<bool> changed(changes.all ? kMaxVoxelTypes + 1 : types.size(), changes.all);
  for (const TypeChange& change : changes.items) changed[change.type] = matters(change);
  if (options_.style == SurfaceStyle::Blocky) {
    types_.registry = std::make_shared<const VoxelRegistry>(types);
  } else {
    types_.materials = std::make_shared<const SurfaceMaterials>(types);
  }
  followed_types_ = now;
  ++types_.generation;
  return changed;
}

// Sorted, each once.
std::vector<GridHandle> MeshScheduler::drawn_grids(const Scene& scene) const {
  std::vector<GridHandle> drawn;
  std::vector<bool> is_known;
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    const std::size_t index = instance.grid.index;
    if (index < is_known.size() && is_known[index]) return;
    if (!is_placed(scene, instance, options_.instances)) return;
    if (is_known.size() <= index) is_known.resize(index + 1);
    is_known[index] = true;
    drawn.push_back(instance.grid);
  });
  std::sort(drawn.begin(), drawn.end());
  return drawn;
}

void MeshScheduler::collect() {
  for (const std::unique_ptr<LiveJob>& job : queue_.collect()) {
    if (LiveGrid* live = find(job->grid)) live->collect(*job);
  }
}

void MeshScheduler::withdraw(const std::function<bool(const LiveJob&)>& is_unwanted) {
  for (const std::unique_ptr<LiveJob>& job : queue_.withdraw(is_unwanted)) {
    if (LiveGrid* live = find(job->grid)) live->withdrawn(*job);
  }
}

LiveGrid* MeshScheduler::find(GridHandle grid) {
  const auto found = grids_.find(grid);
  return found == grids_.end() ? nullptr : &found->second;
}

std::map<GridHandle, ChunkDistances> MeshScheduler::distances_of_grids(const Scene& scene, DVec3 eye) const {
  std::map<GridHandle, ChunkDistances> distances;
  for (const auto& [handle, live] : grids_) distances.try_emplace(handle, live.box(), eye);
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    const auto found = distances.find(instance.grid);
    if (found == distances.end() || !is_placed(scene, instance, options_.instances)) return;
    found->second.add(instance, scene.grids()[instance.grid]);
  });
  for (auto& [handle, places] : distances) places.sort();
  return distances;
}

bool MeshScheduler::has_waiting() const {
  return std::any_of(grids_.begin(), grids_.end(), [](const auto& each) { return !each.second.waiting().empty(); });
}

// The chunks that wait for jobs, as many as may get one, the nearest first.
std::vector<MeshScheduler::Candidate> MeshScheduler::candidates(const std::map<GridHandle, ChunkDistances>& distances) {
  std::vector<Candidate> all;
  for (auto& [handle, live] : grids_) {
    const ChunkDistances& places = distances.at(handle);
    for (const IVec3 chunk : live.waiting()) all.push_back({places.to(chunk), &live, handle, chunk});
  }
  const auto comes_before = [](const Candidate& a, const Candidate& b) {
    if (a.distance != b.distance) return a.distance < b.distance;
    return a.handle == b.handle ? by_zyx(a.chunk, b.chunk) : a.handle < b.handle;
  };
  const std::size_t most = std::min(all.size(), max_ahead_);
  std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(most), all.end(), comes_before);
  all.resize(most);
  return all;
}

// Gives jobs to the workers; those that wait and are farther than what comes now have to wait longer.
void MeshScheduler::hand_over(const Scene& scene, DVec3 eye) {
  if (!has_waiting()) return;
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const std::map<GridHandle, ChunkDistances> distances = distances_of_grids(scene, eye);
  std::map<GridHandle, GridSnapshot> snapshots;
  std::vector<double> queued = queue_.measure([&](const LiveJob& job) { return distances.at(job.grid).to(job.chunk); });
  double farthest = kNone;  // of those that came and have to go
  for (const Candidate& each : candidates(distances)) {
    if (queued.size() >= max_ahead_) {
      if (queued.back() <= each.distance) break;
      farthest = queued.back();
      queued.pop_back();
    }
    GridSnapshot& snapshot = snapshots[each.handle];
    const bool is_blocky = options_.style == SurfaceStyle::Blocky;  // smooth jobs have that of their densities
    if (is_blocky && snapshot == nullptr)
      snapshot = std::make_shared<const Grid>(scene.grids()[each.handle].grid.snapshot());
    std::unique_ptr<LiveJob> job = each.live->make_job(snapshot, each.chunk, types_);
    job->distance = each.distance;
    const std::uint64_t serial = job->serial;
    queue_.push(std::move(job));
    each.live->hand_over(each.chunk, serial);
    queued.insert(std::upper_bound(queued.begin(), queued.end(), each.distance), each.distance);
  }
  if (farthest != kNone) withdraw([&](const LiveJob& job) { return job.distance >= farthest; });
}

std::vector<SurfaceUpdate> MeshScheduler::take() {
  std::vector<SurfaceUpdate> taken;
  try {
    collect();
    taken.reserve(totals_.ready.size());
  } catch (...) {
    forget();
    throw;
  }
  for (const auto& [handle, chunk] : totals_.ready) {
    if (LiveGrid* live = find(handle)) live->take(chunk, taken);
  }
  totals_.ready.clear();
  return taken;
}

void MeshScheduler::finish(const Scene& scene, DVec3 eye) {
  for (;;) {
    const LiveMeshes::Stats before = stats();
    update(scene, eye);
    if (totals_.unfinished == 0) return queue_.wait(0);  // for what was removed while it was meshed
    queue_.wait(has_waiting() ? max_ahead_ / 2 : 0);
    const LiveMeshes::Stats after = stats();
    // Nothing but failures: it will not do to try for ever.
    if (after.out_of_memory != before.out_of_memory && after.chunks_meshed == before.chunks_meshed) {
      throw std::bad_alloc();
    }
  }
}

LiveMeshes::Stats MeshScheduler::stats() const {
  return queue_.stats();
}

}  // namespace quoin
