#include "io/vox/write/unit_voxels.h"

#include <cmath>
#include <cstdio>

namespace quoin::vox {

std::optional<double> common_voxel_size(const Scene& scene) {
  constexpr double kRounding = 1e-6;
  std::optional<double> common;
  bool is_same = true;
  scene.instances().for_each([&](InstanceHandle, const Instance& instance) {
    if (!common) common = instance.voxel_size;
    is_same = is_same && std::abs(instance.voxel_size - *common) <= kRounding * *common;
  });
  const bool is_scaled = common && is_same && *common != 1.0 && *common > 0.0 && std::isfinite(*common);
  return is_scaled ? common : std::nullopt;
}

Scene divided(const Scene& given, double voxel_size) {
  Scene scene = given.snapshot();
  for (const InstanceHandle handle : scene.instances().handles()) {
    Instance& instance = scene.edit(handle);
    instance.voxel_size = 1.0;
    instance.position /= voxel_size;
  }
  for (const GroupHandle handle : scene.groups().handles()) scene.edit(handle).position /= voxel_size;
  return scene;
}

LoadedScene divided(const LoadedScene& given, double voxel_size) {
  LoadedScene unit;
  unit.scene = divided(given.scene, voxel_size);
  unit.format = given.format;
  unit.camera = given.camera;
  unit.cameras = given.cameras;
  unit.render_settings = given.render_settings;
  unit.last_frame = given.last_frame;
  unit.source = given.source;
  if (unit.camera) unit.camera->position /= voxel_size;
  for (FileCamera& each : unit.cameras) {
    each.camera.position /= voxel_size;
    each.focus_distance /= voxel_size;
  }
  return unit;
}

std::string size_warning(double voxel_size) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", voxel_size);
  return std::string("voxel size left out, not supported by .vox: a voxel was ") + text + " units long";
}

}  // namespace quoin::vox
