#pragma once

#include <optional>
#include <vector>

#include <quoin/scene/scene_tracer.h>

#include "scene/instance_tree.h"

namespace quoin {

struct SceneTracer::Impl {
  struct Trees {
    OccupancyTree opaque;
    std::optional<OccupancyTree> transparent;
  };
  std::vector<Trees> trees;  // one for each grid that is placed
  std::vector<PlacedGrid> placed;
  InstanceTree instances;  // of `placed`, in the world
  bool has_transparent = false;
};

}  // namespace quoin
