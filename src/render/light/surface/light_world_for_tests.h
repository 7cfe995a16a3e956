#pragma once

#include <random>

#include <gtest/gtest.h>

#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/render/propagated_light.h>

namespace quoin {

/// A world with its light: empty, or of caves with lamps and glass around the corner of eight chunks, open to the sky
/// here and there.
struct LightWorld {
  static constexpr VoxelType kStone = 1, kLamp = 2, kRedLamp = 3, kGlass = 4;

  LightWorld() {
    add({120, 120, 120, 255}, Visibility::Opaque, 0.0F);
    add({255, 220, 160, 255}, Visibility::Opaque, 1.0F);
    add({250, 30, 0, 255}, Visibility::Opaque, 0.8F);
    add({240, 240, 240, 60}, Visibility::Transparent, 0.0F);
  }
  explicit LightWorld(unsigned seed) : LightWorld() {
    std::mt19937 random(seed);
    const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
    grid.fill_box({{-30, -30, -30}, {30, 10, 30}}, kStone);
    for (int i = 0; i < 40; ++i) grid.fill_sphere(DVec3(somewhere(random)), 2.0 + below(7), kAir);
    for (int i = 0; i < 6; ++i) {
      const IVec3 at = somewhere(random);
      grid.fill_box({at, {at.x + 1 + below(3), 12, at.z + 1 + below(3)}}, kAir);
    }
    for (int i = 0; i < 300; ++i) grid.set(somewhere(random), static_cast<VoxelType>(1 + below(4)));
    light.update(grid, types);
  }
  [[nodiscard]] static IVec3 somewhere(std::mt19937& random) {
    const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
    const int x = below(56) - 28;
    const int y = below(38) - 28;
    return {x, y, below(56) - 28};
  }

  VoxelRegistry types;
  Grid grid;
  PropagatedLight light;

 private:
  void add(Rgba8 colour, Visibility visibility, float emission) {
    VoxelProperties properties;
    properties.colour = colour;
    properties.visibility = visibility;
    properties.emission = emission;
    EXPECT_TRUE(types.add(properties));
  }
};

}  // namespace quoin
