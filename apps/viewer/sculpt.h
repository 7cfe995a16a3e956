#pragma once

#include <optional>

#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/scene/scene_query.h>

#include "brush.h"

namespace quoin::viewer {

/// Where a stroke touches the surface of a field, in the grid.
struct SurfacePlace {
  DVec3 point{0.0};
  DVec3 normal{0.0, 1.0, 0.0};  ///< unit, into the air
  VoxelType material = kAir;    ///< what is there

  /// Nothing when the hit is not of a field, or the instance has no place.
  [[nodiscard]] static std::optional<SurfacePlace> of(const SceneHit& hit, const Instance& instance,
                                                      const SceneGrid& grid);
  /// Where a ray in the grid meets the plane through the place upright to its normal, in which strokes that add or take
  /// away go on; nothing when it runs along it, away from it, or too far.
  [[nodiscard]] std::optional<DVec3> in_plane(const Ray& ray_in_grid) const;
};

/// Of a brush on a field, in samples.
[[nodiscard]] double sculpt_radius(const Brush& brush);

/// The samples that a touch can change.
[[nodiscard]] IBox reach_of(const Brush& brush, DVec3 centre, const DensityGrid& field);

/// A touch of a brush: adds a ball or a box of its type, takes one away, gives what is solid its type, smooths, or
/// flattens towards the plane of `first`, where the stroke began, hollows filled with what is there. Returns how many
/// samples changed.
std::int64_t sculpt(const Brush& brush, DVec3 centre, const SurfacePlace& first, DensityGrid& field);

}  // namespace quoin::viewer
