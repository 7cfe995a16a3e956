#pragma once

#include <quoin/scene/scene.h>

namespace quoin {

/// Adds the instances below changed groups and on changed layers to the changed instances, possibly twice.
/// Requires: `groups` and `layers` of the changes are sorted.
/// Cost: nothing without changed groups and layers; else O(instances + groups * depth).
void add_instances_below(const Scene& scene, SceneChanges& changes);

}  // namespace quoin
