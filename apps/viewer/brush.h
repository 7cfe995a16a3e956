#pragma once

#include <cstdint>
#include <optional>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_query.h>
#include <quoin/trace/ray.h>

namespace quoin::viewer {

/// The effect of a brush on the voxels that it covers.
enum class BrushAction : std::uint8_t {
  Place,    ///< air becomes the brush's type
  Remove,   ///< everything becomes air
  Paint,    ///< solid voxels become the brush's type
  Smooth,   ///< smooths the surface; fields only
  Flatten,  ///< levels to the plane of the first touch, filling with its material; fields only
};

/// Returns true if a stroke follows the surface rather than the layer or plane of its first touch.
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
  std::uint32_t state = 0;  ///< of placed and painted voxels
  /// True if placed voxels turn to the face that is touched (`placed_state`). False for a picked state: strokes keep
  /// it, and painting also gives it to voxels that have the brush's type.
  bool turns = true;

  /// Selects a type, whose voxels turn to the face that is touched.
  void choose(VoxelType chosen) {
    type = chosen;
    state = 0;
    turns = true;
  }
  /// Selects the type and the state of a voxel.
  void choose(VoxelType chosen, std::uint32_t chosen_state) {
    type = chosen;
    state = chosen_state;
    turns = false;
  }
};

/// Returns the state of voxels that a brush places or paints when it touches `hit` in the direction `look`, in the
/// world.
[[nodiscard]] std::uint32_t state_of(const Brush& brush, const SceneHit& hit, DVec3 look, const Instance& instance,
                                     const SceneGrid& grid, const VoxelRegistry& types);

/// Returns the box of voxels that a brush at `centre` can change, clipped to the coordinate range.
[[nodiscard]] IBox reach_of(const Brush& brush, IVec3 centre);

/// Applies a brush. Returns the number of voxels whose type or state changed.
std::int64_t apply(const Brush& brush, IVec3 centre, Grid& grid);

/// Returns the voxel of a stroke's first touch: for Place the one in front of the hit face, otherwise the hit voxel.
[[nodiscard]] IVec3 target_of(BrushAction action, IVec3 voxel, Direction face);

/// Transforms a ray from the world to an instance's grid, in voxels. Empty if the instance's transform is invalid
/// (non-finite numbers or a non-positive size).
[[nodiscard]] std::optional<Ray> ray_in_grid(const Instance& instance, const SceneGrid& grid, const Ray& ray_in_world);

/// The layer of voxels that a stroke stays in, so that dragging neither digs nor piles up.
struct StrokeLayer {
  IVec3 voxel{0};                    ///< the first touch
  Direction face = Direction::PosY;  ///< the hit face

  /// Returns the voxel where a ray in the grid meets the layer. Empty if the ray is parallel to the layer, points away
  /// from it or meets it too far away.
  [[nodiscard]] std::optional<IVec3> at(const Ray& ray_in_grid) const;
};

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
