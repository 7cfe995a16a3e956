#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_set>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/parallel.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/render/chunk_surface.h>
#include <quoin/render/propagated_light.h>
#include <quoin/scene/scene.h>

#include "core/work/workers.h"
#include "render/chunks/surface_job.h"

namespace quoin {

/// Distances from the nearest eye to chunks of a grid, over all its instances.
class ChunkDistances {
 public:
  /// `chunks` should contain all chunks that will be asked for; pass an empty box if unknown. Lifetime: `eyes` must
  /// outlive it.
  ChunkDistances(const IBox& chunks, std::span<const DVec3> eyes) : chunks_(chunks), eyes_(eyes) {}
  /// Becomes as a new object, but keeps its memory.
  void restart(const IBox& chunks, std::span<const DVec3> eyes) {
    chunks_ = chunks;
    eyes_ = eyes;
    places_.clear();
  }

  /// Requires: the instance has a place.
  void add(const Instance& instance, const SceneGrid& grid);
  /// Call it once all instances are added.
  void sort();
  /// Returns the distance in the world. 0 if numbers are not finite or no instance was added.
  [[nodiscard]] double to(IVec3 chunk) const;
  /// As `to`, in voxels or samples; the minimum over the instances, each in its own voxels.
  [[nodiscard]] double in_voxels(IVec3 chunk) const;

 private:
  struct Place {
    DVec3 eye_in_grid{0.0};
    double voxel_size = 1.0;
    double least = 0.0;  // distance of any chunk
  };
  IBox chunks_;
  std::span<const DVec3> eyes_;
  std::vector<Place> places_;
};

/// A chunk whose newest surface is to be taken.
struct ReadyChunk {
  SurfaceKey source;
  IVec3 chunk{0};
};

/// Maximum number of chunks of voxels, or of a field, that are edited together: see SurfaceTotals.
inline constexpr std::size_t kMaxEpochChunks = 256;

/// Totals over all sources.
///
/// The surfaces of all chunks that edits change between two states of the scene form an epoch. They are made from the
/// later state and can be taken when the last one is complete:
///
///   state       1       2       3       4                 numbers of the updates
///   edits       a       b a             c
///   epoch       [ a .......... ][ a b .......... ][ c ...  one at a time; edits in the meantime wait for the next
///   complete    0               1                 3
///
/// Loaded chunks belong to no epoch. Each can be taken on its own, once the state in which it was loaded is complete.
struct SurfaceTotals {
  std::uint64_t serial = 0;  ///< of the job that was made last
  std::size_t unfinished = 0;
  std::size_t pending = 0;
  std::vector<ReadyChunk> ready;  ///< and perhaps some that are no more
  std::uint64_t state = 0;        ///< number of the scene's state that the sources follow
  std::uint64_t complete = 0;     ///< the surfaces of all edits up to this state can be taken
  std::size_t in_epoch = 0;       ///< unfinished parts of the epoch in progress
  bool loads_only = false;        ///< changes count as loaded chunks, not as edits
  /// Destroys densities that no job needs any more. Null: they are destroyed by the calls that drop them.
  std::shared_ptr<ReleaseQueue> releases;
};

/// Keeps the totals right while a chunk's state changes, which has `is_unfinished` and `is_pending`.
template <class State>
class CountedChange {
 public:
  CountedChange(SurfaceTotals& totals, const State& state) : totals_(totals), state_(state) {
    QUOIN_ASSERT(totals.unfinished >= (state.is_unfinished() ? 1U : 0U), "every state is counted");
    QUOIN_ASSERT(totals.pending >= (state.is_pending() ? 1U : 0U), "every state is counted");
    totals_.unfinished -= state.is_unfinished() ? 1 : 0;
    totals_.pending -= state.is_pending() ? 1 : 0;
  }
  CountedChange(const CountedChange&) = delete;
  CountedChange& operator=(const CountedChange&) = delete;
  ~CountedChange() {
    totals_.unfinished += state_.is_unfinished() ? 1 : 0;
    totals_.pending += state_.is_pending() ? 1 : 0;
    QUOIN_ASSERT(totals_.pending >= totals_.unfinished, "unfinished chunks are pending");
  }

 private:
  SurfaceTotals& totals_;
  const State& state_;
};

/// The type data that surfaces are made with.
struct SurfaceTypes {
  std::shared_ptr<const VoxelRegistry> registry;
  std::shared_ptr<const SurfaceMaterials> materials;
  std::uint64_t generation = 0;
};

/// Types with a changed look, by type; empty if there are none.
struct ChangedTypes {
  std::vector<bool> visibility;
  std::vector<bool> colour;
  std::vector<bool> data;  ///< VoxelProperties::remesh_on_data became true, so that earlier data counts

  [[nodiscard]] bool empty() const { return visibility.empty() && colour.empty() && data.empty(); }
};

/// The inputs of one update's jobs. A snapshot is taken when the first job needs it. Workers destroy the snapshots, if
/// `releases` is not null: an old one holds all memory that the scene has dropped since.
class SurfaceInputs {
 public:
  SurfaceInputs(const SceneGrid& content, const SurfaceTypes& with, const GridLight& light = {},
                std::shared_ptr<ReleaseQueue> releases = nullptr)
      : types(&with), content_(&content), light_(light), releases_(std::move(releases)) {}

  [[nodiscard]] const GridSnapshot& voxels() {
    if (voxels_ == nullptr) voxels_ = deferred(releases_, std::make_shared<const Grid>(content_->grid.snapshot()));
    return voxels_;
  }
  [[nodiscard]] const FieldSnapshot& field() {
    if (field_ == nullptr) {
      field_ = deferred(releases_, std::make_shared<const DensityGrid>(content_->field.snapshot()));
    }
    return field_;
  }
  /// Returns the light; null if no light is used.
  [[nodiscard]] const LightSnapshot& light() {
    if (lit_ == nullptr && light_.light != nullptr) {
      QUOIN_ASSERT(light_.voxels != nullptr, "light with its voxels");
      lit_ = deferred(
          releases_, std::make_shared<const LitVoxels>(LitVoxels{light_.light->snapshot(), light_.voxels->snapshot()}));
    }
    return lit_;
  }

  const SurfaceTypes* types;

 private:
  const SceneGrid* content_;
  GridLight light_;
  std::shared_ptr<ReleaseQueue> releases_;
  GridSnapshot voxels_;
  LightSnapshot lit_;
  FieldSnapshot field_;
};

using ChunkSet = std::unordered_set<IVec3, CoordinateHash>;

/// Follows the voxels or the field of one grid of a scene: tracks which chunks need meshing and their results.
class SurfaceSource {
 public:
  SurfaceSource() = default;
  SurfaceSource(const SurfaceSource&) = delete;
  SurfaceSource& operator=(const SurfaceSource&) = delete;
  virtual ~SurfaceSource() = default;

  /// Takes over the edits. Cost: proportional to the edits.
  virtual void follow(const SceneGrid& content, const VoxelRegistry& types, SurfaceClock::time_point now) = 0;
  /// Takes over the changes of its light. The pointers of `light` are null if no light is used.
  virtual void follow_light(const GridLight& light, const VoxelRegistry& types, SurfaceClock::time_point now) {
    (void)light;
    (void)types;
    (void)now;
  }
  /// Takes over the changes of voxel data: marks the chunks that contain or touch a changed voxel of a type with
  /// VoxelProperties::remesh_on_data, or have one with shapes within kShapeReach. Call after `follow`.
  virtual void follow_data(const SceneGrid& content, const VoxelRegistry& types, SurfaceClock::time_point now) {
    (void)content;
    (void)types;
    (void)now;
  }
  /// Called when the grid left the scene: the next epoch removes all of its surfaces.
  virtual void leave() = 0;
  /// Makes the next `follow` start from scratch. Ends its part of the epoch in progress, without surfaces. Does not
  /// throw.
  virtual void forget() = 0;
  /// Drops the surfaces that were not taken; the next ones count as different in all regions. Call `forget` next. Does
  /// not throw.
  virtual void discard() = 0;
  /// Marks the chunks that show one of the types for meshing.
  virtual void mark_types(const SceneGrid& content, const ChangedTypes& changed, SurfaceClock::time_point now) = 0;
  /// Returns true if it needs to choose levels of detail even though no eye moved.
  [[nodiscard]] virtual bool wants_levels() const { return false; }
  /// Takes over the distances of chunks; call after `follow`.
  virtual void choose_levels(const ChunkDistances& distances, SurfaceClock::time_point now) {
    (void)distances;
    (void)now;
  }
  /// Finds the chunks that are ready for workers. Requires: `content` is as in the last `follow`.
  virtual void prepare(const SceneGrid& content, const VoxelRegistry& types) = 0;
  /// Returns the waiting chunks.
  [[nodiscard]] virtual const ChunkSet& waiting() const = 0;
  /// Returns a box that contains all chunks that wait or are being meshed.
  [[nodiscard]] virtual const IBox& box() const = 0;
  [[nodiscard]] virtual bool has_chunks() const = 0;
  /// Creates the job of a waiting chunk. Requires: the chunk waits; `inputs` match the last `follow`.
  [[nodiscard]] virtual std::unique_ptr<SurfaceJob> make_job(SurfaceInputs& inputs, IVec3 chunk) = 0;
  /// Called when a worker has received the job of a waiting chunk.
  virtual void hand_over(IVec3 chunk, std::uint64_t serial) = 0;
  /// Returns true if the job's result is still needed.
  [[nodiscard]] virtual bool is_current(const SurfaceJob& job) const = 0;
  /// Called when the job was withdrawn. The chunk waits again unless it is already waiting.
  virtual void withdrawn(const SurfaceJob& job) = 0;
  /// Called when the job is done.
  virtual void collect(SurfaceJob& job) = 0;

  enum class Turn : std::uint8_t {
    Now,     ///< together with all others of an epoch
    IfRoom,  ///< on its own
    Later,   ///< its state is not complete
  };
  /// Returns when the surface of a listed chunk can be taken.
  [[nodiscard]] virtual Turn turn_of(IVec3 chunk) const = 0;
  /// Appends the surface if one is ready. Does not throw if `out` has memory for it.
  virtual void take(IVec3 chunk, std::vector<SurfaceUpdate>& out) = 0;

  /// Returns the number of chunks that must be meshed for the next epoch. Sets `has_edits` if the epoch has any chunk.
  [[nodiscard]] virtual std::size_t count_edited(bool& has_edits) const = 0;
  /// Returns false if the next epoch must wait for surfaces in progress, which then become urgent.
  [[nodiscard]] virtual bool may_begin_epoch() { return true; }
  /// Returns true if an epoch waits for the surface of a chunk.
  [[nodiscard]] virtual bool is_urgent(IVec3 chunk) const {
    (void)chunk;
    return false;
  }
  /// Begins the next epoch: appends the jobs of all edited chunks, which are then handed over. `inputs`: null if the
  /// grid is not in the scene. Requires: no epoch is in progress; `inputs` match the last `follow`; `prepare` was
  /// called since.
  virtual void begin_epoch(SurfaceInputs* inputs, std::vector<std::unique_ptr<SurfaceJob>>& jobs) = 0;
  /// Makes the surfaces of the epoch ready to be taken. Requires: `totals.in_epoch` is 0.
  virtual void give_epoch() = 0;
  /// Treats the edited chunks as loaded ones.
  virtual void release_edits() = 0;
};

/// Returns the source of the voxels or the field of a grid. Lifetime: `options` and `totals` must outlive it.
[[nodiscard]] std::unique_ptr<SurfaceSource> make_surface_source(SurfaceKey key, const ChunkSurfaceOptions& options,
                                                                 SurfaceTotals& totals);

/// The surfaces of the chunks of one grid's voxels or field, made on request instead of by workers. Equal to those of
/// LiveMeshes with a `region_edge` of 64 and ShapeUse::Cubes; after an edit, only the affected ones are made.
class GridSurfaces {
 public:
  GridSurfaces(GridHandle handle, SurfaceContent content, SurfaceStyle style);
  GridSurfaces(const GridSurfaces&) = delete;
  GridSurfaces& operator=(const GridSurfaces&) = delete;

  [[nodiscard]] SurfaceStyle style() const { return options_.style; }
  /// Makes the next `update` start from scratch, because the look of types may have changed.
  void forget() { source_->forget(); }
  /// Returns the changes since the last call, as LiveMeshes::take does. Requires: always the same grid or its
  /// snapshots. Errors: bad_alloc; do not call it again after that.
  [[nodiscard]] std::vector<SurfaceUpdate> update(const SceneGrid& grid, const VoxelRegistry& types, Threads threads);

 private:
  const ChunkSurfaceOptions options_;
  SurfaceTotals totals_;
  std::unique_ptr<SurfaceSource> source_;
};

}  // namespace quoin
