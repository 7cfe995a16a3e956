#pragma once

#include <optional>

#include <quoin/scene/scene_query.h>

namespace quoin {

/// Where a moving box first meets a voxel.
struct SweepHit {
  double fraction = 0.0;  ///< of the displacement, 0 to 1; 0 when it starts inside
  DVec3 normal{0.0};      ///< in the world, unit, from the voxel towards the box
  InstanceHandle instance;
  IVec3 voxel{0};
  double depth = 0.0;  ///< how deep it starts inside, in world units along `normal`; 0 when it does not
};

/// The first colliding voxel (VoxelProperties::collides) that a box meets on its way, however fast it is.
///
/// The box keeps its rotation; grids stand still, in any rotation. Touching is not meeting: a box may slide along a
/// face. Of voxels met at once the one with an exposed face counts. Numbers that are not finite meet nothing.
///
/// Cost:   for each instance on the way, the voxels about the box for each step of its own size.
/// Source: the separating axes of two boxes (S. Gottschalk, M. Lin, D. Manocha, "OBBTree", 1996), each with the times
///         at which they begin and cease to part them.
[[nodiscard]] std::optional<SweepHit> sweep_box(const SceneTracer& tracer, const VoxelRegistry& types,
                                                const OrientedBox& box, DVec3 displacement);

struct SlideOptions {
  /// The gap that is left in front of what is met, world units: what rounding may not bridge.
  double skin = 1e-3;
  int max_contacts = 5;  ///< after which what is left of the displacement is dropped
  /// A box that starts inside is moved out first. Without, it stays where it is: `is_blocked`, with the displacement as
  /// it was.
  bool pushes_out = true;
};

struct SlideResult {
  DVec3 centre{0.0};        ///< where the box ends
  DVec3 displacement{0.0};  ///< without what went into the contacts: over the time step, the velocity to go on with
  bool is_blocked = false;  ///< whether anything was met
  DVec3 normal{0.0};        ///< of the last contact
};

/// Moves a box and lets it slide along what it meets: the part of the displacement that goes into a face is dropped, in
/// a crease of two faces what does not run along it, in a corner all.
///
/// Cost:    a sweep for each contact, `max_contacts` at most.
/// Threads: any number may ask at once, while the tracer is not updated.
[[nodiscard]] SlideResult move_and_slide(const SceneTracer& tracer, const VoxelRegistry& types, const OrientedBox& box,
                                         DVec3 displacement, const SlideOptions& options = {});

}  // namespace quoin
