#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

#include "grid/chunk/chunk_difference.h"

namespace quoin {

/// The types of a chunk's samples that are transparent, in their order; none of null.
[[nodiscard]] std::vector<VoxelType> transparent_of(const DensityChunk* chunk, const VoxelRegistry& types);

/// What single bodies have of one chunk of densities (smooth::without_others), made by the worker that needs one first,
/// and kept.
///
/// Threads: any.
class BodyChunks {
 public:
  /// Null where all is far air. `whole` is always the same chunk, or a copy of it; it must outlive the result, which is
  /// it where there are no other bodies.
  [[nodiscard]] std::shared_ptr<const DensityChunk> of(const DensityChunk* whole, const VoxelRegistry& types,
                                                       std::uint32_t body);

 private:
  std::mutex mutex_;
  std::vector<VoxelType> transparent_;  // those that were when `made_` was
  std::map<std::uint32_t, std::shared_ptr<const DensityChunk>> made_;
};

/// A grid as it was at one moment, for whoever needs it on other threads.
using GridSnapshot = std::shared_ptr<const Grid>;

/// The densities of one chunk of voxels in one state, made by the first who needs them.
///
/// Threads: any; the voxels are let go once the densities are made.
class LiveDensity {
 public:
  /// `base` are the densities of an earlier state, or null. `changed` holds the voxels that came or went since, in the
  /// grid; empty where the two differ in types alone. `types` says which of these are transparent.
  LiveDensity(GridSnapshot voxels, IVec3 chunk, std::shared_ptr<const LiveDensity> base, const IBox& changed,
              std::shared_ptr<const VoxelRegistry> types);

  /// Tells this state of this chunk from every other; 0 stands for far air, of which there is no object.
  [[nodiscard]] std::uint64_t stamp() const { return stamp_; }
  [[nodiscard]] bool is_made() const { return is_made_.load(std::memory_order_acquire); }
  /// Makes them unless another thread is about it. When that throws, nothing has happened.
  void try_to_make();
  /// Returns once they are made, by this thread or another.
  void make();

  /// Null where all is far air. Requires: is_made().
  [[nodiscard]] const DensityChunk* densities() const { return densities_.get(); }
  /// Those of single bodies. Requires: is_made(), before they are asked for.
  [[nodiscard]] BodyChunks& bodies() { return bodies_; }
  /// Whether these are, for the chunk at an offset from this one that looks `reach` samples beyond its own, those of
  /// `stamp`; false when that is not known. Requires: is_made().
  [[nodiscard]] bool reads_as(std::uint64_t stamp, int reach, IVec3 offset) const;

 private:
  void make_locked();

  const std::uint64_t stamp_;
  const IVec3 chunk_;
  std::mutex mutex_;
  GridSnapshot voxels_;                      // until made, as `base_`
  std::shared_ptr<const LiveDensity> base_;  // made
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
using LiveDensities = std::array<std::shared_ptr<LiveDensity>, 27>;
using DensityStamps = std::array<std::uint64_t, 27>;

/// Follows the voxels of one grid: which densities hold still, and which chunks an edit reaches.
///
/// Threads: one.
class DensityCache {
 public:
  /// `reach` is what meshing reads beyond a chunk's own samples.
  explicit DensityCache(int reach) : reach_(reach) {}

  void clear() { *this = DensityCache(reach_); }
  /// Takes over what was edited since the last time, as `edits` say: the chunks that changed, came or went (`changed`),
  /// and those in which the surface may have changed (`reached`), both sorted. When all has changed, what was there
  /// before is to be cleared first.
  void follow(GridSnapshot grid, const GridChanges& edits, std::vector<IVec3>& changed, std::vector<IVec3>& reached);
  /// Of the grid as `follow` saw it last. `types`: whose visibility all densities of one registry's state have.
  [[nodiscard]] LiveDensities around(IVec3 chunk, const std::shared_ptr<const VoxelRegistry>& types);
  /// Keeps what workers made, as far as it holds still. Returns a bit for each that is new.
  std::uint32_t keep(IVec3 chunk, const LiveDensities& made);

 private:
  struct Slot {
    std::shared_ptr<LiveDensity> kept;     // made
    std::weak_ptr<LiveDensity> under_way;  // of the present state; held by jobs
    bool is_solid_stale = true;            // `kept` is of other voxels
    IBox changed;                          // where these came or went since, as far as that is near
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
  [[nodiscard]] std::shared_ptr<LiveDensity> density(IVec3 chunk, const std::shared_ptr<const VoxelRegistry>& types);

  int reach_;
  GridSnapshot seen_;  // the grid as it was followed last
  std::unordered_map<IVec3, Slot, CoordinateHash> slots_;
};

}  // namespace quoin
