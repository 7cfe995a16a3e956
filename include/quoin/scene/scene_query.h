#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>
#include <quoin/trace/ray.h>

namespace [[gnu::visibility("default")]] quoin {

/// The voxels and field materials that a query detects. Unregistered types, and solid without a material, count as
/// opaque and colliding.
enum class QueryTypes : std::uint8_t {
  All,        ///< all voxels except air
  Colliding,  ///< voxels that stop moving bodies (VoxelProperties::collides, ShapeElement::collides)
  Opaque,     ///< voxels that block sight
};

/// The treatment of unloaded chunks (Grid::make_partial), whose content is unknown. In a partial field, the space
/// between a loaded and an unloaded sample is also unknown.
enum class UnloadedChunks : std::uint8_t {
  Ignore,  ///< treats unloaded chunks as air
  Block,   ///< treats unloaded chunks as solid; hits report `is_unloaded`
};

/// Restricts a query; by default it covers the whole scene.
/// Lifetime: the array behind `ignored` must outlive the query.
struct QueryFilter {
  std::span<const InstanceHandle> ignored = {};    ///< instances to skip: a moving body ignores itself
  std::uint32_t categories = ~std::uint32_t{0};    ///< skips instances that have none of these bits
  std::optional<QueryTypes> types = std::nullopt;  ///< default: All for rays, Colliding for shapes
  /// The default is Ignore for rays, whose hits report `unloaded_t`, and Block for shapes, so that bodies do not fall
  /// through ground that is still loading.
  std::optional<UnloadedChunks> unloaded = std::nullopt;
};

/// A ray hit in a scene.
struct SceneHit {
  InstanceHandle instance;
  /// Voxel in the traced grid: the instance's grid, unless the tracer uses a halved one. For a shape, its
  /// voxel, although the hit may lie outside: a shape reaches up to a voxel beyond its own. For a field, the cell as in
  /// DensityHit.
  IVec3 voxel{0};
  VoxelType type = kAir;  ///< for a field, the material
  /// Face of the voxel, in its grid, as in RayHit; for a shape or a field, the direction nearest to its normal.
  Direction face = Direction::PosX;
  double t = 0.0;       ///< in multiples of the ray direction's length: world units for a unit direction
  DVec3 position{0.0};  ///< in world space
  bool starts_inside = false;
  bool in_field = false;
  /// Unit normal in world space, pointing out of the solid; that of the side that the ray meets, also for turned
  /// elements of shapes; 0 if a field has no gradient.
  DVec3 normal{0.0};
  /// True for a hit on an unloaded chunk (UnloadedChunks::Block): `voxel` is the chunk's first voxel, `type` is air.
  bool is_unloaded = false;
  /// Ray distance of the first entry into unloaded space, before `t`. Unknown content may stop the ray there.
  /// Infinite if it does not enter any.
  double unloaded_t = std::numeric_limits<double>::infinity();
};

/// Returns the nearest voxel or field surface along a world-space ray, transparent ones included, up to and including
/// `max_t` (in multiples of the direction's length). At equal distance, the first instance wins, and within an instance
/// the voxel. Returns nullopt if there is no hit, the ray is not finite, its direction is zero, or `max_t` is negative
/// or NaN.
///
/// Shapes:    a voxel with a shape (VoxelProperties::shapes) consists of the shape's elements, with drawn sides or
///            without, also where their textures are transparent: a ray meets the frame and the panes of a window.
///            With QueryTypes::Colliding, elements with `collides = false` are air; with QueryTypes::Opaque, all
///            elements of types whose `visibility` is Transparent. Halved grids have cubes in place of shapes.
/// Precision: the ray is transformed into each grid in double, so at 10^9 from the origin a hit is as exact as the ray.
/// Filters:   excluded voxels and instances count as air; a ray that starts inside them starts in air.
/// Textures:  a ray hits a voxel also where its texels are invisible.
/// Partial:   with UnloadedChunks::Block, a hit is certain or reports the entry into unloaded space, and a miss
///            means that the ray stays in loaded chunks. Costs a look-up per chunk on the ray.
/// Cost:      O(log instances + grids on the ray). For grids with excluded types, also O(such voxels, and field cells,
///            on the ray).
[[nodiscard]] std::optional<SceneHit> first_hit(const SceneTracer& tracer, const Ray& ray_in_world,
                                                double max_t = std::numeric_limits<double>::infinity(),
                                                const QueryFilter& filter = {});

/// Returns true if a world-space ray hits anything from 0 up to and including `max_t`, transparent voxels included.
/// Like `first_hit`, but stops at any hit. Use it for lines of sight.
[[nodiscard]] bool any_hit(const SceneTracer& tracer, const Ray& ray_in_world,
                           double max_t = std::numeric_limits<double>::infinity(), const QueryFilter& filter = {});

/// Returns the hit at a point of an image. Requires: width and height are positive.
[[nodiscard]] std::optional<SceneHit> pick(const SceneTracer& tracer, const Camera& camera, const ImagePoint& point,
                                           const QueryFilter& filter = {});

/// Returns the voxel or field surface that a pixel of a depth image (RenderedImage::depth) shows: the first hit of the
/// ray at distance `depth` (world units), to the rounding of a float. Returns nullopt if there is none at that
/// distance, or `depth` is negative, infinite or NaN. Requires: width and height are positive.
[[nodiscard]] std::optional<SceneHit> voxel_at_depth(const SceneTracer& tracer, const Camera& camera,
                                                     const ImagePoint& point, float depth,
                                                     const QueryFilter& filter = {});

/// An overlap of a shape with a voxel or with a field cell whose solid touches it. QueryFilter selects the types; by
/// default, types that collide.
struct SceneOverlap {
  InstanceHandle instance;
  IVec3 voxel{0};         ///< for a field, the cell as in DensityHit
  VoxelType type = kAir;  ///< for a field, the material of the nearest sample with a matching material
  bool in_field = false;
  DVec3 normal{0.0};  ///< for a field, its unit gradient at a point inside the shape, in world space; otherwise 0
  /// True for an unloaded chunk (UnloadedChunks::Block): `voxel` is its first voxel, `type` is air.
  bool is_unloaded = false;
};

/// Returns the overlaps of a sphere, box or capsule with a scene: at most one per instance, in instance order. It is
/// the first overlapping voxel by z, y, x; else the first field cell with a negative density inside the shape, at least
/// 1e-6 voxels deep; else an unloaded chunk of the grid.
///
/// Touching is not overlapping. Numbers that are negative or not finite, and a radius of 0, overlap nothing. A box of
/// size 0 along some axes is a plate, a rod or a point.
///
/// Shapes:  voxels with shapes are met as in `sweep_box`; the overlap names the voxel that has the shape.
/// Fields:  cells collide as in `sweep_box`. A cell that its bounds cannot decide counts as overlapping.
/// Cost:    O(log instances), plus, per nearby instance, the voxels within the shape's bounds until one is found.
/// Threads: any number of threads may query at once while the tracer is not updated.
[[nodiscard]] std::vector<SceneOverlap> overlaps(const SceneTracer& tracer, DVec3 centre, double radius,
                                                 const QueryFilter& filter = {});
[[nodiscard]] std::vector<SceneOverlap> overlaps(const SceneTracer& tracer, const OrientedBox& box,
                                                 const QueryFilter& filter = {});
[[nodiscard]] std::vector<SceneOverlap> overlaps(const SceneTracer& tracer, const Capsule& capsule,
                                                 const QueryFilter& filter = {});

}  // namespace quoin
