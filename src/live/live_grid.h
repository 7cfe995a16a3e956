#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include <quoin/live/live_meshes.h>
#include <quoin/scene/scene.h>

#include "live/live_densities.h"
#include "live/live_source.h"

namespace quoin {

/// The state of one chunk's surface.
struct LiveChunk {
  std::uint64_t serial = 0;     ///< of the newest job
  std::uint64_t oldest = 0;     ///< results of earlier jobs are obsolete
  std::uint64_t collected = 0;  ///< the newest collected job
  LiveClock::time_point seen;   ///< time of the last edit
  bool is_waiting = false;      ///< for a job
  bool is_working = false;      ///< the newest job is not collected
  bool is_ready = false;        ///< `surface` is ready to be taken
  bool is_listed = false;       ///< in LiveTotals::ready
  bool is_shown = false;        ///< the last surface taken is not null
  bool is_gone = false;         ///< it must no longer be visible
  std::shared_ptr<const ChunkSurface> surface;
  std::vector<std::uint64_t> region_hashes;    ///< of the surface taken last, if it has several regions; 0: no quads
  std::unique_ptr<DensityStamps> last_stamps;  ///< smooth: densities of the surface collected last
  std::uint64_t type_generation = 0;           ///< types of the surface collected last

  [[nodiscard]] bool is_unfinished() const { return is_waiting || is_working; }
  [[nodiscard]] bool is_pending() const { return is_unfinished() || is_ready; }
};

/// The voxels of one grid.
class LiveGrid final : public LiveSource {
 public:
  LiveGrid(GridHandle handle, const LiveMeshOptions& options, LiveTotals& totals);

  void follow(const SceneGrid& content, LiveClock::time_point now) override { follow(content.grid, now); }
  void follow(const Grid& grid, LiveClock::time_point now);
  void follow_light(const GridLight& light, LiveClock::time_point now) override;
  void leave() override;
  void forget() override { followed_ = followed_light_ = {}; }
  void mark_types(const SceneGrid& content, const ChangedTypes& changed, LiveClock::time_point now) override;

  void prepare(const SceneGrid&, const VoxelRegistry&) override {}
  [[nodiscard]] const ChunkSet& waiting() const override { return waiting_; }
  [[nodiscard]] const IBox& box() const override { return box_; }
  [[nodiscard]] bool has_chunks() const override { return !chunks_.empty(); }
  [[nodiscard]] std::unique_ptr<LiveJob> make_job(LiveInputs& inputs, IVec3 chunk) override;
  /// Makes a job for the grid as of the last `follow`. `grid` is null for smooth surfaces.
  [[nodiscard]] std::unique_ptr<LiveJob> make_job(const GridSnapshot& grid, IVec3 chunk, const LiveTypes& types,
                                                  const LightSnapshot& light = nullptr);
  void hand_over(IVec3 chunk, std::uint64_t serial) override;
  [[nodiscard]] bool is_current(const LiveJob& job) const override;
  void withdrawn(const LiveJob& job) override;
  void collect(LiveJob& job) override;
  void take(IVec3 chunk, std::vector<SurfaceUpdate>& out) override;

 private:
  using Change = LiveChange<LiveChunk>;
  using Chunks = std::unordered_map<IVec3, LiveChunk, CoordinateHash>;

  void begin_anew();
  void follow_blocky(const Grid& grid, const GridChanges& changes, LiveClock::time_point now);
  void follow_smooth(const Grid& grid, const GridChanges& changes, LiveClock::time_point now);
  static void add_chunks_around(IVec3 chunk, int distance, std::vector<IVec3>& to);
  void remove_if_there(IVec3 chunk);
  void see_whether_meshed(const Grid& grid, IVec3 chunk, LiveClock::time_point now);
  void mark_if_there(IVec3 chunk, LiveClock::time_point now);
  void mark_all(LiveClock::time_point now);
  void mark(IVec3 chunk, LiveChunk& state, LiveClock::time_point now);
  void wait_again(IVec3 chunk, LiveChunk& state);
  void remove(IVec3 chunk);
  void keep_densities(const LiveJob& job);
  void keep_stamps(const LiveJob& job, LiveChunk& state);
  void make_ready(IVec3 chunk, LiveChunk& state);
  [[nodiscard]] std::uint64_t note_regions(LiveChunk& state) const;

  GridHandle handle_;
  const LiveMeshOptions& options_;
  LiveTotals& totals_;
  ChangeCursor followed_;
  ChangeCursor followed_light_;
  bool is_lit_ = false;
  Chunks chunks_;
  ChunkSet waiting_;
  IBox box_;                // of all chunks that there were
  DensityCache densities_;  // smooth
};

}  // namespace quoin
