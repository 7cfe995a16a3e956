// Density fields in scenes: changes, ray hits, and fields next to blocks.

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <quoin/scene/scene_query.h>
#include <quoin/scene/scene_tracer.h>

#include "scene/tracer/scene_view.h"

namespace quoin {
namespace {

constexpr DVec3 kCentre{40.0, 20.0, -10.0};  // in the world

// A ball of radius 12 about (16, 16, 16) of its grid, turned, mirrored and doubled in size.
struct BallScene {
  Scene scene;
  GridHandle grid;
  InstanceHandle instance;

  BallScene() {
    SceneGrid ball;
    ball.name = "ball";
    ball.field.add_sphere(DVec3(16.0), 12.0, 3);
    ball.pivot = DVec3(16.0);
    grid = scene.add_grid(std::move(ball));
    instance =
        scene.add_instance({"placed", grid, kCentre, glm::angleAxis(0.7, glm::normalize(DVec3{1, 2, 3})), 2.0, true});
  }
};

DVec3 random_direction(std::mt19937& random) {
  std::normal_distribution<double> any;
  return glm::normalize(DVec3{any(random), any(random), any(random)});
}

TEST(SceneFields, ReportChanges) {
  BallScene s;
  ChangeCursor cursor = s.scene.cursor();
  DensityGrid& field = s.scene.edit(s.grid).field;
  EXPECT_EQ(s.scene.changes_since(cursor).grids.size(), 1U);
  // Edits of the field are reported each time; edits without a change are not.
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(s.scene.has_changed_since(cursor));
    field.add_sphere({16.0 + i, 30.0, 16.0}, 3.0, 2);
    EXPECT_TRUE(s.scene.has_changed_since(cursor));
    EXPECT_EQ(s.scene.changes_since(cursor).grids, std::vector<GridHandle>{s.grid});
    field.set({16, 16, 16}, {field.density({16, 16, 16}), field.material({16, 16, 16})});
    EXPECT_TRUE(s.scene.changes_since(cursor).empty());
  }
  // Replaces the field.
  field = DensityGrid();
  EXPECT_EQ(s.scene.changes_since(cursor).grids, std::vector<GridHandle>{s.grid});
  EXPECT_TRUE(s.scene.bounds().empty());
  field.add_box({0, 0, 0}, {4, 4, 4}, 1);
  EXPECT_EQ(s.scene.changes_since(cursor).grids, std::vector<GridHandle>{s.grid});
}

TEST(SceneFields, SnapshotKeepsFields) {
  BallScene s;
  const Scene before = s.scene.snapshot();
  s.scene.edit(s.grid).field.clear();
  EXPECT_TRUE(s.scene.bounds().empty());
  const SceneTracer tracer(before);
  EXPECT_TRUE(first_hit(tracer, {kCentre + DVec3{0, 100, 0}, {0, -1, 0}}));
  EXPECT_FALSE(first_hit(SceneTracer(s.scene), {kCentre + DVec3{0, 100, 0}, {0, -1, 0}}));
}

TEST(SceneFields, BoundsSurroundSolid) {
  DensityGrid field;
  EXPECT_TRUE(field.bounds().empty());
  field.add_sphere({5.5, 6.5, 7.5}, 3.0, 1);
  EXPECT_EQ(field.solid_bounds(), (IBox{{3, 4, 5}, {9, 10, 11}}));
  EXPECT_EQ(field.bounds(), (IBox{{2, 3, 4}, {9, 10, 11}}));
  // Bounds follow edits across chunk borders, and their reversal.
  field.add_sphere({200.5, 6.5, -7.5}, 3.0, 1);
  EXPECT_EQ(field.solid_bounds(), (IBox{{3, 4, -10}, {204, 10, 11}}));
  field.remove_sphere({200.5, 6.5, -7.5}, 4.0);
  EXPECT_EQ(field.solid_bounds(), (IBox{{3, 4, 5}, {9, 10, 11}}));
  field.clear();
  EXPECT_TRUE(field.solid_bounds().empty());
}

TEST(SceneFields, RaysHitFieldsWherePlaced) {
  const BallScene s;
  const SceneTracer tracer(s.scene);
  std::mt19937 random(1);
  for (int i = 0; i < 300; ++i) {
    const DVec3 out = random_direction(random);
    const auto hit = first_hit(tracer, {kCentre + out * 90.0, -out});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->t, 90.0 - 24.0, 0.05);
    EXPECT_LT(glm::distance(hit->position, kCentre + out * 24.0), 0.05);
    EXPECT_TRUE(hit->in_field);
    EXPECT_EQ(hit->type, 3);
    EXPECT_EQ(hit->instance, s.instance);
    EXPECT_GT(glm::dot(hit->normal, out), 0.99);
    EXPECT_NEAR(glm::length(hit->normal), 1.0, 1e-9);
  }
  EXPECT_FALSE(first_hit(tracer, {kCentre + DVec3{0, 90, 25}, {0, -1, 0}}));
}

TEST(SceneFields, RaysHitNearestOfFieldsAndBlocks) {
  Scene scene;
  SceneGrid both;
  both.grid.fill_box({{0, 0, 0}, {32, 4, 32}}, 1);
  both.field.add_sphere(DVec3{16, 8, 16}, 6.0, 2);
  const GridHandle grid = scene.add_grid(std::move(both));
  scene.add_instance({"a", grid, {}});
  SceneGrid wall;
  wall.grid.fill_box({{0, 0, 0}, {1, 40, 40}}, 4);
  scene.add_instance({"b", scene.add_grid(std::move(wall)), {40, 0, 0}});
  SceneTracer tracer(scene);
  const auto type_below = [&](double x, double z) { return first_hit(tracer, {{x, 50, z}, {0, -1, 0}})->type; };
  EXPECT_EQ(type_below(16, 16), 2);
  EXPECT_EQ(type_below(3, 3), 1);
  EXPECT_EQ(first_hit(tracer, {{100, 8, 16}, {-1, 0, 0}})->type, 4);
  EXPECT_EQ(first_hit(tracer, {{30, 8, 16}, {-1, 0, 0}})->type, 2);
  EXPECT_EQ(first_hit(tracer, {{30, 2.5, 16}, {0, 0, -1}})->type, 1);

  // Packets agree with single rays, and follow edits.
  std::mt19937 random(2);
  for (int round = 0; round < 3; ++round) {
    const SceneView view(tracer, DVec3(0.0));
    int in_field = 0;
    for (int i = 0; i < 60; ++i) {
      RayPacket packet;
      const DVec3 eye = DVec3{16, 10, 16} + random_direction(random) * 60.0;
      for (int lane = 0; lane < RayPacket::kSize; ++lane) {
        const DVec3 to = DVec3{16, 6, 16} + random_direction(random) * 12.0;
        packet.set(lane, {eye, glm::normalize(to - eye)}, 200.0);
      }
      SceneHits hits;
      view.first_hits(packet, hits);
      for (int lane = 0; lane < RayPacket::kSize; ++lane) {
        const auto at = static_cast<std::size_t>(lane);
        const auto alone = first_hit(tracer, packet.ray(lane), 200.0);
        ASSERT_EQ(hits.grids.hit >> lane & 1U, alone.has_value());
        if (!alone) continue;
        EXPECT_NEAR(hits.grids.t[at], alone->t, 1e-9);
        ASSERT_EQ((hits.in_field >> lane & 1U) != 0, alone->in_field);
        EXPECT_EQ(IVec3(hits.grids.x[at], hits.grids.y[at], hits.grids.z[at]), alone->voxel);
        if (!alone->in_field) continue;
        ++in_field;
        EXPECT_EQ(hits.material[at], alone->type);
        // No steps between cells.
        EXPECT_NEAR(glm::length(hits.normal(at)), 1.0, 1e-5);
        EXPECT_GT(glm::dot(DVec3(hits.normal(at)), alone->normal), 0.5);
      }
    }
    EXPECT_GT(in_field, 40);
    SceneGrid& edited = scene.edit(grid);
    edited.field.remove_sphere(DVec3{16, 13, 16}, 3.0 + round);
    edited.grid.set({3, 4 + round, 3}, 5);
    EXPECT_TRUE(tracer.update());
    EXPECT_FALSE(tracer.update());
    EXPECT_EQ(type_below(3.5, 3.5), 5);
  }
}

TEST(SceneFields, UpdatedTracerMatchesNewTracer) {
  BallScene s;
  SceneTracer followed(s.scene);
  std::mt19937 random(3);
  for (int i = 0; i < 20; ++i) {
    SceneGrid& ball = s.scene.edit(s.grid);
    if (i == 10) ball.field = DensityGrid();
    if (i == 11) ball.field.add_sphere(DVec3(16.0), 5.0, 1);
    ball.field.add_sphere(DVec3(16.0) + random_direction(random) * 14.0, 4.0, static_cast<VoxelType>(i + 1));
    if (i == 15) s.scene.edit(s.instance).position += DVec3{5, 0, 0};
    followed.update();
    const SceneTracer anew(s.scene);
    for (int k = 0; k < 60; ++k) {
      const DVec3 out = random_direction(random);
      const DVec3 to = kCentre + random_direction(random) * 24.0;
      const Ray ray{to + out * 90.0, -out};
      const auto a = first_hit(followed, ray);
      const auto b = first_hit(anew, ray);
      ASSERT_EQ(a.has_value(), b.has_value());
      if (!a) continue;
      EXPECT_EQ(a->t, b->t);
      EXPECT_EQ(a->type, b->type);
    }
  }
}

}  // namespace
}  // namespace quoin
