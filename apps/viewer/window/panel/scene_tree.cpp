#include "scene_tree.h"

namespace quoin::viewer {

HiddenParts hidden_parts(const Scene& scene) {
  HiddenParts hidden;
  scene.layers().for_each([&](LayerHandle, const SceneLayer& layer) { hidden.layers += layer.visible ? 0 : 1; });
  scene.instances().for_each(
      [&](InstanceHandle, const Instance& instance) { hidden.instances += is_shown(scene, instance) ? 0 : 1; });
  return hidden;
}

void SceneTree::update(const Scene& scene) {
  const SceneChanges changes = scene.changes_since(cursor_);
  if (!changes.all && changes.instances.empty() && changes.groups.empty() && changes.layers.empty()) return;
  hidden_ = hidden_parts(scene);
  below_.clear();
  for (const GroupHandle group : groups_from_top(scene)) below_[parent_of(scene, group)].groups.push_back(group);
  scene.instances().for_each([&](InstanceHandle handle, const Instance& instance) {
    const bool is_below = scene.groups().find(instance.group) != nullptr;
    below_[is_below ? instance.group : GroupHandle{}].instances.push_back(handle);
  });
}

}  // namespace quoin::viewer
