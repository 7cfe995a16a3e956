#include <quoin/scene/sweep.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/query/field_scene_for_tests.h"

namespace quoin {
namespace {

// A registry in which type 1 collides and type 2 does not.
VoxelRegistry two_types() {
  VoxelRegistry types;
  VoxelProperties properties;
  EXPECT_TRUE(types.add(properties).has_value());
  properties.collides = false;
  EXPECT_TRUE(types.add(properties).has_value());
  return types;
}

Scene scene_of_voxels(Grid grid, DQuat rotation = {1, 0, 0, 0}, DVec3 position = DVec3(0.0)) {
  Scene scene;
  scene.types = two_types();
  SceneGrid placed;
  placed.grid = std::move(grid);
  Instance instance;
  instance.grid = scene.add_grid(std::move(placed));
  instance.rotation = rotation;
  instance.position = position;
  scene.add_instance(instance);
  return scene;
}

Scene random_scene(Random& random) {
  Scene scene;
  scene.types = two_types();
  for (int g = 0; g < 2; ++g) {
    SceneGrid grid;
    for (int i = 0; i < 60; ++i) grid.grid.set(IVec3(random.vector() * 6.0), static_cast<VoxelType>(1 + (i % 6 == 0)));
    const GridHandle handle = scene.add_grid(std::move(grid));
    for (int i = 0; i < 8; ++i) {
      Instance instance;
      instance.grid = handle;
      instance.position = random.vector() * 20.0;
      instance.rotation = random.rotation();
      instance.voxel_size = 1.0 + 0.4 * random.share();
      instance.mirrored = i % 3 == 0;
      scene.add_instance(instance);
    }
  }
  return scene;
}

TEST(Sweep, StopsExactlyBeforeTheFirstOverlap) {
  Random random(3);
  const Scene scene = random_scene(random);
  const SceneTracer tracer(scene);
  int hits = 0;
  int misses = 0;
  for (int i = 0; i < 600; ++i) {
    const OrientedBox box{random.vector() * 30.0, glm::abs(random.vector()) * 1.5 + 0.1, random.rotation()};
    const DVec3 displacement = random.direction() * (i % 2 == 0 ? 25.0 : 3.0);
    const bool starts_inside = !overlaps(tracer, box).empty();
    const auto hit = sweep_box(tracer, box, displacement);
    if (starts_inside) {
      ASSERT_TRUE(hit.has_value());
      EXPECT_EQ(hit->fraction, 0.0);
      EXPECT_GT(hit->depth, 0.0);
      continue;
    }
    const double until = hit ? hit->fraction : 1.0;
    for (int step = 0; step < 100; ++step) {
      const double t = until * step / 100.0 - (hit ? 1e-7 : 0.0);
      ASSERT_TRUE(t < 0.0 || overlaps(tracer, moved(box, displacement * t)).empty()) << i << " at " << t;
    }
    if (!hit) {
      ++misses;
      continue;
    }
    ++hits;
    EXPECT_EQ(hit->depth, 0.0);
    EXPECT_NEAR(glm::length(hit->normal), 1.0, 1e-9);
    EXPECT_LT(glm::dot(hit->normal, displacement), 0.0);
    EXPECT_FALSE(overlaps(tracer, moved(box, displacement * (hit->fraction + 1e-7))).empty()) << i;
  }
  EXPECT_GT(hits, 60);
  EXPECT_GT(misses, 80);
}

TEST(Sweep, NeverTunnelsAtAnySpeed) {
  Random random(8);
  Grid wall;
  wall.fill_box({{-40, -40, 0}, {41, 41, 1}}, 1);
  const Scene scene = scene_of_voxels(std::move(wall), random.rotation());
  const SceneTracer tracer(scene);
  const DVec3 normal = scene.instances()[scene.instances().handles()[0]].rotation * DVec3(0, 0, 1);
  for (const double speed : {3.0, 100.0, 1e4, 1e6}) {
    for (int i = 0; i < 20; ++i) {
      const DVec3 aside = glm::cross(random.vector(), normal) * 4.0;
      const OrientedBox box{normal * 2.5 + aside, glm::abs(random.vector()) * 0.4 + 0.01, random.rotation()};
      const auto hit = sweep_box(tracer, box, -normal * speed);
      ASSERT_TRUE(hit.has_value()) << speed;
      EXPECT_LT(hit->fraction * speed, 2.0);
      EXPECT_GT(glm::dot(hit->normal, normal), 0.999);
    }
  }
}

TEST(Sweep, HitsOnlyCollidingTypesAndRejectsInvalidInput) {
  Grid grid;
  grid.set({0, 0, 0}, 2);
  grid.set({0, 0, 5}, 1);
  const Scene scene = scene_of_voxels(std::move(grid));
  const SceneTracer tracer(scene);
  const OrientedBox box{{0.5, 0.5, -3.0}, DVec3(0.25), {0, 0, 0, 0}};
  const auto hit = sweep_box(tracer, box, {0, 0, 20});
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->voxel, IVec3(0, 0, 5));
  EXPECT_NEAR(hit->fraction * 20.0, 7.75, 1e-6);
  EXPECT_EQ(hit->normal, DVec3(0, 0, -1));
  const double nan = std::nan("");
  EXPECT_FALSE(sweep_box(tracer, box, DVec3(nan)).has_value());
  EXPECT_FALSE(sweep_box(tracer, {DVec3(nan), DVec3(1.0), {}}, {0, 0, 1}).has_value());
  EXPECT_FALSE(sweep_box(tracer, {DVec3(0.0), DVec3(-1.0), {}}, {0, 0, 1}).has_value());
  EXPECT_FALSE(sweep_box(tracer, box, DVec3(0.0)).has_value());
  EXPECT_TRUE(is_finite(move_and_slide(tracer, box, DVec3(nan)).centre));
}

TEST(Sweep, RestsWithoutSinkingOrJitter) {
  Random random(14);
  for (const DVec3 away : {DVec3(0.0), DVec3(1e9, 1e9, -1e9)}) {
    Grid floor;
    floor.fill_box({{-30, -2, -30}, {31, 1, 31}}, 1);
    const DQuat rotation = random.rotation();
    const Scene scene = scene_of_voxels(std::move(floor), rotation, away);
    const SceneTracer tracer(scene);
    const DVec3 up = rotation * DVec3(0, 1, 0);
    OrientedBox box{away + up * 3.0, {0.4, 0.9, 0.4}, rotation};
    double settled = 0.0;
    for (int frame = 0; frame < 1'000; ++frame) {
      box.centre = move_and_slide(tracer, box, up * -0.3).centre;
      const double height = glm::dot(box.centre - away, up);
      if (frame == 20) settled = height;
      if (frame < 20) continue;
      ASSERT_NEAR(height, settled, away == DVec3(0.0) ? 1e-9 : 1e-5) << frame;
    }
    EXPECT_NEAR(settled, 1.0 + 0.9 + 1e-3, away == DVec3(0.0) ? 1e-6 : 1e-5);
  }
}

TEST(Sweep, SlidesAlongWallsAndStopsInCorners) {
  Grid room;
  room.fill_box({{0, 0, 0}, {21, 21, 21}}, 1);
  room.fill_box({{1, 1, 1}, {20, 20, 20}}, kAir);  // its faces are at 1 and 20
  Random random(17);
  for (int turn = 0; turn < 4; ++turn) {
    const DQuat rotation = turn == 0 ? DQuat(1, 0, 0, 0) : random.rotation();
    const Scene scene = scene_of_voxels(room.snapshot(), rotation);
    const SceneTracer tracer(scene);
    const OrientedBox box{rotation * DVec3(10.3, 10.1, 10.2), DVec3(0.6), rotation};
    // Slides over the floor: removes the downward part and keeps the rest, across voxel borders.
    const SlideResult slid = move_and_slide(tracer, box, rotation * DVec3(5.0, -20.0, 3.0));
    const DVec3 ended = glm::conjugate(rotation) * slid.centre;
    EXPECT_TRUE(slid.is_blocked);
    EXPECT_NEAR(ended.x, 15.3, 1e-6);
    EXPECT_NEAR(ended.y, 1.6 + 1e-3, 1e-6);
    EXPECT_NEAR(ended.z, 13.2, 1e-6);
    EXPECT_NEAR(glm::length(slid.displacement - rotation * DVec3(5.0, 0.0, 3.0)), 0.0, 1e-6);
    // Pushes into a corner a thousand times: the box never leaves the room.
    OrientedBox pushed = box;
    for (int i = 0; i < 1'000; ++i) {
      pushed.centre = move_and_slide(tracer, pushed, rotation * (DVec3(9, 8, 10) + random.vector())).centre;
    }
    const DVec3 corner = glm::conjugate(rotation) * pushed.centre;
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(corner[axis], 20.0 - 0.6, 0.01) << axis;
  }
}

TEST(Sweep, MovesOutOfSolidAtStart) {
  Grid floor;
  floor.fill_box({{-5, -3, -5}, {6, 1, 6}}, 1);
  const Scene scene = scene_of_voxels(std::move(floor));
  const SceneTracer tracer(scene);
  const OrientedBox box{{0.5, 1.2, 0.5}, DVec3(0.4), {1, 0, 0, 0}};
  const auto hit = sweep_box(tracer, box, {0.1, 0, 0});
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->fraction, 0.0);
  EXPECT_NEAR(hit->depth, 0.2, 1e-6);
  EXPECT_EQ(hit->normal, DVec3(0, 1, 0));
  const SlideResult out = move_and_slide(tracer, box, {0.1, 0, 0});
  EXPECT_TRUE(overlaps(tracer, moved(box, out.centre - box.centre)).empty());
  EXPECT_NEAR(out.centre.y, 1.4 + 1e-3, 1e-6);
  EXPECT_NEAR(out.centre.x, 0.6, 1e-6);
}

}  // namespace
}  // namespace quoin
