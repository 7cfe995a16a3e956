#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/changes.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/progress.h>
#include <quoin/core/vec.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/voxel_registry.h>

namespace [[gnu::visibility("default")]] quoin {

/// The density and material of a sample.
struct DensitySample {
  float density = 0.0F;  ///< negative is solid
  VoxelType material = kAir;
};

/// Options of DensityGrid::flatten.
struct FlattenOptions {
  DVec3 point{0.0};             ///< a point on the plane, in samples
  DVec3 normal{0.0, 1.0, 0.0};  ///< points into the air; any length except 0
  double strength = 1.0;        ///< fraction of the way to the plane at the centre; falls off as in `smooth`
  VoxelType material = 1;       ///< for samples that become solid
};

/// A sparse, unbounded density field in chunks of 64^3 samples. Negative is solid; 0 and above is air. A sample that
/// was never set is far air: its density is `band`.
///
/// Space:     sample (i, j, k) lies at the point (i, j, k). Between samples the field is trilinear. All int32
///            coordinates are valid, except that the outermost chunk on each side stays air.
/// Precision: half floats within `band` of 0, clamped beyond, so rock and sky far from the surface cost nothing.
///            Ambient occlusion needs densities that are distances in samples. Rounding never changes the sign of a
///            density. NaN counts as far air, infinities as +-band.
/// Materials: the material of an air sample does not affect any mesh. Far air has no material: it reads as kAir.
/// Edits:     a chunk that is all far air is removed. If an edit throws (bad_alloc or an exception from a callback), or
///            `progress` cancels it, the changes made so far stay and are recorded. `changes_since` reports changes to
///            any number of consumers.
/// Partial:   as in Grid. `smooth` does not change chunks next to an unloaded chunk.
/// Sharing:   as in Grid.
/// Threads:   as in Grid.
/// Moving:    a moved-from field can only be assigned to or destroyed.
class DensityGrid {
 public:
  /// Creates an empty field. Requires: 0 < band <= 65,504. A band that is not a half is rounded down to a half.
  explicit DensityGrid(float band = 8.0F);
  DensityGrid(DensityGrid&&) noexcept;
  DensityGrid& operator=(DensityGrid&&) noexcept;
  ~DensityGrid();
  /// Returns a copy-on-write copy, as Grid::snapshot.
  [[nodiscard]] DensityGrid snapshot() const;

  /// Returns the clamping limit of densities, in samples.
  [[nodiscard]] float band() const;
  /// Returns the stored density or material of a sample: `band` and kAir if never set.
  [[nodiscard]] float density(IVec3 sample) const;
  [[nodiscard]] VoxelType material(IVec3 sample) const;
  template <std::floating_point T>
  float density(Point<T> point) const = delete;  // density_at(point)
  template <std::floating_point T>
  VoxelType material(Point<T> point) const = delete;
  /// Returns the trilinear field at any point, across chunk borders. The result is exact at samples. Returns far air
  /// outside the int32 range and for NaN.
  [[nodiscard]] float density_at(DVec3 point) const;
  /// Returns the gradient of the trilinear field. On a face between two cells, the cell on the greater side counts.
  /// Returns 0 outside the int32 range and for NaN.
  [[nodiscard]] DVec3 gradient_at(DVec3 point) const;

  /// Sets a sample. Returns true if its density or material changed.
  bool set(IVec3 sample, DensitySample value);
  template <std::floating_point T>
  bool set(Point<T> point, DensitySample value) = delete;
  /// Returns the stored density and material of a sample.
  [[nodiscard]] DensitySample get(IVec3 sample) const { return {density(sample), material(sample)}; }
  template <std::floating_point T>
  DensitySample get(Point<T> point) const = delete;

  /// Adds a sphere or a box to the solid, or removes it. Adding takes the minimum of density and shape distance;
  /// removing takes the maximum of density and negated shape distance. Samples that become solid take `material`. All
  /// other samples keep theirs, including samples that become air. `rounding` >= 0 is the radius of a box's edges,
  /// limited to half of its shortest side.
  ///
  /// Blend:   `blend` >= 0 is the width k, in samples, of the smooth transition between the two surfaces (0: a sharp
  ///          crease): min(a, b) - max(k - |a - b|, 0)^2 / (4 k). Because densities end at the band, k is limited to
  ///          band - max(a, b).
  /// Returns: the number of changed samples.
  /// Errors:  a negative, infinite or NaN size or position, or a box with `max` less than `min`, changes nothing.
  /// Cost:    adding: O(chunks of the shape's box), plus O(samples) in chunks near its surface and in existing chunks.
  ///          Each chunk inside becomes a uniform chunk of about 200 bytes, and a sphere of radius 10^6 has 10^13 of
  ///          them. If users choose the size, cancel oversized edits with `progress`. Removing: only existing chunks.
  std::int64_t add_sphere(DVec3 centre, double radius, VoxelType material, double blend = 0.0,
                          const Progress& progress = {});
  std::int64_t remove_sphere(DVec3 centre, double radius, double blend = 0.0);
  std::int64_t add_box(DVec3 min, DVec3 max, VoxelType material, double rounding = 0.0, double blend = 0.0,
                       const Progress& progress = {});
  std::int64_t remove_box(DVec3 min, DVec3 max, double rounding = 0.0, double blend = 0.0);
  /// Smooths the surface inside a sphere: moves each density towards the mean of its 26 neighbours, as they were
  /// before. Each density moves strength * (1 - (distance / radius)^2)^2 of the way. A strength above 1 counts as 1. A
  /// sample that becomes solid takes the most frequent material of its solid neighbours.
  /// Returns: the number of changed samples.
  /// Errors:  an infinite or NaN centre or radius, a NaN strength, or a radius or strength of 0 or less, changes
  ///          nothing.
  /// Cost:    O(samples of the sphere's box in existing chunks and their neighbours), and 4 bytes of temporary memory
  ///          each.
  std::int64_t smooth(DVec3 centre, double radius, double strength);
  /// Moves the surface inside a sphere towards a plane. Returns the number of changed samples. An invalid strength,
  /// centre, radius, point or normal changes nothing (see FlattenOptions and `smooth`).
  /// Cost: same as adding a sphere.
  std::int64_t flatten(DVec3 centre, double radius, const FlattenOptions& options, const Progress& progress = {});
  /// Calls `pick(IVec3 sample, DensitySample current)` for every sample of the box and stores the returned value. The
  /// box is half-open (`max` excluded). The order is x fastest, then y, then z within a chunk; chunks in the same
  /// order. Returns the number of changed samples.
  /// Requires: `pick` does not access the grid. Cost: O(samples of the box), including far air.
  template <class Pick>
  std::int64_t edit(const IBox& box, Pick&& pick, const Progress& progress = {}) {
    return edit_rows(
        box,
        [&pick](IVec3 first, std::span<float> densities, std::span<VoxelType> materials) {
          for (std::size_t i = 0; i < densities.size(); ++i, ++first.x) {
            const DensitySample picked = pick(first, DensitySample{densities[i], materials[i]});
            densities[i] = picked.density;
            materials[i] = picked.material;
          }
        },
        progress);
  }
  /// Edits a box row by row. `change(first, densities, materials)` receives the samples of the box along x in one
  /// chunk, starting at `first`, and changes them in place. Returns the number of changed samples.
  std::int64_t edit_rows(
      const IBox& box,
      FunctionRef<void(IVec3 first, std::span<float> densities, std::span<VoxelType> materials)> change,
      const Progress& progress = {});
  /// Replaces a whole chunk, as an edit of each sample that differs. Returns the number of changed samples. Outermost
  /// chunks are ignored. Requires: all densities are `stored_density` results for this band.
  std::int64_t put_chunk(IVec3 chunk, DensityChunk samples);
  /// Sets all samples to far air, as an edit.
  void clear();

  /// Makes the grid partial. All functions for partial grids work as in Grid.
  void make_partial();
  [[nodiscard]] bool is_partial() const;
  void set_extent(const IBox& chunks, std::span<const IVec3> others = {});
  [[nodiscard]] IBox extent() const;
  /// Loads a chunk, as Grid::load_chunk. Requires: same as `put_chunk`.
  bool load_chunk(IVec3 chunk, DensityChunk samples);
  /// Loads a chunk that is known to be far air, as `load_chunk`.
  bool load_air_chunk(IVec3 chunk);
  bool unload_chunk(IVec3 chunk);
  [[nodiscard]] bool is_loaded(IVec3 chunk) const;
  [[nodiscard]] bool is_loaded_around(IVec3 chunk, int distance = 1) const;
  /// Returns true if all chunks that a box of samples overlaps are loaded, as Grid::is_loaded_within. A point between
  /// samples is known if all eight samples around it are loaded.
  [[nodiscard]] bool is_loaded_within(const IBox& samples) const;
  [[nodiscard]] std::vector<IVec3> loaded_chunks() const;

  /// Returns the chunk, or null if all its samples are far air. Lifetime: same as Grid::find_chunk.
  [[nodiscard]] const DensityChunk* find_chunk(IVec3 chunk) const;
  /// Returns the coordinates of all chunks that are not far air, sorted by z, then y, then x.
  [[nodiscard]] std::vector<IVec3> chunks() const;
  [[nodiscard]] std::size_t chunk_count() const;
  /// Returns the chunk and its 26 neighbours, for meshers. Lifetime: the grid must outlive it, and an edit invalidates
  /// it.
  [[nodiscard]] DensityNeighbourhood neighbourhood(IVec3 chunk) const;
  /// Returns the smallest box around all solid samples; empty if there are none.
  /// Cost: O(chunks * 4096) the first time, then O(4096) per changed chunk.
  [[nodiscard]] IBox solid_bounds() const;
  /// Returns the smallest box with integer corners around all points with a negative trilinear field. The box is empty
  /// if there are none. Cost: same as `solid_bounds`.
  [[nodiscard]] IBox bounds() const;
  /// Returns the number of solid samples. Cost: O(chunks * 4096) per call.
  [[nodiscard]] std::int64_t solid_count() const;

  /// Returns the exact changes since the cursor's last read, and moves the cursor to the present.
  /// Cost: O(changed chunks), independent of the grid's size. See ChangeCursor.
  [[nodiscard]] DensityChanges changes_since(ChangeCursor& cursor) const;
  /// As above. Replaces `changes`, and keeps its memory.
  void changes_since(ChangeCursor& cursor, DensityChanges& changes) const;
  /// Returns true if anything has changed since the cursor, as Grid::has_changed_since.
  [[nodiscard]] bool has_changed_since(const ChangeCursor& cursor) const;
  [[nodiscard]] ChangeCursor cursor() const;

  /// Returns the memory in use, in bytes.
  [[nodiscard]] std::size_t bytes() const;
  /// Frees memory that edits left unused.
  void compact();

  // For Grid::load_chunk and Grid::unload_chunk of both.
  [[gnu::visibility("hidden")]] LoadedChunks& loaded();
  /// Replaces the content of a chunk that was loaded or unloaded: by far air without `samples`.
  [[gnu::visibility("hidden")]] void replace_loaded(IVec3 chunk, std::optional<DensityChunk> samples);

 private:
  friend class Scene;
  struct [[gnu::visibility("hidden")]] Impl;
  explicit DensityGrid(std::unique_ptr<Impl> impl);
  [[nodiscard]] DensityGrid snapshot(BulkMemory& memory) const;
  [[nodiscard]] inline Impl& impl() const;

  std::unique_ptr<Impl> impl_;
  mutable ChangeNotifier notifier_;  // mutable: a scene that follows the grid is not part of its value
};

}  // namespace quoin
