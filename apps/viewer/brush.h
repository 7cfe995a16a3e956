#pragma once

#include <cstdint>
#include <optional>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/grid.h>
#include <quoin/scene/scene.h>
#include <quoin/trace/ray.h>

namespace quoin::viewer {

/// What a brush does to the voxels that it covers.
enum class BrushAction : std::uint8_t {
  Place,    ///< air becomes the brush's type
  Remove,   ///< everything becomes air
  Paint,    ///< what is not air becomes the brush's type
  Smooth,   ///< of fields only
  Flatten,  ///< likewise: towards the plane of the first touch, with what is there
};

/// Whether a stroke follows the surface, rather than the layer or plane of its first touch.
[[nodiscard]] constexpr bool follows_surface(BrushAction action) {
  return action != BrushAction::Place && action != BrushAction::Remove;
}

enum class BrushShape : std::uint8_t { Box, Sphere };

inline constexpr int kMaxBrush = 32;

struct Brush {
  BrushAction action = BrushAction::Place;
  BrushShape shape = BrushShape::Box;
  int radius = 0;  ///< voxels beyond the middle one, 0 (one voxel) to kMaxBrush
  VoxelType type = 1;
};

/// The box of voxels that a brush can change about a voxel; cut off where coordinates end.
[[nodiscard]] IBox reach_of(const Brush& brush, IVec3 centre);

/// Applies a brush. Returns how many voxels changed.
std::int64_t apply(const Brush& brush, IVec3 centre, Grid& grid);

/// Where the first touch of a stroke lands: beside the voxel that was hit for placing, in it otherwise.
[[nodiscard]] IVec3 target_of(BrushAction action, IVec3 voxel, Direction face);

/// A ray of the world in an instance's grid, in voxels. Nothing when the instance has no place (numbers that are not
/// finite, a size that is not positive).
[[nodiscard]] std::optional<Ray> ray_in_grid(const Instance& instance, const SceneGrid& grid, const Ray& ray_in_world);

/// The layer of voxels in which a stroke goes on, so that dragging neither digs nor piles up.
struct StrokeLayer {
  IVec3 voxel{0};                    ///< of the first touch
  Direction face = Direction::PosY;  ///< that was hit

  /// The voxel of the layer that a ray in the grid meets; nothing when it runs along it, away from it, or too far.
  [[nodiscard]] std::optional<IVec3> at(const Ray& ray_in_grid) const;
};

}  // namespace quoin::viewer
