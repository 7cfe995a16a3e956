// Tests the displacement of overlapping boxes.

#include <quoin/scene/sweep.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/query/field_scene_for_tests.h"

namespace quoin {
namespace {

Scene scene_of(Grid voxels, const Instance& instance = {}) {
  SceneGrid grid;
  grid.grid = std::move(voxels);
  return scene_of(std::move(grid), instance);
}

// Returns a heap of single voxels and small boxes about the origin.
Grid heap(Random& random, int count) {
  Grid grid;
  for (int i = 0; i < count; ++i) {
    const IVec3 low(random.vector() * 5.0);
    grid.fill_box({low, low + 1 + IVec3(glm::abs(random.vector()) * 2.5)}, i % 7 == 0 ? kWater : kStone);
  }
  return grid;
}

// Returns the least length among many random displacements that free the box.
double least_of_samples(const SceneTracer& tracer, const OrientedBox& box, double below, Random& random) {
  double least = below;
  for (int i = 0; i < 3000; ++i) {
    const DVec3 by = random.direction() * (least * std::cbrt(std::abs(random.share())));
    if (glm::length(by) < least && overlaps(tracer, moved(box, by)).empty()) least = glm::length(by);
  }
  return least;
}

TEST(FreePlace, IsNearestAmongBlocks) {
  Random random(3);
  int found = 0;
  int none = 0;
  for (int round = 0; round < 240; ++round) {
    Instance instance;
    // Quarter turns leave the axes parallel.
    instance.rotation = glm::angleAxis(0.5 * std::numbers::pi * (round % 4), DVec3(0, 1, 0));
    instance.mirrored = round % 3 == 0;
    instance.position = round % 2 == 0 ? DVec3(0.0) : DVec3(1e9, -1e8, 3e8);
    instance.voxel_size = round % 5 == 0 ? 0.5 : 1.0;
    const Scene scene = scene_of(heap(random, 160), instance);
    const SceneTracer tracer(scene);
    const DVec3 half = glm::abs(random.vector()) * 1.2 * instance.voxel_size;
    const OrientedBox box{instance.position + random.vector() * 2.0, half, {1, 0, 0, 0}};
    const double reach = 2.5 * instance.voxel_size;
    const auto away = depenetration(tracer, box, reach);
    const double least = least_of_samples(tracer, box, reach, random);
    if (!away) {
      ++none;
      EXPECT_EQ(least, reach) << round;
      continue;
    }
    ++found;
    EXPECT_TRUE(overlaps(tracer, moved(box, *away)).empty()) << round;
    EXPECT_LE(glm::length(*away), least + 1e-5) << round;
  }
  EXPECT_GT(found, 80);
  EXPECT_GT(none, 3);
}

TEST(FreePlace, IsNearNearestAmongTurnedBlocksAndFields) {
  Random random(5);
  int found = 0;
  for (int round = 0; round < 16; ++round) {
    Instance instance;
    instance.rotation = random.rotation();
    const Scene scene = round % 2 == 0 ? scene_of(heap(random, 120), instance) : random_blobs(random);
    const SceneTracer tracer(scene);
    const OrientedBox box{random.vector() * 3.0, 0.2 + glm::abs(random.vector()) * 0.6, random.rotation()};
    constexpr double kReach = 2.0;
    const auto away = depenetration(tracer, box, kReach);
    const double least = least_of_samples(tracer, box, kReach, random);
    if (!away) {
      // Any free space is narrower than 1/32.
      EXPECT_GT(least, 0.5 * kReach) << round;
      continue;
    }
    ++found;
    EXPECT_TRUE(overlaps(tracer, moved(box, *away)).empty()) << round;
    EXPECT_LE(glm::length(*away), least + kReach / 32.0) << round;
  }
  EXPECT_GT(found, 8);
}

TEST(FreePlace, FindsShaftAsWideAsBox) {
  Grid grid;
  grid.fill_box({{-4, -4, -4}, {5, 5, 5}}, kStone);
  grid.fill_box({{1, -4, 0}, {2, 5, 1}}, kAir);
  const Scene scene = scene_of(std::move(grid));
  const SceneTracer tracer(scene);
  const auto away = depenetration(tracer, {{0.7, 0.3, 0.6}, DVec3(0.5), {1, 0, 0, 0}}, 2.0);
  ASSERT_TRUE(away.has_value());
  EXPECT_NEAR(glm::distance(*away, DVec3(0.8, 0.0, -0.1)), 0.0, 1e-9);
}

TEST(FreePlace, StaysWithinDistance) {
  Grid grid;
  grid.fill_box({{-9, -9, -9}, {10, 10, 10}}, kStone);
  const Scene scene = scene_of(std::move(grid));
  const SceneTracer tracer(scene);
  const OrientedBox box{{0.5, 8.6, 0.5}, DVec3(0.5), {1, 0, 0, 0}};
  EXPECT_FALSE(depenetration(tracer, box, 1.89).has_value());
  EXPECT_NEAR(depenetration(tracer, box, 1.91)->y, 1.9, 1e-9);
  EXPECT_FALSE(depenetration(tracer, box, 0.0).has_value());
  EXPECT_EQ(*depenetration(tracer, moved(box, {0, 2, 0}), 0.0), DVec3(0.0));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {-1.0, nan, kInfinity}) {
    EXPECT_FALSE(depenetration(tracer, box, bad).has_value());
  }
  EXPECT_FALSE(depenetration(tracer, {{nan, 0, 0}, DVec3(0.5), {1, 0, 0, 0}}, 1.0).has_value());
  // A point.
  EXPECT_NEAR(depenetration(tracer, {{0.5, 9.8, 0.5}, DVec3(0.0), {1, 0, 0, 0}}, 1.0)->y, 0.2, 1e-9);
}

TEST(FreePlace, BoxStaysOnHump) {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {100, 21, 100}}, kStone);
  grid.fill_box({{49, 21, 49}, {52, 22, 52}}, kStone);
  const Scene scene = scene_of(std::move(grid));
  const SceneTracer tracer(scene);
  OrientedBox box{{50.5, 21.95, 50.5}, {0.4, 0.9, 0.4}, {1, 0, 0, 0}};
  for (const bool walks : {false, true}) {
    SlideOptions options;
    if (walks) options.floor.emplace();
    const SlideResult out = move_and_slide(tracer, box, {0, -0.02, 0}, options);
    EXPECT_NEAR(out.centre.x, 50.5, 1e-9);
    EXPECT_NEAR(out.centre.y, 22.9, 0.003);
    EXPECT_NEAR(out.centre.z, 50.5, 1e-9);
    const SlideResult again = move_and_slide(tracer, {out.centre, box.half_size, box.rotation}, {0, -0.02, 0}, options);
    EXPECT_NEAR(glm::distance(again.centre, out.centre), 0.0, 0.003);
  }
}

TEST(FreePlace, MovedBoxStaysOutside) {
  Random random(7);
  for (int round = 0; round < 40; ++round) {
    Instance instance;
    if (round % 2 == 0) instance.rotation = random.rotation();
    const Scene scene = scene_of(heap(random, 100), instance);
    const SceneTracer tracer(scene);
    const OrientedBox box{random.vector() * 3.0, {0.4, 0.9, 0.4}, {1, 0, 0, 0}};
    SlideOptions options;
    options.max_push_out = 20.0;
    const SlideResult out = move_and_slide(tracer, box, DVec3(0.0), options);
    const OrientedBox there{out.centre, box.half_size, box.rotation};
    EXPECT_TRUE(overlaps(tracer, there).empty()) << round;
    const SlideResult again = move_and_slide(tracer, there, DVec3(0.0), options);
    EXPECT_EQ(again.centre, out.centre) << round;
    EXPECT_FALSE(again.is_blocked) << round;
    options.max_push_out = 0.0;
    const bool was_inside = !overlaps(tracer, box).empty();
    const SlideResult stays = move_and_slide(tracer, box, DVec3(0.0), options);
    EXPECT_EQ(stays.is_blocked, was_inside) << round;
    EXPECT_EQ(stays.centre, box.centre) << round;
  }
}

}  // namespace
}  // namespace quoin
