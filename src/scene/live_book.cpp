#include "scene/live_book.h"

#include <algorithm>
#include <limits>
#include <new>
#include <utility>

#include "grid/chunk_order.h"
#include "scene/instance_axes.h"

namespace quoin {
namespace {

unsigned worker_count(Threads threads) {
  return threads.count != 0 ? threads.count : std::max(2U, resolve(threads)) - 1;
}

// A smooth chunk takes a worker milliseconds, and its job the copies of up to 125 chunks.
std::size_t jobs_ahead(SurfaceStyle style, unsigned workers) {
  constexpr std::size_t kBlocky = 64;
  return style == SurfaceStyle::Blocky ? kBlocky : std::clamp<std::size_t>(4 * std::size_t{workers}, 8, kBlocky);
}

std::uint32_t look_of(const VoxelRegistry& types, VoxelType type, SurfaceStyle style) {
  if (style == SurfaceStyle::Blocky) return static_cast<std::uint32_t>(types.visibility(type));
  // Types that are not registered are opaque white.
  const Rgba8 colour = type < types.size() ? types[type].colour : Rgba8{255, 255, 255, 255};
  return colour.r | colour.g << 8U | colour.b << 16U | static_cast<std::uint32_t>(colour.a) << 24U;
}

bool is_drawn(const Instance& instance, const Scene& scene, bool hidden_too) {
  return (instance.visible || hidden_too) && has_place(instance) && scene.grids().find(instance.grid) != nullptr;
}

}  // namespace

// A chunk that waits for a job.
struct LiveBook::Candidate {
  double distance = 0.0;
  LiveGrid* live = nullptr;
  GridHandle handle;
  IVec3 chunk{0};
};

LiveBook::LiveBook(const LiveMeshOptions& options, LiveQueue::Work work)
    : options_(options),
      workers_(worker_count(options.threads)),
      most_ahead_(jobs_ahead(options.style, workers_)),
      copied_(std::make_shared<std::atomic<std::size_t>>(0)),
      queue_(workers_, std::move(work), options.on_ready) {}

void LiveBook::update(const Scene& scene, DVec3 eye) {
  try {
    update_or_throw(scene, eye);
  } catch (...) {
    forget();
    throw;
  }
}

// Memory ran out in the middle: whatever was lost is found by beginning anew.
void LiveBook::forget() {
  for (auto& [handle, grid] : grids_) grid.forget();
}

void LiveBook::update_or_throw(const Scene& scene, DVec3 eye) {
  const LiveClock::time_point now = LiveClock::now();
  collect();
  const std::vector<bool> changed_types = follow_types(scene.types);
  const std::vector<GridHandle> drawn = drawn_grids(scene);
  for (auto& [handle, grid] : grids_) {
    if (!std::binary_search(drawn.begin(), drawn.end(), handle)) grid.leave();
  }
  for (const GridHandle handle : drawn) {
    const Grid& grid = scene.grids()[handle].grid;
    LiveGrid& live = grids_.try_emplace(handle, handle, options_, totals_, copied_).first->second;
    live.follow(grid, now);
    if (!changed_types.empty()) live.mark_types(grid, changed_types, now);
  }
  withdraw([&](const LiveJob& job) {
    const LiveGrid* live = find(job.grid);
    return live == nullptr || !live->is_current(job);
  });
  if (totals_.unfinished != 0) hand_over(scene, eye);
  for (auto& [handle, grid] : grids_) grid.tidy();
  std::erase_if(grids_, [&](const auto& each) {
    return !each.second.has_chunks() && !std::binary_search(drawn.begin(), drawn.end(), each.first);
  });
}

// Which types look otherwise than before, by type; empty when none does.
std::vector<bool> LiveBook::follow_types(const VoxelRegistry& types) {
  std::vector<std::uint32_t> looks(types.size());
  for (std::size_t i = 0; i < looks.size(); ++i) looks[i] = look_of(types, static_cast<VoxelType>(i), options_.style);
  if (types_.generation != 0 && looks == type_looks_) return {};
  const std::uint32_t unregistered = look_of(VoxelRegistry(), 1, options_.style);
  std::vector<bool> changed(std::max(looks.size(), type_looks_.size()));
  for (std::size_t i = 1; i < changed.size(); ++i) {
    const auto look = [&](const std::vector<std::uint32_t>& all) { return i < all.size() ? all[i] : unregistered; };
    changed[i] = look(looks) != look(type_looks_);
  }
  if (options_.style == SurfaceStyle::Blocky) {
    types_.registry = std::make_shared<const VoxelRegistry>(types);
  } else {
    types_.materials = std::make_shared<const SurfaceMaterials>(types);
  }
  type_looks_ = std::move(looks);
  ++types_.generation;
  return changed;
}

// Sorted, each once.
std::vector<GridHandle> LiveBook::drawn_grids(const Scene& scene) const {
  std::vector<GridHandle> drawn;
  std::vector<bool> is_known;
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    const std::size_t index = instance.grid.index;
    if (index < is_known.size() && is_known[index]) return;
    if (!is_drawn(instance, scene, options_.hidden)) return;
    if (is_known.size() <= index) is_known.resize(index + 1);
    is_known[index] = true;
    drawn.push_back(instance.grid);
  });
  std::sort(drawn.begin(), drawn.end());
  return drawn;
}

void LiveBook::collect() {
  for (const std::unique_ptr<LiveJob>& job : queue_.collect()) {
    if (LiveGrid* live = find(job->grid)) live->collect(*job);
  }
}

void LiveBook::withdraw(const std::function<bool(const LiveJob&)>& is_unwanted) {
  for (const std::unique_ptr<LiveJob>& job : queue_.withdraw(is_unwanted)) {
    if (LiveGrid* live = find(job->grid)) live->withdrawn(*job);
  }
}

LiveGrid* LiveBook::find(GridHandle grid) {
  const auto found = grids_.find(grid);
  return found == grids_.end() ? nullptr : &found->second;
}

std::map<GridHandle, ChunkDistances> LiveBook::distances_of_grids(const Scene& scene, DVec3 eye) const {
  std::map<GridHandle, ChunkDistances> distances;
  for (const auto& [handle, live] : grids_) distances.try_emplace(handle, live.box(), eye);
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    const auto found = distances.find(instance.grid);
    if (found == distances.end() || !is_drawn(instance, scene, options_.hidden)) return;
    found->second.add(instance, scene.grids()[instance.grid]);
  });
  for (auto& [handle, places] : distances) places.sort();
  return distances;
}

bool LiveBook::has_waiting() const {
  return std::any_of(grids_.begin(), grids_.end(), [](const auto& each) { return !each.second.waiting().empty(); });
}

// The chunks that wait for jobs, as many as may get one, the nearest first.
std::vector<LiveBook::Candidate> LiveBook::candidates(const std::map<GridHandle, ChunkDistances>& distances) {
  std::vector<Candidate> all;
  for (auto& [handle, live] : grids_) {
    const ChunkDistances& places = distances.at(handle);
    for (const IVec3 chunk : live.waiting()) all.push_back({places.to(chunk), &live, handle, chunk});
  }
  const auto comes_before = [](const Candidate& a, const Candidate& b) {
    if (a.distance != b.distance) return a.distance < b.distance;
    return a.handle == b.handle ? by_zyx(a.chunk, b.chunk) : a.handle < b.handle;
  };
  const std::size_t most = std::min(all.size(), most_ahead_);
  std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(most), all.end(), comes_before);
  all.resize(most);
  return all;
}

// Gives jobs to the workers; those that wait and are farther than what comes now have to wait longer.
void LiveBook::hand_over(const Scene& scene, DVec3 eye) {
  if (!has_waiting()) return;
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const std::map<GridHandle, ChunkDistances> distances = distances_of_grids(scene, eye);
  std::vector<double> queued = queue_.measure([&](const LiveJob& job) { return distances.at(job.grid).to(job.chunk); });
  double farthest = kNone;  // of those that came and have to go
  for (const Candidate& each : candidates(distances)) {
    if (queued.size() >= most_ahead_) {
      if (queued.back() <= each.distance) break;
      farthest = queued.back();
      queued.pop_back();
    }
    std::unique_ptr<LiveJob> job = each.live->make_job(scene.grids()[each.handle].grid, each.chunk, types_);
    job->distance = each.distance;
    const std::uint64_t serial = job->serial;
    queue_.push(std::move(job));
    each.live->hand_over(each.chunk, serial);
    queued.insert(std::upper_bound(queued.begin(), queued.end(), each.distance), each.distance);
  }
  if (farthest != kNone) withdraw([&](const LiveJob& job) { return job.distance >= farthest; });
}

std::vector<SurfaceUpdate> LiveBook::take() {
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

void LiveBook::finish(const Scene& scene, DVec3 eye) {
  for (;;) {
    const LiveMeshes::Facts before = facts();
    update(scene, eye);
    if (totals_.unfinished == 0) return queue_.wait(0);  // for what was removed while it was meshed
    queue_.wait(has_waiting() ? most_ahead_ / 2 : 0);
    const LiveMeshes::Facts after = facts();
    // Nothing but failures: it will not do to try for ever.
    if (after.out_of_memory != before.out_of_memory && after.chunks_meshed == before.chunks_meshed) {
      throw std::bad_alloc();
    }
  }
}

LiveMeshes::Facts LiveBook::facts() const {
  LiveMeshes::Facts facts = queue_.facts();
  facts.copied_bytes = copied_->load(std::memory_order_relaxed);
  return facts;
}

}  // namespace quoin
