#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include <quoin/core/changes.h>
#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

namespace [[gnu::visibility("default")]] quoin {

/// Halves the resolution of a grid: voxel c of the result covers the 2^3 voxels from 2 c to 2 c + 1 (a cell).
///
/// Solid:   a cell becomes solid if at least 4 of its 8 voxels are not air. Thin structures are kept by a second rule.
///          A thin cell has 2 or 3 voxels, with voxels in both halves along an axis. It becomes solid if a neighbour
///          along that axis is not empty, and none of the four cells next to it across the axis has 4 or more voxels.
///          If two thin cells lie side by side, at an even and the next odd coordinate, only the lower becomes solid:
///          a rod that is two voxels wide there becomes a rod one cell wide. Each solid cell covers at least 2 voxels,
///          so the volume of the result is at most 4 times the volume of the grid.
/// Type:    opaque types win over transparent types. Among these, the type with the greatest weight wins; ties go to
///          the lower type. A voxel weighs 1, plus 8 per face that meets air (tuned on images of terrain).
/// Shapes:  voxels whose type has shapes are air in these rules, and then count by their coverage: the mean share of a
///          side that they hide along the three axes, without the part that lies on a face of another voxel. A cell
///          that is not solid becomes one of their type with the probability c / (4 - n), where c is the sum of their
///          coverages and n the number of other voxels. So thin shapes neither grow into full cells nor vanish: enough
///          cells stay. A solid cell becomes one of their type with the probability of their share of its surface: c
///          and the faces that they cover, against the open faces. A carpet thus colours the ground below. The cell's
///          position decides, so the result is always the same. Opaque types win as above; shapes with glass sides do
///          not replace opaque cells.
/// States:  a cell of a type that its state turns (VoxelProperties::orientations) has the state of its voxels of that
///          type with the greatest weight. Other data is not kept.
/// Again:   `types` is for the voxels of `grid`. To halve the result, use `types_of_halved(types)`.
/// Threads: the result is the same at any thread count.
/// Cost:    1.3 to 3 ms per chunk of the result, for caves with several types; 4 to 6 ms more for an ocean or a town of
///          shapes.
/// Errors:  Cancelled.
[[nodiscard]] Result<Grid> downsample(const Grid& grid, const VoxelRegistry& types, Threads threads = {},
                                      const Progress& progress = {});

/// Returns the types for halved grids: types with shapes are cubes of the mean colour of their sides, opaque unless a
/// side is glass. Other types are the same. Cost: O(types with shapes).
[[nodiscard]] VoxelRegistry types_of_halved(const VoxelRegistry& types);

/// The types for halved grids of one registry, made again only after its types have changed.
class HalvedTypes {
 public:
  /// Returns `types` if no type has shapes, else `types_of_halved(types)`. Lifetime: until the next call; the registry
  /// must outlive the result. Cost: O(1) if no type has changed since the last call with this registry or a snapshot.
  [[nodiscard]] const VoxelRegistry& of(const VoxelRegistry& types);

 private:
  ChangeCursor cursor_;
  std::optional<VoxelRegistry> cubes_;
};

/// Computes one chunk of `downsample(grid, types)`, by its chunk coordinates in the result.
///
/// Reads only the voxels that its cells cover and two more on each side. An edit elsewhere does not change the result.
[[nodiscard]] Chunk downsample_chunk(const Grid& grid, const VoxelRegistry& types, IVec3 chunk);

/// Coarser levels of a grid, each at half the resolution of the previous level, updated incrementally after edits.
///
/// Threads: any number may read at once; an update needs exclusive access.
class GridPyramid {
 public:
  GridPyramid();
  GridPyramid(GridPyramid&&) noexcept;
  GridPyramid& operator=(GridPyramid&&) noexcept;
  ~GridPyramid();

  /// Updates the pyramid: halves `grid` up to `levels` times, or until nothing is left. Recomputes only chunks affected
  /// by edits since the last update, or all chunks if the grid is a different grid.
  ///
  /// States of shapes and of turned types count as edits.
  /// Requires: type visibilities, shapes and orientations are the same as in the last update; this is not checked.
  /// Lifetime: grid and types are read only during the call. The next call may use snapshots of them instead.
  /// Cost:     `downsample_chunk` for each chunk that an edit can affect.
  void update(const Grid& grid, const VoxelRegistry& types, int levels, Threads threads = {});
  /// As above, for many pyramids that share `halved_types`. Requires: `halved_types` equals `types_of_halved(types)`.
  void update(const Grid& grid, const VoxelRegistry& types, const VoxelRegistry& halved_types, int levels,
              Threads threads = {});

  /// Returns the number of levels; 0 before the first update.
  [[nodiscard]] int levels() const;
  /// Returns the grid halved `level` times. Lifetime: the pyramid owns it, until an update has fewer levels.
  ///
  /// Requires: 1 <= level <= levels().
  [[nodiscard]] const Grid& level(int level) const;

 private:
  struct [[gnu::visibility("hidden")]] Impl;
  std::unique_ptr<Impl> impl_;
};

/// Halves the number of samples of a field along each axis. Sample c of the result lies at sample 2 c of the field. Its
/// density is the field's density at that point, in units of the coarser samples (half the number, in half the band).
/// The surface therefore stays at the same position between samples.
///
/// Material: a solid sample next to air (26 neighbours) takes its material from the 27 field samples at and around 2 c.
///           The solid sample with the greatest density wins, because it is nearest to the air: a thin layer of grass
///           stays green. Ties prefer the sample at 2 c, then the least (z, y, x). Other solid samples keep the
///           material at 2 c.
/// Threads:  the result is the same at any thread count.
/// Cost:     about 5 ms per chunk of the result, for caves with several materials.
/// Errors:   Cancelled.
[[nodiscard]] Result<DensityGrid> downsample(const DensityGrid& field, Threads threads = {},
                                             const Progress& progress = {});

/// Sample counts that show how much of a field survives halving.
struct DownsampledDensityCounts {
  std::int64_t finer_solid = 0;  ///< solid samples of the finer field
  std::int64_t solid = 0;        ///< solid samples of the result
  std::int64_t surface = 0;      ///< solid samples with air next to them along some axis
  std::int64_t thin = 0;         ///< solid samples with air on both sides along some axis

  DownsampledDensityCounts& operator+=(const DownsampledDensityCounts& other) {
    finer_solid += other.finer_solid;
    solid += other.solid;
    surface += other.surface;
    thin += other.thin;
    return *this;
  }
  DownsampledDensityCounts& operator-=(const DownsampledDensityCounts& other) {
    finer_solid -= other.finer_solid;
    solid -= other.solid;
    surface -= other.surface;
    thin -= other.thin;
    return *this;
  }
  bool operator==(const DownsampledDensityCounts&) const = default;
};

/// Coarser levels of a density field, as GridPyramid for a grid.
///
/// Threads: any number may read at once; an update needs exclusive access.
class DensityPyramid {
 public:
  DensityPyramid();
  DensityPyramid(DensityPyramid&&) noexcept;
  DensityPyramid& operator=(DensityPyramid&&) noexcept;
  ~DensityPyramid();

  /// Updates the pyramid, as GridPyramid::update. An edit recomputes each coarser chunk that reads a changed sample.
  /// Lifetime: the field is read only during the call.
  void update(const DensityGrid& field, int levels, Threads threads = {});

  /// Returns the number of levels; 0 before the first update.
  [[nodiscard]] int levels() const;
  /// Returns the field halved `level` times. Lifetime: same as GridPyramid::level.
  /// Requires: 1 <= level <= levels().
  [[nodiscard]] const DensityGrid& level(int level) const;
  /// Returns the sample counts of `level` and of the next finer field. Lifetime: same as `level`.
  /// Requires: 1 <= level <= levels().
  [[nodiscard]] const DownsampledDensityCounts& counts(int level) const;

 private:
  struct [[gnu::visibility("hidden")]] Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
