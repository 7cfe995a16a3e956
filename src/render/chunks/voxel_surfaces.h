#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include <quoin/scene/scene.h>

#include "render/chunks/surface_source.h"
#include "render/chunks/voxel_densities.h"

namespace quoin {

/// The state of one chunk's surface.
struct VoxelChunk {
  std::uint64_t serial = 0;       ///< of the newest job
  std::uint64_t oldest = 0;       ///< results of earlier jobs are obsolete
  std::uint64_t collected = 0;    ///< the newest collected job
  SurfaceClock::time_point seen;  ///< time of the last edit
  bool is_waiting = false;        ///< for a job
  bool is_working = false;        ///< the newest job is not collected
  bool is_ready = false;          ///< `surface` is ready to be taken
  bool is_listed = false;         ///< in SurfaceTotals::ready
  bool is_shown = false;          ///< the last surface taken is not null
  bool is_gone = false;           ///< it must no longer be visible
  std::shared_ptr<const ChunkSurface> surface;
  std::vector<std::uint64_t> region_hashes;    ///< of the surface taken last, if it has several regions; 0: no quads
  std::unique_ptr<DensityStamps> last_stamps;  ///< smooth: densities of the surface collected last
  std::uint64_t type_generation = 0;           ///< types of the surface collected last

  [[nodiscard]] bool is_unfinished() const { return is_waiting || is_working; }
  [[nodiscard]] bool is_pending() const { return is_unfinished() || is_ready; }
};

/// The voxels of one grid.
class VoxelSurfaces final : public SurfaceSource {
 public:
  VoxelSurfaces(GridHandle handle, const ChunkSurfaceOptions& options, SurfaceTotals& totals);

  void follow(const SceneGrid& content, SurfaceClock::time_point now) override { follow(content.grid, now); }
  void follow(const Grid& grid, SurfaceClock::time_point now);
  void follow_light(const GridLight& light, SurfaceClock::time_point now) override;
  void leave() override;
  void forget() override { followed_ = followed_light_ = {}; }
  void mark_types(const SceneGrid& content, const ChangedTypes& changed, SurfaceClock::time_point now) override;

  void prepare(const SceneGrid&, const VoxelRegistry&) override {}
  [[nodiscard]] const ChunkSet& waiting() const override { return waiting_; }
  [[nodiscard]] const IBox& box() const override { return box_; }
  [[nodiscard]] bool has_chunks() const override { return !chunks_.empty(); }
  [[nodiscard]] std::unique_ptr<SurfaceJob> make_job(SurfaceInputs& inputs, IVec3 chunk) override;
  /// Makes a job for the grid as of the last `follow`. `grid` is null for smooth surfaces.
  [[nodiscard]] std::unique_ptr<SurfaceJob> make_job(const GridSnapshot& grid, IVec3 chunk, const SurfaceTypes& types,
                                                     const LightSnapshot& light = nullptr);
  void hand_over(IVec3 chunk, std::uint64_t serial) override;
  [[nodiscard]] bool is_current(const SurfaceJob& job) const override;
  void withdrawn(const SurfaceJob& job) override;
  void collect(SurfaceJob& job) override;
  void take(IVec3 chunk, std::vector<SurfaceUpdate>& out) override;

 private:
  using Change = CountedChange<VoxelChunk>;
  using Chunks = std::unordered_map<IVec3, VoxelChunk, CoordinateHash>;

  void begin_anew();
  void follow_blocky(const Grid& grid, const GridChanges& changes, SurfaceClock::time_point now);
  void follow_smooth(const Grid& grid, const GridChanges& changes, SurfaceClock::time_point now);
  static void add_chunks_around(IVec3 chunk, int distance, std::vector<IVec3>& to);
  void remove_if_there(IVec3 chunk);
  void see_whether_meshed(const Grid& grid, IVec3 chunk, SurfaceClock::time_point now);
  void mark_if_there(IVec3 chunk, SurfaceClock::time_point now);
  void mark_all(SurfaceClock::time_point now);
  void mark(IVec3 chunk, VoxelChunk& state, SurfaceClock::time_point now);
  void wait_again(IVec3 chunk, VoxelChunk& state);
  void remove(IVec3 chunk);
  void keep_densities(const SurfaceJob& job);
  void keep_stamps(const SurfaceJob& job, VoxelChunk& state);
  void make_ready(IVec3 chunk, VoxelChunk& state);
  [[nodiscard]] std::uint64_t note_regions(VoxelChunk& state) const;

  GridHandle handle_;
  const ChunkSurfaceOptions& options_;
  SurfaceTotals& totals_;
  ChangeCursor followed_;
  ChangeCursor followed_light_;
  bool is_lit_ = false;
  Chunks chunks_;
  ChunkSet waiting_;
  IBox box_;                // of all chunks that there were
  DensityCache densities_;  // smooth
};

}  // namespace quoin
