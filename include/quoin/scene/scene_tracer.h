#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>

namespace [[gnu::visibility("default")]] quoin {

struct [[gnu::visibility("hidden")]] PlacedGrid;

/// The acceleration structures for tracing rays through a scene.
///
/// Lifetime: the scene must outlive the tracer and keep its address. After an edit of the scene, call `update` before
///           any other function.
class SceneTracer {
 public:
  /// Builds the structures for the instances that pass `filter`. Skips empty grids, and instances with a non-finite
  /// transform or a size that is not positive.
  /// Cost: O(chunks of the placed grids), on several threads.
  explicit SceneTracer(const Scene& scene, InstanceFilter filter = InstanceFilter::Visible, Threads threads = {});
  explicit SceneTracer(Scene&&, InstanceFilter = InstanceFilter::Visible, Threads = {}) = delete;  // would dangle
  SceneTracer(SceneTracer&&) noexcept;
  SceneTracer& operator=(SceneTracer&&) noexcept;
  ~SceneTracer();

  /// Applies all changes of the scene: instances that were added, removed, moved, shown or hidden; grids that were
  /// added, removed, edited or replaced, also states that select shapes; types whose transparency or shapes changed.
  /// The result equals a newly built tracer.
  /// Returns true if a traced grid or the transparency of its types changed; data derived from them is then out of
  /// date.
  ///
  /// Requires: no other thread reads the tracer during the call. Invalidates the results of `with_detail`.
  /// Cost:     for an edited grid: OccupancyTree::update of its changed chunks; its halved versions are updated at
  ///           their next use, only where the edit matters. For a moved instance: its transform and its entry in the
  ///           instance tree, which is rebuilt in O(n log n) when instances are added, removed or moved far. When a
  ///           grid's bounds change: a pass over all instances. When a type's transparency changes: all trees with such
  ///           voxels.
  /// Errors:   if it throws (bad_alloc), only another `update` or the destructor may follow.
  /// Threads:  grids are updated on several threads.
  bool update(Threads threads = {});

  /// Traces `scene` from now on. The result equals a newly built tracer. Use it with snapshots of one scene
  /// (`Scene::snapshot`), or with the scene itself; for an unrelated scene it builds all trees from scratch.
  ///
  /// Cost:     as `update`, for the differences from the scene traced before, plus a pass over all grids and instances.
  /// Lifetime: the former scene must live until the call returns, `scene` longer than the tracer.
  /// Requires, errors, threads: as `update`.
  void update(const Scene& scene, Threads threads = {});
  void update(Scene&&, Threads = {}) = delete;  // would dangle

  /// Returns a tracer of the same instances, with those in `selected` at their chosen detail. Mid and Far instances use
  /// grids (voxels and field) halved to the selected level. A grid is halved less if its voxel or field volume would
  /// change by more than an eighth, or more than an eighth of the field's surface would become one sample thin. Fields
  /// with transparent parts are never halved. Other instances, which are outside the image but may cast shadows into
  /// it, keep full detail.
  ///
  /// Lifetime: this tracer must outlive the result and must not be updated before that. It caches the halved grids, so
  ///           only the first image pays for them. Calling `update` on the result turns it into a tracer of full-detail
  ///           grids.
  /// Threads:  any number of threads may call it at once.
  [[nodiscard]] SceneTracer with_detail(std::span<const SelectedInstance> selected, Threads threads = {}) const;

  /// Returns the traced scene, whose registry defines the types that collide.
  [[nodiscard]] const Scene& scene() const;
  /// Returns true if any instance has transparent voxels, transparent parts of shapes or transparent material in its
  /// field.
  [[nodiscard]] bool has_transparent() const;
  /// Returns the bytes of all traced voxel and field trees, and of the lists of shapes; shared ones count once.
  [[nodiscard]] std::size_t bytes() const;

  // For Quoin's own sources.
  struct [[gnu::visibility("hidden")]] Impl;
  [[nodiscard]] const Impl& impl() const;

 private:
  explicit SceneTracer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
