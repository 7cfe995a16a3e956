#pragma once

#include <utility>

#include <glm/gtc/quaternion.hpp>

#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

#include "grid/shapes/shape_types_for_tests.h"
#include "render/cpu/render_test_support.h"

namespace quoin {

/// A cave through the corner of eight chunks with a red and a blue lamp, a pane of glass, and a shaft of sky; behind
/// its wall a closed room, and a lamp in that wall that shines into the cave alone.
struct Cave {
  static constexpr IBox kRoom{{12, -10, -26}, {24, -2, -14}};

  Cave() {
    const VoxelType stone = add({150, 145, 140, 255}, Visibility::Opaque, 0.0F);
    const VoxelType earth = add({140, 110, 80, 255}, Visibility::Opaque, 0.0F);
    const VoxelType red = add({255, 90, 40, 255}, Visibility::Opaque, 1.0F);
    const VoxelType blue = add({60, 110, 255, 255}, Visibility::Opaque, 1.0F);
    const VoxelType glass = add({200, 230, 210, 90}, Visibility::Transparent, 0.0F);
    SceneGrid made;
    Grid& grid = made.grid;
    grid.fill_box({{-34, -18, -34}, {34, 16, 34}}, stone);
    grid.fill_box({{-34, -18, -34}, {34, -12, 34}}, earth);
    grid.fill_box({{-28, -12, -10}, {28, 4, 14}}, kAir);
    grid.fill_sphere({0.0, -8.0, 4.0}, 13.0, kAir);
    grid.fill_box({{-30, -14, -12}, {30, -12, 18}}, earth);
    grid.fill_box({{-3, 0, 0}, {4, 16, 7}}, kAir);  // the shaft
    for (const int x : {-14, 13}) grid.fill_box({{x, -12, -4}, {x + 3, 4, -1}}, stone);
    grid.set({-18, -11, -2}, red);
    grid.set({20, -6, 6}, blue);
    grid.fill_box({{8, -12, 2}, {9, -4, 10}}, glass);
    grid.fill_box(kRoom, kAir);
    grid.set({18, -6, -11}, red);
    grid_handle = scene.add_grid(std::move(made));
    scene.add_instance({"cave", grid_handle});
  }

  [[nodiscard]] static Camera inside() { return render_test::towards({-26.0, -2.0, 12.0}, {6.0, -9.0, 0.0}, 1.2); }

  /// The same cave turned, and a house on the first. Seen by `outside`.
  void add_others() {
    scene.add_instance({"turned", grid_handle, {90.0, 10.0, -20.0}, glm::angleAxis(0.7, DVec3(0.6, 0.0, 0.8))});
    Grid house;
    house.fill_box({{0, 0, 0}, {20, 12, 20}}, 1);
    house.fill_box({{1, 1, 1}, {19, 11, 19}}, kAir);
    house.fill_box({{6, 1, 19}, {12, 7, 20}}, kAir);
    render_test::place(scene, std::move(house), {-10.0, 16.0, -10.0});
  }
  [[nodiscard]] static Camera outside() { return render_test::towards({110.0, 70.0, 120.0}, {30.0, 0.0, 0.0}, 0.9); }

  Scene scene;
  GridHandle grid_handle;

 private:
  VoxelType add(Rgba8 colour, Visibility visibility, float emission) {
    VoxelProperties properties;
    properties.colour = colour;
    properties.visibility = visibility;
    properties.emission = emission;
    return scene.types.add(properties).value();
  }
};

/// A dim hall with two open sides and a lamp. Full boxes, shapes or cubes, float in it. `has_others`: more shapes stand
/// on the floor.
struct Hall {
  explicit Hall(bool has_others, bool has_shaped_boxes = true) {
    VoxelProperties of_box{.name = "box", .colour = {220, 210, 190}};
    if (has_shaped_boxes) of_box.shapes = VoxelShape::box({0, 0, 0}, {16, 16, 16});
    const VoxelType box = scene.types.add(of_box).value();
    const VoxelType lamp = scene.types.add({.name = "lamp", .colour = {255, 150, 60}, .emission = 1.0F}).value();
    Grid grid;
    grid.fill_box({{-9, -1, -9}, {10, 7, 10}}, types.stone);
    grid.fill_box({{-8, 0, -8}, {10, 6, 10}}, kAir);
    grid.set({-4, 3, -2}, lamp);
    for (const IVec3 at : {IVec3{-1, 3, -4}, {4, 2, 3}, {-5, 2, 4}, {2, 3, -1}}) grid.set(at, box);
    if (has_others) {
      grid.fill_box({{-6, 0, -6}, {-2, 1, -2}}, types.slab);
      for (std::uint32_t i = 0; i < 8; ++i) grid.set({static_cast<int>(i) - 4, 0, 0}, types.stairs, {.state = i});
      for (std::uint32_t i = 0; i < 4; ++i) grid.set({static_cast<int>(i) - 1, 0, 3}, types.door, {.state = i});
      for (int i = 0; i < 5; ++i) grid.set({i + 1, 0, -4}, types.fence);
      grid.set({-3, 0, 6}, types.flower);
      grid.set({5, 1, 6}, types.beam);
      grid.set({0, 0, 6}, box);
    }
    render_test::place(scene, std::move(grid));
  }
  [[nodiscard]] static Camera inside() { return render_test::towards({8.5, 5.0, 9.5}, {-1.5, 1.0, -0.5}, 1.1); }

  Scene scene;
  ShapeTypes types{scene.types};
};

[[nodiscard]] inline RenderOptions propagated(int width, int height, OcclusionMode occlusion = OcclusionMode::Off) {
  RenderOptions options = render_test::sized(width, height);
  options.light.model = LightModel::Propagated;
  options.light.occlusion_mode = occlusion;
  return options;
}

/// Selects halved grids; none of them is Far.
inline void use_halved(RenderOptions& options) {
  options.detail.policy = DetailPolicy{};
  options.detail.policy->voxel_pixels = 100.0;
  options.detail.policy->cell_pixels = 4.0;
  options.detail.policy->far_pixels = 0;
}

}  // namespace quoin
