#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

#include "core/work/workers.h"
#include "grid/change_records.h"

namespace quoin {

/// Returns the transparent types of a chunk's samples, in ascending order; empty for null.
[[nodiscard]] std::vector<VoxelType> transparent_of(const DensityChunk* chunk, const VoxelRegistry& types);

/// The densities of single bodies in one chunk (smooth::without_others). The first worker that needs a body computes
/// its densities; they are then kept.
///
/// Threads: any.
class BodyChunks {
 public:
  /// Null if all is far air. `whole` must always be the same chunk or a copy of it. It must outlive the result, because
  /// the result refers to it if there are no other bodies.
  [[nodiscard]] std::shared_ptr<const DensityChunk> of(const DensityChunk* whole, const VoxelRegistry& types,
                                                       std::uint32_t body);

 private:
  std::mutex mutex_;
  std::vector<VoxelType> transparent_;  // the transparent types at the time of `made_`
  std::map<std::uint32_t, std::shared_ptr<const DensityChunk>> made_;
};

/// A grid at one moment, for use on other threads.
using GridSnapshot = std::shared_ptr<const Grid>;

/// The densities of one chunk of voxels in one state, computed by the first thread that needs them.
///
/// Threads: any. The voxels are released once the densities exist.
class VoxelDensity {
 public:
  /// `base` are the densities of an earlier state, or null. `changed` holds the voxels that came or went since, in the
  /// grid; empty where the two differ in types alone. `types` says which of these are transparent.
  VoxelDensity(GridSnapshot voxels, IVec3 chunk, std::shared_ptr<const VoxelDensity> base, const IBox& changed,
               std::shared_ptr<const VoxelRegistry> types);

  /// Returns the unique stamp of this state of this chunk. 0 stands for far air, which has no object.
  [[nodiscard]] std::uint64_t stamp() const { return stamp_; }
  [[nodiscard]] bool is_made() const { return is_made_.load(std::memory_order_acquire); }
  /// Computes them unless another thread does so already. If it throws, nothing has changed.
  void try_to_make();
  /// Returns once they exist, computed by this thread or another.
  void make();

  /// Returns the densities; null if all is far air. Requires: is_made().
  [[nodiscard]] const DensityChunk* densities() const {
    QUOIN_ASSERT(is_made(), "densities that were made");
    return densities_.get();
  }
  /// Returns the densities of single bodies. Requires: is_made().
  [[nodiscard]] BodyChunks& bodies() {
    QUOIN_ASSERT(is_made(), "densities that were made");
    return bodies_;
  }
  /// Returns true if a neighbour at `offset` that reads `reach` samples past its own reads the same densities here as
  /// in the state `stamp`. Returns false if that is unknown. Requires: is_made().
  [[nodiscard]] bool reads_as(std::uint64_t stamp, int reach, IVec3 offset) const;

 private:
  void make_locked();

  const std::uint64_t stamp_;
  const IVec3 chunk_;
  std::mutex mutex_;
  GridSnapshot voxels_;                       // until made, as `base_`
  std::shared_ptr<const VoxelDensity> base_;  // made
  const IBox changed_;
  std::unique_ptr<const DensityChunk> densities_;
  std::uint64_t base_stamp_ = 0;
  bool has_base_ = false;
  ChangeReach changed_densities_;  // from the base
  ChangeReach changed_types_;
  bool may_change_bodies_ = false;              // with `changed_types_`
  std::shared_ptr<const VoxelRegistry> types_;  // until made
  BodyChunks bodies_;
  std::atomic<bool> is_made_{false};
};

/// The densities around a chunk; null is far air.
using VoxelDensities = std::array<std::shared_ptr<VoxelDensity>, 27>;
using DensityStamps = std::array<std::uint64_t, 27>;

/// Follows the voxels of one grid: which densities hold still, and which chunks an edit reaches.
///
/// Threads: one.
class DensityCache {
 public:
  /// `reach`: number of samples that meshing reads past a chunk's own. `releases` destroys densities; may be null.
  explicit DensityCache(int reach, std::shared_ptr<ReleaseQueue> releases = nullptr)
      : reach_(reach), releases_(std::move(releases)) {}

  void clear() { *this = DensityCache(reach_, releases_); }
  /// Takes over the edits since the last call. Appends the chunks that changed, came or went to `changed`, and the
  /// chunks whose surface may have changed to `reached`, both sorted. If everything has changed, call `clear` first.
  void follow(GridSnapshot grid, const GridChanges& edits, std::vector<IVec3>& changed, std::vector<IVec3>& reached);
  /// Returns densities for the grid as of the last `follow`. `types`: must have the same visibility in all calls for
  /// one registry state.
  [[nodiscard]] VoxelDensities around(IVec3 chunk, const std::shared_ptr<const VoxelRegistry>& types);
  /// Keeps the densities that workers computed, unless their chunks have changed since. Returns a bit for each new one.
  std::uint32_t keep(IVec3 chunk, const VoxelDensities& made);

 private:
  struct Slot {
    std::shared_ptr<VoxelDensity> kept;     // made
    std::weak_ptr<VoxelDensity> under_way;  // of the present state; held by jobs
    bool is_solid_stale = true;             // `kept` is of other voxels
    IBox changed;                           // where these came or went since, as far as that is near
    bool is_type_stale = true;
  };

  struct Change {
    IVec3 chunk{0};
    ChunkDifference difference;
  };
  [[nodiscard]] std::vector<Change> changes_of(const Grid& grid, const GridChanges& edits) const;
  void reach_from(const Change& change, std::vector<IVec3>& reached);
  void drop_what_is_gone(const std::vector<IVec3>& changed);
  void invalidate(IVec3 chunk, bool solid, const IBox& changed);
  [[nodiscard]] bool has_voxels_near(IVec3 chunk) const;
  [[nodiscard]] std::shared_ptr<VoxelDensity> density(IVec3 chunk, const std::shared_ptr<const VoxelRegistry>& types);

  int reach_;
  std::shared_ptr<ReleaseQueue> releases_;
  GridSnapshot seen_;  // the grid as it was followed last
  std::unordered_map<IVec3, Slot, CoordinateHash> slots_;
};

}  // namespace quoin
