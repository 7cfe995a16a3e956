#pragma once

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/grid/density_grid.h>
#include <quoin/io/volume.h>

namespace quoin {

struct VolumeFieldOptions {
  float iso = 0.0F;        ///< what has a greater value is solid
  VoxelType material = 1;  ///< of all that is solid
};

/// The density whose surface is where a volume has the value `iso`.
///
/// Space:     sample (i, j, k) is the volume's; beyond the volume is far air, so that what it cuts off is closed there.
/// Density:   (iso - value) / slope within a band of 8, where `slope` is the median steepness of the volume where
///            the surface crosses its edges, so that densities are about distances in samples; where nothing is
///            crossed, the slope is that which takes the volume's range, or 1 where that is 0, to 8. The value `iso`
///            itself is air.
/// Values:    NaN is air; infinities are far air and deep solid.
/// Order:     the same densities at any thread count.
/// Errors:    InvalidArgument when `iso` is NaN, a size is not positive or there are not as many values as the size
///            says; Cancelled. A volume that never crosses `iso` gives an empty or a solid field.
/// Memory:    2 bytes a sample near the surface or where the volume is within the band, none where it is far from it.
[[nodiscard]] Result<DensityGrid> field_from_volume(const Volume& volume, const VolumeFieldOptions& options,
                                                    Threads threads = {}, const Progress& progress = {});

}  // namespace quoin
