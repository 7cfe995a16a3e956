#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_query.h>
#include <quoin/scene/scene_tracer.h>

namespace [[gnu::visibility("default")]] quoin {

/// The first contact of a moving shape with a voxel or with a field's solid.
struct SweepHit {
  double fraction = 0.0;  ///< fraction of the displacement, 0 to 1; 0 if the shape starts inside
  /// Unit normal in world space, out of the obstacle towards the shape. For a field, it depends on the touching part of
  /// the box. A corner gives the field's gradient. An edge gives the gradient without its component along the edge. A
  /// face that rests on a peak gives the face's own normal.
  DVec3 normal{0.0};
  InstanceHandle instance;
  IVec3 voxel{0};      ///< for a field, the cell as in DensityHit
  double depth = 0.0;  ///< penetration depth at the start, in world units along `normal`; 0 if the shape starts outside
  VoxelType type = kAir;  ///< for a field, the material
  bool in_field = false;
  /// True for an unloaded chunk (QueryFilter::unloaded): `voxel` is its first voxel, `type` is air.
  bool is_unloaded = false;
};

/// Returns the first voxel that a moving box hits, or the first point where an instance's field is negative. Fast boxes
/// do not tunnel. By default, only types that collide (VoxelProperties::collides) count; `filter` may change that.
///
/// The box keeps its rotation; grids are static, with any rotation. Touching is not a hit, so a box can slide along a
/// face. Among voxels hit at the same time, one with an exposed face wins. Numbers that are not finite hit nothing. A
/// box of size 0 along some axes is a plate, a rod or a point.
///
/// Shapes:  a voxel with a shape (VoxelProperties::shapes) is met as the boxes of its shape, also where they reach
///          outside their voxel: exactly, but a tilted box, and a fluid with an inclined surface, as their bounds along
///          the grid's axes. Elements with `collides` false do not collide. `voxel` is the one that has the shape.
/// Fields:  a cell's solid collides if the material of any of its solid samples does, or if it has no material. The box
///          stops before the solid or touching it, less than 1e-5 voxels away, for any densities; less than 1e-6 voxels
///          deep counts as touching. If 4,000 cell parts cannot decide (a large box almost flush with an uneven
///          surface), the box stops at the first undecided part, up to one part's size away.
/// Partial: unloaded chunks stop the box, unless `filter` sets UnloadedChunks::Ignore.
/// Inside:  in a field's solid, `normal` is the gradient at the deepest point of the box, and `depth` leads out of all
///          of that field's solid around the box. If the gradient does not lead out within about the box's size, the
///          grid axis with the shortest way out replaces it. If no axis does, `depth` is one voxel.
/// Cost:    per instance on the way: the voxels around the box, for each step of the box's size. In a field: the cells
///          with solid, which are divided into more parts if the box is nearly parallel to the surface.
/// Source:  the separating axes of two boxes (S. Gottschalk, M. Lin, D. Manocha, "OBBTree", 1996), each with the time
///          interval in which it separates them. In a field: the separation of the box from the space below planes
///          under the trilinear field, subdivided until the planes are close enough to it.
[[nodiscard]] std::optional<SweepHit> sweep_box(const SceneTracer& tracer, const OrientedBox& box, DVec3 displacement,
                                                const QueryFilter& filter = {});

/// Returns the first voxel or field point that a moving capsule or ball hits. A capsule slides over edges and small
/// steps that stop a box. `depth` is the distance that moves it out of its deepest voxel.
///
/// Exact:  to 1e-9 voxels among voxels of any rotation; in fields as a box. The normal points from the contact to the
///         capsule's axis.
/// Source: the distance of two convex bodies is convex in time; Newton's method from the start.
[[nodiscard]] std::optional<SweepHit> sweep_capsule(const SceneTracer& tracer, const Capsule& capsule,
                                                    DVec3 displacement, const QueryFilter& filter = {});

/// Returns the shortest world-space displacement that moves a shape to a free position: 0 if it is free already,
/// nullopt if there is no free position within `max_distance` (world units).
///
/// Exact:  for a box among voxels aligned with its axes, the nearest free position, including gaps exactly as wide as
///         the box. Among equally near positions, any may be returned.
/// Others: among rotated grids, in fields, and for a capsule, a position at most max_distance / 32 farther than the
///         nearest. One is always found if there is that much room.
/// Cost:   one overlap query for each candidate position that is nearer than the result: a few hundred queries for a
///         voxel-sized box and a distance of twice its size.
/// Errors: returns nullopt for sizes, positions and distances that are negative or not finite.
[[nodiscard]] std::optional<DVec3> depenetration(const SceneTracer& tracer, const OrientedBox& box, double max_distance,
                                                 const QueryFilter& filter = {});
[[nodiscard]] std::optional<DVec3> depenetration(const SceneTracer& tracer, const Capsule& capsule, double max_distance,
                                                 const QueryFilter& filter = {});

/// Floor settings of a walking body. A floor is a surface no steeper than `max_slope_degrees`.
struct FloorOptions {
  DVec3 up{0.0, 1.0, 0.0};          ///< in world space, any length; 0 or not finite: there are no floors
  double max_slope_degrees = 45.0;  ///< measured from horizontal
  /// Maximum height of an obstacle that the body steps onto, in world units; 0: no stepping. The step needs a floor on
  /// top of the obstacle or within half of the box's width beyond its edge, and room for the box above.
  double step_height = 0.0;
  /// Maximum drop, in world units, that a standing body follows down slopes and steps without leaving the ground. With
  /// 0 it falls instead.
  double snap_distance = 0.0;
};

struct SlideOptions {
  /// The gap kept in front of obstacles, in world units, so that rounding cannot cause a penetration.
  double skin = 1e-3;
  int max_contacts = 5;  ///< the remaining displacement is dropped after this many contacts
  /// Moves a body that starts inside an obstacle out of it first. In a field's solid it moves along the gradient
  /// if that leads out; otherwise it uses `depenetration`. If this is false or there is no free position,
  /// the body stays in place with `is_blocked` set and its displacement unchanged.
  bool pushes_out = true;
  /// Limit of that push, in world units; default: the longest edge of the box plus the way out of the obstacle.
  std::optional<double> max_push_out = std::nullopt;
  std::optional<FloorOptions> floor = std::nullopt;  ///< nullopt: no floors; the body slides on every surface
  QueryFilter filter{};                              ///< the obstacles to consider
};

/// One contact of a moving body.
struct SlideContact {
  enum class Kind : std::uint8_t {
    Floor,     ///< with `SlideOptions::floor`: a surface no steeper than its maximum slope
    Wall,      ///< any other surface
    Ceiling,   ///< with `SlideOptions::floor`: a floor seen from below
    Inside,    ///< the body started inside and was moved out if possible
    Unloaded,  ///< an unloaded chunk, which never counts as a floor
  };
  Kind kind = Kind::Wall;
  SweepHit hit;  ///< `fraction` refers to the displacement that was left at this contact
};

struct SlideResult {
  DVec3 centre{0.0};        ///< final position
  DVec3 displacement{0.0};  ///< without the parts removed by contacts; divide by the time step for the new velocity
  /// True after any contact; with `SlideOptions::floor`, only after contacts that are not floors.
  bool is_blocked = false;
  DVec3 normal{0.0};  ///< normal of the last contact that sets `is_blocked`
  /// True if an unloaded chunk was in the way. A body that starts in one stays there, with zero displacement, until the
  /// chunk is loaded.
  bool is_waiting = false;
  bool is_on_floor = false;  ///< at the end, with `SlideOptions::floor`
  DVec3 floor_normal{0.0};   ///< normal of that floor
  /// The contact with that floor: the voxel, and the instance, which may carry the body (`transformed_point`).
  SweepHit floor;
  /// All contacts in order, except a floor that supports the body from start to end.
  std::vector<SlideContact> contacts;
  int sweeps = 0;  ///< number of sweeps of the move, which are its cost
};

/// Moves a box or a capsule and slides it along obstacles. At a face, the displacement into the face is dropped; in a
/// crease of two faces, only the displacement along the crease remains; in a corner, none does.
///
/// With `SlideOptions::floor`, a body on a floor keeps the horizontal part of its displacement and follows the ground
/// up and down. Its downward part is dropped, so the body stands still on a slope, and the resulting displacement is
/// horizontal. A standing body treats steeper surfaces as walls and does not climb them; a falling body slides down
/// along them. An upward displacement leaves the floor. Add gravity to the displacement every frame.
///
/// Requires: `max_contacts` is at least 1.
/// Cost:     a sweep per contact, `max_contacts` at most. With a floor, two more, and five per attempted step, at most.
///           A step that failed is not attempted again at the same position and wall.
/// Threads:  any number of threads may call it at once while the tracer is not updated.
[[nodiscard]] SlideResult move_and_slide(const SceneTracer& tracer, const OrientedBox& box, DVec3 displacement,
                                         const SlideOptions& options = {});
[[nodiscard]] SlideResult move_and_slide(const SceneTracer& tracer, const Capsule& capsule, DVec3 displacement,
                                         const SlideOptions& options = {});
/// As above. Replaces `result`, and keeps the memory of its contacts: for bodies that move in each frame.
void move_and_slide(const SceneTracer& tracer, const OrientedBox& box, DVec3 displacement, const SlideOptions& options,
                    SlideResult& result);
void move_and_slide(const SceneTracer& tracer, const Capsule& capsule, DVec3 displacement, const SlideOptions& options,
                    SlideResult& result);

}  // namespace quoin
