#pragma once

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/grid/volume.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/scene/scene.h>

namespace [[gnu::visibility("default")]] quoin {

struct VolumeSceneOptions {
  float iso = 0.0F;  ///< values above are solid
  Rgba8 colour{180, 176, 168, 255};
};

/// Converts a volume to a scene: one grid with the field from field_from_volume, at the volume's position and in its
/// units.
///
/// Spacing: if it differs between axes, values are first resampled to the smallest spacing (trilinear), because grid
///          cells are cubes.
/// Errors:  Unsupported for axes that are not perpendicular; InvalidArgument if a spacing is 0 or not finite;
///          LimitExceeded if the resampled volume would have more than 2^31 samples; those of field_from_volume.
[[nodiscard]] Result<Scene> scene_from_volume(const Volume& volume, const VolumeSceneOptions& options = {},
                                              Threads threads = {}, const Progress& progress = {});

}  // namespace quoin
