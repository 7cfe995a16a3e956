#pragma once

#include <map>
#include <vector>

#include <quoin/scene/scene.h>

namespace quoin::viewer {

/// A scene's groups and instances by what they belong to; the default handle stands for the top.
class SceneTree {
 public:
  struct Below {
    std::vector<GroupHandle> groups;
    std::vector<InstanceHandle> instances;
  };

  /// Follows the scene. Cost: O(instances + groups * depth) when any of them has changed or another scene is given;
  /// else what asking costs.
  void update(const Scene& scene);
  /// Null where nothing is below.
  [[nodiscard]] const Below* find(GroupHandle group) const {
    const auto found = below_.find(group);
    return found == below_.end() ? nullptr : &found->second;
  }

 private:
  std::map<GroupHandle, Below> below_;
  ChangeCursor cursor_;
};

}  // namespace quoin::viewer
