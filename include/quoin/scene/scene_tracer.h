#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>

namespace quoin {

struct PlacedGrid;

/// The traversal structures of a scene's instances.
///
/// Lifetime: the scene must outlive it, in its place; after an edit of the scene `update` comes before anything else.
class SceneTracer {
 public:
  /// Left out are instances that `filter` does not let pass; empty grids; and instances whose numbers are not finite or
  /// whose size is not positive.
  /// Cost: O(chunks of the grids that are placed), on several threads.
  explicit SceneTracer(const Scene& scene, InstanceFilter filter = InstanceFilter::Visible, Threads threads = {});
  explicit SceneTracer(Scene&&, InstanceFilter = InstanceFilter::Visible, Threads = {}) = delete;  // it must outlive it
  SceneTracer(SceneTracer&&) noexcept;
  SceneTracer& operator=(SceneTracer&&) noexcept;
  ~SceneTracer();

  /// Brings it up to date with its scene, whatever happened to that: instances that came, went, moved, turned, showed
  /// or hid; grids that came, went, were edited or replaced; types that became transparent or opaque. Then it is as one
  /// that was built anew. Returns whether grids that are traced, or their types' transparency, are other than before:
  /// what was made of them is then out of date.
  ///
  /// Requires: nothing reads it meanwhile. What `with_detail` returned is invalidated.
  /// Cost:     of what changed: OccupancyTree::update for the chunks of a grid that is placed; of its halved ones only
  ///           what the edit can have changed, when they are next asked for. For an instance that moved: its transform,
  ///           and its share of the tree of instances, which is built anew, O(n log n), when instances come or go or
  ///           have moved far. A look at all instances when the bounds of a grid change.
  ///           A change of a type's transparency: all trees that hold such voxels.
  /// Threads:  grids are updated on several.
  bool update(Threads threads = {});

  /// The same instances, those of `selected` in their detail: Mid and Far ones as grids halved that often, voxels and
  /// field, or less often where that would change the volume of either by more than an eighth or leave more than an
  /// eighth of the field's surface a sample thin; never where anything of the field is transparent. The others, which
  /// are out of the picture but may cast shadows into it, stay as they are.
  ///
  /// Lifetime: this one, which keeps the halved grids so that only the first picture pays for them, must outlive the
  ///           result, without an update. An update of the result makes it a tracer of whole grids.
  /// Threads:  any number may call at once.
  [[nodiscard]] SceneTracer with_detail(std::span<const SelectedInstance> selected, Threads threads = {}) const;

  /// What it traces; queries ask its registry what collides.
  [[nodiscard]] const Scene& scene() const;
  /// Whether any instance has transparent voxels, or anything transparent in its field.
  [[nodiscard]] bool has_transparent() const;
  /// Bytes of the trees of voxels and of fields' cells that it traces, those that instances share once.
  [[nodiscard]] std::size_t bytes() const;

 private:
  friend class SceneView;
  friend class SceneQuery;
  friend const std::vector<PlacedGrid>& placed_in(const SceneTracer& tracer);
  struct Impl;
  explicit SceneTracer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace quoin
