#pragma once

#include <glm/mat4x4.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/io/smooth_files.h>
#include <quoin/io/volume.h>
#include <quoin/mesh/smooth_mesh.h>
#include <quoin/scene/scene.h>

namespace quoin {

struct SmoothSceneOptions {
  SmoothMeshOptions mesh;
  std::optional<float> simplify_error;  ///< in voxels, as simplify_smooth_mesh has it; without, nothing is simplified
  bool hidden = false;                  ///< whether instances that are not visible count as drawn
};

/// Smooth surfaces around the voxels of a scene.
struct SmoothScene {
  std::vector<SmoothPart> parts;  ///< a grid that a drawn instance places each, in the order of their handles
  float simplify_error = 0.0F;    ///< the largest that was reached, in voxels
};

/// Meshes every grid that a drawn instance places, once, as field_from_grid and build_smooth_mesh do. A placement per
/// drawn instance keeps its name and transform; the part's pivot is the grid's.
///
/// Types:  every voxel that is not air is solid and opaque.
/// Order:  the same bytes at any thread count.
/// Errors: those of build_smooth_mesh and simplify_smooth_mesh; InvalidArgument when a drawn instance's transform is
///         not finite or its voxel size not positive; Cancelled.
[[nodiscard]] Result<SmoothScene> smooth_scene(const Scene& scene, const SmoothSceneOptions& options,
                                               Threads threads = {}, const Progress& progress = {});

struct SmoothVolumeOptions {
  float iso = 0.0F;  ///< solid where values are above
  SmoothMeshOptions mesh;
  std::optional<float> simplify_error;  ///< in samples
  Rgba8 colour{180, 176, 168, 255};
};

/// The surface of a volume.
struct SmoothVolume {
  SmoothPart part;  ///< placed where the volume says, in its units; named as the volume
  std::int64_t solid_samples = 0;
  float simplify_error = 0.0F;  ///< reached, in samples
};

/// Meshes a volume as field_from_volume and build_smooth_mesh do. Errors: theirs, and those of simplify_smooth_mesh.
[[nodiscard]] Result<SmoothVolume> smooth_volume(const Volume& volume, const SmoothVolumeOptions& options,
                                                 Threads threads = {}, const Progress& progress = {});

/// A value between the two groups into which the finite values part best: the one that leaves the least variance within
/// the groups, by a histogram of 1,024 bins; amid the gap where there is one. The value itself where all are the same.
///
/// Source: N. Otsu, "A Threshold Selection Method from Gray-Level Histograms" (1979).
[[nodiscard]] float volume_threshold(const Volume& volume);

/// How many metres a unit of length has: "m", "cm", "mm", "um" and "nm", also spelt out; nothing for others.
[[nodiscard]] std::optional<double> metres_of_unit(std::string_view unit);

}  // namespace quoin
