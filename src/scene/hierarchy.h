#pragma once

#include <quoin/scene/scene.h>

namespace quoin {

/// Adds to the changed instances those below changed groups and on changed layers, some of them twice.
/// Requires: `groups` and `layers` of the changes are sorted.
/// Cost: nothing without such; else O(instances + groups * depth).
void add_instances_below(const Scene& scene, SceneChanges& changes);

/// Shows every instance, group and layer.
void show_all(Scene& scene);

}  // namespace quoin
