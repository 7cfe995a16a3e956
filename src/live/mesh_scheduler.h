#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/function_ref.h>
#include <quoin/core/parallel.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/live/live_meshes.h>
#include <quoin/scene/scene.h>

#include "core/work/workers.h"
#include "live/light_worker.h"
#include "render/chunks/surface_job.h"
#include "render/chunks/surface_source.h"
#include "scene/scene_follower.h"

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
  /// Replaces the function of jobs that were not started. Returns when all others are done, and drops all results that
  /// were not collected. Requires: no worker's function calls it. Errors: bad_alloc, without any change.
  void replace_work(Work work);
  /// Replaces the callback. Returns when no worker runs the former one. Requires: as `replace_work`. Errors: as there.
  void replace_on_ready(std::function<void()> on_ready) { on_ready_.replace(std::move(on_ready)); }
  /// Calls `on_ready`, if any.
  void call_on_ready() const;
  void push(std::unique_ptr<SurfaceJob> job);
  /// Returns the first exception of a callback since the last call, or null.
  [[nodiscard]] std::exception_ptr take_failure();
  /// Withdraws and returns the waiting jobs that match `is_unwanted`.
  [[nodiscard]] std::vector<std::unique_ptr<SurfaceJob>> withdraw(FunctionRef<bool(const SurfaceJob&)> is_unwanted);
  /// Sets new distances of the waiting jobs. Returns the distances in ascending order.
  [[nodiscard]] std::vector<double> measure(FunctionRef<double(const SurfaceJob&)> distance);
  /// Calls `renew` for the waiting jobs, so that blocky ones can get newer snapshots in which their chunks are
  /// unchanged. An old snapshot keeps all memory that was released since.
  void renew(FunctionRef<void(SurfaceJob&)> renew);
  /// Returns the jobs completed since the last call, in order of completion.
  [[nodiscard]] std::vector<std::unique_ptr<SurfaceJob>> collect();
  /// Returns once at most `waiting` jobs wait for workers; with 0, once all jobs are done.
  void wait(std::size_t waiting);
  [[nodiscard]] LiveMeshes::Stats stats() const;
  /// Returns the queue of objects that the workers destroy. It also destroys the surfaces of jobs.
  [[nodiscard]] const std::shared_ptr<ReleaseQueue>& releases() const { return workers_.releases(); }

 private:
  [[nodiscard]] Workers::Clock::time_point step(Workers::Lock& lock, SurfaceWorkspace& workspace);
  [[nodiscard]] std::exception_ptr work_on(const Work& work, SurfaceJob& job, SurfaceWorkspace& workspace);
  void finish(std::unique_ptr<SurfaceJob> job, SurfaceClock::time_point start);
  [[nodiscard]] std::unique_ptr<SurfaceJob> take_nearest();

  Replaceable<Work> work_;
  Replaceable<std::function<void()>> on_ready_;
  mutable std::mutex mutex_;
  std::size_t running_ = 0;
  std::vector<std::unique_ptr<SurfaceJob>> queue_;
  std::vector<std::unique_ptr<SurfaceJob>> done_;  // with capacity for all waiting and running jobs
  LiveMeshes::Stats stats_;
  std::vector<SurfaceWorkspace> workspaces_;  // of each worker
  Workers workers_{mutex_};
};

/// Returns the options with neither `convert` nor `on_ready`.
[[nodiscard]] LiveMeshOptions without_callbacks(const LiveMeshOptions& options);

/// Returns the options that workers need.
[[nodiscard]] ChunkSurfaceOptions surface_options(const LiveMeshOptions& options);

/// Makes the surface of a job's chunk and converts it, as LiveMeshOptions::convert.
void make_live_surface(const LiveMeshOptions& options, SurfaceJob& job, SurfaceWorkspace& workspace);

/// The implementation of LiveMeshes, with a choice of the workers' function.
class MeshScheduler {
 public:
  /// Calls of `work` come from several threads at once.
  MeshScheduler(const LiveMeshOptions& options, MeshJobQueue::Work work);

  std::uint64_t update(const Scene& scene, DVec3 eye, std::span<const DVec3> other_eyes = {});
  /// Replaces the workers' function. Drops the surfaces that were not taken, and makes all again. As
  /// LiveMeshes::set_convert.
  void replace_work(MeshJobQueue::Work work);
  /// As LiveMeshes::set_on_ready.
  void replace_on_ready(std::function<void()> on_ready) { queue_.replace_on_ready(std::move(on_ready)); }
  /// At most one of both is not null. Must not overlap with `update`.
  void use_light(const SceneLight* light, std::shared_ptr<LightWorker> worker);
  [[nodiscard]] std::vector<SurfaceUpdate> take(std::size_t max_bytes = std::numeric_limits<std::size_t>::max());
  [[nodiscard]] std::size_t pending() const;
  [[nodiscard]] std::uint64_t shown_update() const {
    const std::lock_guard lock(mutex_);
    return shown_;
  }
  void finish(const Scene& scene, DVec3 eye, std::span<const DVec3> other_eyes = {});
  [[nodiscard]] LiveMeshes::Stats stats() const;
  /// Stops the workers. Do not call other functions after it.
  void stop();

 private:
  struct Candidate;

  using Sources = std::map<SurfaceKey, std::unique_ptr<SurfaceSource>>;

  /// The input of surfaces: the scene of `update`, or a snapshot with its light.
  struct State {
    const Scene* scene = nullptr;
    const SceneLight* light = nullptr;  // null: no light is used
    std::uint64_t number = 0;           // of the newest update whose edits it contains
    SurfaceClock::time_point seen;      // time of an update whose edits it contains
  };

  void update_or_throw(const Scene& scene);
  void follow(const State& state, const Scene& places);
  void receive(std::shared_ptr<LitState> lit);
  void begin_epoch(const State& state);
  void end_epoch();
  void complete(std::uint64_t state, const std::shared_ptr<LitState>& lit);
  [[nodiscard]] std::pair<std::size_t, bool> count_edited() const;
  void release_edits(const State& state);
  void throw_failure();
  [[nodiscard]] ChangedTypes follow_types(const VoxelRegistry& types);
  void follow_scene(const Scene& scene);
  void follow_grid(const Scene& scene, GridHandle handle, SurfaceClock::time_point now);
  void follow_light(const SceneLight* light, const VoxelRegistry& types, SurfaceClock::time_point now);
  void mark_types(const Scene& scene, const ChangedTypes& changed, SurfaceClock::time_point now);
  void prepare(const Scene& scene);
  void choose_levels(const Scene& scene, SurfaceClock::time_point now);
  void forget();
  void collect();
  void push_retries();
  void renew_jobs(const State& state, SurfaceClock::time_point now);
  void hand_over(const State& state, const Scene& places);
  [[nodiscard]] bool has_waiting() const;
  void add_places(const Scene& scene, std::map<GridHandle, ChunkDistances>& distances) const;
  [[nodiscard]] std::map<GridHandle, ChunkDistances> distances_of_grids(const Scene& scene) const;
  [[nodiscard]] std::vector<Candidate> candidates(const std::map<GridHandle, ChunkDistances>& distances);
  void withdraw(FunctionRef<bool(const SurfaceJob&)> is_unwanted);
  [[nodiscard]] SurfaceSource* find(SurfaceKey source);

  const LiveMeshOptions options_;  // without callbacks
  const ChunkSurfaceOptions surface_options_;
  const unsigned workers_;
  const std::size_t max_ahead_;  // jobs that wait for workers
  mutable std::mutex mutex_;     // guards the following members, except the queue, which has its own mutex
  SurfaceTotals totals_;
  SurfaceTypes types_;
  const SceneLight* light_ = nullptr;           // of the caller
  std::shared_ptr<LightWorker> light_worker_;   // its states are followed, instead of the caller's scene
  std::shared_ptr<LitState> lit_;               // the newest of these
  std::shared_ptr<LitState> followed_lit_;      // the one that the sources follow
  std::uint64_t lit_number_ = 0;                // of the newest update with the same content
  const SceneLight* followed_light_ = nullptr;  // by the sources; only its address is used
  bool must_follow_light_ = false;              // also if it is the same
  SceneFollower placed_;                        // in the caller's scene: placements that no state may have
  std::exception_ptr receive_failure_;
  std::uint64_t updates_ = 0;
  bool is_epoch_open_ = false;
  std::uint64_t epoch_state_ = 0;           // number of the state that the epoch shows
  std::shared_ptr<LitState> epoch_lit_;     // its light
  std::shared_ptr<LitState> complete_lit_;  // of the newest complete state, to be shown
  std::uint64_t shown_ = 0;
  std::uint64_t forgotten_ = 0;                       // results of jobs up to this serial are dropped
  std::vector<std::unique_ptr<SurfaceJob>> retries_;  // jobs of the epoch that ran out of memory
  ChangeCursor followed_types_;
  SurfaceClock::time_point renewed_{};
  SceneFollower drawn_;
  std::vector<GridHandle> changed_;  // drawn grids that may have changed; kept for its memory
  Sources sources_;
  std::vector<DVec3> eyes_;
  std::vector<DVec3> next_eyes_;                          // of the update in progress; kept for its memory
  std::map<GridHandle, ChunkDistances> level_distances_;  // for `choose_levels`; kept for its memory
  bool must_restart_ = false;                             // memory ran out; `update` was not called since
  bool is_all_new_ = false;                               // the scene that was followed last is another one
  bool are_places_new_ = true;                            // eyes or instances moved since levels were last chosen
  MeshJobQueue queue_;                                    // last: its threads end first
};

}  // namespace quoin
