#pragma once

#include <utility>

#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

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

}  // namespace quoin
