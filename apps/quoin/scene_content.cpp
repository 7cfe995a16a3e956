#include "scene_content.h"

#include <quoin/scene/scene_meshes.h>

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

void warn_of_lamps(const Scene& scene, std::vector<std::string>& warnings) {
  if (scene.lamps.empty()) return;
  warnings.push_back("lamps left out: " + std::to_string(scene.lamps.size()) +
                     " (--lights writes them to .glb and .gltf)");
}

void warn_of_values(std::size_t values, std::vector<std::string>& warnings) {
  if (values == 0) return;
  warnings.push_back("application values left out: " + std::to_string(values) + " (quoin world backup copies them)");
}

void warn_of_data(std::int64_t voxels, std::vector<std::string>& warnings) {
  if (voxels == 0) return;
  warnings.push_back("data of voxels left out, not supported by meshes: " + std::to_string(voxels));
}

void warn_of_left_out(const Scene& scene, InstanceFilter filter, std::vector<std::string>& warnings) {
  std::size_t left_out = 0;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (is_drawn(scene, instance, InstanceFilter::All) && !is_drawn(scene, instance, filter)) ++left_out;
  }
  if (left_out == 1) warnings.emplace_back("1 hidden instance left out; --hidden includes it");
  if (left_out > 1) {
    warnings.push_back(std::to_string(left_out) + " hidden instances left out; --hidden includes them");
  }
}

}  // namespace quoin::tool
