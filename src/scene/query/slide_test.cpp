// Sliding and walking on fields, and on fields and blocks together.

#include <algorithm>
#include <cmath>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/scene/sweep.h>

#include "scene/query/field_scene_for_tests.h"

namespace quoin {
namespace {

constexpr DVec3 kUp{0.0, 1.0, 0.0};
const OrientedBox kPlayer{DVec3(0.0), {0.4, 0.9, 0.4}, {1, 0, 0, 0}};

// A plane through the origin that rises along x.
Scene slope_of(double degrees) {
  DensityGrid field;
  const double angle = degrees * std::numbers::pi / 180.0;
  field.edit({IVec3{-30, -30, -12}, IVec3{31, 31, 13}}, [&](IVec3 p, DensitySample) {
    return DensitySample{static_cast<float>(p.y * std::cos(angle) - p.x * std::sin(angle)), kStone};
  });
  return scene_of(std::move(field), {});
}

SlideOptions on_foot(double max_slope = 45.0, double step_height = 0.0, double snap_distance = 0.3) {
  SlideOptions options;
  options.floor = FloorOptions{kUp, max_slope, step_height, snap_distance};
  return options;
}

// Moves like a game's player: applies the remaining velocity and gravity at 60 steps per second.
struct Player {
  const SceneTracer& tracer;
  SlideOptions options;
  OrientedBox box = kPlayer;
  double falling = 0.0;
  SlideResult last;

  void step(DVec3 speed) {
    constexpr double kFrame = 1.0 / 60.0;
    falling -= 9.81 * kFrame;
    last = move_and_slide(tracer, box, (speed + kUp * falling) * kFrame, options);
    box.centre = last.centre;
    falling = glm::dot(last.displacement, kUp) / kFrame;
  }
  void steps(int count, DVec3 speed) {
    for (int i = 0; i < count; ++i) step(speed);
  }
  [[nodiscard]] double feet() const { return box.centre.y - box.half_size.y; }
};

Player player_at(const SceneTracer& tracer, DVec3 centre, const SlideOptions& options) {
  Player player{tracer, options, kPlayer, 0.0, {}};
  player.box.centre = centre;
  return player;
}

TEST(Walk, StandsStillOnSlope) {
  const Scene scene = slope_of(30.0);
  const SceneTracer tracer(scene);
  Player player = player_at(tracer, {0.0, 2.5, 0.3}, on_foot());
  player.steps(60, DVec3(0.0));
  const DVec3 settled = player.box.centre;
  EXPECT_TRUE(player.last.is_on_floor);
  EXPECT_NEAR(player.last.floor_normal.y, std::cos(std::numbers::pi / 6.0), 2e-3);
  player.steps(1'000, DVec3(0.0));
  EXPECT_LT(glm::length(player.box.centre - settled), 1e-6);
  EXPECT_TRUE(player.last.is_on_floor);
  // Without floor options the player slides as if on ice.
  Player sliding = player_at(tracer, settled, {});
  sliding.steps(60, DVec3(0.0));
  EXPECT_LT(sliding.box.centre.x, settled.x - 0.05);
}

TEST(Walk, ClimbsOnlySlopesUpToLimit) {
  const Scene scene = slope_of(40.0);
  const SceneTracer tracer(scene);
  for (const double max_slope : {45.0, 30.0}) {
    Player player = player_at(tracer, {-10.0, -6.0, 0.3}, on_foot(max_slope, 0.5));
    player.steps(60, DVec3(0.0));
    const DVec3 start = player.box.centre;
    player.steps(180, {3.0, 0.0, 0.0});
    if (max_slope > 40.0) {
      // The same speed as on level ground.
      EXPECT_NEAR(player.box.centre.x, start.x + 9.0, 0.05);
      EXPECT_NEAR(player.box.centre.y - start.y,
                  (player.box.centre.x - start.x) * std::tan(40.0 / 180.0 * std::numbers::pi), 0.05);
      EXPECT_TRUE(player.last.is_on_floor);
    } else {
      EXPECT_LT(player.box.centre.y, start.y + 0.01);
      EXPECT_FALSE(player.last.is_on_floor);
    }
  }
}

TEST(Walk, DescendsWithoutHopping) {
  const Scene scene = slope_of(35.0);
  const SceneTracer tracer(scene);
  Player player = player_at(tracer, {10.0, 10.0, 0.3}, on_foot());
  player.steps(60, DVec3(0.0));
  const DVec3 start = player.box.centre;
  const double tangent = std::tan(35.0 / 180.0 * std::numbers::pi);
  for (int i = 0; i < 180; ++i) {
    player.step({-5.0, 0.0, 0.0});
    ASSERT_TRUE(player.last.is_on_floor) << i;
    ASSERT_NEAR(player.box.centre.y - start.y, (player.box.centre.x - start.x) * tangent, 0.02) << i;
  }
  EXPECT_NEAR(player.box.centre.x, start.x - 15.0, 0.05);
}

TEST(Walk, JumpsAndLands) {
  const Scene scene = slope_of(20.0);
  const SceneTracer tracer(scene);
  Player player = player_at(tracer, {0.0, 3.0, 0.3}, on_foot());
  player.steps(60, DVec3(0.0));
  const double ground = player.feet();
  player.falling = 5.0;
  double highest = ground;
  for (int i = 0; i < 120; ++i) {
    player.step(DVec3(0.0));
    highest = std::max(highest, player.feet());
  }
  EXPECT_NEAR(highest, ground + 25.0 / (2.0 * 9.81), 0.1);
  EXPECT_NEAR(player.feet(), ground, 1e-3);
  EXPECT_TRUE(player.last.is_on_floor);
}

TEST(Walk, FollowsRollingGroundInAnyPlacement) {
  Random random(41);
  for (int round = 0; round < 16; ++round) {
    Instance placed;
    placed.rotation = glm::angleAxis(random.share() * 3.0, kUp);
    placed.voxel_size = 1.0 + 0.5 * random.share();
    placed.mirrored = round % 2 == 1;
    placed.position = random.vector() * 20.0;
    const Scene scene = scene_of(rolling_ground(random, 30, 0.4 + 0.3 * (round % 2)), placed);
    const SceneTracer tracer(scene);
    Player player = player_at(tracer, placed.position + kUp * 8.0, on_foot());
    if (round % 3 == 0) player.box.rotation = glm::angleAxis(random.share() * 3.0, kUp);
    player.steps(120, DVec3(0.0));
    const DVec3 start = player.box.centre;
    DVec3 before = start;
    for (int i = 0; i < 200; ++i) {
      player.step(placed.rotation * DVec3(4.0, 0.0, 1.0));
      ASSERT_TRUE(player.last.is_on_floor) << round << ", " << i;
      // No invisible walls where cells meet.
      ASSERT_FALSE(player.last.is_blocked) << round << ", " << i;
      ASSERT_LT(std::abs(player.box.centre.y - before.y), 0.1) << round << ", " << i;
      ASSERT_TRUE(overlaps(tracer, player.box).empty());
      // The ground is within the skin of some part of the box.
      OrientedBox thicker = player.box;
      thicker.half_size += 2.1e-3;
      ASSERT_FALSE(overlaps(tracer, thicker).empty()) << round << ", " << i;
      before = player.box.centre;
    }
    EXPECT_NEAR(glm::length((before - start) * DVec3(1, 0, 1)), 200.0 / 60.0 * std::sqrt(17.0), 0.1) << round;
  }
}

TEST(Walk, StepsUpToStepHeight) {
  SceneGrid yard;
  yard.field.edit({IVec3{-24, -8, -12}, IVec3{25, 9, 13}}, [](IVec3 p, DensitySample) {
    return DensitySample{static_cast<float>(p.y) + 0.5F, kStone};
  });
  yard.grid.fill_box({{4, -1, -8}, {24, 0, 8}}, kWood);  // half a voxel above the ground
  yard.grid.fill_box({{10, 0, -8}, {24, 1, 8}}, kWood);  // one voxel above that
  const Scene scene = scene_of(std::move(yard), {});
  const SceneTracer tracer(scene);
  const auto walk = [&](double step_height) {
    Player player = player_at(tracer, {0.0, 1.0, 0.2}, on_foot(45.0, step_height));
    player.steps(30, DVec3(0.0));
    player.steps(240, {4.0, 0.0, 0.0});
    EXPECT_TRUE(player.last.is_on_floor);
    return player;
  };
  EXPECT_NEAR(walk(0.0).box.centre.x, 4.0 - 0.4, 2e-3);
  EXPECT_NEAR(walk(0.4).box.centre.x, 4.0 - 0.4, 2e-3);
  EXPECT_NEAR(walk(0.6).box.centre.x, 10.0 - 0.4, 2e-3);
  EXPECT_NEAR(walk(0.6).feet(), 0.0, 2e-3);
  EXPECT_NEAR(walk(1.1).box.centre.x, 16.0, 0.1);
  EXPECT_NEAR(walk(1.1).feet(), 1.0, 2e-3);
  // Walks down again; does not fall while the floor is within the search distance.
  Player down = walk(1.1);
  down.options = on_foot(45.0, 1.1, 1.1);
  for (int i = 0; i < 240; ++i) {
    down.step({-4.0, 0.0, 0.0});
    ASSERT_TRUE(down.last.is_on_floor) << i;
  }
  EXPECT_NEAR(down.feet(), -0.5, 2e-3);
}

TEST(Walk, StepsOntoRocksOfField) {
  SceneGrid yard;
  yard.field.edit({IVec3{-24, -8, -12}, IVec3{25, 9, 13}}, [](IVec3 p, DensitySample) {
    return DensitySample{static_cast<float>(p.y) + 0.5F, kStone};
  });
  yard.field.add_box({4.0, -2.0, -8.0}, {12.0, 0.2, 8.0}, kStone);
  const Scene scene = scene_of(std::move(yard), {});
  const SceneTracer tracer(scene);
  for (const double step_height : {0.0, 1.0}) {
    Player player = player_at(tracer, {0.0, 1.0, 0.2}, on_foot(35.0, step_height));
    player.steps(30, DVec3(0.0));
    player.steps(120, {3.0, 0.0, 0.0});
    if (step_height == 0.0) {
      EXPECT_LT(player.box.centre.x, 4.0);
      EXPECT_LT(player.feet(), 0.0);
    } else {
      EXPECT_NEAR(player.box.centre.x, 6.0, 0.1);
      EXPECT_NEAR(player.feet(), 0.2, 2e-3);
    }
  }
}

TEST(Walk, DoesNotStepOntoSteepSlopes) {
  const Scene scene = slope_of(60.0);
  const SceneTracer tracer(scene);
  Player player = player_at(tracer, {-3.0, 1.0, 0.3}, on_foot(45.0, 0.6));
  player.steps(20, {2.0, 0.0, 0.0});
  const double height = player.box.centre.y;
  player.steps(200, {2.0, 0.0, 0.0});
  EXPECT_LT(player.box.centre.y, height);
}

// A box pushed in any direction enters neither blocks nor the slope that they stand in.
TEST(Walk, StaysOutOfCornersOfBlocksAndSlopes) {
  Random random(6);
  for (const double degrees : {20.0, 50.0}) {
    for (const bool walks : {false, true}) {
      Scene scene = slope_of(degrees);
      scene.edit(scene.grids().handles()[0]).grid.fill_box({{4, -20, -12}, {6, 20, 12}}, kWood);
      const SceneTracer tracer(scene);
      Player player = player_at(tracer, {0.0, 3.0, 0.3}, walks ? on_foot(45.0, 0.5) : SlideOptions());
      for (int i = 0; i < 600; ++i) {
        DVec3 speed = DVec3(6.0, 0.0, 0.0) + random.vector() * DVec3(4.0, 0.0, 4.0);
        if (std::abs(player.box.centre.z) > 8.0) speed.z = -player.box.centre.z;
        player.step(speed);
        ASSERT_LT(player.box.centre.x, 4.0 - 0.4);
        ASSERT_TRUE(overlaps(tracer, player.box).empty()) << degrees << ", " << i;
      }
    }
  }
}

// Thousands of steps of all kinds over hills with houses and rocks never end inside a solid.
TEST(Walk, WandersWithoutEnteringSolids) {
  Random random(2024);
  for (int round = 0; round < 8; ++round) {
    SceneGrid land;
    land.field = rolling_ground(random, 24, 0.5 + 0.5 * (round % 3));
    for (int i = 0; i < 12; ++i) {
      const IVec3 at(random.vector() * DVec3(16.0, 3.0, 16.0));
      land.grid.fill_box({at, at + IVec3(1 + i % 4, 1 + i % 3, 1 + i % 2)}, kWood);
      land.field.add_sphere(random.vector() * DVec3(16.0, 3.0, 16.0), 1.5, kStone, 1.0);
    }
    Instance placed;
    if (round % 2 == 1) place_anywhere(placed, random);
    const Scene scene = scene_of(std::move(land), placed);
    const Instance& instance = scene.instances()[scene.instances().handles()[0]];
    const SceneGrid& grid = scene.grids()[instance.grid];
    const SceneTracer tracer(scene);
    const DVec3 up = glm::normalize(world_from_grid_direction(instance, kUp));
    SlideOptions options = on_foot(45.0, round % 4 < 2 ? 0.5 : 0.0);
    options.floor->up = up;
    if (round == 7) options.floor.reset();
    OrientedBox box = kPlayer;
    box.rotation = round % 3 == 0 ? random.rotation() : instance.rotation;
    DVec3 heading(0.0);
    for (int i = 0; i < 1'500; ++i) {
      const DVec3 in_grid = grid_from_world(instance, grid, box.centre);
      if (i == 0 || std::max(std::abs(in_grid.x), std::abs(in_grid.z)) > 18.0 || in_grid.y < -8.0) {
        box.centre = world_from_grid(instance, grid, {random.share() * 10.0, 9.0, random.share() * 10.0});
      }
      if (i % 40 == 0) heading = random.vector() * 0.3;
      DVec3 way = heading + random.vector() * 0.05 - up * (i % 100 < 90 ? 0.08 : -0.1);
      if (i % 200 == 0) way *= 20.0;
      const SlideResult result = move_and_slide(tracer, box, way, options);
      box.centre = result.centre;
      ASSERT_TRUE(is_finite(box.centre));
      ASSERT_TRUE(overlaps(tracer, box).empty()) << round << ", " << i;
      ASSERT_LE(glm::length(result.displacement), glm::length(way) + 1e-9) << round << ", " << i;
    }
  }
}

// Floor options also apply to blocks; without them, blocks behave as ordinary obstacles.
TEST(Walk, WalksOnBlocks) {
  SceneGrid yard;
  yard.grid.fill_box({{-10, -1, -10}, {10, 0, 10}}, kWood);
  yard.grid.fill_box({{3, 0, -10}, {5, 3, 10}}, kWood);
  const Scene scene = scene_of(std::move(yard), {});
  const SceneTracer tracer(scene);
  Player player = player_at(tracer, {0.0, 2.0, 0.2}, on_foot());
  player.steps(60, DVec3(0.0));
  EXPECT_TRUE(player.last.is_on_floor);
  EXPECT_FALSE(player.last.is_blocked);
  EXPECT_EQ(player.last.floor_normal, kUp);
  EXPECT_NEAR(player.feet(), 1e-3, 1e-8);
  player.steps(60, {6.0, 0.0, 2.0});
  EXPECT_TRUE(player.last.is_blocked);
  EXPECT_EQ(player.last.normal, DVec3(-1, 0, 0));
  EXPECT_NEAR(player.box.centre.x, 2.6, 1e-3 + 1e-8);
  EXPECT_NEAR(player.box.centre.z, 2.2, 1e-6);
  EXPECT_NEAR(player.feet(), 1e-3, 1e-8);
  EXPECT_TRUE(player.last.is_on_floor);
  player.steps(2, {0.0, 6.0, 0.0});
  EXPECT_FALSE(player.last.is_on_floor);
}

TEST(Walk, InvalidFloorOptionsDisableFloor) {
  const Scene scene = slope_of(20.0);
  const SceneTracer tracer(scene);
  const double nan = std::nan("");
  for (const DVec3 up : {DVec3(0.0), DVec3(nan), DVec3(0.0, kInfinity, 0.0)}) {
    SlideOptions options = on_foot();
    options.floor->up = up;
    const OrientedBox box = moved(kPlayer, {0.0, 2.0, 0.0});
    const SlideResult plain = move_and_slide(tracer, box, {0.5, -3.0, 0.2});
    const SlideResult result = move_and_slide(tracer, box, {0.5, -3.0, 0.2}, options);
    EXPECT_EQ(result.centre, plain.centre);
    EXPECT_FALSE(result.is_on_floor);
  }
  EXPECT_EQ(move_and_slide(tracer, kPlayer, DVec3(nan), on_foot()).centre, kPlayer.centre);
  SlideOptions no_slope = on_foot(nan);
  EXPECT_FALSE(move_and_slide(tracer, moved(kPlayer, {0, 2, 0}), {0, -3, 0}, no_slope).is_on_floor);
}

}  // namespace
}  // namespace quoin
