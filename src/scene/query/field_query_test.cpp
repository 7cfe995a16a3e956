// Overlaps and sweeps against fields, compared with a search over sample points of the solid and with results known by
// analysis.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/scene/scene_query.h>
#include <quoin/scene/sweep.h>

#include "scene/query/field_scene_for_tests.h"

namespace quoin {
namespace {

// Returns the lattice points with a negative field, in the world.
std::vector<DVec3> points_of_solid(const Scene& scene, InstanceHandle handle, double spacing) {
  const Instance& instance = scene.instances()[handle];
  const SceneGrid& grid = scene.grids()[instance.grid];
  std::vector<DVec3> points;
  const IBox box = grid.field.bounds();
  for (double z = box.min.z; z <= box.max.z; z += spacing) {
    for (double y = box.min.y; y <= box.max.y; y += spacing) {
      for (double x = box.min.x; x <= box.max.x; x += spacing) {
        if (grid.field.density_at({x, y, z}) < 0.0F) points.push_back(world_from_grid(instance, grid, {x, y, z}));
      }
    }
  }
  return points;
}

// A moving box and the times when it contains points.
struct Way {
  OrientedBox box;
  DVec3 speed;
  glm::dmat3 axes;

  Way(const OrientedBox& on_its_way, DVec3 displacement)
      : box(on_its_way), axes(glm::mat3_cast(glm::normalize(on_its_way.rotation))) {
    speed = displacement * axes;
  }
  // Infinity if no contact, or no contact deeper than `shrunk_by`.
  [[nodiscard]] double entry(DVec3 point, double shrunk_by) const {
    const DVec3 at = (point - box.centre) * axes;
    double enter = 0.0;
    double leave = 1.0;
    for (int i = 0; i < 3; ++i) {
      const double half = box.half_size[i] - shrunk_by;
      if (half < 0.0) return kInfinity;
      if (speed[i] == 0.0) {
        if (std::abs(at[i]) > half) return kInfinity;
        continue;
      }
      const double a = (at[i] - half) / speed[i];
      const double b = (at[i] + half) / speed[i];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    return enter <= leave ? enter : kInfinity;
  }
  [[nodiscard]] bool holds_any(const std::vector<DVec3>& points, double shrunk_by) const {
    return std::any_of(points.begin(), points.end(), [&](DVec3 p) { return entry(p, shrunk_by) == 0.0; });
  }
};

TEST(FieldQuery, SweepsStopExactlyAtSolid) {
  Random random(11);
  int hits = 0;
  int inside = 0;
  for (int round = 0; round < 12; ++round) {
    Scene scene = round % 2 == 0 ? random_blobs(random) : random_noise(random);
    const InstanceHandle handle = scene.instances().handles()[0];
    place_anywhere(scene.edit(handle), random);
    const double size = scene.instances()[handle].voxel_size;
    const DVec3 about = scene.instances()[handle].position;
    const SceneTracer tracer(scene);
    const std::vector<DVec3> solid = points_of_solid(scene, handle, 0.125);
    for (int i = 0; i < 60; ++i) {
      const DVec3 half = glm::abs(random.vector()) * size * (i % 4 == 0 ? 0.1 : 1.5);
      const OrientedBox box{about + random.vector() * 14.0 * size, half, random.rotation()};
      const DVec3 way = about + random.vector() * 5.0 * size - box.centre;
      const DVec3 displacement = way * (i % 3 == 0 ? 0.3 : 2.0);
      const auto hit = sweep_box(tracer, box, displacement);
      double soonest = kInfinity;
      const Way on_its_way(box, displacement);
      for (const DVec3 point : solid) soonest = std::min(soonest, on_its_way.entry(point, 2e-6 * size));
      const std::string where = "round " + std::to_string(round) + ", sweep " + std::to_string(i);
      ASSERT_LE(hit ? hit->fraction : 1.0, std::max(soonest, 0.0)) << where;
      if (!hit) continue;
      EXPECT_NEAR(glm::length(hit->normal), 1.0, 1e-9) << where;
      EXPECT_TRUE(hit->in_field);
      if (hit->depth > 0.0) {
        ++inside;
        EXPECT_EQ(hit->fraction, 0.0);
        EXPECT_FALSE(overlaps(tracer, box).empty()) << where;
        continue;
      }
      ++hits;
      EXPECT_LE(glm::dot(hit->normal, displacement), 1e-9) << where;
      OrientedBox there = moved(box, displacement * hit->fraction);
      EXPECT_TRUE(overlaps(tracer, there).empty()) << where;
      there.half_size += 2e-5 * size;
      EXPECT_FALSE(overlaps(tracer, there).empty()) << where;
    }
  }
  EXPECT_GT(hits, 200);
  EXPECT_GT(inside, 20);
}

TEST(FieldQuery, OverlapsMatchPointsOfSolid) {
  Random random(4);
  int both = 0;
  int neither = 0;
  for (int round = 0; round < 8; ++round) {
    Scene scene = round % 2 == 0 ? random_blobs(random) : random_noise(random);
    const InstanceHandle handle = scene.instances().handles()[0];
    place_anywhere(scene.edit(handle), random);
    const double size = scene.instances()[handle].voxel_size;
    const DVec3 about = scene.instances()[handle].position;
    const SceneTracer tracer(scene);
    const std::vector<DVec3> solid = points_of_solid(scene, handle, 0.125);
    for (int i = 0; i < 100; ++i) {
      const OrientedBox box{about + random.vector() * 9.0 * size, glm::abs(random.vector()) * size * 2.0,
                            random.rotation()};
      const auto found = overlaps(tracer, box);
      const bool has_point = Way(box, DVec3(0.0)).holds_any(solid, 2e-6 * size);
      if (has_point) {
        ASSERT_EQ(found.size(), 1U) << round << ", " << i;
        EXPECT_TRUE(found[0].in_field);
        EXPECT_EQ(found[0].type, 1);
        ++both;
      }
      // If even a box that is larger by half the spacing of the points contains no solid point, the query finds
      // nothing.
      OrientedBox larger = box;
      larger.half_size += 0.13 * size;
      const bool is_near = Way(larger, DVec3(0.0)).holds_any(solid, 0.0);
      if (!is_near) {
        EXPECT_TRUE(found.empty()) << round << ", " << i;
        ++neither;
      }
      const double radius = std::abs(random.share()) * 3.0 * size;
      double nearest = kInfinity;
      for (const DVec3 p : solid) nearest = std::min(nearest, glm::length(p - box.centre));
      const bool in_ball = !overlaps(tracer, box.centre, radius).empty();
      if (nearest < radius - 2e-6 * size) {
        EXPECT_TRUE(in_ball) << round << ", " << i;
      }
      if (nearest > radius + 0.25 * size) {
        EXPECT_FALSE(in_ball) << round << ", " << i;
      }
    }
  }
  EXPECT_GT(both, 100);
  EXPECT_GT(neither, 100);
}

// The trilinear field represents a plane exactly where halves hold its samples exactly.
TEST(FieldQuery, SweepsStopAtPlanesOfAnyOrientation) {
  Random random(21);
  for (const IVec3 normal : {IVec3(0, 1, 0), IVec3(1, 2, 0), IVec3(1, 2, 2), IVec3(-2, 3, 1), IVec3(3, -1, 2)}) {
    DensityGrid field(1024.0F);
    field.edit({IVec3{-20}, IVec3{21}}, [&](IVec3 p, DensitySample) {
      return DensitySample{static_cast<float>(glm::dot(DVec3(normal), DVec3(p)) + 0.5), 1};
    });
    for (int i = 0; i < 60; ++i) {
      Scene scene = scene_of(field.snapshot(), {});
      const InstanceHandle handle = scene.instances().handles()[0];
      if (i % 2 == 1) place_anywhere(scene.edit(handle), random);
      const Instance& instance = scene.instances()[handle];
      const SceneTracer tracer(scene);
      const DVec3 up = glm::normalize(world_from_grid_direction(instance, DVec3(normal)));
      const double size = instance.voxel_size;
      const double height = -0.5 / glm::length(DVec3(normal)) * size;  // plane above the position, along `up`
      const DQuat rotation = i % 4 < 2 ? instance.rotation : random.rotation();
      const OrientedBox box{instance.position + up * (5.0 * size) + random.vector() * size,
                            glm::abs(random.vector()) * size, rotation};
      const glm::dmat3 axes = glm::mat3_cast(rotation);
      double reach = 0.0;
      for (int k = 0; k < 3; ++k) reach += std::abs(glm::dot(axes[k], up)) * box.half_size[k];
      const DVec3 way = (random.vector() - 2.0 * up) * 6.0 * size;
      const double expected = (glm::dot(box.centre - instance.position, up) - reach - height) / -glm::dot(way, up);
      const auto hit = sweep_box(tracer, box, way);
      ASSERT_EQ(hit.has_value(), expected <= 1.0) << i;
      if (!hit) continue;
      EXPECT_NEAR(hit->fraction, expected, 1e-9) << i;
      // For a flush box, all directions that separate both bodies are equal.
      EXPECT_LT(glm::length(hit->normal - up), 1e-6) << i;
    }
  }
}

TEST(FieldQuery, BallIsHitByFacesEdgesAndCorners) {
  Random random(5);
  DensityGrid field;
  field.add_sphere(DVec3(0.25, -0.5, 0.125), 9.0, 1);
  const Scene scene = scene_of(std::move(field), {});
  const SceneTracer tracer(scene);
  const DVec3 centre(0.25, -0.5, 0.125);
  for (int i = 0; i < 200; ++i) {
    const DVec3 half = glm::abs(random.vector()) * 2.0;
    const DQuat rotation = random.rotation();
    const DVec3 from = centre + random.direction() * 20.0;
    const OrientedBox box{from, half, rotation};
    const DVec3 way = (centre + random.vector() - from) * 1.2;
    const auto hit = sweep_box(tracer, box, way);
    ASSERT_TRUE(hit.has_value());
    // The box's nearest point is one radius away; the trilinear field is off by a few hundredths.
    const glm::dmat3 axes = glm::mat3_cast(rotation);
    const DVec3 at = box.centre + way * hit->fraction;
    const DVec3 nearest = at + axes * glm::clamp((centre - at) * axes, -half, half);
    EXPECT_NEAR(glm::length(nearest - centre), 9.0, 0.03) << i;
    EXPECT_GT(glm::dot(hit->normal, glm::normalize(nearest - centre)), 0.98) << i;
  }
}

TEST(FieldQuery, NeverTunnelsAtAnySpeed) {
  Random random(8);
  DensityGrid sheet;
  // A sheet half a sample thick.
  sheet.edit({{-40, -2, -40}, {41, 3, 41}}, [](IVec3 p, DensitySample) {
    return DensitySample{static_cast<float>(std::abs(p.y)) - 0.25F, 1};
  });
  const DQuat rotation = random.rotation();
  const Scene scene = scene_of(std::move(sheet), {"", {}, DVec3(0.0), rotation});
  const SceneTracer tracer(scene);
  const DVec3 normal = rotation * DVec3(0, 1, 0);
  for (const double speed : {3.0, 100.0, 1e4, 1e6}) {
    for (int i = 0; i < 20; ++i) {
      const DVec3 aside = glm::cross(random.vector(), normal) * 4.0;
      const DVec3 half = i % 4 == 0 ? DVec3(0.0) : glm::abs(random.vector()) * 0.4;
      const OrientedBox box{normal * 2.5 + aside, half, random.rotation()};
      const auto hit = sweep_box(tracer, box, -normal * speed);
      ASSERT_TRUE(hit.has_value()) << speed;
      EXPECT_LT(hit->fraction * speed, 2.5);
      EXPECT_GT(glm::dot(hit->normal, normal), 0.999);
    }
  }
}

TEST(FieldQuery, PointSweepMatchesRay) {
  Random random(31);
  Scene scene = random_blobs(random);
  place_anywhere(scene.edit(scene.instances().handles()[0]), random);
  const Instance& instance = scene.instances()[scene.instances().handles()[0]];
  const SceneTracer tracer(scene);
  int hits = 0;
  for (int i = 0; i < 300; ++i) {
    const Ray ray{instance.position + random.direction() * 20.0 * instance.voxel_size, {}};
    const DVec3 way = (instance.position + random.vector() * 6.0 * instance.voxel_size - ray.origin) * 1.5;
    const auto expected = first_hit(tracer, {ray.origin, way}, 1.0);
    const auto hit = sweep_box(tracer, {ray.origin, DVec3(0.0), random.rotation()}, way);
    ASSERT_EQ(hit.has_value(), expected.has_value()) << i;
    if (!hit) continue;
    ++hits;
    EXPECT_NEAR(hit->fraction, expected->t, 1e-5) << i;
    EXPECT_GT(glm::dot(hit->normal, expected->normal), 0.999) << i;
    EXPECT_EQ(hit->type, expected->type);
  }
  EXPECT_GT(hits, 100);
}

TEST(FieldQuery, AnyHitMatchesFirstHit) {
  Random random(53);
  Scene scene = random_blobs(random);
  SceneGrid& blocks = scene.edit(scene.grids().handles()[0]);
  for (int i = 0; i < 20; ++i) blocks.grid.set(IVec3(random.vector() * 9.0), i % 2 == 0 ? kWood : kWater);
  const GridHandle handle = scene.grids().handles()[0];
  for (int i = 0; i < 12; ++i) {
    Instance instance;
    instance.grid = handle;
    place_anywhere(instance, random);
    instance.position = random.vector() * 40.0;
    scene.add_instance(instance);
  }
  const SceneTracer tracer(scene);
  std::array<int, 2> answers{};
  for (int i = 0; i < 2'000; ++i) {
    const Ray ray{random.vector() * 50.0, random.vector()};
    const double max_t = i % 3 == 0 ? kInfinity : 60.0 * std::abs(random.share());
    const auto first = first_hit(tracer, ray, max_t);
    ASSERT_EQ(any_hit(tracer, ray, max_t), first.has_value()) << i;
    ++answers.at(first.has_value() ? 1 : 0);
    if (!first) continue;
    EXPECT_TRUE(any_hit(tracer, ray, first->t + 1e-6)) << i;
    EXPECT_TRUE(first->t == 0.0 || !any_hit(tracer, ray, first->t * (1.0 - 1e-6))) << i;
  }
  EXPECT_GT(std::min(answers[0], answers[1]), 60);
}

TEST(FieldQuery, MovesOutOfSolidAtStart) {
  Random random(77);
  int moved_out = 0;
  for (int round = 0; round < 20; ++round) {
    Scene scene = scene_of(rolling_ground(random, 24), {});
    place_anywhere(scene.edit(scene.instances().handles()[0]), random);
    const Instance& instance = scene.instances()[scene.instances().handles()[0]];
    const SceneGrid& grid = scene.grids()[instance.grid];
    const SceneTracer tracer(scene);
    for (int i = 0; i < 10; ++i) {
      const DVec3 place(random.share() * 12.0, 0.0, random.share() * 12.0);
      const double ground = height_of(grid.field, place.x, place.z);
      const DVec3 half = (0.2 + glm::abs(random.vector())) * instance.voxel_size;
      const OrientedBox box{world_from_grid(instance, grid, {place.x, ground + random.share(), place.z}), half,
                            random.rotation()};
      if (overlaps(tracer, box).empty()) continue;
      const auto hit = sweep_box(tracer, box, random.vector());
      ASSERT_TRUE(hit.has_value());
      EXPECT_EQ(hit->fraction, 0.0);
      EXPECT_GT(hit->depth, 0.0);
      EXPECT_TRUE(overlaps(tracer, moved(box, hit->normal * (hit->depth + 1e-4 * instance.voxel_size))).empty());
      const SlideResult out = move_and_slide(tracer, box, DVec3(0.0));
      EXPECT_TRUE(overlaps(tracer, moved(box, out.centre - box.centre)).empty());
      SlideOptions stays;
      stays.pushes_out = false;
      const SlideResult stayed = move_and_slide(tracer, box, random.vector(), stays);
      EXPECT_EQ(stayed.centre, box.centre);
      EXPECT_TRUE(stayed.is_blocked);
      ++moved_out;
    }
  }
  EXPECT_GT(moved_out, 100);
}

TEST(FieldQuery, StopsOnlyAtCollidingMaterials) {
  DensityGrid sea;
  sea.add_box({-8, -8, -8}, {8, 0, 8}, kStone);
  sea.add_box({-8, -8, -8}, {8, 4, 8}, kWater);
  const Scene scene = scene_of(std::move(sea), {});
  const SceneTracer tracer(scene);
  const OrientedBox box{{0.3, 9.0, 0.2}, DVec3(0.4), {1, 0, 0, 0}};
  const auto hit = sweep_box(tracer, box, {0, -20, 0});
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->type, kStone);
  // The cells between the last samples of stone and the first of water collide.
  EXPECT_NEAR(9.0 - 20.0 * hit->fraction - 0.4, 1.0, 1.0 + 1e-6);
  EXPECT_TRUE(overlaps(tracer, moved(box, {0, -6.5, 0})).empty());
  EXPECT_EQ(overlaps(tracer, moved(box, {0, -9.5, 0})).size(), 1U);
  // Solid without a material, or with an unregistered one, is still solid.
  for (const VoxelType type : {kAir, VoxelType{99}}) {
    DensityGrid bare;
    bare.edit({IVec3{-4}, IVec3{5}}, [&](IVec3 p, DensitySample) {
      return DensitySample{static_cast<float>(p.y) - 0.5F, type};
    });
    const Scene other = scene_of(std::move(bare), {});
    const SceneTracer of_other(other);
    EXPECT_TRUE(sweep_box(of_other, box, {0, -20, 0}).has_value());
  }
}

TEST(FieldQuery, TouchingIsNoHit) {
  DensityGrid floor;
  floor.edit({IVec3{-10}, IVec3{11}}, [](IVec3 p, DensitySample) {
    return DensitySample{static_cast<float>(p.y), kStone};
  });
  const Scene scene = scene_of(std::move(floor), {});
  const SceneTracer tracer(scene);
  const OrientedBox box{{0.3, 0.5, 0.2}, DVec3(0.5), {1, 0, 0, 0}};
  EXPECT_TRUE(overlaps(tracer, box).empty());
  EXPECT_TRUE(overlaps(tracer, {0.3, 0.5, 0.2}, 0.5).empty());
  EXPECT_FALSE(sweep_box(tracer, box, {5, 0, 3}).has_value());
  EXPECT_FALSE(sweep_box(tracer, box, {0, 3, 0}).has_value());
  const auto hit = sweep_box(tracer, box, {5, -1, 3});
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->fraction, 0.0);
  EXPECT_EQ(hit->depth, 0.0);
  EXPECT_EQ(hit->normal, DVec3(0, 1, 0));
}

TEST(FieldQuery, NonFiniteInputHitsNothing) {
  const Scene scene = scene_of(
      [] {
        DensityGrid ball;
        ball.add_sphere(DVec3(0.0), 6.0, kStone);
        return ball;
      }(),
      {});
  const SceneTracer tracer(scene);
  for (const double bad : {std::nan(""), kInfinity, -kInfinity}) {
    for (int axis = 0; axis < 3; ++axis) {
      OrientedBox box;
      box.centre[axis] = bad;
      EXPECT_TRUE(overlaps(tracer, box).empty());
      EXPECT_FALSE(sweep_box(tracer, box, {1, 0, 0}).has_value());
      box = {};
      box.half_size[axis] = bad;
      EXPECT_TRUE(overlaps(tracer, box).empty());
      EXPECT_FALSE(sweep_box(tracer, box, {1, 0, 0}).has_value());
      DVec3 way(0.0);
      way[axis] = bad;
      EXPECT_FALSE(sweep_box(tracer, {}, way).has_value());
    }
    EXPECT_TRUE(overlaps(tracer, DVec3(0.0), bad).empty());
  }
  // Distant boxes, and an empty scene.
  EXPECT_FALSE(sweep_box(tracer, {DVec3(1e9)}, {1e8, 0, 0}).has_value());
  const Scene empty = scene_of(DensityGrid(), {});
  EXPECT_TRUE(overlaps(SceneTracer(empty), OrientedBox{}).empty());
  EXPECT_FALSE(sweep_box(SceneTracer(empty), {}, {5, 0, 0}).has_value());
}

// Only the signs of densities and the trilinear field between them matter.
TEST(FieldQuery, AcceptsDensitiesOfAnyScale) {
  for (const float scale : {1e-4F, 1.0F, 1000.0F}) {
    DensityGrid field(60'000.0F);
    field.edit({IVec3{-10}, IVec3{11}}, [&](IVec3 p, DensitySample) {
      return DensitySample{scale * (static_cast<float>(p.y) - 0.5F), kStone};
    });
    const Scene scene = scene_of(std::move(field), {});
    const SceneTracer tracer(scene);
    for (const double thick : {0.0, 0.5}) {
      const OrientedBox box{{0.3, 8.0, 0.2}, DVec3(thick), glm::angleAxis(0.3, DVec3(0, 1, 0))};
      const auto hit = sweep_box(tracer, box, {0, -20, 0});
      ASSERT_TRUE(hit.has_value());
      EXPECT_NEAR(8.0 - thick - 20.0 * hit->fraction, 0.5, 1e-3) << scale;
      EXPECT_NEAR(hit->normal.y, 1.0, 1e-3);
      const auto inside = sweep_box(tracer, moved(box, {0, -8.0, 0}), {1, 0, 0});
      ASSERT_TRUE(inside.has_value());
      EXPECT_NEAR(inside->depth, 0.5 + thick, 1e-2) << scale;
    }
  }
}

// Results do not depend on an instance's placement.
TEST(FieldQuery, ResultsMoveWithInstance) {
  Random random(64);
  Scene plain = random_blobs(random);
  Scene turned = plain.snapshot();
  const InstanceHandle handle = plain.instances().handles()[0];
  const SceneTracer in_plain(plain);
  for (int round = 0; round < 10; ++round) {
    Instance& instance = turned.edit(handle);
    place_anywhere(instance, random);
    instance.mirrored = false;
    if (round % 3 == 0) instance.position *= 1e6;
    const SceneTracer in_turned(turned);
    const SceneGrid& grid = turned.grids()[instance.grid];
    for (int i = 0; i < 40; ++i) {
      const OrientedBox box{random.direction() * 14.0, glm::abs(random.vector()) * 1.5, random.rotation()};
      const DVec3 way = (random.vector() * 4.0 - box.centre) * 1.5;
      const OrientedBox other{world_from_grid(instance, grid, box.centre), box.half_size * instance.voxel_size,
                              instance.rotation * box.rotation};
      const auto expected = sweep_box(in_plain, box, way);
      const auto hit = sweep_box(in_turned, other, world_from_grid_direction(instance, way));
      ASSERT_EQ(hit.has_value(), expected.has_value());
      if (!hit) continue;
      EXPECT_NEAR(hit->fraction, expected->fraction, 1e-5);
      EXPECT_LT(glm::length(hit->normal - glm::normalize(world_from_grid_direction(instance, expected->normal))), 2e-2);
      EXPECT_NEAR(hit->depth / instance.voxel_size, expected->depth, 1e-5);
    }
  }
}

TEST(FieldQuery, HitsBlocksAndFieldOfOneGrid) {
  SceneGrid farm;
  farm.field.edit({IVec3{-20}, IVec3{21}}, [](IVec3 p, DensitySample) {
    return DensitySample{static_cast<float>(p.y) - 0.5F, kStone};
  });
  farm.grid.fill_box({{2, 0, -3}, {8, 4, 3}}, kWood);
  Scene scene = scene_of(std::move(farm), {});
  const SceneTracer tracer(scene);
  const OrientedBox box{{-5.0, 3.0, 0.1}, DVec3(0.5), {1, 0, 0, 0}};
  const auto ground = sweep_box(tracer, box, {0, -9, 0});
  ASSERT_TRUE(ground.has_value());
  EXPECT_TRUE(ground->in_field);
  EXPECT_EQ(ground->type, kStone);
  EXPECT_NEAR(ground->fraction, 2.0 / 9.0, 1e-9);
  const auto wall = sweep_box(tracer, box, {9, 0, 0});
  ASSERT_TRUE(wall.has_value());
  EXPECT_FALSE(wall->in_field);
  EXPECT_EQ(wall->type, kWood);
  EXPECT_NEAR(wall->fraction, 6.5 / 9.0, 1e-9);
  // One result per instance: its voxel, if it has one in the box.
  const auto both = overlaps(tracer, {{1.7, 0.6, 0.0}, DVec3(0.5), {1, 0, 0, 0}});
  ASSERT_EQ(both.size(), 1U);
  EXPECT_FALSE(both[0].in_field);
  const auto field = overlaps(tracer, {{-1.7, 0.6, 0.0}, DVec3(0.5), {1, 0, 0, 0}});
  ASSERT_EQ(field.size(), 1U);
  EXPECT_TRUE(field[0].in_field);
  EXPECT_LT(glm::length(field[0].normal - DVec3(0, 1, 0)), 1e-9);
}

TEST(FieldQuery, PointsAndPlatesHitBlocks) {
  SceneGrid wall;
  wall.grid.fill_box({{2, -3, -3}, {8, 4, 3}}, kWood);
  const Scene scene = scene_of(std::move(wall), {});
  const SceneTracer tracer(scene);
  for (const DVec3 half : {DVec3(0.0), DVec3(0.0, 1.0, 1.0), DVec3(0.0, 0.0, 1.0)}) {
    const OrientedBox box{{0.1, 0.2, 0.3}, half, {1, 0, 0, 0}};
    const auto hit = sweep_box(tracer, box, {4, 0, 0});
    ASSERT_TRUE(hit.has_value());
    EXPECT_NEAR(hit->fraction, 1.9 / 4.0, 1e-8);
    EXPECT_EQ(hit->normal, DVec3(-1, 0, 0));
    EXPECT_TRUE(overlaps(tracer, box).empty());
    EXPECT_EQ(overlaps(tracer, moved(box, {2.5, 0, 0})).size(), 1U);
  }
}

TEST(FieldQuery, FollowsEditsAfterUpdate) {
  Scene scene = scene_of(DensityGrid(), {});
  const GridHandle grid = scene.grids().handles()[0];
  SceneTracer tracer(scene);
  const OrientedBox box{{0.0, 9.0, 0.0}, DVec3(0.4), {1, 0, 0, 0}};
  EXPECT_FALSE(sweep_box(tracer, box, {0, -18, 0}).has_value());
  scene.edit(grid).field.add_sphere(DVec3(0.0), 4.0, kStone);
  tracer.update();
  const auto hit = sweep_box(tracer, box, {0, -18, 0});
  ASSERT_TRUE(hit.has_value());
  EXPECT_NEAR(9.0 - 18.0 * hit->fraction - 0.4, 4.0, 0.05);
  scene.edit(grid).field.clear();
  tracer.update();
  EXPECT_FALSE(sweep_box(tracer, box, {0, -18, 0}).has_value());
}

}  // namespace
}  // namespace quoin
