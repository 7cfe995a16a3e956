// Transforms from the world into an instance's grid and back.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <gtest/gtest.h>

#include <quoin/scene/scene.h>
#include <quoin/scene/scene_query.h>

namespace quoin {
namespace {

struct RandomInstances {
  std::mt19937 engine;
  explicit RandomInstances(unsigned seed) : engine(seed) {}
  double share() { return std::uniform_real_distribution<double>(-1.0, 1.0)(engine); }
  DVec3 vector() { return {share(), share(), share()}; }
  // Returns a rotation of any length, including quarter turns.
  DQuat rotation() {
    if (engine() % 4 == 0) {
      DVec3 axis(0.0);
      axis[static_cast<int>(engine() % 3)] = 1.0;
      return glm::angleAxis(0.5 * std::numbers::pi * static_cast<double>(engine() % 4), axis);
    }
    return glm::angleAxis(share() * std::numbers::pi, glm::normalize(vector())) * std::exp2(4.0 * share());
  }
  Instance instance(double distance) {
    Instance made;
    made.position = vector() * distance;
    made.rotation = rotation();
    made.voxel_size = std::exp2(5.0 * share());
    made.mirrored = engine() % 2 == 0;
    return made;
  }
};

double largest(DVec3 v) {
  return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

TEST(GridFromWorld, InvertsWorldFromGrid) {
  for (unsigned seed = 1; seed <= 2'000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomInstances random(seed);
    const Instance instance = random.instance(std::pow(10.0, 4.5 + 4.5 * random.share()));
    SceneGrid grid;
    grid.pivot = random.vector() * 100.0;
    const DVec3 point = random.vector() * std::pow(10.0, 4.0 + 3.0 * random.share());
    const DVec3 world = world_from_grid(instance, grid, point);
    // Rounding errors of the world's doubles and of the offset in the grid.
    const double rounding = 8.0 * std::numeric_limits<double>::epsilon();
    const double room = rounding * ((largest(world) + largest(instance.position)) / instance.voxel_size +
                                    largest(point) + largest(grid.pivot));
    EXPECT_LE(largest(grid_from_world(instance, grid, world) - point), room);
    const DVec3 back = world_from_grid(instance, grid, grid_from_world(instance, grid, world));
    EXPECT_LE(largest(back - world), room * instance.voxel_size);

    const DVec3 direction = world_from_grid_direction(instance, point);
    EXPECT_LE(largest(grid_from_world_direction(instance, direction) - point), rounding * largest(point));
    const DVec3 moved = world_from_grid(instance, grid, grid.pivot + point) - instance.position;
    EXPECT_LE(largest(direction - moved), 4.0 * room * instance.voxel_size);
  }
}

TEST(WorldFromGrid, MatchesMatrix) {
  for (unsigned seed = 1; seed <= 500; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomInstances random(seed);
    const Instance instance = random.instance(1e3);
    SceneGrid grid;
    grid.pivot = random.vector() * 100.0;
    const glm::dmat4 matrix = world_from_grid(instance, grid);
    EXPECT_EQ(glm::determinant(matrix) < 0.0, instance.mirrored);
    const DVec3 point = random.vector() * 100.0;
    EXPECT_LE(largest(DVec3(matrix * glm::dvec4(point, 1.0)) - world_from_grid(instance, grid, point)), 1e-9);
  }
}

TEST(GridFromWorld, IsExactForQuarterTurnsOfIntegers) {
  SceneGrid grid;
  grid.pivot = {0.5, 2.0, -3.0};
  for (int turns = 0; turns < 4; ++turns) {
    for (const bool mirrored : {false, true}) {
      Instance instance;
      instance.position = {1e9, -7.0, 123'456'789.0};
      instance.rotation = glm::angleAxis(0.5 * std::numbers::pi * turns, DVec3(0, 0, 1));
      instance.voxel_size = 0.25;
      instance.mirrored = mirrored;
      const DVec3 point{12.0, -5.5, 1024.25};
      EXPECT_EQ(grid_from_world(instance, grid, world_from_grid(instance, grid, point)), point);
    }
  }
}

TEST(GridFromWorld, IsNanForInvalidTransforms) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const SceneGrid grid;
  for (int fault = 0; fault < 5; ++fault) {
    Instance instance;
    if (fault == 0) instance.position.y = nan;
    if (fault == 1) instance.rotation.w = std::numeric_limits<double>::infinity();
    if (fault == 2) instance.voxel_size = 0.0;
    if (fault == 3) instance.voxel_size = -1.0;
    if (fault == 4) instance.voxel_size = nan;
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_TRUE(std::isnan(grid_from_world(instance, grid, {1, 2, 3})[axis]));
      EXPECT_TRUE(std::isnan(grid_from_world_direction(instance, {1, 2, 3})[axis]));
    }
    EXPECT_FALSE(voxel_from_world(instance, grid, {1, 2, 3}).has_value());
  }
}

TEST(VoxelFromWorld, ReturnsVoxelContainingPoint) {
  const SceneGrid grid;
  const Instance instance;
  EXPECT_EQ(voxel_from_world(instance, grid, {1.5, -0.5, 2.0}), IVec3(1, -1, 2));
  EXPECT_EQ(voxel_from_world(instance, grid, {2'147'483'647.5, -2'147'483'648.0, 0.0}),
            IVec3(std::numeric_limits<int>::max(), std::numeric_limits<int>::min(), 0));
  EXPECT_FALSE(voxel_from_world(instance, grid, {2'147'483'648.0, 0.0, 0.0}).has_value());
  EXPECT_FALSE(voxel_from_world(instance, grid, {0.0, -2'147'483'649.0, 0.0}).has_value());
  EXPECT_FALSE(voxel_from_world(instance, grid, {0.0, 0.0, std::nan("")}).has_value());
}

TEST(VoxelFromWorld, MatchesRayHits) {
  for (const double distance : {0.0, 1e9}) {
    int hits = 0;
    for (unsigned seed = 1; seed <= 60; ++seed) {
      SCOPED_TRACE("seed " + std::to_string(seed));
      RandomInstances random(seed);
      Scene scene;
      (void)scene.types.add({});
      SceneGrid grid;
      grid.pivot = random.vector() * 4.0;
      for (int i = 0; i < 200; ++i) grid.grid.set(IVec3(random.vector() * 8.0), 1);
      Instance instance = random.instance(distance);
      instance.voxel_size = 1.0 + 0.9 * random.share();
      instance.grid = scene.add_grid(std::move(grid));
      const InstanceHandle handle = scene.add_instance(instance);
      const SceneTracer tracer(scene);
      for (int i = 0; i < 40; ++i) {
        const DVec3 origin = instance.position + random.vector() * 60.0;
        const DVec3 direction = glm::normalize(instance.position + random.vector() * 8.0 - origin);
        const auto hit = first_hit(tracer, {origin, direction});
        if (!hit || hit->starts_inside) continue;
        ++hits;
        ASSERT_EQ(hit->instance, handle);
        // A thousandth of a voxel behind the hit face: the position itself is rounded to either side of the face.
        const DVec3 inwards = world_from_grid_direction(instance, DVec3(normal_of(hit->face)) * -1e-3);
        const DVec3 point = hit->position + inwards;
        const DVec3 in_grid = grid_from_world(instance, scene.grids()[instance.grid], point);
        const DVec3 within = in_grid - DVec3(hit->voxel);
        for (int axis = 0; axis < 3; ++axis) {
          EXPECT_GT(within[axis], -1e-5);
          EXPECT_LT(within[axis], 1.0 + 1e-5);
        }
        // Next to an edge, rounding decides the voxel.
        const DVec3 from_sides = glm::min(within, 1.0 - within);
        if (std::min({from_sides.x, from_sides.y, from_sides.z}) < 1e-5) continue;
        EXPECT_EQ(voxel_from_world(instance, scene.grids()[instance.grid], point), hit->voxel);
      }
    }
    EXPECT_GT(hits, 500);
  }
}

}  // namespace
}  // namespace quoin
