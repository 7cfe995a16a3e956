#pragma once

#include <vector>

#include <quoin/scene/scene_tracer.h>

#include "scene/coarse_grids.h"
#include "scene/instance_tree.h"

namespace quoin {

struct SceneTracer::Impl {
  const Scene* scene = nullptr;
  std::vector<OpticalTrees> trees;  // one for each grid that is placed
  std::vector<PlacedGrid> placed;
  InstanceTree instances;  // of `placed`, in the world
  bool has_transparent = false;
  CoarseGrids coarse;  // those of `with_detail`
};

}  // namespace quoin
