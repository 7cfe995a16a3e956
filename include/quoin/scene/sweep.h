#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <quoin/core/shapes.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_query.h>
#include <quoin/scene/scene_tracer.h>

namespace quoin {

/// Where a moving box first meets a voxel or the solid of a field.
struct SweepHit {
  double fraction = 0.0;  ///< of the displacement, 0 to 1; 0 when it starts inside
  /// In the world, unit, out of what is met, towards the box. Of a field what parts the two at the contact: the
  /// field's gradient where a corner of the box meets it, less what of it runs along an edge where that does, and of a
  /// face of the box that comes to lie on a peak the face's own.
  DVec3 normal{0.0};
  InstanceHandle instance;
  IVec3 voxel{0};         ///< of a field the cell, as in DensityHit
  double depth = 0.0;     ///< how deep it starts inside, in world units along `normal`; 0 when it does not
  VoxelType type = kAir;  ///< of a field the material
  bool in_field = false;
  /// A chunk that is not loaded (QueryFilter::unloaded): `voxel` is its first one, `type` air.
  bool is_unloaded = false;
};

/// The first voxel that a box meets on its way, or the first point at which the field of an instance is negative,
/// however fast it is; of types that collide (VoxelProperties::collides), unless `filter` says others.
///
/// The box keeps its rotation; grids stand still, in any rotation. Touching is not meeting: a box may slide along a
/// face. Of voxels met at once the one with an exposed face counts. Numbers that are not finite meet nothing. Sizes of
/// 0 make it a plate, a rod or a point.
///
/// Fields: a cell's solid collides where the material of any of its solid samples does; solid without a material does.
///         The box stops before it or touching it, less than 1e-5 voxels away, whatever the densities mean; less than
///         1e-6 voxels deep is touching. Where bounds do not tell within 4,000 parts of cells (a large box that lies
///         almost flush on an uneven surface), it stops at the first that is open, up to a part's size away.
/// Partial: chunks that are not loaded stop it, unless `filter` says others.
/// Inside: of a field's solid the way out is along the gradient where the box is deepest, and `depth` leads out of all
///         of that field that is about the box; of what is nowhere near a surface it leads a voxel on.
/// Cost:   for each instance on the way, the voxels about the box for each step of its own size; of a field those that
///         hold solid, and the more parts of these the nearer the box comes to lie along the surface.
/// Source: the separating axes of two boxes (S. Gottschalk, M. Lin, D. Manocha, "OBBTree", 1996), each with the times
///         at which they begin and cease to part them; in a field of the box and what lies below planes under the
///         trilinear field, halved until these are near enough to it.
[[nodiscard]] std::optional<SweepHit> sweep_box(const SceneTracer& tracer, const OrientedBox& box, DVec3 displacement,
                                                const QueryFilter& filter = {});

/// The same for a capsule or a ball: it slides over edges and small steps where a box catches. `depth` is how far it is
/// to where it is out of the voxel that it is deepest in.
///
/// Exact: to 1e-9 voxels among voxels, whatever their rotation; in fields as a box, and the normal is that of what is
///        round: from where it is met to its line.
/// Source: the distance of two convex bodies is convex in time; Newton's method from the start.
[[nodiscard]] std::optional<SweepHit> sweep_capsule(const SceneTracer& tracer, const Capsule& capsule,
                                                    DVec3 displacement, const QueryFilter& filter = {});

/// The displacement, in the world, that takes a shape to the nearest place where it meets nothing: 0 where it meets
/// nothing; nothing where there is no such place within `max_distance`, world units.
///
/// Exact:  of a box among voxels whose axes are its own, the nearest such place, gaps that are as wide as the box
///         included; of several that are as near, one.
/// Others: among grids that are turned against the box, and of fields, and of a capsule, a place at most
///         max_distance / 32 farther away than the nearest, and surely one where there is that much room.
/// Cost:   an overlap query for each place that is nearer: some hundred of them for a box of the size of a voxel and
///         twice that distance.
/// Errors: sizes, places and distances that are not finite, or below 0, have none.
[[nodiscard]] std::optional<DVec3> displacement_to_free_place(const SceneTracer& tracer, const OrientedBox& box,
                                                              double max_distance, const QueryFilter& filter = {});
[[nodiscard]] std::optional<DVec3> displacement_to_free_place(const SceneTracer& tracer, const Capsule& capsule,
                                                              double max_distance, const QueryFilter& filter = {});

/// How a body that walks stands: on floors, which are whatever is no steeper than `max_slope_degrees`.
struct FloorOptions {
  DVec3 up{0.0, 1.0, 0.0};          ///< in the world, of any length; where it is 0 or not finite nothing is a floor
  double max_slope_degrees = 45.0;  ///< from level
  /// How high an obstacle may be that is stepped onto, world units; 0: none. There must be a floor on it, or within
  /// half of the box's width beyond its edge, and room for the box above.
  double step_height = 0.0;
  /// How far below its feet a box that stood on a floor finds the next one, world units: it walks down slopes and steps
  /// without leaving the ground; 0: it falls.
  double snap_distance = 0.0;
};

struct SlideOptions {
  /// The gap that is left in front of what is met, world units: what rounding may not bridge.
  double skin = 1e-3;
  int max_contacts = 5;  ///< after which what is left of the displacement is dropped
  /// A box that starts inside is moved out first: of a field's solid along the gradient where that leads out, else by
  /// the `displacement_to_free_place`. Without, and where there is none, it stays where it is: `is_blocked`, with the
  /// displacement as it was.
  bool pushes_out = true;
  /// How far that may be, world units; nothing: the longest edge of the box, and the way out of what it is in.
  std::optional<double> max_push_out = std::nullopt;
  std::optional<FloorOptions> floor = std::nullopt;  ///< nothing: a body that slides, whatever it lies on
  QueryFilter filter{};                              ///< what the body meets at all
};

/// What a moving body met.
struct SlideContact {
  enum class Kind : std::uint8_t {
    Floor,     ///< with `SlideOptions::floor`: no steeper than that says
    Wall,      ///< anything else
    Ceiling,   ///< with `SlideOptions::floor`: what would be a floor from the other side
    Inside,    ///< it started in there, and was moved out if it could be
    Unloaded,  ///< a chunk that is not loaded: no floor, whatever its direction
  };
  Kind kind = Kind::Wall;
  SweepHit hit;  ///< `fraction` is of the part of the way that was left then
};

struct SlideResult {
  DVec3 centre{0.0};        ///< where the box ends
  DVec3 displacement{0.0};  ///< without what went into the contacts: over the time step, the velocity to go on with
  bool is_blocked = false;  ///< whether anything was met; with `SlideOptions::floor`, anything but a floor
  DVec3 normal{0.0};        ///< of the last such contact
  /// What is not loaded was in its way. Where it starts in there it stays, with no displacement, until that is loaded.
  bool is_waiting = false;
  bool is_on_floor = false;  ///< at the end, with `SlideOptions::floor`
  DVec3 floor_normal{0.0};   ///< of that floor
  SweepHit floor;            ///< what it stands on then: the instance, which may carry it (`carried_point`), the voxel
  /// Whatever it met on its way, in that order; a floor that it stood on from the start and still does is not among
  /// them.
  std::vector<SlideContact> contacts;
};

/// Moves a box or a capsule and lets it slide along what it meets: what goes into a face is dropped,
/// in a crease of two faces what does not run along it, in a corner all.
///
/// With a floor: on one the box keeps the level part of its displacement, and goes up and down with the ground; what
/// points down is dropped, so that it stands still on a slope, and what is left in the result is level. What is steeper
/// is a wall to it while it stands: it does not climb it; when it falls it slides down along it. A displacement that
/// points up leaves the floor. Gravity belongs to the displacement in every frame.
///
/// Requires: `max_contacts` is at least 1.
/// Cost:    a sweep for each contact, `max_contacts` at most. With a floor two more, and four for an attempt to step.
/// Threads: any number may ask at once, while the tracer is not updated.
[[nodiscard]] SlideResult move_and_slide(const SceneTracer& tracer, const OrientedBox& box, DVec3 displacement,
                                         const SlideOptions& options = {});
[[nodiscard]] SlideResult move_and_slide(const SceneTracer& tracer, const Capsule& capsule, DVec3 displacement,
                                         const SlideOptions& options = {});

}  // namespace quoin
