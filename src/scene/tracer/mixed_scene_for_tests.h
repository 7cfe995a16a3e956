#pragma once

// A scene for the benchmarks.

#include <cstdint>
#include <random>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <quoin/scene/scene.h>

namespace quoin {

/// Instances of five boxes of different sizes, spread over a flat square of 12,000.
inline Scene mixed_scene(std::int64_t count) {
  Scene scene;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  std::vector<GridHandle> grids;
  for (const int edge : {8, 30, 90, 200, 500}) {
    SceneGrid grid;
    grid.grid.fill_box({{0, 0, 0}, IVec3(edge)}, 1);
    grids.push_back(scene.add_grid(std::move(grid)));
  }
  for (std::int64_t i = 0; i < count; ++i) {
    Instance instance;
    instance.grid = grids[static_cast<std::size_t>(i) % grids.size()];
    instance.position = DVec3(share(random), 0.1 * share(random), share(random)) * 6000.0;
    instance.rotation = glm::normalize(DQuat(share(random), share(random), share(random), 1.1));
    scene.add_instance(instance);
  }
  return scene;
}

}  // namespace quoin
