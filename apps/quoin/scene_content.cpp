#include "scene_content.h"

#include "output.h"

namespace quoin::tool {

std::int64_t solid_samples(const Scene& scene) {
  std::int64_t count = 0;
  scene.grids().for_each([&](GridHandle, const SceneGrid& grid) { count += grid.field.solid_count(); });
  return count;
}

std::int64_t voxels_with_data(const Scene& scene) {
  std::int64_t count = 0;
  scene.grids().for_each([&](GridHandle, const SceneGrid& grid) { count += grid.grid.data_count(); });
  return count;
}

std::string content_text(const SceneContent& content) {
  const std::string samples = with_thousands(content.solid_samples);
  if (content.solid_samples == 0) return "Voxels: " + with_thousands(content.voxels);
  if (content.voxels == 0) return "Solid samples: " + samples;
  return "Voxels: " + with_thousands(content.voxels) + ", solid samples: " + samples;
}

}  // namespace quoin::tool
