#include "scene_tree.h"

namespace quoin::viewer {

void SceneTree::update(const Scene& scene) {
  const SceneChanges changes = scene.changes_since(cursor_);
  if (!changes.all && changes.instances.empty() && changes.groups.empty()) return;
  below_.clear();
  for (const GroupHandle group : groups_from_top(scene)) below_[parent_of(scene, group)].groups.push_back(group);
  scene.instances().for_each([&](InstanceHandle handle, const Instance& instance) {
    const bool is_below = scene.groups().find(instance.group) != nullptr;
    below_[is_below ? instance.group : GroupHandle{}].instances.push_back(handle);
  });
}

}  // namespace quoin::viewer
