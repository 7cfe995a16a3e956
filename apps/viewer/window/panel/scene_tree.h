#pragma once

#include <map>
#include <vector>

#include <quoin/scene/scene.h>

namespace quoin::viewer {

/// How much of a scene is not seen.
struct HiddenParts {
  std::size_t layers = 0;     ///< that are switched off
  std::size_t instances = 0;  ///< whatever hides them
};

[[nodiscard]] HiddenParts hidden_parts(const Scene& scene);

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
  [[nodiscard]] const HiddenParts& hidden() const { return hidden_; }
  /// Null where nothing is below.
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
