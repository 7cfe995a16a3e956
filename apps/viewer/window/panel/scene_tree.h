#pragma once

#include <map>
#include <vector>

#include <quoin/scene/scene.h>

namespace quoin::viewer {

/// The number of hidden parts of a scene.
struct HiddenParts {
  std::size_t layers = 0;     ///< layers switched off
  std::size_t instances = 0;  ///< instances hidden by themselves, a group or a layer
};

[[nodiscard]] HiddenParts hidden_parts(const Scene& scene);

/// A scene's groups and instances by parent group; the default handle is the top level.
class SceneTree {
 public:
  struct Below {
    std::vector<GroupHandle> groups;
    std::vector<InstanceHandle> instances;
  };

  /// Updates the tree. Cost: O(instances + groups * depth) if any of them has changed or the scene is another one;
  /// otherwise only the check.
  void update(const Scene& scene);
  [[nodiscard]] const HiddenParts& hidden() const { return hidden_; }
  /// Returns the children of a group; null if it has none.
  [[nodiscard]] const Below* find(GroupHandle group) const {
    const auto found = below_.find(group);
    return found == below_.end() ? nullptr : &found->second;
  }

 private:
  std::map<GroupHandle, Below> below_;
  HiddenParts hidden_;
  ChangeCursor cursor_;
};

}  // namespace quoin::viewer
