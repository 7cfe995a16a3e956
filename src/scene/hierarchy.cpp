#include "scene/hierarchy.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include <glm/gtc/quaternion.hpp>

#include "scene/instance_axes.h"

namespace quoin {

namespace {

bool is_visible_layer(const Scene& scene, LayerHandle handle) {
  const SceneLayer* layer = scene.layers().find(handle);
  return layer == nullptr || layer->visible;
}

/// Whether the groups above by themselves show it; nothing where they go round in a circle.
std::optional<bool> is_shown_without_circles(const Scene& scene, GroupHandle from) {
  bool shown = true;
  std::size_t left = scene.groups().size();
  for (const SceneGroup* group = scene.groups().find(from); group != nullptr;
       group = scene.groups().find(group->parent)) {
    if (left-- == 0) return std::nullopt;
    shown = shown && group->visible && is_visible_layer(scene, group->layer);
  }
  return shown;
}

bool is_shown_by(const Scene& scene, GroupHandle from) {
  if (const auto shown = is_shown_without_circles(scene, from)) return *shown;
  for (; scene.groups().find(from) != nullptr; from = parent_of(scene, from)) {
    const SceneGroup& group = scene.groups()[from];
    if (!group.visible || !is_visible_layer(scene, group.layer)) return false;
  }
  return true;
}

}  // namespace

bool is_shown(const Scene& scene, const Instance& instance) {
  return instance.visible && is_visible_layer(scene, instance.layer) && is_shown_by(scene, instance.group);
}

bool is_shown(const Scene& scene, const SceneGroup& group) {
  return group.visible && is_visible_layer(scene, group.layer) && is_shown_by(scene, group.parent);
}

GroupHandle parent_of(const Scene& scene, GroupHandle group) {
  const SceneGroup* found = scene.groups().find(group);
  if (found == nullptr || scene.groups().find(found->parent) == nullptr) return {};
  GroupHandle above = found->parent;
  // A group above may be part of a circle of which this one is not: that is walked round until all were counted.
  for (std::size_t left = scene.groups().size(); left > 0; --left) {
    if (above == group) return {};
    const SceneGroup* next = scene.groups().find(above);
    if (next == nullptr) break;
    above = next->parent;
  }
  return found->parent;
}

std::vector<GroupHandle> groups_from_top(const Scene& scene) {
  std::vector<std::pair<std::size_t, GroupHandle>> by_depth;
  scene.groups().for_each([&](GroupHandle handle, const SceneGroup&) {
    std::size_t depth = 0;
    for (GroupHandle above = parent_of(scene, handle); scene.groups().find(above) != nullptr;
         above = parent_of(scene, above)) {
      ++depth;
    }
    by_depth.emplace_back(depth, handle);
  });
  std::ranges::stable_sort(by_depth, {}, [](const auto& each) { return each.first; });
  std::vector<GroupHandle> sorted;
  sorted.reserve(by_depth.size());
  for (const auto& [depth, handle] : by_depth) sorted.push_back(handle);
  return sorted;
}

namespace {

/// Says of groups whether they are below, or are, one of those that were changed.
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

void move_group(Scene& scene, GroupHandle group, DVec3 position, const DQuat& rotation) {
  const SceneGroup before = scene.groups()[group];
  const DQuat turn = unit_rotation(rotation) * glm::conjugate(unit_rotation(before.rotation));
  const auto moved = [&](DVec3 point) { return position + turn * (point - before.position); };
  const auto is_below = [&](GroupHandle each) {
    for (std::size_t left = scene.groups().size(); left > 0 && scene.groups().find(each) != nullptr; --left) {
      if (each == group) return true;
      each = parent_of(scene, each);
    }
    return false;
  };
  for (const InstanceHandle handle : scene.instances().handles()) {
    if (!is_below(scene.instances()[handle].group)) continue;
    Instance& instance = scene.edit(handle);
    instance.position = moved(instance.position);
    instance.rotation = turn * unit_rotation(instance.rotation);
  }
  for (const GroupHandle handle : scene.groups().handles()) {
    if (handle == group || !is_below(handle)) continue;
    SceneGroup& below = scene.edit(handle);
    below.position = moved(below.position);
    below.rotation = turn * unit_rotation(below.rotation);
  }
  SceneGroup& itself = scene.edit(group);
  itself.position = position;
  itself.rotation = rotation;
}

}  // namespace quoin
