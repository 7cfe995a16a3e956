#pragma once

// Scenes of fields that tests of queries share.

#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/core/vec.h>
#include <quoin/scene/scene.h>

#include "core/not_finite_for_tests.h"

namespace quoin {

inline constexpr VoxelType kStone = 1;
inline constexpr VoxelType kWater = 2;  // does not collide
inline constexpr VoxelType kWood = 3;

struct Random {
  std::mt19937 engine;
  explicit Random(unsigned seed) : engine(seed) {}
  double share() { return std::uniform_real_distribution<double>(-1.0, 1.0)(engine); }
  DVec3 vector() { return {share(), share(), share()}; }
  DVec3 direction() { return glm::normalize(vector()); }
  DQuat rotation() { return glm::angleAxis(share() * std::numbers::pi, direction()); }
};

inline OrientedBox moved(OrientedBox box, DVec3 by) {
  box.centre += by;
  return box;
}

/// Creates a scene with one instance of a grid; replaces the grid of `instance`.
inline Scene scene_of(SceneGrid grid, Instance instance) {
  Scene scene;
  for (const bool collides : {true, false, true}) {
    VoxelProperties properties;
    properties.name = std::to_string(scene.types.size());
    properties.collides = collides;
    EXPECT_TRUE(scene.types.add(properties).has_value());
  }
  instance.grid = scene.add_grid(std::move(grid));
  scene.add_instance(instance);
  return scene;
}
inline Scene scene_of(DensityGrid field, const Instance& instance) {
  SceneGrid grid;
  grid.field = std::move(field);
  return scene_of(std::move(grid), instance);
}

/// Balls and boxes that flow together, about the origin.
inline Scene random_blobs(Random& random) {
  DensityGrid field;
  for (int i = 0; i < 5; ++i) {
    field.add_sphere(random.vector() * 4.0, 1.0 + std::abs(random.share()) * 2.5, kStone, 1.0);
    const DVec3 low = random.vector() * 4.0;
    field.add_box(low, low + glm::abs(random.vector()) * 4.0, kStone, 0.3);
    field.remove_sphere(random.vector() * 4.0, 1.5);
  }
  return scene_of(std::move(field), {});
}

/// A field of independent random samples.
inline Scene random_noise(Random& random) {
  DensityGrid field(4.0F);
  field.edit({IVec3{-5}, IVec3{6}}, [&](IVec3, DensitySample) {
    return DensitySample{static_cast<float>(random.share() * 3.0 + 1.2), kStone};
  });
  return scene_of(std::move(field), {});
}

/// Hills over x and z from -`half_width` on, some four samples high.
inline DensityGrid rolling_ground(Random& random, int half_width, double steepness = 1.0) {
  const double a = random.share() * 3.0;
  const double b = random.share() * 3.0;
  DensityGrid field;
  field.edit({{-half_width, -12, -half_width}, {half_width + 1, 13, half_width + 1}}, [&](IVec3 p, DensitySample) {
    const double height = steepness * (2.0 * std::sin(0.23 * p.x + a) * std::cos(0.19 * p.z + b) +
                                       1.2 * std::sin(0.51 * p.z - 0.11 * p.x + b));
    return DensitySample{static_cast<float>(p.y - height), kStone};
  });
  return field;
}

/// Returns the height of a field's ground at (x, z).
inline double height_of(const DensityGrid& field, double x, double z) {
  double low = -12.0;
  double high = 12.0;
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (field.density_at({x, middle, z}) < 0.0F ? low : high) = middle;
  }
  return high;
}

/// Turned, mirrored, of another size, elsewhere.
inline void place_anywhere(Instance& instance, Random& random) {
  instance.position = DVec3(IVec3(random.vector() * 100.0)) / 4.0;
  instance.rotation = random.rotation();
  instance.voxel_size = 1.0 + 0.5 * random.share();
  instance.mirrored = random.share() > 0.0;
}

}  // namespace quoin
