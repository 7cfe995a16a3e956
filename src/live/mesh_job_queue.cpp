#include "live/mesh_job_queue.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>

#include <quoin/core/assert.h>

#include "core/make_room.h"

namespace quoin {
namespace {

double seconds(SurfaceClock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

// Releases the inputs of a job. Copies of chunks are freed as early as possible.
void drop_inputs(SurfaceJob& job) {
  job.voxels = {};
  job.field.reset();
  job.types.reset();
  job.materials.reset();
}

}  // namespace

MeshJobQueue::MeshJobQueue(unsigned workers, Work work, std::function<void()> on_ready)
    : work_(std::move(work)), on_ready_(std::move(on_ready)), workspaces_(workers) {
  QUOIN_ASSERT(workers > 0 && work_ != nullptr, "workers with a function");
  workers_.start(workers, [this](Workers::Lock& lock, unsigned worker) { return step(lock, workspaces_[worker]); });
}

void MeshJobQueue::push(std::unique_ptr<SurfaceJob> job) {
  QUOIN_ASSERT(job != nullptr && !std::isnan(job->distance), "a job with a distance");
  {
    const std::lock_guard lock(mutex_);
    const std::size_t wanted = done_.size() + queue_.size() + running_ + 1;
    // Reserves memory here, so that workers cannot fail when they report a failure.
    make_room(done_, wanted - done_.size(), wanted);
    queue_.push_back(std::move(job));
  }
  workers_.wake_one();
}

std::vector<std::unique_ptr<SurfaceJob>> MeshJobQueue::withdraw(
    const std::function<bool(const SurfaceJob&)>& is_unwanted) {
  std::vector<std::unique_ptr<SurfaceJob>> taken;
  const std::lock_guard lock(mutex_);
  taken.reserve(queue_.size());
  std::erase_if(queue_, [&](std::unique_ptr<SurfaceJob>& job) {
    if (!is_unwanted(*job)) return false;
    taken.push_back(std::move(job));
    return true;
  });
  return taken;
}

std::vector<double> MeshJobQueue::measure(const std::function<double(const SurfaceJob&)>& distance) {
  std::vector<double> distances;
  const std::lock_guard lock(mutex_);
  distances.reserve(queue_.size());
  for (const std::unique_ptr<SurfaceJob>& job : queue_) distances.push_back(job->distance = distance(*job));
  std::sort(distances.begin(), distances.end());
  return distances;
}

void MeshJobQueue::renew(const std::function<void(SurfaceJob&)>& renew) {
  const std::lock_guard lock(mutex_);
  for (const std::unique_ptr<SurfaceJob>& job : queue_) {
    if (job->voxels == nullptr) continue;
    spent_.emplace_back(job->voxels, job->light);
    renew(*job);
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
  ++running_;
  auto spent = std::exchange(spent_, {});
  lock.unlock();
  spent.clear();
  const SurfaceClock::time_point start = SurfaceClock::now();
  std::exception_ptr failure;
  try {
    work_(*job, workspace);
  } catch (const std::bad_alloc&) {
    job->outcome = SurfaceJob::Outcome::OutOfMemory;
    job->surface.reset();
    workspace = {};
  } catch (...) {
    failure = std::current_exception();
  }
  drop_inputs(*job);
  // Failures are not reported to the callback: an immediate retry would fail again.
  const bool is_reported = job->outcome != SurfaceJob::Outcome::OutOfMemory;
  lock.lock();
  workers_.keep_failure(std::move(failure));
  finish(std::move(job), start);
  lock.unlock();
  if (is_reported && on_ready_) on_ready_();
  lock.lock();
  return Workers::kAgain;
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

ChunkSurfaceOptions surface_options(const LiveMeshOptions& options) {
  return {.style = options.style,
          .merge = options.merge,
          .region_edge = options.region_edge,
          .light_merging = options.light_merging,
          .occlusion = options.occlusion,
          .colours = options.colours,
          .detail_distance = options.detail_distance};
}

void make_live_surface(const LiveMeshOptions& options, SurfaceJob& job, SurfaceWorkspace& workspace) {
  make_chunk_surface(surface_options(options), job, workspace);
  if (options.convert && job.surface != nullptr) {
    job.surface->converted =
        options.convert({job.source.grid, job.chunk, job.surface, job.source.content, ~std::uint64_t{0}});
  }
}

}  // namespace quoin
