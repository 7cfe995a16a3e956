#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <quoin/core/changes.h>
#include <quoin/core/function_ref.h>
#include <quoin/core/progress.h>
#include <quoin/core/vec.h>
#include <quoin/grid/changes.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// One sample as an edit sees it.
struct DensitySample {
  float density = 0.0F;  ///< negative is solid
  VoxelType material = kAir;
};

/// What DensityGrid::flatten moves a surface towards.
struct FlattenOptions {
  DVec3 point{0.0};             ///< of the plane, in samples
  DVec3 normal{0.0, 1.0, 0.0};  ///< into the air; any length but 0
  double strength = 1.0;        ///< as in `smooth`: how far of the way
  VoxelType material = 1;       ///< of samples that become solid
};

/// A sparse, unbounded field of densities in chunks of 64^3 samples: negative is solid, 0 and above is air. What was
/// never set is air, `band` from the surface.
///
/// Space:     sample (i, j, k) lies at the point (i, j, k); between samples the field is trilinear. Any int32
///            coordinates, except the outermost chunk on each side, which stays air.
/// Precision: half floats within `band` of 0, clamped beyond, so that rock and sky far from the surface cost nothing.
///            Values are distances in samples wherever occlusion is to mean what it says. The sign that is given is
///            kept, however small the value; NaN counts as far air, infinities as +-band.
/// Materials: that of an air sample has no effect on any mesh. Far air has none: it reads as kAir.
/// Edits:     a chunk that is all far air is dropped. When an edit throws (bad_alloc, or what a callback threw), what
///            it did until then, or until its `progress` cancelled it, stays done and booked. `changes_since` tells
///            any number of consumers what edits changed.
/// Partial:   as Grid; `smooth` leaves chunks as they are beside which one is not loaded.
/// Sharing:   and threads as Grid.
/// Moving:    a field that was moved from may only be assigned to or destroyed.
class DensityGrid {
 public:
  /// Requires: 0 < band <= 65,504. A band that is no half counts as the next lesser one.
  explicit DensityGrid(float band = 8.0F);
  DensityGrid(DensityGrid&&) noexcept;
  DensityGrid& operator=(DensityGrid&&) noexcept;
  ~DensityGrid();
  /// As Grid::snapshot.
  [[nodiscard]] DensityGrid snapshot() const;

  /// The distance beyond which densities are clamped, in samples.
  [[nodiscard]] float band() const;
  /// What is stored at a sample: `band` and kAir where nothing was set.
  [[nodiscard]] float density(IVec3 sample) const;
  [[nodiscard]] VoxelType material(IVec3 sample) const;
  template <std::floating_point T>
  float density(Point<T> point) const = delete;  // density_at(point)
  template <std::floating_point T>
  VoxelType material(Point<T> point) const = delete;
  /// The trilinear field at any point, across chunk borders. Exact at samples; outside the int32 range, and at NaN, far
  /// air.
  [[nodiscard]] float density_at(DVec3 point) const;
  /// The gradient of the trilinear field, a one-sided one on the faces between cells: that of the cell above.
  /// 0 outside the int32 range, and at NaN.
  [[nodiscard]] DVec3 gradient_at(DVec3 point) const;

  /// Returns true when density or material was another before.
  bool set(IVec3 sample, DensitySample value);
  template <std::floating_point T>
  bool set(Point<T> point, DensitySample value) = delete;
  /// Both of a sample: what `set` puts there.
  [[nodiscard]] DensitySample get(IVec3 sample) const { return {density(sample), material(sample)}; }
  template <std::floating_point T>
  DensitySample get(Point<T> point) const = delete;

  /// Unites the solid with a sphere, a box (`rounding` >= 0 rounds its edges, at most until its shortest side is
  /// round): the least of both distances; or takes it away: the greater of the density and minus the distance. Samples
  /// that become solid take `material`; others, those that become air too, keep theirs.
  ///
  /// Blend:   `blend` >= 0 is the width k, in samples, over which the two surfaces flow together (0: a sharp crease):
  ///          min(a, b) - max(k - |a - b|, 0)^2 / (4 k). Since densities end at the band, k is at most
  ///          band - max(a, b).
  /// Returns: how many samples changed.
  /// Errors:  a negative, infinite or NaN size or place, or a box whose `max` is less than its `min`, changes nothing.
  /// Cost:    adding: O(chunks of the shape's box), and O(samples) in those that its surface comes near or that exist;
  ///          each chunk inside becomes a uniform one of about 200 bytes, and a sphere of radius 10^6 has 10^13 of
  ///          them: where a size is a user's own choice, say how much is too much by `progress`. Removing: only chunks
  ///          that exist.
  std::int64_t add_sphere(DVec3 centre, double radius, VoxelType material, double blend = 0.0,
                          const Progress& progress = {});
  std::int64_t remove_sphere(DVec3 centre, double radius, double blend = 0.0);
  std::int64_t add_box(DVec3 min, DVec3 max, VoxelType material, double rounding = 0.0, double blend = 0.0,
                       const Progress& progress = {});
  std::int64_t remove_box(DVec3 min, DVec3 max, double rounding = 0.0, double blend = 0.0);
  /// Smooths the surface within a sphere: moves each density towards the mean of its 26 neighbours (as they were
  /// before), strength * (1 - (distance / radius)^2)^2 of the way. Samples that become solid take the material of most
  /// of their solid neighbours. A strength above 1 counts as 1; sizes, places and strengths that are not above 0,
  /// infinite or NaN change nothing. Returns how many samples changed.
  /// Cost: O(samples of the sphere's box in chunks that exist, or are beside one), and 4 bytes of memory for each
  /// meanwhile.
  std::int64_t smooth(DVec3 centre, double radius, double strength);
  /// Moves the surface within a sphere towards a plane. A strength, place or normal that is not as FlattenOptions says
  /// changes nothing. Returns how many samples changed. Cost: as adding a sphere.
  std::int64_t flatten(DVec3 centre, double radius, const FlattenOptions& options, const Progress& progress = {});
  /// Asks `pick(IVec3 sample, DensitySample current)` for the new value of every sample of the box (half open: `max`
  /// excluded), x fastest, then y, then z within a chunk, and chunks in that order too. Returns how many samples
  /// changed.
  /// Requires: `pick` leaves the grid alone. Cost: O(samples of the box), far air too.
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
  /// `edit`, a row at a time: `change(first, densities, materials)` gets the samples of the box along x in one chunk,
  /// from `first` on, and changes them in place. Returns how many changed.
  std::int64_t edit_rows(
      const IBox& box,
      FunctionRef<void(IVec3 first, std::span<float> densities, std::span<VoxelType> materials)> change,
      const Progress& progress = {});
  /// Puts a whole chunk in place; counts as an edit of whatever differs. Returns how many samples changed. Outermost
  /// chunks are ignored. Requires: its densities are `stored_density` of this band.
  std::int64_t put_chunk(IVec3 chunk, DensityChunk samples);
  /// Makes everything far air, as an edit.
  void clear();

  /// As those of Grid.
  void make_partial();
  [[nodiscard]] bool is_partial() const;
  /// Requires: as `put_chunk`.
  bool load_chunk(IVec3 chunk, DensityChunk samples);
  /// Likewise, of a chunk that is known to be far air.
  bool load_air_chunk(IVec3 chunk);
  bool unload_chunk(IVec3 chunk);
  [[nodiscard]] bool is_loaded(IVec3 chunk) const;
  [[nodiscard]] bool is_loaded_around(IVec3 chunk, int distance = 1) const;
  /// As that of Grid, of a box of samples. A point between samples is known where all eight around it are loaded.
  [[nodiscard]] bool is_loaded_within(const IBox& samples) const;
  [[nodiscard]] std::vector<IVec3> loaded_chunks() const;

  /// Null where all is far air. Lifetime: as Grid::find_chunk.
  [[nodiscard]] const DensityChunk* find_chunk(IVec3 chunk) const;
  /// Coordinates of all chunks that are not far air, sorted by z, then y, then x.
  [[nodiscard]] std::vector<IVec3> chunks() const;
  [[nodiscard]] std::size_t chunk_count() const;
  /// The chunk and the 26 around it, for meshers. Lifetime: the grid must outlive it, and an edit ends it.
  [[nodiscard]] DensityNeighbourhood neighbourhood(IVec3 chunk) const;
  /// The smallest box around all solid samples; empty when there are none.
  /// Cost: O(chunks * 4096) the first time, then that of the chunks that changed.
  [[nodiscard]] IBox solid_bounds() const;
  /// The smallest box of whole coordinates within which the trilinear field is negative anywhere: the solid lies
  /// between its sides. Empty where there is none. Cost: as `solid_bounds`.
  [[nodiscard]] IBox bounds() const;
  /// How many samples are solid. Cost: as `solid_bounds`.
  [[nodiscard]] std::int64_t solid_count() const;

  /// What edits changed since the cursor's last time, exactly; moves the cursor to the present.
  /// Cost: O(chunks that changed), whatever the size of the grid. See ChangeCursor.
  [[nodiscard]] DensityChanges changes_since(ChangeCursor& cursor) const;
  /// As those of Grid.
  [[nodiscard]] bool has_changed_since(const ChangeCursor& cursor) const;
  [[nodiscard]] ChangeCursor cursor() const;

  /// Bytes held.
  [[nodiscard]] std::size_t bytes() const;
  /// Gives back memory that edits left unused.
  void compact();

 private:
  friend class Scene;
  struct Impl;
  explicit DensityGrid(std::unique_ptr<Impl> impl);
  [[nodiscard]] inline Impl& impl() const;

  std::unique_ptr<Impl> impl_;
  mutable EditNotice notice_;  // a scene that follows it is no part of it
};

}  // namespace quoin
