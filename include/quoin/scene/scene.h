#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>

#include <quoin/core/changes.h>
#include <quoin/core/slot_map.h>
#include <quoin/core/vec.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

namespace quoin {

/// A light without a body, at a point of the world. Voxels that emit light are lamps by themselves.
///
/// Falls off with the square of the distance, times 1 - (distance / range)^4, as KHR_lights_punctual of glTF
/// recommends; where it would add less than 1/4096 before its range is over, it ends there in the same way. A lamp
/// whose numbers are not finite (but the range), or whose intensity is not positive, lights nothing.
struct Lamp {
  enum class Kind : std::uint8_t {
    Point,  ///< shines into all directions alike
    Spot,   ///< into a cone around `direction`
  };
  std::string name{};
  Kind kind = Kind::Point;
  DVec3 position{0.0};              ///< world units
  DVec3 direction{0.0, -1.0, 0.0};  ///< of a spot's middle; any length but 0
  Vec3 colour{1.0F};                ///< linear
  double intensity = 1.0;           ///< the light of a white surface that faces it 1 world unit away
  double range = std::numeric_limits<double>::infinity();  ///< world units
  double inner_angle_radians = 0.0;                        ///< from a spot's middle, up to which it is at its brightest
  double outer_angle_radians = 0.785398163;                ///< and from which on it is dark; up to pi

  bool operator==(const Lamp&) const = default;
};

/// A grid as a scene holds it: blocks, a field of densities, or both in one space, in which sample (i, j, k) of the
/// field lies at the point (i, j, k), the least corner of voxel (i, j, k).
struct SceneGrid {
  std::string name{};
  Grid grid{};  ///< the voxels
  /// The point of the grid, in voxels, that an instance's position places and about which it turns.
  DVec3 pivot{0.0};
  /// The box that the file declares for it (an artist's canvas), in voxels; empty when none was declared. Voxels may
  /// lie outside after edits; `declared_box` says how large the grid counts as.
  IBox canvas{};
  /// The densities; its materials are types of the scene's registry. Pictures by rays see through transparent ones.
  /// Where transparent and opaque ones meet inside the solid, the samples of both hold the distance to that border.
  /// A field whose samples are voxels' centres (`field_from_grid`, `distance_field`) needs a grid of its own, whose
  /// pivot is 0.5 less along each axis than that of the voxels.
  DensityGrid field = DensityGrid();

  /// The smallest box of whole coordinates around the voxels and the field's solid; empty where there are none.
  [[nodiscard]] IBox bounds() const { return unite(grid.bounds(), field.bounds()); }
  /// The canvas and the tight bounds together.
  [[nodiscard]] IBox declared_box() const { return unite(canvas, bounds()); }
};

using GridHandle = Handle<SceneGrid>;

struct SceneGroup;
struct SceneLayer;
using GroupHandle = Handle<SceneGroup>;
using LayerHandle = Handle<SceneLayer>;

/// One placement of a grid in the world. Moving it touches no voxel and no mesh. One without a place (`has_place`) is
/// left out of pictures, queries and bounds.
struct Instance {
  std::string name{};
  GridHandle grid{};
  DVec3 position{0.0};  ///< of the grid's pivot, in world units
  /// World from grid. Of any length: what reads it makes it unit, and takes a zero one as no rotation.
  DQuat rotation{1.0, 0.0, 0.0, 0.0};
  double voxel_size = 1.0;  ///< world units a voxel; positive
  bool mirrored = false;    ///< the grid's x is negated (about the pivot) before the rotation
  bool visible = true;      ///< its own switch; `is_shown` says whether its groups and layers show it too
  GroupHandle group = {};   ///< that it belongs to; one that names nothing: it stands at the top
  LayerHandle layer = {};   ///< that it lies on; one that names nothing: on none
  /// Bits of a game's own meaning (terrain, ships, what the player owns), by which queries select: QueryFilter.
  std::uint32_t categories = 1;
};

using InstanceHandle = Handle<Instance>;

/// A node of a scene's hierarchy: instances and groups that belong together. Places of instances and groups are those
/// of the world, so a group's place says only where its own frame lies: the point and the turn that tools handle it by.
/// `move_group` moves a group with all that is below it.
struct SceneGroup {
  std::string name{};
  GroupHandle parent = {};             ///< that it belongs to; one that names nothing: it stands at the top
  LayerHandle layer = {};              ///< that it lies on, with all below it
  DVec3 position{0.0};                 ///< of its frame, in world units
  DQuat rotation{1.0, 0.0, 0.0, 0.0};  ///< world from group; as Instance::rotation
  bool mirrored = false;               ///< as Instance::mirrored
  bool visible = true;                 ///< false hides all below it
};

/// Groups and instances that are shown and hidden together, wherever they stand in the hierarchy.
struct SceneLayer {
  std::string name{};
  bool visible = true;
};

/// Which instances a function looks at.
enum class InstanceFilter : std::uint8_t {
  Visible,  ///< those that `is_shown`
  All,      ///< hidden ones too
};

/// What changed in a scene; in the order of the handles, each once. Those that were removed are among them: they name
/// nothing.
struct SceneChanges {
  bool all = false;               ///< anything may have changed; the lists are empty
  std::vector<GridHandle> grids;  ///< added, removed, edited, or with another name, pivot or canvas
  /// Added, removed, or changed; and those below groups and on layers that were.
  std::vector<InstanceHandle> instances;
  std::vector<GroupHandle> groups;  ///< added, removed, or changed
  std::vector<LayerHandle> layers;  ///< likewise

  [[nodiscard]] bool empty() const {
    return !all && grids.empty() && instances.empty() && groups.empty() && layers.empty();
  }
};

/// Many grids, placed any number of times each, that share one registry.
///
/// Axes:      right-handed, +Y up, one world unit a voxel unless an instance says otherwise.
/// Addresses: a grid stays where it is until it is removed, also when the scene is moved: a reference to it may be
///            kept.
/// Threads:   any number may read at once, and take snapshots; a change needs the scene to itself, `edit` too. But
///            grids to which references were taken before may be edited at once, each on one thread. A snapshot is a
///            scene of its own.
/// Moving:    a scene that was moved from may only be assigned to or destroyed.
class Scene {
 public:
  VoxelRegistry types;
  /// Lights without a body; voxels that emit light are lamps by themselves. LightOptions::max_lamps says whether they
  /// shine. Renderers take over what changed here with their next `update`.
  std::vector<Lamp> lamps;

  Scene();
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;
  ~Scene();
  /// The scene as it is now; later changes of either do not reach the other. Cursors that read this one's changes read
  /// on in the snapshot, and the other way round, until the snapshot is changed itself.
  /// Cost: a pointer a grid and a copy of each instance, well below a microsecond each, whatever the grids hold.
  [[nodiscard]] Scene snapshot() const;

  /// Takes a grid, which the scene owns from then on. It shows once an instance places it.
  GridHandle add_grid(SceneGrid grid);
  /// Places a grid. One whose `grid` names nothing is kept, and left out of all that looks at the scene.
  InstanceHandle add_instance(Instance instance);
  /// Removes the grid and every instance of it. Returns false when the handle names nothing, as all that remove.
  /// Cost: O(instances).
  bool remove_grid(GridHandle handle);
  bool remove_instance(InstanceHandle handle);

  /// Adds a group or a layer, empty until instances name it.
  GroupHandle add_group(SceneGroup group);
  LayerHandle add_layer(SceneLayer layer);
  /// Removes the group; what belonged to it belongs to its parent then. Cost: O(instances and groups).
  bool remove_group(GroupHandle handle);
  /// Removes the layer; what lay on it lies on none then. Cost: O(instances and groups).
  bool remove_layer(LayerHandle handle);

  [[nodiscard]] const SlotMap<SceneGrid>& grids() const { return grids_; }
  [[nodiscard]] const SlotMap<Instance>& instances() const { return instances_; }
  [[nodiscard]] const SlotMap<SceneGroup>& groups() const { return groups_; }
  [[nodiscard]] const SlotMap<SceneLayer>& layers() const { return layers_; }
  /// A grid, to be edited, now or later: the scene learns of every edit of its voxels and its field. Name, pivot and
  /// canvas are to be changed before the next `changes_since`, since this call is what records the change.
  /// Requires: the handle names a grid. Lifetime: until it is removed, also when the scene is moved.
  [[nodiscard]] SceneGrid& edit(GridHandle handle);
  /// An instance, to be changed before the next `changes_since`: this call is what records it.
  /// Requires: the handle names an instance. Lifetime: as that of a grid.
  [[nodiscard]] Instance& edit(InstanceHandle handle);
  /// A group or a layer, likewise. Groups that go round in a circle by their parents count as standing at the top.
  /// Requires: the handle names one. Lifetime: as that of a grid.
  [[nodiscard]] SceneGroup& edit(GroupHandle handle);
  [[nodiscard]] SceneLayer& edit(LayerHandle handle);

  /// What changed since the cursor's last time; moves the cursor to the present. Which of a grid's chunks changed its
  /// own `changes_since` tells, which types those of `types`.
  /// Cost: O(grids and instances that changed), whatever the size of the scene; where a group or a layer changed, O(all
  /// instances). See ChangeCursor.
  [[nodiscard]] SceneChanges changes_since(ChangeCursor& cursor) const;
  /// Whether that would tell of anything; of `types` they tell themselves. Cost: as `changes_since`.
  [[nodiscard]] bool has_changed_since(const ChangeCursor& cursor) const;
  /// A cursor at the present: it will be told what changes from now on.
  [[nodiscard]] ChangeCursor cursor() const;

  /// Non-air voxels of all grids, without their fields; a grid that is placed several times counts once.
  [[nodiscard]] std::int64_t voxel_count() const;

  /// The box around the tight bounds (SceneGrid::bounds) of every grid that an instance of `filter` places, in world
  /// units; empty when nothing is placed.
  [[nodiscard]] DBox bounds(InstanceFilter filter = InstanceFilter::Visible) const;

 private:
  struct Book;
  [[nodiscard]] Book& book() const;
  [[nodiscard]] std::size_t keys() const;
  SlotMap<SceneGrid> grids_;
  SlotMap<Instance> instances_;
  SlotMap<SceneGroup> groups_;
  SlotMap<SceneLayer> layers_;
  std::unique_ptr<Book> book_;
};

/// Whether an instance, and all that it belongs to, is visible: itself, its layer, its groups, and their layers.
/// Cost: O(groups above it).
[[nodiscard]] bool is_shown(const Scene& scene, const Instance& instance);
/// The same of a group.
[[nodiscard]] bool is_shown(const Scene& scene, const SceneGroup& group);

/// Whether an instance is among those of a filter.
[[nodiscard]] inline bool passes(InstanceFilter filter, const Scene& scene, const Instance& instance) {
  return filter == InstanceFilter::All || is_shown(scene, instance);
}

/// The group that a group belongs to; one that names nothing for those at the top, whose parent is not there, or that
/// are part of a circle. Cost: O(groups above it).
[[nodiscard]] GroupHandle parent_of(const Scene& scene, GroupHandle group);

/// All groups, each after the one that it belongs to, else in the order of their handles.
/// Cost: O(groups * depth).
[[nodiscard]] std::vector<GroupHandle> groups_from_top(const Scene& scene);

/// Gives a group another place, and moves what is below it with it.
///
/// Requires: the handle names a group; its rotation and the new one are finite and not zero.
/// Cost: O(instances and groups).
void move_group(Scene& scene, GroupHandle group, DVec3 position, const DQuat& rotation);

/// Whether an instance has a place: all its numbers are finite, and its voxels have a positive size.
[[nodiscard]] bool has_place(const Instance& instance);

/// Whether an instance is to be drawn: its grid exists, and `filter` lets it pass; whatever its numbers are.
[[nodiscard]] bool is_drawn(const Scene& scene, const Instance& instance, InstanceFilter filter);

/// A point of the instance's grid (voxels) in the world.
[[nodiscard]] DVec3 world_from_grid(const Instance& instance, const SceneGrid& grid, DVec3 point_in_grid);
/// The same for all points, as a matrix; a mirrored instance's has a negative determinant, so its triangles turn their
/// other side. For a shader subtract the camera's position from the last column in double first: far from the origin
/// floats cannot tell neighbouring voxels apart.
[[nodiscard]] glm::dmat4 world_from_grid(const Instance& instance, const SceneGrid& grid);
/// A point of the world in the instance's grid (voxels): the inverse of `world_from_grid`, to the rounding of the
/// point's own doubles. NaN in every component where the instance has no place (`has_place`).
[[nodiscard]] DVec3 grid_from_world(const Instance& instance, const SceneGrid& grid, DVec3 point_in_world);
/// A displacement in the instance's grid (voxels) as one in the world (world units): turned, mirrored and scaled, not
/// moved; and its inverse, NaN where the instance has no place.
[[nodiscard]] DVec3 world_from_grid_direction(const Instance& instance, DVec3 direction_in_grid);
[[nodiscard]] DVec3 grid_from_world_direction(const Instance& instance, DVec3 direction_in_world);
/// Where a point that is fixed to an instance goes when the instance goes from one placement to another: so what stands
/// on a lift or a turning ship is carried, frame by frame. The point itself where either is no place.
[[nodiscard]] DVec3 carried_point(const Instance& before, const Instance& after, DVec3 point_in_world);
/// The voxel that fills the place of a point of the world, whether it is air or not; of a point between two voxels the
/// greater one on each axis. Nothing where the instance has no place, the point is not finite, or the voxel's
/// coordinates are no int32.
[[nodiscard]] std::optional<IVec3> voxel_from_world(const Instance& instance, const SceneGrid& grid,
                                                    DVec3 point_in_world);

}  // namespace quoin
