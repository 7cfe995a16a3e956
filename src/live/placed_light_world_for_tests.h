#pragma once

#include <utility>

#include <quoin/scene/scene.h>

#include "render/light/surface/light_world_for_tests.h"

namespace quoin {

/// A LightWorld's grid and types in a scene, placed once.
struct PlacedLightWorld {
  explicit PlacedLightWorld(unsigned seed) {
    LightWorld world(seed);
    scene.types = world.types;
    SceneGrid grid;
    grid.grid = std::move(world.grid);
    handle = scene.add_grid(std::move(grid));
    scene.add_instance({"world", handle});
  }

  Scene scene;
  GridHandle handle;
};

}  // namespace quoin
