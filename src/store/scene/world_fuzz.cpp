#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include <quoin/scene/scene.h>

#include "store/store_formats.h"

// Complete small databases: any bytes must give an error or a scene whose content can be traversed.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto loaded = quoin::read_world_format(std::as_bytes(std::span(data, size)), {}, quoin::Threads{1}, {});
  if (!loaded) return 0;
  const quoin::Scene& scene = loaded->scene;
  for (const quoin::GridHandle handle : scene.grids().handles()) {
    const quoin::SceneGrid& grid = scene.grids()[handle];
    for (const quoin::VoxelType type : grid.grid.types()) {
      if (type >= scene.types.size()) std::abort();
    }
    grid.grid.for_each_data([&](quoin::IVec3, quoin::VoxelType type, const quoin::VoxelData&) {
      if (type == quoin::kAir) std::abort();
    });
  }
  for (const quoin::InstanceHandle handle : scene.instances().handles()) {
    if (scene.grids().find(scene.instances()[handle].grid) == nullptr) std::abort();
  }
  return 0;
}
