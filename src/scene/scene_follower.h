#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/changes.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// Adds the instances below changed groups and on changed layers to the changed instances, possibly twice.
/// Requires: `groups` and `layers` of the changes are sorted.
/// Cost: nothing without changed groups and layers; else O(instances + groups * depth).
void add_instances_below(const Scene& scene, SceneChanges& changes);

/// Follows a scene for a consumer with data per grid: the grids that drawn instances place, and which of them changed.
///
///   SceneFollower::Update update(follower, scene);
///   for (const GridHandle grid : update.touched()) follower.places(grid) ? renew(grid) : drop(grid);
///   update.commit();
///
/// Cost: O(changed grids and instances); all of them the first time and after a failure.
class SceneFollower {
 public:
  enum class Transforms : std::uint8_t {
    Any,
    Valid,  ///< only instances with `has_valid_transform` count as drawn
  };
  class Update;

  explicit SceneFollower(InstanceFilter filter = InstanceFilter::Visible, Transforms transforms = Transforms::Any)
      : filter_(filter), transforms_(transforms) {}

  /// Returns true if a drawn instance places the grid, as of the last update.
  [[nodiscard]] bool places(GridHandle grid) const {
    const auto found = placements_.find(grid);
    return found != placements_.end() && found->second != 0;
  }
  /// Makes the next update report that everything changed.
  void forget() { followed_ = {}; }

 private:
  struct Placed {
    std::uint64_t generation = 0;  // of the instance's handle
    GridHandle grid;
  };

  void read(const Scene& scene, const SceneChanges& changes) {
    released_.clear();
    has_other_placements_ = changes.all;
    touched_.insert(touched_.end(), changes.grids.begin(), changes.grids.end());
    if (changes.all) {
      touch_placed();
      placed_.clear();
      placements_.clear();
      scene.instances().for_each(
          [&](InstanceHandle handle, const Instance& instance) { add(scene, handle, instance); });
      touch_placed();
    }
    for (const InstanceHandle handle : changes.instances) remove(handle);
    for (const InstanceHandle handle : changes.instances) {
      const Instance* const instance = scene.instances().find(handle);
      if (instance != nullptr && add(scene, handle, *instance)) touched_.push_back(instance->grid);
    }
    // Grids whose only instance moves were placed again.
    for (const GridHandle grid : released_) {
      if (!places(grid)) has_other_placements_ |= placements_.erase(grid) != 0;
    }
    std::sort(touched_.begin(), touched_.end());
    touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
  }
  void touch_placed() {
    for (const auto& [grid, count] : placements_) touched_.push_back(grid);
  }
  // Returns true if the instance is drawn.
  bool add(const Scene& scene, InstanceHandle handle, const Instance& instance) {
    if (!is_drawn(scene, instance, filter_)) return false;
    if (transforms_ == Transforms::Valid && !has_valid_transform(instance)) return false;
    if (handle.index >= placed_.size()) placed_.resize(handle.index + std::size_t{1});
    const auto [found, is_first] = placements_.try_emplace(instance.grid, 0);
    has_other_placements_ |= is_first;
    ++found->second;
    placed_[handle.index] = {handle.generation, instance.grid};
    return true;
  }
  void remove(InstanceHandle handle) {
    if (handle.index >= placed_.size() || placed_[handle.index].generation != handle.generation) return;
    Placed& placed = placed_[handle.index];
    touched_.push_back(placed.grid);
    const auto found = placements_.find(placed.grid);
    QUOIN_ASSERT(found != placements_.end() && found->second > 0, "a counted placement");
    if (--found->second == 0) released_.push_back(placed.grid);
    placed = {};
  }

  InstanceFilter filter_;
  Transforms transforms_;
  ChangeCursor followed_;
  std::vector<Placed> placed_;                    // drawn instances, by slot
  std::map<GridHandle, std::size_t> placements_;  // number of drawn instances, without zeros except during `read`
  std::vector<GridHandle> touched_;               // since the last commit
  std::vector<GridHandle> released_;              // during `read`: grids that lost their last drawn instance
  bool has_other_placements_ = false;             // in the last update
  SceneChanges buffer_;                           // kept for its memory
};

/// Changes of a scene that a consumer applies completely or not at all, as PendingChanges.
class SceneFollower::Update {
 public:
  Update(SceneFollower& follower, const Scene& scene)
      : follower_(&follower), changes_(follower.followed_, scene, follower.buffer_) {
    follower.read(scene, *changes_);
  }

  /// Returns the changed grids, ascending: added, removed or edited, or placed by a changed instance now or before.
  /// After a failure also those of the failed update. If everything changed, all grids placed now or before.
  [[nodiscard]] std::span<const GridHandle> touched() const { return follower_->touched_; }
  [[nodiscard]] bool all() const { return changes_->all; }
  /// Returns true if any instance, group or layer may have changed.
  [[nodiscard]] bool has_other_instances() const {
    return all() || !changes_->instances.empty() || !changes_->groups.empty() || !changes_->layers.empty();
  }
  /// Returns true if any grid may be placed that was not placed before, or the reverse.
  [[nodiscard]] bool has_other_placements() const { return follower_->has_other_placements_; }
  /// Call when all changes are applied.
  void commit() {
    follower_->touched_.clear();
    changes_.commit();
  }

 private:
  SceneFollower* follower_;
  PendingChanges<Scene, SceneChanges&> changes_;
};

}  // namespace quoin
