#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/core/shapes.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_tracer.h>
#include <quoin/trace/ray.h>

namespace quoin {

/// Which voxels a query meets, and which solid of fields. Unregistered types, and solid without a material, count as
/// opaque and colliding.
enum class QueryTypes : std::uint8_t {
  All,        ///< whatever is not air
  Colliding,  ///< what stops a moving body (VoxelProperties::collides)
  Opaque,     ///< what blocks sight
};

/// What chunks that are not loaded are to a query (Grid::make_partial): nobody knows what is in them. Between samples
/// of a field that is partial, what lies between a sample that is loaded and one that is not is not known either.
enum class UnloadedChunks : std::uint8_t {
  Passed,  ///< air
  Met,     ///< solid, and what is met says so
};

/// What of a scene a query looks at; by default all of it.
/// Lifetime: what `ignored` looks at must outlive the query.
struct QueryFilter {
  std::span<const InstanceHandle> ignored = {};    ///< passed through: a body that moves ignores itself
  std::uint32_t categories = ~std::uint32_t{0};    ///< instances without any of these bits are passed through
  std::optional<QueryTypes> types = std::nullopt;  ///< nothing: All for rays, Colliding for shapes
  /// Nothing: Passed for rays, whose hits say what they passed; Met for shapes, so that nobody falls through ground
  /// that has not come yet.
  std::optional<UnloadedChunks> unloaded = std::nullopt;
};

/// Where a ray meets a scene.
struct SceneHit {
  InstanceHandle instance;
  /// In the grid that is traced: the instance's own, unless the tracer has halved it. Of a field the cell, as in
  /// DensityHit.
  IVec3 voxel{0};
  VoxelType type = kAir;             ///< of a field the material
  Direction face = Direction::PosX;  ///< of the voxel, in its grid; as in RayHit. Of a field that nearest to its normal
  double t = 0.0;                    ///< in lengths of the ray's direction: world units for a unit one
  DVec3 position{0.0};               ///< in the world
  bool starts_inside = false;
  bool in_field = false;
  DVec3 normal{0.0};  ///< in the world: unit, out of what was hit; 0 where a field has no gradient
  /// What was met is a chunk that is not loaded (UnloadedChunks::Met): `voxel` is its first one, `type` air.
  bool is_unloaded = false;
  /// Where the ray came to what is not loaded, before `t`: it may be stopped from there on by what is not known.
  /// Infinite where it did not.
  double unloaded_t = std::numeric_limits<double>::infinity();
};

/// The nearest voxel or field's surface along a ray in the world, up to and including `max_t` (in lengths of its
/// direction), transparent ones too; of equally near ones that of the instance that comes first, in it the voxel.
/// Nothing when there is none, when the ray is not finite or its direction is zero, or when `max_t` is negative or NaN.
///
/// Precision: moved into each grid in double before it is traced there, so as exact 10^9 from the origin as the ray
///            itself.
/// Filters:   what is passed through is nowhere; a ray that starts inside of it starts in air.
/// Partial:   with UnloadedChunks::Met a hit is certain, or says that the ray comes to what is not loaded, and where;
///            nothing is then met by a ray that stays in what is loaded. Costs a look-up for each chunk on the ray.
/// Cost:      O(log instances + grids on the ray); in grids that hold types which the filter passes through, besides
///            O(such voxels, and a field's cells, on the ray).
[[nodiscard]] std::optional<SceneHit> first_hit(const SceneTracer& tracer, const Ray& ray_in_world,
                                                double max_t = std::numeric_limits<double>::infinity(),
                                                const QueryFilter& filter = {});

/// Whether anything meets a ray in the world from 0 up to and including `max_t`, transparent ones too: as `first_hit`,
/// without asking what is nearest, so it is done with the first that is found. For lines of sight.
[[nodiscard]] bool any_hit(const SceneTracer& tracer, const Ray& ray_in_world,
                           double max_t = std::numeric_limits<double>::infinity(), const QueryFilter& filter = {});

/// What is seen at a point of a picture. Requires: width and height are positive.
[[nodiscard]] std::optional<SceneHit> pick(const SceneTracer& tracer, const Camera& camera, const PicturePoint& point,
                                           const QueryFilter& filter = {});

/// The voxel that a pixel of a depth picture shows: the first one no nearer than `depth`, which is a float's rounding
/// off at most. Nothing when there is none at that distance.
[[nodiscard]] std::optional<SceneHit> voxel_at_depth(const SceneTracer& tracer, const Camera& camera,
                                                     const PicturePoint& point, float depth,
                                                     const QueryFilter& filter = {});

/// A voxel that meets a shape, or a cell of a field whose solid does; of the types that the query's filter says, by
/// default those that collide.
struct SceneOverlap {
  InstanceHandle instance;
  IVec3 voxel{0};         ///< of a field the cell, as in DensityHit
  VoxelType type = kAir;  ///< of a field the material, of the nearest sample whose material counts
  bool in_field = false;
  DVec3 normal{0.0};  ///< of a field its gradient at a point within the shape, in the world, unit; otherwise 0
  /// A chunk that is not loaded (UnloadedChunks::Met): `voxel` is its first one, `type` air.
  bool is_unloaded = false;
};

/// For each instance that has such a voxel within a sphere, a box or a capsule, the first of these (by z, y, x), in
/// the order of the instances; of one without, the first cell in which its field is negative anywhere within the shape,
/// unless that is less than 1e-6 voxels deep; of one without that too, a chunk of its grid that is not loaded. To touch
/// is not to overlap. Numbers that are not finite or negative meet
/// nothing, nor does a radius of 0; a box of size 0 is a plate, a rod or a point.
///
/// Fields:  which cells collide, and what bounds do not tell, is as for `sweep_box`; the latter counts as overlapping.
/// Cost:    O(log instances), and for each instance near it the voxels within the shape's bounds until one is found.
/// Threads: any number may ask at once, while the tracer is not updated.
[[nodiscard]] std::vector<SceneOverlap> overlaps(const SceneTracer& tracer, DVec3 centre, double radius,
                                                 const QueryFilter& filter = {});
[[nodiscard]] std::vector<SceneOverlap> overlaps(const SceneTracer& tracer, const OrientedBox& box,
                                                 const QueryFilter& filter = {});
[[nodiscard]] std::vector<SceneOverlap> overlaps(const SceneTracer& tracer, const Capsule& capsule,
                                                 const QueryFilter& filter = {});

}  // namespace quoin
