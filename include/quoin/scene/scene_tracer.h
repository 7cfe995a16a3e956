#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include <glm/mat3x3.hpp>

#include <quoin/core/parallel.h>
#include <quoin/core/vec.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>
#include <quoin/trace/occupancy_tree.h>
#include <quoin/trace/packet.h>
#include <quoin/trace/ray.h>

namespace quoin {

/// A grid in the place that an instance gives it, ready to be traced. Instances of one grid share its trees.
struct PlacedGrid {
  InstanceHandle instance;
  const SceneGrid* grid = nullptr;  ///< as the scene holds it
  const Grid* voxels = nullptr;     ///< what is traced: its voxels, or what is left of them once halved
  DVec3 pivot{0.0};                 ///< in the coordinates of `voxels`
  const OccupancyTree* opaque = nullptr;
  const OccupancyTree* transparent = nullptr;  ///< null when the grid has no transparent voxel
  glm::dmat3 world_axes{1.0};  ///< columns: the grid's axes in the world, unit; a mirrored instance's x is negated
  DVec3 position{0.0};         ///< of the grid's pivot, in the world
  double voxel_size = 1.0;     ///< world units a voxel of `voxels`
  Detail detail = Detail::Near;
  int halvings = 0;  ///< how often `voxels` was halved

  /// How many voxels of the full grid a voxel of `voxels` spans.
  [[nodiscard]] double voxels_per_cell() const { return std::ldexp(1.0, halvings); }
};

/// The traversal structures of a scene's instances.
class SceneTracer {
 public:
  /// `scene` must outlive it in its place; after an edit of it `update` comes before anything else. Left out are
  /// instances that are not visible, unless `hidden`; empty grids; and instances whose numbers are not finite or whose
  /// size is not positive.
  /// Cost: O(chunks of the grids that are placed), on several threads.
  explicit SceneTracer(const Scene& scene, bool hidden = false, Threads threads = {});
  SceneTracer(SceneTracer&&) noexcept;
  SceneTracer& operator=(SceneTracer&&) noexcept;
  ~SceneTracer();

  /// Brings it up to date with its scene, whatever happened to that: instances that came, went, moved, turned, showed
  /// or hid; grids that came, went, were edited or replaced; types that became transparent or opaque. Then it is as one
  /// that was built anew. Returns whether grids that are traced, or their types' transparency, are other than before:
  /// what was made of them is then out of date.
  ///
  /// Requires: nothing reads it meanwhile. SceneViews of it and what `with_detail` returned are good no longer.
  /// Cost:     of what changed: OccupancyTree::update for the chunks of a grid that is placed; of its halved ones only
  ///           what the edit can have changed, when they are next asked for. For an instance that moved: its transform,
  ///           and its share of the tree of instances, which is built anew, O(n log n), when instances come or go or
  ///           have moved far. A look at all instances when the bounds of a grid change.
  ///           A change of a type's transparency: all trees that hold such voxels.
  /// Threads:  grids are updated on several.
  bool update(Threads threads = {});

  /// The same instances, those of `selected` in their detail: Mid and Far ones as grids halved that often, or less
  /// often where that would change the volume of their voxels by more than an eighth. The others, which are out of the
  /// picture but may cast shadows into it, stay as they are.
  ///
  /// This one must outlive the result, without an update; the result cannot be updated itself but becomes a tracer of
  /// whole grids by that. It keeps the halved grids, so that only the first picture pays for them.
  /// Threads: any number may call at once.
  [[nodiscard]] SceneTracer with_detail(std::span<const SelectedInstance> selected, Threads threads = {}) const;

  /// In the order of the instances' handles.
  [[nodiscard]] const std::vector<PlacedGrid>& placed() const;
  [[nodiscard]] bool has_transparent() const;

 private:
  friend class SceneView;
  friend class SceneQuery;
  struct Impl;
  explicit SceneTracer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// What a packet of rays met in a scene; lanes whose bit in `grids.hit` is not set hold nothing of meaning.
struct SceneHits {
  PacketHits grids;                         ///< voxels and faces in the grid, distances of the packet's rays
  RayPacket::Lanes<std::int32_t> placed{};  ///< index into SceneTracer::placed
};

/// A transparent voxel on a ray.
struct TransparentSpan {
  VoxelSpan span;
  std::int32_t placed = 0;
};

/// Traces rays through a scene, relative to a point near which they are.
///
/// Spaces: view, the world's axes and units with `origin` in the middle, so that rays are as exact 10^9 away from the
///         world's origin as near it; and grid, PlacedGrid::voxels of a placed grid. A ray's t is the same number in
///         both.
/// Threads: any number may trace at once.
class SceneView {
 public:
  /// `tracer` must outlive it. Cost: O(instances).
  SceneView(const SceneTracer& tracer, DVec3 origin);
  SceneView(SceneView&&) noexcept;
  SceneView& operator=(SceneView&&) noexcept;
  ~SceneView();

  [[nodiscard]] const SceneTracer& tracer() const;

  /// From now on `first_hits` passes through these (indices into SceneTracer::placed), which are drawn in another way.
  /// They still stop other rays. Cost: O(instances * log instances).
  void leave_to_impostors(std::span<const std::int32_t> placed);

  /// The nearest opaque voxel of all instances for each ray, in view space; of equally near ones the instance that
  /// comes first.
  void first_hits(const RayPacket& rays_in_view, SceneHits& hits) const;

  /// Which rays meet an opaque voxel of any instance. They are in the space of grid `home`, which is asked first.
  [[nodiscard]] std::uint32_t any_hits(std::int32_t home, const RayPacket& rays_in_grid) const;

  /// Which rays meet a transparent voxel of any instance.
  [[nodiscard]] std::uint32_t any_transparent(const RayPacket& rays_in_view) const;

  /// Calls `visit` for every transparent voxel that one ray passes: instance by instance, each in the ray's order.
  /// What `visit` answers false to is the end of that instance.
  void visit_transparent(const Ray& ray_in_view, double max_t,
                         const std::function<bool(const TransparentSpan&)>& visit) const;

  [[nodiscard]] DVec3 grid_from_view(std::int32_t placed, DVec3 point_in_view) const;
  [[nodiscard]] RayPacket view_from_grid(std::int32_t placed, const RayPacket& rays_in_grid) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
