#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <quoin/live/live_meshes.h>

#include "core/work/workers.h"
#include "render/chunks/surface_job.h"

namespace quoin {

/// Workers, the waiting jobs (nearest first), and the finished ones.
///
/// Threads: all calls come from one thread at a time.
class MeshJobQueue {
 public:
  /// Sets a job's outcome and surface. A bad_alloc counts as OutOfMemory; other exceptions are kept.
  using Work = std::function<void(SurfaceJob&, SurfaceWorkspace&)>;

  /// `on_ready`, if any, is called by a worker after each job that did not run out of memory.
  MeshJobQueue(unsigned workers, Work work, std::function<void()> on_ready);

  /// Waits for started jobs. Discards waiting jobs and all later ones.
  void stop() { workers_.stop(); }
  void push(std::unique_ptr<SurfaceJob> job);
  /// Returns the first exception of a callback since the last call, or null.
  [[nodiscard]] std::exception_ptr take_failure();
  /// Withdraws and returns the waiting jobs that match `is_unwanted`.
  [[nodiscard]] std::vector<std::unique_ptr<SurfaceJob>> withdraw(
      const std::function<bool(const SurfaceJob&)>& is_unwanted);
  /// Sets new distances of the waiting jobs. Returns the distances in ascending order.
  [[nodiscard]] std::vector<double> measure(const std::function<double(const SurfaceJob&)>& distance);
  /// Calls `renew` for the waiting jobs, so that blocky ones can get newer snapshots in which their chunks are
  /// unchanged. An old snapshot keeps all memory that was released since. Workers free the old snapshots.
  void renew(const std::function<void(SurfaceJob&)>& renew);
  /// Returns the jobs completed since the last call, in order of completion.
  [[nodiscard]] std::vector<std::unique_ptr<SurfaceJob>> collect();
  /// Returns once at most `waiting` jobs wait for workers; with 0, once all jobs are done.
  void wait(std::size_t waiting);
  [[nodiscard]] LiveMeshes::Stats stats() const;

 private:
  [[nodiscard]] Workers::Clock::time_point step(Workers::Lock& lock, SurfaceWorkspace& workspace);
  void finish(std::unique_ptr<SurfaceJob> job, SurfaceClock::time_point start);
  [[nodiscard]] std::unique_ptr<SurfaceJob> take_nearest();

  const Work work_;
  const std::function<void()> on_ready_;
  mutable std::mutex mutex_;
  std::size_t running_ = 0;
  std::vector<std::unique_ptr<SurfaceJob>> queue_;
  std::vector<std::unique_ptr<SurfaceJob>> done_;  // with capacity for all waiting and running jobs
  std::vector<std::pair<GridSnapshot, LightSnapshot>> spent_;
  LiveMeshes::Stats stats_;
  std::vector<SurfaceWorkspace> workspaces_;  // of each worker
  Workers workers_{mutex_};
};

/// Returns the options that workers need.
[[nodiscard]] ChunkSurfaceOptions surface_options(const LiveMeshOptions& options);

/// Makes the surface of a job's chunk and converts it, as LiveMeshOptions::convert.
void make_live_surface(const LiveMeshOptions& options, SurfaceJob& job, SurfaceWorkspace& workspace);

}  // namespace quoin
