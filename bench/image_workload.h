#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include <glm/geometric.hpp>

#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

#include "bench/workloads.h"

/// The benchmarks' image: the 256x128x256 terrain at 1280x720 pixels.
namespace quoin::workloads {

inline constexpr std::int64_t kImageVoxels = 2'062'206;
inline constexpr std::int64_t kPixelsHit = 474'308;

inline Scene image_scene() {
  Scene scene;
  scene.types = three_types();
  SceneGrid grid;
  grid.grid.edit({IVec3{0}, IVec3{256, 128, 256}},
                 [](IVec3 v, VoxelType) { return terrain_type(v.y, height(v.x, v.z)); });
  scene.add_instance({"terrain", scene.add_grid(std::move(grid))});
  return scene;
}

inline Camera over_the_terrain() {
  Camera camera;
  camera.position = {20, 90, 20};
  camera.forward = glm::normalize(DVec3{128, 40, 128} - camera.position);
  camera.right = glm::normalize(glm::cross(camera.forward, DVec3{0, 1, 0}));
  camera.up = glm::cross(camera.right, camera.forward);
  camera.vertical_fov_radians = 70.0 * std::numbers::pi / 180.0;
  return camera;
}

inline void fail_unless(bool holds, const char* what, std::int64_t found) {
  if (holds) return;
  std::fprintf(stderr, "render benchmark: %s is %lld\n", what, static_cast<long long>(found));
  std::exit(1);
}

}  // namespace quoin::workloads
