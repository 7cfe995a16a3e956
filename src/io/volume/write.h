#pragma once

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

#include "io/placed/placed_grids.h"

namespace quoin {

/// Writes a scene as a NIfTI-1 file, at its place and size in the world. Voxels become the numbers of their types (8 or
/// 16 bits, intent LABEL), 0 where there are none; a field becomes its densities, negated, so that what is above 0 is
/// solid (32-bit floats, as far as its band reaches).
///
/// Axes:   read_volume gives the same places again.
/// Errors: Unsupported for several fields, for a field beside voxels, and what placed/placed_grids.h says of
///         voxels; LimitExceeded beyond 32,767 samples a side or 2^30 in all; Cancelled.
[[nodiscard]] Result<models::ModelBytes> write_nifti(const Scene& scene, const Progress& progress = {});

}  // namespace quoin
