#include <quoin/scene/scene.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include <glm/gtc/quaternion.hpp>

#include <quoin/core/assert.h>

#include "core/coordinates/unit_rotation.h"
#include "scene/scene_follower.h"

namespace quoin {

namespace {

bool is_visible_layer(const Scene& scene, LayerHandle handle) {
  const SceneLayer* layer = scene.layers().find(handle);
  return layer == nullptr || layer->visible;
}

/// Returns true if `passes` holds for a group and all groups above it, true for an invalid handle. Groups in a cycle
/// count as top-level groups.
template <class Passes>
bool all_above(const Scene& scene, GroupHandle from, Passes passes) {
  std::size_t left = scene.groups().size();
  bool all = true;
  const SceneGroup* group = scene.groups().find(from);
  for (; group != nullptr && left != 0; group = scene.groups().find(group->parent), --left) all = all && passes(*group);
  if (group == nullptr) return all;
  for (; scene.groups().find(from) != nullptr; from = parent_of(scene, from)) {  // there is a cycle
    if (!passes(scene.groups()[from])) return false;
  }
  return true;
}

bool is_shown_by(const Scene& scene, GroupHandle from) {
  return all_above(scene, from,
                   [&](const SceneGroup& group) { return group.visible && is_visible_layer(scene, group.layer); });
}

bool is_saved_by(const Scene& scene, GroupHandle from) {
  return all_above(scene, from, [](const SceneGroup& group) { return group.saved; });
}

}  // namespace

bool is_shown(const Scene& scene, const Instance& instance) {
  return instance.visible && is_visible_layer(scene, instance.layer) && is_shown_by(scene, instance.group);
}

bool is_shown(const Scene& scene, const SceneGroup& group) {
  return group.visible && is_visible_layer(scene, group.layer) && is_shown_by(scene, group.parent);
}

bool is_saved(const Scene& scene, const Instance& instance) {
  const SceneGrid* const grid = scene.grids().find(instance.grid);
  return instance.saved && (grid == nullptr || grid->saved) && is_saved_by(scene, instance.group);
}

bool is_saved(const Scene& scene, const SceneGroup& group) {
  if (!group.saved) return false;
  const SceneGroup* above = scene.groups().find(group.parent);
  for (std::size_t left = scene.groups().size(); left > 0 && above != nullptr; --left) {
    if (above == &group) return true;  // in a cycle, so at the top
    above = scene.groups().find(above->parent);
  }
  return is_saved_by(scene, group.parent);
}

GroupHandle parent_of(const Scene& scene, GroupHandle group) {
  const SceneGroup* found = scene.groups().find(group);
  if (found == nullptr || scene.groups().find(found->parent) == nullptr) return {};
  GroupHandle above = found->parent;
  // The parent chain may end in a cycle that does not contain this group. The loop then stops after as many steps as
  // there are groups.
  for (std::size_t left = scene.groups().size(); left > 0; --left) {
    if (above == group) return {};
    const SceneGroup* next = scene.groups().find(above);
    if (next == nullptr) break;
    above = next->parent;
  }
  return found->parent;
}

namespace {

/// The number of groups above each group, by slot, as defined by parent_of. Visits each group at most twice.
class GroupDepths {
 public:
  explicit GroupDepths(const Scene& scene) : scene_(scene) {
    scene.groups().for_each([&](GroupHandle handle, const SceneGroup&) {
      if (handle.index >= depths_.size()) depths_.resize(handle.index + std::size_t{1}, kUnknown);
    });
    scene.groups().for_each([&](GroupHandle handle, const SceneGroup&) { find(handle); });
  }

  [[nodiscard]] std::size_t of(GroupHandle handle) const {
    QUOIN_ASSERT(handle.index < depths_.size() && depths_[handle.index] < kOnTheWay, "a group of the scene");
    return depths_[handle.index];
  }

 private:
  static constexpr std::size_t kUnknown = static_cast<std::size_t>(-1);
  static constexpr std::size_t kOnTheWay = kUnknown - 1;

  void find(GroupHandle handle) {
    std::vector<std::size_t> way;
    const SceneGroup* group = scene_.groups().find(handle);
    while (group != nullptr && depths_[handle.index] == kUnknown) {
      depths_[handle.index] = kOnTheWay;
      way.push_back(handle.index);
      handle = group->parent;
      group = scene_.groups().find(handle);
    }
    std::size_t depth = 0;
    if (group != nullptr && depths_[handle.index] == kOnTheWay) {
      // Groups in a cycle count as roots.
      for (bool is_first = false; !is_first; way.pop_back()) {
        is_first = way.back() == handle.index;
        depths_[way.back()] = 0;
      }
    }
    if (group != nullptr) depth = depths_[handle.index] + 1;
    for (; !way.empty(); way.pop_back()) depths_[way.back()] = depth++;
  }

  const Scene& scene_;
  std::vector<std::size_t> depths_;
};

}  // namespace

std::vector<GroupHandle> groups_from_top(const Scene& scene) {
  const GroupDepths depths(scene);
  std::vector<std::pair<std::size_t, GroupHandle>> by_depth;
  scene.groups().for_each(
      [&](GroupHandle handle, const SceneGroup&) { by_depth.emplace_back(depths.of(handle), handle); });
  std::ranges::stable_sort(by_depth, {}, [](const auto& each) { return each.first; });
  std::vector<GroupHandle> sorted;
  sorted.reserve(by_depth.size());
  for (const auto& [depth, handle] : by_depth) sorted.push_back(handle);
  QUOIN_ASSERT(sorted.size() == scene.groups().size(), "each group once");
  return sorted;
}

namespace {

/// Tests if groups are equal to, or below, a changed group.
class ChangedGroups {
 public:
  ChangedGroups(const Scene& scene, const SceneChanges& changes) : changed_(changes.groups) {
    scene.groups().for_each([&](GroupHandle handle, const SceneGroup& group) {
      if (std::binary_search(changes.layers.begin(), changes.layers.end(), group.layer)) changed_.push_back(handle);
    });
    std::sort(changed_.begin(), changed_.end());
    std::vector<GroupHandle> below;
    scene.groups().for_each([&](GroupHandle handle, const SceneGroup&) {
      if (is_below(scene, handle)) below.push_back(handle);
    });
    changed_.insert(changed_.end(), below.begin(), below.end());
    std::sort(changed_.begin(), changed_.end());
  }

  [[nodiscard]] bool contains(GroupHandle group) const {
    return std::binary_search(changed_.begin(), changed_.end(), group);
  }

 private:
  [[nodiscard]] bool is_below(const Scene& scene, GroupHandle group) const {
    for (std::size_t left = scene.groups().size(); left > 0; --left) {
      if (contains(group)) return true;
      const SceneGroup* found = scene.groups().find(group);
      if (found == nullptr) return false;
      group = found->parent;
    }
    return false;
  }

  std::vector<GroupHandle> changed_;
};

}  // namespace

void add_instances_below(const Scene& scene, SceneChanges& changes) {
  if (changes.groups.empty() && changes.layers.empty()) return;
  const ChangedGroups groups(scene, changes);
  scene.instances().for_each([&](InstanceHandle handle, const Instance& instance) {
    const bool on_changed_layer = std::binary_search(changes.layers.begin(), changes.layers.end(), instance.layer);
    if (on_changed_layer || groups.contains(instance.group)) changes.instances.push_back(handle);
  });
}

void show_all(Scene& scene) {
  for (const InstanceHandle each : scene.instances().handles()) scene.edit(each).visible = true;
  for (const GroupHandle each : scene.groups().handles()) scene.edit(each).visible = true;
  for (const LayerHandle each : scene.layers().handles()) scene.edit(each).visible = true;
}

namespace {

[[maybe_unused]] bool is_rotation(const DQuat& q) {
  const double squared = glm::dot(q, q);
  return squared > 0.0 && std::isfinite(squared);
}

}  // namespace

void move_group(Scene& scene, GroupHandle group, DVec3 position, const DQuat& rotation) {
  const SceneGroup before = scene.groups()[group];
  QUOIN_ASSERT(is_rotation(rotation) && is_rotation(before.rotation), "rotations that are finite and not zero");
  const DQuat turn = unit_rotation(rotation) * glm::conjugate(unit_rotation(before.rotation));
  const auto moved = [&](DVec3 point) { return position + turn * (point - before.position); };
  std::set<GroupHandle> moving = {group};
  for (const GroupHandle each : groups_from_top(scene)) {
    if (moving.contains(parent_of(scene, each))) moving.insert(each);
  }
  for (const InstanceHandle handle : scene.instances().handles()) {
    if (!moving.contains(scene.instances()[handle].group)) continue;
    Instance& instance = scene.edit(handle);
    instance.position = moved(instance.position);
    instance.rotation = turn * unit_rotation(instance.rotation);
  }
  for (const GroupHandle handle : moving) {
    if (handle == group) continue;
    SceneGroup& below = scene.edit(handle);
    below.position = moved(below.position);
    below.rotation = turn * unit_rotation(below.rotation);
  }
  SceneGroup& itself = scene.edit(group);
  itself.position = position;
  itself.rotation = rotation;
}

}  // namespace quoin
