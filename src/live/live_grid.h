#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include <quoin/live/live_meshes.h>
#include <quoin/scene/scene.h>

#include "grid/coordinate_hash.h"
#include "live/live_densities.h"
#include "live/mesh_job_queue.h"

namespace quoin {

/// What is known of the surface of one chunk.
struct LiveChunk {
  std::uint64_t serial = 0;     ///< of the newest job
  std::uint64_t oldest = 0;     ///< results of jobs before this one are of something else
  std::uint64_t collected = 0;  ///< the newest job that is done
  LiveClock::time_point seen;   ///< when the last edit was
  bool is_waiting = false;      ///< for a job
  bool is_working = false;      ///< the newest job is not collected
  bool is_ready = false;        ///< `surface` is to be taken
  bool is_listed = false;       ///< in LiveTotals::ready
  bool is_shown = false;        ///< what was taken last is not null
  bool is_gone = false;         ///< not to be seen any more
  std::shared_ptr<const ChunkSurface> surface;
  std::unique_ptr<DensityStamps> last_stamps;  ///< smooth: of what was collected last
  std::uint64_t type_generation = 0;           ///< likewise

  [[nodiscard]] bool is_unfinished() const { return is_waiting || is_working; }
  [[nodiscard]] bool is_pending() const { return is_unfinished() || is_ready; }
};

/// Totals over all grids.
struct LiveTotals {
  std::uint64_t serial = 0;  ///< of the job that was made last
  std::size_t unfinished = 0;
  std::size_t pending = 0;
  std::vector<std::pair<GridHandle, IVec3>> ready;  ///< and perhaps some that are no more
};

/// What surfaces are made with.
struct LiveTypes {
  std::shared_ptr<const VoxelRegistry> registry;
  std::shared_ptr<const SurfaceMaterials> materials;
  std::uint64_t generation = 0;
};

/// Follows one grid of a scene: which of its chunks are to be meshed, and what became of them.
class LiveGrid {
 public:
  LiveGrid(GridHandle handle, const LiveMeshOptions& options, LiveTotals& totals);

  /// Takes over what was edited, at a cost in proportion to that.
  void follow(const Grid& grid, LiveClock::time_point now);
  /// Nothing of the grid is drawn any more.
  void leave();
  /// Makes the next `follow` begin anew.
  void forget() { followed_ = {}; }
  /// Chunks that show one of the types are to be meshed again.
  void mark_types(const Grid& grid, const std::vector<bool>& changed, LiveClock::time_point now);

  [[nodiscard]] const std::unordered_set<IVec3, CoordinateHash>& waiting() const { return waiting_; }
  /// Holds all chunks that wait or are being meshed.
  [[nodiscard]] const IBox& box() const { return box_; }
  [[nodiscard]] bool has_chunks() const { return !chunks_.empty(); }
  /// Requires: the chunk waits; `grid` is as `follow` saw it.
  [[nodiscard]] std::unique_ptr<LiveJob> make_job(const GridSnapshot& grid, IVec3 chunk, const LiveTypes& types);
  /// The job is with the workers.
  void hand_over(IVec3 chunk, std::uint64_t serial);
  /// Whether the job is of the chunk's present state.
  [[nodiscard]] bool is_current(const LiveJob& job) const;
  /// The job was taken back; what is not meshed anew anyway waits again.
  void withdrawn(const LiveJob& job);
  /// The job is done.
  void collect(LiveJob& job);
  /// Appends the surface if there is one to be taken.
  void take(IVec3 chunk, std::vector<SurfaceUpdate>& out);

 private:
  class Change;
  using Chunks = std::unordered_map<IVec3, LiveChunk, CoordinateHash>;

  void begin_anew();
  void follow_blocky(const Grid& grid, const GridChanges& changes, LiveClock::time_point now);
  void follow_smooth(const Grid& grid, const GridChanges& changes, LiveClock::time_point now);
  void remove_if_there(IVec3 chunk);
  void see_whether_meshed(const Grid& grid, IVec3 chunk, LiveClock::time_point now);
  void mark_if_there(IVec3 chunk, LiveClock::time_point now);
  void mark(IVec3 chunk, LiveChunk& state, LiveClock::time_point now);
  void wait_again(IVec3 chunk, LiveChunk& state);
  void remove(IVec3 chunk);
  void keep_densities(const LiveJob& job);
  void keep_stamps(const LiveJob& job, LiveChunk& state);
  void make_ready(IVec3 chunk, LiveChunk& state);

  GridHandle handle_;
  const LiveMeshOptions& options_;
  LiveTotals& totals_;
  ChangeCursor followed_;
  Chunks chunks_;
  std::unordered_set<IVec3, CoordinateHash> waiting_;
  IBox box_;                // of all chunks that there were
  DensityCache densities_;  // smooth
};

}  // namespace quoin
