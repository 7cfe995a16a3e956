#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/live/live_meshes.h>
#include <quoin/scene/scene.h>

#include "live/mesh_job_queue.h"
#include "render/chunks/surface_source.h"
#include "scene/scene_follower.h"

namespace quoin {

/// The implementation of LiveMeshes, with a choice of the workers' function.
class MeshScheduler {
 public:
  /// Calls of `work` come from several threads at once.
  MeshScheduler(const LiveMeshOptions& options, MeshJobQueue::Work work);

  void update(const Scene& scene, DVec3 eye, std::span<const DVec3> other_eyes = {});
  void use_light(const SceneLight* light) {
    const std::lock_guard lock(mutex_);
    light_ = light;
  }
  [[nodiscard]] std::vector<SurfaceUpdate> take(std::size_t max_bytes = std::numeric_limits<std::size_t>::max());
  [[nodiscard]] std::size_t pending() const {
    const std::lock_guard lock(mutex_);
    return totals_.pending;
  }
  void finish(const Scene& scene, DVec3 eye, std::span<const DVec3> other_eyes = {});
  [[nodiscard]] LiveMeshes::Stats stats() const;
  /// Stops the workers. Do not call other functions after it.
  void stop() { queue_.stop(); }

 private:
  struct Candidate;

  using Sources = std::map<SurfaceKey, std::unique_ptr<SurfaceSource>>;

  void update_or_throw(const Scene& scene);
  void throw_failure();
  [[nodiscard]] ChangedTypes follow_types(const VoxelRegistry& types);
  [[nodiscard]] std::vector<GridHandle> follow_scene(const Scene& scene);
  void follow_grid(const Scene& scene, GridHandle handle, SurfaceClock::time_point now);
  void follow_light(SurfaceClock::time_point now);
  void choose_levels(const Scene& scene, SurfaceClock::time_point now);
  void forget();
  void collect();
  void renew_jobs(const Scene& scene, SurfaceClock::time_point now);
  void hand_over(const Scene& scene);
  [[nodiscard]] bool has_waiting() const;
  void add_places(const Scene& scene, std::map<GridHandle, ChunkDistances>& distances) const;
  [[nodiscard]] std::map<GridHandle, ChunkDistances> distances_of_grids(const Scene& scene) const;
  [[nodiscard]] std::vector<Candidate> candidates(const std::map<GridHandle, ChunkDistances>& distances);
  void withdraw(const std::function<bool(const SurfaceJob&)>& is_unwanted);
  [[nodiscard]] SurfaceSource* find(SurfaceKey source);

  const LiveMeshOptions options_;
  const ChunkSurfaceOptions surface_options_;
  const unsigned workers_;
  const std::size_t max_ahead_;  // jobs that wait for workers
  mutable std::mutex mutex_;     // guards the following members, except the queue, which has its own mutex
  SurfaceTotals totals_;
  SurfaceTypes types_;
  const SceneLight* light_ = nullptr;  // of the caller
  ChangeCursor followed_types_;
  SurfaceClock::time_point renewed_{};
  SceneFollower drawn_;
  Sources sources_;
  std::vector<DVec3> eyes_;
  bool are_places_new_ = true;  // eyes or instances moved since levels were last chosen
  MeshJobQueue queue_;          // last: its threads end first
};

}  // namespace quoin
