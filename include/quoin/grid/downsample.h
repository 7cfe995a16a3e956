#pragma once

#include <cstdint>
#include <memory>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// The grid in cells of 2^3 voxels: voxel c of the result stands for the voxels from 2 c to 2 c + 1.
///
/// Solid:   a cell of which at least half is not air (4 voxels of 8). And what is thin: a cell with 2 or 3 voxels that
///          lie in both halves along some axis, where the next cell along that axis on either side is not empty and
///          none of the four cells beside it is solid by half. Of several such cells side by side the one with the
///          least coordinates counts, so that a rod one or two voxels wide becomes a rod one cell wide. So a cell that
///          is added stands for at least 2 voxels, and none is added beside what is solid: the result's volume is at
///          most 4 times the grid's.
/// Type:    opaque types before transparent ones; of these the one with the greatest weight, a voxel weighing 1 and 8
///          more for every face that meets air (tuned on pictures of terrains); of equal ones the lower.
/// Threads: the same result at any number.
/// Cost:    1.3 to 3 milliseconds a chunk of the result, of caves and several types.
/// Errors:  Cancelled.
[[nodiscard]] Result<Grid> downsample(const Grid& grid, const VoxelRegistry& types, Threads threads = {},
                                      const Progress& progress = {});

/// One chunk of `downsample(grid, types)`, by its place among that grid's chunks.
///
/// Reads the voxels that its cells stand for and two past them on each side, and no others: an edit elsewhere leaves it
/// as it was.
[[nodiscard]] Chunk downsample_chunk(const Grid& grid, const VoxelRegistry& types, IVec3 chunk);

/// The coarser levels of a grid, each half as fine as the one before, kept and brought up to date where the grid was
/// edited.
///
/// Threads: any number may read; an update needs it to itself.
class GridPyramid {
 public:
  GridPyramid();
  GridPyramid(GridPyramid&&) noexcept;
  GridPyramid& operator=(GridPyramid&&) noexcept;
  ~GridPyramid();

  /// Halves `grid` up to `levels` times, fewer where nothing would be left. Only chunks that edits since the last
  /// update can have changed are made again; all of another grid.
  ///
  /// Requires: the visibility of the types is that of the last update; this is not checked.
  /// Lifetime: grid and types are only read within the call; their snapshots may take their place in the next.
  /// Cost:     `downsample_chunk` for each chunk that an edit can have changed.
  void update(const Grid& grid, const VoxelRegistry& types, int levels, Threads threads = {});

  /// How many there are; none before the first update.
  [[nodiscard]] int levels() const;
  /// The grid halved `level` times. Lifetime: the pyramid owns it, until an update leaves fewer levels.
  ///
  /// Requires: 1 <= level <= levels().
  [[nodiscard]] const Grid& level(int level) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The field at half as many samples along each axis: sample c stands where sample 2 c was, with its density in the
/// samples that are left (half the number, in half the band), so that the surface stays where it was between the two.
///
/// Material: of a solid sample with air among its 26 neighbours in the result that of the solid samples of the field at
///           2 c and around it (27) whose density is the greatest, the one that lies nearest to the air: grass stays
///           green, however thin it is. Of equal ones the sample itself, else the least of (z, y, x). Of any other
///           solid sample its own.
/// Threads:  the same result at any number.
/// Cost:     some 5 milliseconds a chunk of the result, of caves and several materials.
/// Errors:   Cancelled.
[[nodiscard]] Result<DensityGrid> downsample(const DensityGrid& field, Threads threads = {},
                                             const Progress& progress = {});

/// What a halved field has kept of the finer one, in samples.
struct DownsampledDensityCounts {
  std::int64_t finer_solid = 0;  ///< of the field that was halved
  std::int64_t solid = 0;        ///< of the result
  std::int64_t surface = 0;      ///< of these, those with air beside them along some axis
  std::int64_t thin = 0;         ///< of these, those with air on both sides along some axis

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

/// The coarser levels of a field, as GridPyramid has those of a grid.
///
/// Threads: any number may read; an update needs it to itself.
class DensityPyramid {
 public:
  DensityPyramid();
  DensityPyramid(DensityPyramid&&) noexcept;
  DensityPyramid& operator=(DensityPyramid&&) noexcept;
  ~DensityPyramid();

  /// As GridPyramid::update: an edit costs a halved chunk for each chunk that reads what it changed.
  /// Lifetime: the field is only read within the call.
  void update(const DensityGrid& field, int levels, Threads threads = {});

  /// How many there are; none before the first update.
  [[nodiscard]] int levels() const;
  /// The field halved `level` times. Lifetime: as GridPyramid::level.
  /// Requires: 1 <= level <= levels().
  [[nodiscard]] const DensityGrid& level(int level) const;
  /// What halving to `level` has kept. Lifetime: as `level`. Requires: 1 <= level <= levels().
  [[nodiscard]] const DownsampledDensityCounts& counts(int level) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
