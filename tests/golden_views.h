#pragma once

#include <array>
#include <cstdint>
#include <numbers>
#include <ostream>

#include <quoin/render/cpu_renderer.h>
#include <quoin/terrain/terrain.h>

#include "render/cpu/environment_for_tests.h"

/// The scenes and views of the golden images.
namespace quoin::golden {

inline constexpr int kWidth = 320;
inline constexpr int kHeight = 180;
inline constexpr std::int64_t kPixels = kWidth * kHeight;

/// Uses Quoin's axes, +Y up; the terrain fills 128 x 64 x 128 voxels from the origin, two chunks along x and z.
struct GoldenView {
  const char* name;
  DVec3 position;
  DVec3 target;
  double fov_degrees;
  DVec3 sun;
};

inline void PrintTo(const GoldenView& view, std::ostream* out) {
  *out << view.name;
}

inline const DVec3 kUsualSun = Environment::reference().sun.direction;
/// From behind the ridge, whose shadow falls over the slope and the water in front.
inline const DVec3 kLowSun{-1.0, 0.9, -0.5};

inline const std::array<GoldenView, 7> kViews = {{
    {"front", {64, 60, 230}, {64, 20, 64}, 38, kUsualSun},
    {"corner", {175, 90, 175}, {63, 12, 63}, 42, kUsualSun},
    {"top_down", {64, 240, 64}, {64, 0, 64}, 36, kUsualSun},
    {"boundary", {84, 62, 112}, {62, 22, 64}, 55, kUsualSun},  // the border at x = 64 runs through the middle
    {"edge", {150, 40, 140}, {118, 14, 100}, 50, kUsualSun},
    {"shadow", {110, 50, 150}, {60, 16, 70}, 45, kLowSun},
    {"ao", {74, 44, 104}, {48, 16, 74}, 55, kUsualSun},
}};

inline Grid terrain(VoxelRegistry& types) {
  const TerrainOptions options{.seed = 42, .size = {4, 2, 4}};
  return generate_terrain(options, add_terrain_types(types).value()).value();
}

inline Scene scene_of(VoxelRegistry types, Grid grid) {
  Scene scene;
  scene.types = std::move(types);
  SceneGrid placed;
  placed.grid = std::move(grid);
  Instance instance;
  instance.grid = scene.add_grid(std::move(placed));
  scene.add_instance(instance);
  return scene;
}

inline Scene terrain_scene() {
  VoxelRegistry types;
  Grid grid = terrain(types);
  return scene_of(std::move(types), std::move(grid));
}

inline Camera camera_for(const GoldenView& view) {
  return look_at(view.position, view.target, view.fov_degrees * std::numbers::pi / 180.0).value();
}

inline RenderOptions options_for(const GoldenView& view) {
  RenderOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.depth = true;
  environment_in(options).sun.direction = view.sun;
  return options;
}

}  // namespace quoin::golden
