#pragma once

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/grid/volume.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/scene/scene.h>

namespace quoin {

struct VolumeSceneOptions {
  float iso = 0.0F;  ///< solid where values are above
  Rgba8 colour{180, 176, 168, 255};
};

/// A volume as a scene: one grid with the field that field_from_volume makes of it, placed where the volume says, in
/// its units.
///
/// Spacing: where it differs along the axes, values are interpolated at the least of the spacings first (trilinear), as
///          grids have cubes for cells.
/// Errors:  Unsupported for a volume whose axes are not perpendicular to each other; InvalidArgument where a spacing is
///          0 or not finite; LimitExceeded where the interpolated volume would have more than 2^31 samples; those of
///          field_from_volume.
[[nodiscard]] Result<Scene> scene_from_volume(const Volume& volume, const VolumeSceneOptions& options = {},
                                              Threads threads = {}, const Progress& progress = {});

}  // namespace quoin
