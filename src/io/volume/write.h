#pragma once

#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

#include "io/placed/placed_grids.h"

namespace quoin {

/// Writes a scene as a NIfTI-1 file, at its position and size in the world. Voxels become their type numbers (8 or 16
/// bits, intent LABEL), 0 for air. A field becomes its negated densities, so that values above 0 are solid (32-bit
/// floats, within its band).
///
/// Axes:   read_volume restores the same positions.
/// Errors: Unsupported for several fields, for a field together with voxels, and as in placed/placed_grids.h;
///         LimitExceeded beyond 32,767 samples per side or 2^30 in total; Cancelled.
[[nodiscard]] Result<models::ModelBytes> write_nifti(const Scene& scene, const Progress& progress = {});

}  // namespace quoin
