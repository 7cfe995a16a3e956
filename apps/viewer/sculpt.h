#pragma once

#include <optional>

#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/scene/scene_query.h>

#include "brush.h"

namespace quoin::viewer {

/// The point where a stroke touches the surface of a field, in the grid.
struct SurfacePlace {
  DVec3 point{0.0};
  DVec3 normal{0.0, 1.0, 0.0};  ///< unit, into the air
  VoxelType material = kAir;    ///< the material at the point

  /// Empty if the hit is not on a field, or the instance's transform is invalid.
  [[nodiscard]] static std::optional<SurfacePlace> of(const SceneHit& hit, const Instance& instance,
                                                      const SceneGrid& grid);
  /// Returns the point where a ray in the grid meets the tangent plane, in which strokes that add or remove continue.
  /// Empty if the ray is parallel to the plane, points away from it or meets it too far away.
  [[nodiscard]] std::optional<DVec3> in_plane(const Ray& ray_in_grid) const;
};

/// Returns the radius of a brush on a field, in samples.
[[nodiscard]] double sculpt_radius(const Brush& brush);

/// Returns the samples that a touch can change.
[[nodiscard]] IBox reach_of(const Brush& brush, DVec3 centre, const DensityGrid& field);

/// Applies one touch of a brush: adds or removes a ball or box, paints solid samples, smooths, or flattens to the
/// tangent plane at `first`, the start of the stroke, and fills hollows with its material. Returns the number of
/// samples changed.
std::int64_t sculpt(const Brush& brush, DVec3 centre, const SurfacePlace& first, DensityGrid& field);

}  // namespace quoin::viewer
