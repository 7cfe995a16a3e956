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
  std::uint64_t state = 0;        ///< of the scene: `surface` waits until it is complete
  SurfaceClock::time_point seen;  ///< time of the last edit
  bool is_waiting = false;        ///< for a job, on its own
  bool is_edited = false;         ///< waits for the next epoch
  bool is_in_epoch = false;       ///< in the epoch in progress
  bool is_working = false;        ///< the newest job is not collected
  bool is_ready = false;          ///< `surface` is ready to be taken
  bool is_together = false;       ///< `surface` is to be taken with all others of its epoch
  bool is_listed = false;         ///< in SurfaceTotals::ready
  bool is_shown = false;          ///< the last surface taken is not null
  bool is_gone = false;           ///< the grid no longer has it
  std::shared_ptr<const ChunkSurface> surface;
  std::vector<std::uint64_t> region_hashes;    ///< of the surface taken last, if it has several regions; 0: no quads
  std::unique_ptr<DensityStamps> last_stamps;  ///< smooth: densities of the surface collected last
  std::uint64_t type_generation = 0;           ///< types of the surface collected last
  std::uint64_t data_generation = 0;           ///< number of changes of data that it was marked for
  std::uint64_t collected_data = 0;            ///< as `data_generation`, of the surface collected last

  [[nodiscard]] bool is_unfinished() const { return is_waiting || is_edited || is_in_epoch || is_working; }
  [[nodiscard]] bool is_pending() const { return is_unfinished() || is_ready; }
};

/// The voxels of one grid.
///
/// A chunk is meshed on its own if it was loaded, and in the next epoch if it was edited:
///
///   loaded    is_waiting -> is_working -> is_ready
///   edited    is_edited -> is_in_epoch -> is_ready, with the rest of the epoch
class VoxelSurfaces final : public SurfaceSource {
 public:
  VoxelSurfaces(GridHandle handle, const ChunkSurfaceOptions& options, SurfaceTotals& totals);

  void follow(const SceneGrid& content, const VoxelRegistry& types, SurfaceClock::time_point now) override;
  void follow_light(const GridLight& light, const VoxelRegistry& types, SurfaceClock::time_point now) override;
  void follow_data(const SceneGrid& content, const VoxelRegistry& types, SurfaceClock::time_point now) override;
  void leave() override;
  void forget() override;
  void discard() override;
  void mark_types(const SceneGrid& content, const ChangedTypes& changed, SurfaceClock::time_point now) override;

  void prepare(const SceneGrid&, const VoxelRegistry&) override {}
  [[nodiscard]] const ChunkSet& waiting() const override { return waiting_; }
  [[nodiscard]] const IBox& box() const override { return box_; }
  [[nodiscard]] bool has_chunks() const override { return !chunks_.empty(); }
  [[nodiscard]] std::unique_ptr<SurfaceJob> make_job(SurfaceInputs& inputs, IVec3 chunk) override;
  /// Makes a job for the grid as of the last `follow`.
  [[nodiscard]] std::unique_ptr<SurfaceJob> make_job(const GridSnapshot& grid, IVec3 chunk, const SurfaceTypes& types,
                                                     const LightSnapshot& light = nullptr);
  void hand_over(IVec3 chunk, std::uint64_t serial) override;
  [[nodiscard]] bool is_current(const SurfaceJob& job) const override;
  void withdrawn(const SurfaceJob& job) override;
  void collect(SurfaceJob& job) override;
  [[nodiscard]] Turn turn_of(IVec3 chunk) const override;
  void take(IVec3 chunk, std::vector<SurfaceUpdate>& out) override;
  [[nodiscard]] std::size_t count_edited(bool& has_edits) const override;
  void begin_epoch(SurfaceInputs* inputs, std::vector<std::unique_ptr<SurfaceJob>>& jobs) override;
  void give_epoch() override;
  void release_edits() override;

 private:
  using Change = CountedChange<VoxelChunk>;
  using Chunks = std::unordered_map<IVec3, VoxelChunk, CoordinateHash>;
  enum class Cause : std::uint8_t { Load, Edit };
  static constexpr std::size_t kMaxRegions = 64;

  /// A chunk of the epoch in progress.
  struct Member {
    std::uint64_t serial = 0;  // of its job; 0: the chunk is gone
    bool is_done = false;
    bool is_as_before = false;
    std::shared_ptr<const ChunkSurface> surface;
  };

  void begin_anew(Cause cause);
  void follow_blocky(const Grid& grid, const VoxelRegistry& types, const GridChanges& changes, Cause cause,
                     SurfaceClock::time_point now);
  void follow_smooth(const Grid& grid, const GridChanges& changes, Cause cause, SurfaceClock::time_point now);
  void mark_data(const Grid& grid, const DataChanges& changes, const VoxelRegistry& types,
                 SurfaceClock::time_point now);
  static void add_chunks_around(IVec3 chunk, int distance, std::vector<IVec3>& to);
  void remove_if_there(IVec3 chunk, Cause cause);
  void see_whether_meshed(IVec3 chunk, bool is_meshed, Cause cause, SurfaceClock::time_point now);
  void mark_if_there(IVec3 chunk, Cause cause, SurfaceClock::time_point now);
  void mark_for_look(IVec3 chunk, SurfaceClock::time_point now);
  void mark_all(SurfaceClock::time_point now);
  void mark(IVec3 chunk, VoxelChunk& state, Cause cause, SurfaceClock::time_point now);
  void note_edit(IVec3 chunk, VoxelChunk& state);
  void remove(IVec3 chunk, Cause cause);
  void leave_epoch(IVec3 chunk, VoxelChunk& state);
  void erase_if_over(IVec3 chunk);
  void keep_densities(const SurfaceJob& job);
  void keep_stamps(const SurfaceJob& job, VoxelChunk& state);
  void collect_member(SurfaceJob& job, VoxelChunk& state, Member& member);
  void show(IVec3 chunk, VoxelChunk& state, std::shared_ptr<const ChunkSurface> surface, bool is_together);
  [[nodiscard]] std::uint64_t note_regions(VoxelChunk& state) const;
  /// Returns the number of regions of a chunk, at most kMaxRegions.
  [[nodiscard]] std::size_t region_count() const {
    const auto across = static_cast<std::size_t>(kChunkEdge / options_.region_edge);
    return across * across * across;
  }
  // Returns true if surfaces may have shapes: they then depend on voxels farther away.
  [[nodiscard]] bool has_shapes(const VoxelRegistry& types) const {
    return types.has_shapes() && options_.style == SurfaceStyle::Blocky && options_.shapes == ShapeUse::Faces;
  }
  [[nodiscard]] bool has_regions() const { return options_.style == SurfaceStyle::Blocky && region_count() > 1; }

  GridHandle handle_;
  const ChunkSurfaceOptions& options_;
  SurfaceTotals& totals_;
  ChangeCursor followed_;
  ChangeCursor followed_light_;
  bool is_lit_ = false;
  ChangeCursor followed_data_;
  GridSnapshot followed_voxels_;  // as of `followed_data_`; null if no type's data changes meshes
  Chunks chunks_;
  ChunkSet waiting_;
  ChunkSet edited_;
  std::unordered_map<IVec3, Member, CoordinateHash> epoch_;
  IBox box_;                // of all chunks that there were
  DensityCache densities_;  // smooth
};

}  // namespace quoin
