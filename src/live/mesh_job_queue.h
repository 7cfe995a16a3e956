#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include <quoin/live/live_meshes.h>
#include <quoin/mesh/blocky.h>
#include <quoin/mesh/smooth.h>

#include "core/work/workers.h"
#include "live/live_densities.h"
#include "mesh/surface/face_materials.h"

namespace quoin {

using LiveClock = std::chrono::steady_clock;

/// The state of a field at one moment.
using FieldSnapshot = std::shared_ptr<const DensityGrid>;

/// The densities of single bodies, per chunk of a field; empty if nothing is transparent.
using FieldBodies = std::unordered_map<IVec3, std::shared_ptr<BodyChunks>, CoordinateHash>;

/// A grid's light at one moment, and the voxels that it was computed from.
struct LitVoxels {
  PropagatedLight light;
  Grid voxels;
};
using LightSnapshot = std::shared_ptr<const LitVoxels>;

/// The source of surfaces: the voxels or the field of a grid.
struct LiveKey {
  GridHandle grid;
  SurfaceContent content = SurfaceContent::Voxels;

  bool operator==(const LiveKey&) const = default;
  bool operator<(const LiveKey& other) const {
    return grid == other.grid ? content < other.content : grid < other.grid;
  }
};

/// A chunk to be meshed, with all inputs, and later its surface.
struct LiveJob {
  LiveKey source;
  IVec3 chunk{0};
  std::uint64_t serial = 0;
  double distance = 0.0;       ///< from the eye; the nearest job comes first
  LiveClock::time_point seen;  ///< time of the edit

  GridSnapshot voxels;  ///< blocky
  LightSnapshot light;  ///< blocky; null if no light is used
  std::shared_ptr<const VoxelRegistry> types;
  LiveDensities densities;                            ///< smooth
  std::shared_ptr<const SurfaceMaterials> materials;  ///< smooth surfaces and fields
  /// Smooth: density stamps of the last surface. If the stamps match, meshing is skipped.
  std::optional<DensityStamps> last_stamps;
  std::uint64_t last_collected = 0;           ///< the job that made the last surface
  std::uint64_t type_generation = 0;          ///< generation of `types` and `materials`
  FieldSnapshot field;                        ///< fields only; uses `materials` too
  std::shared_ptr<const FieldBodies> bodies;  ///< bodies of `field`
  std::array<std::uint8_t, 27> levels{};      ///< fields: levels of detail, in neighbourhood order

  enum class Outcome : std::uint8_t { Meshed, AsBefore, OutOfMemory };
  Outcome outcome = Outcome::Meshed;
  std::shared_ptr<ChunkSurface> surface;  ///< null if there is no surface
};

/// Scratch memory that a worker keeps between chunks.
struct LiveWorkspace {
  std::optional<BlockyMesher> blocky;
  std::optional<SmoothMesher> smooth;
  QuadBuffer quads;
  QuadBuffer cut_quads;
  QuadBuffer lit_quads;
  std::vector<FaceLight> face_light;  // of `lit_quads`
  LightSnapshot lit;                  // with the types
  std::shared_ptr<const VoxelRegistry> lit_types;
  std::optional<SurfaceLight> surface_light;  // of both; it remembers rows from chunk to chunk
  SmoothChunkMesh mesh;
};

/// Workers, the waiting jobs (nearest first), and the finished ones.
///
/// Threads: all calls come from one thread at a time.
class MeshJobQueue {
 public:
  /// Sets a job's outcome and surface. A bad_alloc counts as OutOfMemory; other exceptions are kept.
  using Work = std::function<void(LiveJob&, LiveWorkspace&)>;

  /// `on_ready`, if any, is called by a worker after each job that did not run out of memory.
  MeshJobQueue(unsigned workers, Work work, std::function<void()> on_ready);

  /// Waits for started jobs. Discards waiting jobs and all later ones.
  void stop() { workers_.stop(); }
  void push(std::unique_ptr<LiveJob> job);
  /// Returns the first exception of a callback since the last call, or null.
  [[nodiscard]] std::exception_ptr take_failure();
  /// Withdraws and returns the waiting jobs that match `is_unwanted`.
  [[nodiscard]] std::vector<std::unique_ptr<LiveJob>> withdraw(const std::function<bool(const LiveJob&)>& is_unwanted);
  /// Sets new distances of the waiting jobs. Returns the distances in ascending order.
  [[nodiscard]] std::vector<double> measure(const std::function<double(const LiveJob&)>& distance);
  /// Calls `renew` for the waiting jobs, so that blocky ones can get newer snapshots in which their chunks are
  /// unchanged. An old snapshot keeps all memory that was released since. Workers free the old snapshots.
  void renew(const std::function<void(LiveJob&)>& renew);
  /// Returns the jobs completed since the last call, in order of completion.
  [[nodiscard]] std::vector<std::unique_ptr<LiveJob>> collect();
  /// Returns once at most `waiting` jobs wait for workers; with 0, once all jobs are done.
  void wait(std::size_t waiting);
  [[nodiscard]] LiveMeshes::Stats stats() const;

 private:
  [[nodiscard]] Workers::Clock::time_point step(Workers::Lock& lock, LiveWorkspace& workspace);
  void finish(std::unique_ptr<LiveJob> job, LiveClock::time_point start);
  [[nodiscard]] std::unique_ptr<LiveJob> take_nearest();

  const Work work_;
  const std::function<void()> on_ready_;
  mutable std::mutex mutex_;
  std::size_t running_ = 0;
  std::vector<std::unique_ptr<LiveJob>> queue_;
  std::vector<std::unique_ptr<LiveJob>> done_;  // with capacity for all waiting and running jobs
  std::vector<std::pair<GridSnapshot, LightSnapshot>> spent_;
  LiveMeshes::Stats stats_;
  std::vector<LiveWorkspace> workspaces_;  // of each worker
  Workers workers_{mutex_};
};

/// Makes the surface of a job's chunk.
void make_live_surface(const LiveMeshOptions& options, LiveJob& job, LiveWorkspace& workspace);

}  // namespace quoin
