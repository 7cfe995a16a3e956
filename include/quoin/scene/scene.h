#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>

#include <quoin/core/changes.h>
#include <quoin/core/slot_map.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/scene/environment.h>

namespace [[gnu::visibility("default")]] quoin {

/// A point or spot light without geometry. Emissive voxels also light surfaces, but are not lamps.
///
/// Intensity falls off with the squared distance, times 1 - (distance / range)^4, as glTF's KHR_lights_punctual
/// recommends. The same cut-off also ends the light at the distance where the lamp would add less than 1/4096. A lamp
/// gives no light if its intensity or range is not positive, if its position, colour or intensity is not finite, or,
/// for a spot, if its direction is zero or its direction or angles are not finite.
struct Lamp {
  enum class Kind : std::uint8_t {
    Point,  ///< shines equally in all directions
    Spot,   ///< shines in a cone around `direction`
  };
  std::string name{};
  Kind kind = Kind::Point;
  DVec3 position{0.0};              ///< world units
  DVec3 direction{0.0, -1.0, 0.0};  ///< axis of a spot's cone; any non-zero length
  Vec3 colour{1.0F};                ///< linear
  double intensity = 1.0;           ///< light received by a white surface that faces the lamp at 1 world unit
  double range = std::numeric_limits<double>::infinity();  ///< world units
  double inner_angle_radians = 0.0;                        ///< full brightness within this angle of the spot's axis
  double outer_angle_radians = 0.785398163;                ///< dark beyond this angle of the spot's axis; up to pi

  bool operator==(const Lamp&) const = default;
};

/// A grid in a scene: voxels, a density field, or both in one space. Field sample (i, j, k) lies at the point (i, j,
/// k), the minimum corner of voxel (i, j, k).
struct SceneGrid {
  std::string name{};
  Grid grid{};  ///< the voxels
  /// The centre of rotation, in voxels; instances place it at Instance::position.
  DVec3 pivot{0.0};
  /// The box that the file declares for the grid (an artist's canvas), in voxels; empty if there is none. Edits may
  /// place voxels outside it; `declared_box` includes them.
  IBox canvas{};
  /// The density field. Its materials are types in the scene's registry. Ray renderers see through transparent
  /// materials. Where transparent and opaque material meet inside the solid, samples on both sides store the distance
  /// to their shared border. A field whose samples are voxel centres (`field_from_grid`, `distance_field`) needs its
  /// own SceneGrid, with a pivot that is 0.5 lower on each axis than the voxels' pivot.
  DensityGrid field = DensityGrid();
  /// World files (.quoin) leave out the grid and its instances if false: see `is_saved`. Must stay true for a grid that
  /// StreamedWorld streams.
  bool saved = true;
  /// Stored in world files. If true, StreamedWorld loads all of the grid when it opens the file; if false, it loads
  /// only the chunks near viewers. Set it for small grids: props, vehicles. Grids that the program adds to the scene of
  /// a StreamedWorld (Scene::add_grid) are stored with `whole` set.
  bool whole = false;

  /// Returns the smallest integer box around the voxels and the field's solid; empty if there are none.
  [[nodiscard]] IBox bounds() const { return unite(grid.bounds(), field.bounds()); }
  /// Returns the union of the canvas and the tight bounds.
  [[nodiscard]] IBox declared_box() const { return unite(canvas, bounds()); }
};

using GridHandle = Handle<SceneGrid>;

struct SceneGroup;
struct SceneLayer;
using GroupHandle = Handle<SceneGroup>;
using LayerHandle = Handle<SceneLayer>;

/// One placement of a grid in the world. Moving an instance changes no voxels and no meshes. An instance with an
/// invalid transform (see `has_valid_transform`) is left out of images, queries and bounds.
struct Instance {
  std::string name{};
  GridHandle grid{};
  DVec3 position{0.0};  ///< world position of the grid's pivot
  /// World from grid. Any length: readers normalise it, and treat zero as no rotation.
  DQuat rotation{1.0, 0.0, 0.0, 0.0};
  double voxel_size = 1.0;  ///< world units per voxel; positive
  bool mirrored = false;    ///< negates the grid's x (about the pivot) before the rotation
  bool visible = true;      ///< the instance's own flag; `is_shown` also checks its groups and layers
  GroupHandle group = {};   ///< parent group; an invalid handle: the top level
  LayerHandle layer = {};   ///< layer; an invalid handle: no layer
  /// Category bits defined by the game (terrain, ships, player property) that queries select by: see QueryFilter.
  std::uint32_t categories = 1;
  bool saved = true;  ///< the instance's own flag: world files (.quoin) leave it out if false; see `is_saved`
};

using InstanceHandle = Handle<Instance>;

/// A node of the scene hierarchy, which contains instances and groups. All transforms are in world space, so a group's
/// transform only defines its frame for editing tools. `move_group` moves a group with everything below it.
struct SceneGroup {
  std::string name{};
  GroupHandle parent = {};             ///< parent group; an invalid handle: the top level
  LayerHandle layer = {};              ///< layer of the group and everything below it
  DVec3 position{0.0};                 ///< of the group's frame, in world units
  DQuat rotation{1.0, 0.0, 0.0, 0.0};  ///< world from group; see Instance::rotation
  bool mirrored = false;               ///< see Instance::mirrored
  bool visible = true;                 ///< false hides everything below the group
  bool saved = true;                   ///< if false, world files leave out the group and everything below it
};

/// A layer: groups and instances that are shown or hidden together, independent of the hierarchy.
struct SceneLayer {
  std::string name{};
  bool visible = true;
};

/// Selects the instances that a function processes.
enum class InstanceFilter : std::uint8_t {
  Visible,  ///< only instances that pass `is_shown`
  All,      ///< all instances, including hidden ones
};

/// The changes in a scene, in handle order without duplicates. The lists include removed objects, whose handles are no
/// longer valid.
struct SceneChanges {
  bool all = false;               ///< true if anything may have changed; the lists are then empty
  std::vector<GridHandle> grids;  ///< added, removed or edited grids, and grids with other changed settings
  /// Added, removed or changed instances, and instances below a changed group or on a changed layer.
  std::vector<InstanceHandle> instances;
  std::vector<GroupHandle> groups;  ///< added, removed or changed groups
  std::vector<LayerHandle> layers;  ///< added, removed or changed layers

  [[nodiscard]] bool empty() const {
    return !all && grids.empty() && instances.empty() && groups.empty() && layers.empty();
  }
};

/// Grids, the instances that place them in the world, and the voxel types that all grids share. Each grid may be placed
/// any number of times.
///
/// Axes:      right-handed, +Y up; one world unit per voxel unless an instance sets another size.
/// Addresses: a grid keeps its address until it is removed, even when the scene is moved, so references stay valid.
/// Threads:   any number of threads may read and take snapshots at once. Changes, including `edit`, need exclusive
///            access. Exception: grids whose references were taken earlier may be edited in parallel, each by one
///            thread. A snapshot is an independent scene.
/// Moving:    a moved-from scene may only be assigned to or destroyed.
class Scene {
 public:
  VoxelRegistry types;
  /// Lights without geometry. LightOptions::max_lamps limits how many of them and of the emissive voxels light a
  /// surface. Renderers apply changes to this list at their next `update`.
  std::vector<Lamp> lamps;
  /// Sun, sky, fog, ground, exposure and tone. Renderers apply changes at their next `update`. See
  /// `environment_of`.
  std::optional<Environment> environment;

  Scene();
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;
  ~Scene();
  /// Returns a copy of the scene as it is now. The two are independent. A cursor of one is also valid in the other
  /// until the snapshot itself is changed.
  /// Cost: one pointer per grid and a copy of each instance; well below 1 microsecond each, at any grid size.
  [[nodiscard]] Scene snapshot() const;
  // For Quoin's own sources.
  /// Brings an earlier snapshot of this scene up to date; a snapshot that was changed, or of another scene, becomes a
  /// new one. `changes` is only used for its memory. If it throws, the snapshot may only be assigned to or destroyed.
  /// Cost: O(changes since the snapshot), as `changes_since`, O(lamps) and O(handles of removed objects); O(types) if
  /// types changed.
  [[gnu::visibility("hidden")]] void update_snapshot(Scene& snapshot, SceneChanges& changes) const;

  /// Adds a grid, which the scene then owns. The grid is visible only where an instance places it.
  GridHandle add_grid(SceneGrid grid);
  /// Adds an instance. An instance with an invalid `grid` handle is stored but ignored by renderers and queries.
  InstanceHandle add_instance(Instance instance);
  /// Removes the grid and all its instances. Returns false if the handle is invalid, as do all remove functions.
  /// Cost: O(instances).
  bool remove_grid(GridHandle handle);
  bool remove_instance(InstanceHandle handle);

  /// Adds a group or a layer. It is empty until instances refer to it.
  GroupHandle add_group(SceneGroup group);
  LayerHandle add_layer(SceneLayer layer);
  /// Removes the group; its children move to its parent group. Cost: O(instances and groups).
  bool remove_group(GroupHandle handle);
  /// Removes the layer; its members then have no layer. Cost: O(instances and groups).
  bool remove_layer(LayerHandle handle);

  [[nodiscard]] const SlotMap<SceneGrid>& grids() const { return grids_; }
  [[nodiscard]] const SlotMap<Instance>& instances() const { return instances_; }
  [[nodiscard]] const SlotMap<SceneGroup>& groups() const { return groups_; }
  [[nodiscard]] const SlotMap<SceneLayer>& layers() const { return layers_; }
  /// Returns a grid for editing, now or later. The scene detects every later edit of its voxels and field. This call
  /// itself records changes of the other members, so make those before the next `changes_since`.
  /// Requires: the handle is valid. Lifetime: until the grid is removed, even when the scene is moved.
  [[nodiscard]] SceneGrid& edit(GridHandle handle);
  /// Returns an instance for editing and records the change. Change it before the next `changes_since`.
  /// Requires: the handle is valid. Lifetime: until the instance is removed, even when the scene is moved.
  [[nodiscard]] Instance& edit(InstanceHandle handle);
  /// Returns a group or a layer for editing and records the change. Change it before the next `changes_since`. Groups
  /// whose parents form a cycle count as top-level groups.
  /// Requires: the handle is valid. Lifetime: until it is removed, even when the scene is moved.
  [[nodiscard]] SceneGroup& edit(GroupHandle handle);
  [[nodiscard]] SceneLayer& edit(LayerHandle handle);

  /// Returns the changes since the cursor's last call and advances the cursor. For changed chunks, call the grid's own
  /// `changes_since`; for changed types, `types.changes_since`.
  /// Cost: O(changed grids and instances), at any scene size; O(all instances) after a change of a group or a layer.
  ///       See ChangeCursor.
  [[nodiscard]] SceneChanges changes_since(ChangeCursor& cursor) const;
  /// As above. Replaces `changes`, and keeps its memory.
  void changes_since(ChangeCursor& cursor, SceneChanges& changes) const;
  /// Returns true if `changes_since` would report a change. It does not report changes of `types`, which have their own
  /// journal, or of `lamps` and `environment`. Cost: as `changes_since`.
  [[nodiscard]] bool has_changed_since(const ChangeCursor& cursor) const;
  /// Returns a cursor that reports all changes from now on.
  [[nodiscard]] ChangeCursor cursor() const;

  /// Returns the number of non-air voxels in all grids, without fields. A grid that is placed several times counts
  /// once.
  [[nodiscard]] std::int64_t voxel_count() const;

  /// Returns the world-space box around the tight bounds (SceneGrid::bounds) of every grid placed by an instance that
  /// passes `filter`; empty if there is none.
  [[nodiscard]] DBox bounds(InstanceFilter filter = InstanceFilter::Visible) const;

 private:
  struct [[gnu::visibility("hidden")]] Book;
  [[gnu::visibility("hidden")]] Scene(const VoxelRegistry& with_types, std::unique_ptr<Book> book);
  [[nodiscard]] Book& book() const;
  [[nodiscard]] std::size_t keys() const;
  SlotMap<SceneGrid> grids_;
  SlotMap<Instance> instances_;
  SlotMap<SceneGroup> groups_;
  SlotMap<SceneLayer> layers_;
  std::unique_ptr<Book> book_;
};

/// Returns the scene's environment, or Environment::reference() if it has none.
[[nodiscard]] const Environment& environment_of(const Scene& scene);

/// Returns true if an instance, its layer, its parent groups and their layers are all visible.
/// Cost: O(parent groups).
[[nodiscard]] bool is_shown(const Scene& scene, const Instance& instance);
/// Returns true if a group, its layer, its parent groups and their layers are all visible.
[[nodiscard]] bool is_shown(const Scene& scene, const SceneGroup& group);

/// Returns true if world files (.quoin) hold an instance: it, its grid and its parent groups are all marked as saved.
/// Other formats write all instances. A change of a mark adds or removes its objects at the next save.
/// Cost: O(parent groups).
[[nodiscard]] bool is_saved(const Scene& scene, const Instance& instance);
/// Returns true if a group and its parent groups are all marked as saved.
[[nodiscard]] bool is_saved(const Scene& scene, const SceneGroup& group);

/// Sets `visible` of every instance, group and layer. Cost: O(instances, groups and layers).
void show_all(Scene& scene);

/// Returns true if the filter accepts an instance.
[[nodiscard]] inline bool passes(InstanceFilter filter, const Scene& scene, const Instance& instance) {
  return filter == InstanceFilter::All || is_shown(scene, instance);
}

/// Returns a group's parent. The handle is invalid for top-level groups, for groups with a missing parent, and for
/// groups that are part of a cycle. Cost: O(parent groups).
[[nodiscard]] GroupHandle parent_of(const Scene& scene, GroupHandle group);

/// Returns all groups, parents before children, otherwise in handle order.
/// Cost: O(groups * depth).
[[nodiscard]] std::vector<GroupHandle> groups_from_top(const Scene& scene);

/// Moves a group to a new position and rotation, together with everything below it.
///
/// Requires: the handle is valid; the group's old and new rotation are finite and not zero.
/// Cost:     O(instances and groups).
void move_group(Scene& scene, GroupHandle group, DVec3 position, const DQuat& rotation);

/// Returns true if an instance has a valid transform: all numbers are finite and the voxel size is positive.
[[nodiscard]] bool has_valid_transform(const Instance& instance);

/// Returns true if an instance's grid exists and `filter` accepts the instance. Does not check the transform.
[[nodiscard]] bool is_drawn(const Scene& scene, const Instance& instance, InstanceFilter filter);
/// Returns the grids that drawn instances place, each once, in handle order. Cost: O(instances).
[[nodiscard]] std::vector<GridHandle> drawn_grids(const Scene& scene, InstanceFilter filter);

/// Returns the grid's axes in the world, as columns: the rotation after the mirror, without the voxels' size. Exact for
/// quarter turns, whose quaternions hold the irrational square root of one half.
[[nodiscard]] glm::dmat3 world_axes(const DQuat& rotation, bool mirrored);
[[nodiscard]] inline glm::dmat3 world_axes(const Instance& instance) {
  return world_axes(instance.rotation, instance.mirrored);
}
/// Transforms a point from the instance's grid (voxels) to the world.
[[nodiscard]] DVec3 world_from_grid(const Instance& instance, const SceneGrid& grid, DVec3 point_in_grid);
/// Returns the matrix that transforms points from the instance's grid (voxels) to the world. The determinant is
/// negative for a mirrored instance, which flips triangle winding. For a shader, first subtract the camera's position
/// from the last column in double: far from the origin, floats cannot separate neighbouring voxels.
[[nodiscard]] glm::dmat4 world_from_grid(const Instance& instance, const SceneGrid& grid);
/// Transforms a point from the world to the instance's grid (voxels): the inverse of `world_from_grid`, to rounding.
/// Returns NaN in every component if the instance has no valid transform (`has_valid_transform`).
[[nodiscard]] DVec3 grid_from_world(const Instance& instance, const SceneGrid& grid, DVec3 point_in_world);
/// Transforms a displacement between the instance's grid (voxels) and the world (world units). Rotation, mirroring and
/// scale apply; translation does not. grid_from_world_direction returns NaN if the instance has no valid transform.
[[nodiscard]] DVec3 world_from_grid_direction(const Instance& instance, DVec3 direction_in_grid);
[[nodiscard]] DVec3 grid_from_world_direction(const Instance& instance, DVec3 direction_in_world);
/// Returns the new world position of a point fixed to an instance that moves from `before` to `after`. Call it each
/// frame to carry bodies on a lift or a turning ship. Returns the point unchanged if either transform is invalid.
[[nodiscard]] DVec3 transformed_point(const Instance& before, const Instance& after, DVec3 point_in_world);
/// Returns the voxel (air included) that contains a world point. A point on a border belongs to the voxel with the
/// greater coordinate on that axis. Returns nullopt if the instance has no valid transform, the point is not finite, or
/// the voxel's coordinates do not fit in int32.
[[nodiscard]] std::optional<IVec3> voxel_from_world(const Instance& instance, const SceneGrid& grid,
                                                    DVec3 point_in_world);

// Edits of a scene's voxels by shapes in world space. To edit fields, use DensityGrid's own functions, with positions
// from `grid_from_world`. The edits go through Scene::edit, so the change journals of scene and grid record them. An
// edit of a grid shows in all its instances.
//
// Requires: the handle names an instance of the scene, and the scene contains the instance's grid.
// Invalid:  does nothing and returns false or 0 if the instance has no valid transform (`has_valid_transform`), or a
//           number of the shape is negative or not finite.

/// Sets the voxel that contains a world point (see `voxel_from_world`). Returns true if its type changed.
bool set_voxel(Scene& scene, InstanceHandle instance, DVec3 point_in_world, VoxelType type);

/// Sets the voxels of an instance's grid whose centres are within `radius` (world units) of `centre_in_world`, like
/// Grid::fill_sphere in grid space. Returns the number of changed voxels.
/// Cost: O(voxels of the box around the sphere); for air, only those in existing chunks.
std::int64_t fill_sphere(Scene& scene, InstanceHandle instance, DVec3 centre_in_world, double radius, VoxelType type);

/// Sets the voxels of an instance's grid whose centres lie inside a world-space box or on its surface, to the
/// rounding of doubles. Returns the number of changed voxels.
/// Cost: O(rows of 64 voxels in the chunks at the box's surface + chunks inside it); for air, only existing chunks. A
///       long rotated box costs only the chunks that it crosses.
std::int64_t fill_box(Scene& scene, InstanceHandle instance, const OrientedBox& box_in_world, VoxelType type);

}  // namespace quoin
