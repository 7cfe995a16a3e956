
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <gtest/gtest.h>

#include "core/death_for_tests.h"
#include "core/not_finite_for_tests.h"
#include "scene/tracer/placed_grid.h"
#include "scene/tracer/scene_view.h"

namespace quoin {
namespace {

VoxelRegistry stone_and_glass() {
  VoxelRegistry types;
  VoxelProperties properties;
  EXPECT_TRUE(types.add(properties).has_value());
  properties.visibility = Visibility::Transparent;
  EXPECT_TRUE(types.add(properties).has_value());
  return types;
}

// Returns scattered instances of three small grids.
Scene random_scene(unsigned seed, int instances, DVec3 away = DVec3(0.0)) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  const auto vector = [&] { return DVec3(share(random), share(random), share(random)); };
  Scene scene;
  scene.types = stone_and_glass();
  std::vector<GridHandle> grids;
  for (int i = 0; i < 3; ++i) {
    SceneGrid grid;
    grid.pivot = vector() * 4.0;
    for (int voxel = 0; voxel < 60; ++voxel) {
      grid.grid.set(IVec3(vector() * 6.0), static_cast<VoxelType>(1 + (i == 2 && voxel % 2 == 0)));
    }
    grids.push_back(scene.add_grid(std::move(grid)));
  }
  for (int i = 0; i < instances; ++i) {
    Instance instance;
    instance.grid = grids[random() % 3];
    instance.position = away + vector() * 30.0;
    instance.rotation = glm::angleAxis(share(random) * std::numbers::pi, glm::normalize(vector()));
    instance.voxel_size = 1.0 + 0.5 * share(random);
    instance.mirrored = i % 3 == 0;
    scene.add_instance(instance);
  }
  return scene;
}

Ray ray_in_grid(const PlacedGrid& placed, const Ray& ray) {
  const glm::dmat3 axes = glm::transpose(placed.world_axes) / placed.voxel_size;
  return {axes * (ray.origin - placed.position) + placed.grid->pivot, axes * ray.direction};
}

RayPacket random_packet(std::mt19937& random, DVec3 towards) {
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  const auto vector = [&] { return DVec3(share(random), share(random), share(random)); };
  RayPacket rays;
  const DVec3 origin = vector() * 50.0;
  for (int lane = 0; lane < 16; ++lane) {
    if (lane == 7) continue;
    rays.set(lane, {origin + vector() * 0.1, glm::normalize(towards - origin) + vector() * 0.2},
             lane % 4 == 0 ? 40.0 : kInfinity);
  }
  return rays;
}

TEST(SceneTracer, FirstHitsAreNearestOfAllInstances) {
  for (const int instances : {1, 3, 40}) {
    const Scene scene = random_scene(1, instances);
    const SceneTracer tracer(scene);
    const SceneView view(tracer, DVec3(0.0));
    std::mt19937 random(2);
    int hit_count = 0;
    for (int round = 0; round < 400; ++round) {
      const RayPacket rays = random_packet(random, placed_in(tracer)[random() % placed_in(tracer).size()].position);
      SceneHits hits;
      view.first_hits(rays, hits);
      for (int lane = 0; lane < 16; ++lane) {
        const auto l = static_cast<std::size_t>(lane);
        double nearest = kInfinity;
        std::int32_t index = -1;
        for (std::size_t i = 0; (rays.active >> lane & 1U) != 0 && i < placed_in(tracer).size(); ++i) {
          const PlacedGrid& placed = placed_in(tracer)[i];
          const auto hit = first_hit(*placed.opaque, ray_in_grid(placed, rays.ray(lane)), rays.max_t[l]);
          if (!hit || hit->t >= nearest) continue;
          nearest = hit->t;
          index = static_cast<std::int32_t>(i);
        }
        ASSERT_EQ(hits.grids.hit >> lane & 1U, index >= 0 ? 1U : 0U);
        if (index < 0) continue;
        ++hit_count;
        EXPECT_NEAR(hits.grids.t[l], nearest, 1e-9);
        EXPECT_EQ(hits.placed[l], index);
      }
    }
    EXPECT_GT(hit_count, 300);
  }
}

TEST(SceneTracer, AnyHitsMatchFirstHits) {
  const Scene scene = random_scene(5, 25);
  const SceneTracer tracer(scene);
  const SceneView view(tracer, {3, 4, 5});
  std::mt19937 random(6);
  int blocked_count = 0;
  for (int round = 0; round < 400; ++round) {
    const auto home = static_cast<std::int32_t>(random() % placed_in(tracer).size());
    const RayPacket rays_in_grid = random_packet(random, DVec3(0.0));
    const RayPacket rays = view.view_from_grid(home, rays_in_grid);
    SceneHits hits;
    view.first_hits(rays, hits);
    EXPECT_EQ(view.any_hits(home, rays_in_grid), hits.grids.hit);
    blocked_count += hits.grids.hit != 0;
  }
  EXPECT_GT(blocked_count, 100);
}

TEST(SceneTracer, AnyHitsOfArraysMatchPackets) {
  const Scene scene = random_scene(5, 25);
  const SceneTracer tracer(scene);
  const SceneView view(tracer, {3, 4, 5});
  std::mt19937 random(7);
  int blocked_count = 0;
  for (int round = 0; round < 40; ++round) {
    const auto home = static_cast<std::int32_t>(random() % placed_in(tracer).size());
    std::vector<RayPacket> packets(random() % 20);
    for (RayPacket& rays : packets) {
      rays = random_packet(random, DVec3(0.0));
      if (random() % 2 == 0) rays.max_t.fill(kInfinity);
    }
    std::vector<std::uint32_t> blocked(packets.size());
    view.any_hits(home, packets, blocked);
    for (std::size_t i = 0; i < packets.size(); ++i) {
      EXPECT_EQ(blocked[i], view.any_hits(home, packets[i]));
      blocked_count += blocked[i] != 0;
    }
  }
  EXPECT_GT(blocked_count, 50);
}

TEST(SceneTracer, IsExactFarFromOrigin) {
  const DVec3 away{1e9, -1e9, 1e9};
  const Scene near_scene = random_scene(9, 12);
  const Scene far_scene = random_scene(9, 12, away);
  const SceneTracer near_tracer(near_scene);
  const SceneTracer far_tracer(far_scene);
  const SceneView near_view(near_tracer, DVec3(0.0));
  const SceneView far_view(far_tracer, away);
  std::mt19937 random(10);
  int same = 0;
  int all = 0;
  for (int round = 0; round < 300; ++round) {
    const RayPacket rays = random_packet(random, DVec3(0.0));
    SceneHits a;
    SceneHits b;
    near_view.first_hits(rays, a);
    far_view.first_hits(rays, b);
    for (std::size_t i = 0; i < 16; ++i) {
      const bool hit_a = (a.grids.hit >> i & 1U) != 0;
      const bool hit_b = (b.grids.hit >> i & 1U) != 0;
      if (!hit_a && !hit_b) continue;
      ++all;
      // Positions at 10^9 are multiples of 1.2e-7.
      same += hit_a && hit_b && std::abs(a.grids.t[i] - b.grids.t[i]) < 1e-5 && a.placed[i] == b.placed[i];
    }
  }
  EXPECT_GT(all, 200);
  EXPECT_GE(same, all - all / 200);
}

TEST(SceneTracer, EqualDistancesBelongToFirstInstance) {
  Scene scene;
  scene.types = stone_and_glass();
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, 1);
  const GridHandle handle = scene.add_grid(std::move(grid));
  // Many instances at one position, so that each leaf of the tree contains some.
  for (const double x : {5.0, -5.0}) scene.add_instance({"", handle, {x, 0, 0}});
  for (int i = 0; i < 30; ++i) scene.add_instance({"", handle});
  const SceneTracer tracer(scene);
  EXPECT_EQ(placed_in(tracer)[0].opaque, placed_in(tracer)[6].opaque) << "trees are shared";
  const SceneView view(tracer, DVec3(0.0));
  RayPacket rays;
  rays.set(0, {{0.5, 0.5, 9.0}, {0, 0, -1}}, kInfinity);
  SceneHits hits;
  view.first_hits(rays, hits);
  ASSERT_EQ(hits.grids.hit, 1U);
  EXPECT_EQ(hits.placed[0], 2);
  EXPECT_EQ(hits.grids.t[0], 8.0);
}

TEST(SceneTracer, SkipsHiddenEmptyAndInvalidInstances) {
  Scene scene;
  scene.types = stone_and_glass();
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, 1);
  const GridHandle handle = scene.add_grid(std::move(grid));
  const GridHandle empty = scene.add_grid({});
  Instance instance{"", handle};
  scene.add_instance(instance);
  scene.add_instance({"", empty});
  instance.visible = false;
  scene.add_instance(instance);
  instance.visible = true;
  instance.voxel_size = 0.0;
  scene.add_instance(instance);
  instance.voxel_size = 1.0;
  instance.position.x = std::numeric_limits<double>::quiet_NaN();
  scene.add_instance(instance);
  EXPECT_EQ(placed_in(SceneTracer(scene)).size(), 1U);
  EXPECT_EQ(placed_in(SceneTracer(scene, InstanceFilter::All)).size(), 2U);
}

// Shapes without textures are glass.
TEST(SceneTracer, FindsGlassAmongShapesWhoseLooksChange) {
  Scene scene;
  VoxelProperties pane{.name = "pane", .visibility = Visibility::Transparent};
  pane.shapes = VoxelShape::box({0, 0, 7}, {16, 16, 9});
  VoxelProperties leaves = pane;
  leaves.faces = VoxelFaces(*Texture::from_image("leaf", {16, 16, std::vector<std::uint8_t>(4 * 16 * 16, 255)}));
  const VoxelType type = *scene.types.add(leaves);
  const GridHandle grid = scene.add_grid({});
  scene.edit(grid).grid.set({1, 1, 1}, type);
  scene.add_instance({.grid = grid});
  SceneTracer tracer(scene);
  EXPECT_FALSE(tracer.has_transparent());
  scene.types.replace(type, pane);
  tracer.update();
  EXPECT_TRUE(tracer.has_transparent());
  scene.types.replace(type, leaves);
  tracer.update();
  EXPECT_FALSE(tracer.has_transparent());
}

TEST(SceneTracer, VisitsTransparentVoxelsWithoutHitting) {
  Scene scene;
  scene.types = stone_and_glass();
  SceneGrid glass;
  glass.grid.fill_box({{0, 0, 0}, {1, 1, 3}}, 2);
  SceneGrid stone;
  stone.grid.set({0, 0, 0}, 1);
  scene.add_instance({"", scene.add_grid(std::move(glass))});
  scene.add_instance({"", scene.add_grid(std::move(stone)), {0, 0, -5}});
  const SceneTracer tracer(scene);
  EXPECT_TRUE(tracer.has_transparent());
  EXPECT_EQ(placed_in(tracer)[1].transparent, nullptr);
  const SceneView view(tracer, DVec3(0.0));
  RayPacket rays;
  rays.set(4, {{0.5, 0.5, 9.0}, {0, 0, -1}}, kInfinity);
  rays.set(5, {{1.5, 0.5, 9.0}, {0, 0, -1}}, kInfinity);
  SceneHits hits;
  view.first_hits(rays, hits);
  EXPECT_EQ(hits.grids.hit, 1U << 4);
  EXPECT_EQ(hits.placed[4], 1);
  EXPECT_EQ(view.any_transparent(rays), 1U << 4);
  double length = 0.0;
  view.visit_transparent(rays.ray(4), kInfinity, [&](std::int32_t index, const Ray& ray) {
    EXPECT_EQ(index, 0);
    visit_hits(*placed_in(tracer)[0].transparent, ray, kInfinity, [&](const VoxelSpan& span) {
      length += span.t_exit - span.t_enter;
      return true;
    });
  });
  EXPECT_DOUBLE_EQ(length, 3.0);
}

TEST(SceneTracer, CountsBytesOfSharedTreesOnce) {
  Scene scene;
  const VoxelType stone = scene.types.add({}).value();
  SceneGrid grid;
  grid.grid.fill_box({IVec3(0), IVec3(40)}, stone);
  grid.field.add_sphere(DVec3(80.0), 20.0, stone);
  const GridHandle handle = scene.add_grid(std::move(grid));
  EXPECT_EQ(SceneTracer(scene).bytes(), 0U);
  Instance instance;
  instance.grid = handle;
  scene.add_instance(instance);
  const std::size_t one = SceneTracer(scene).bytes();
  const PlacedGrid placed = placed_in(SceneTracer(scene)).at(0);
  EXPECT_GT(one, 0U);
  instance.position = DVec3(500.0);
  scene.add_instance(instance);
  EXPECT_EQ(SceneTracer(scene).bytes(), one);
  EXPECT_EQ(placed.voxels, &scene.grids()[handle].grid);
}

TEST(SceneViewDeathTest, RejectsIndicesOfNoPlacedGrid) {
  const Scene scene = random_scene(3, 2);
  const SceneTracer tracer(scene);
  SceneView view(tracer, DVec3(0.0));
  QUOIN_EXPECT_MISTAKE((void)view.grid_from_view(2), "a placed grid");
  QUOIN_EXPECT_MISTAKE((void)view.view_from_grid(-1), "a placed grid");
  QUOIN_EXPECT_MISTAKE((void)view.any_hits(2, RayPacket()), "a placed grid");
  QUOIN_EXPECT_MISTAKE(view.leave_to_impostors(std::vector<std::int32_t>{2}), "a placed grid");
}

}  // namespace
}  // namespace quoin
