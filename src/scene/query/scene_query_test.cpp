#include <quoin/scene/scene_query.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "scene/query/field_scene_for_tests.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {
namespace {

VoxelRegistry stone_and_ghost() {
  VoxelRegistry types;
  VoxelProperties properties;
  EXPECT_TRUE(types.add(properties).has_value());
  properties.collides = false;
  properties.visibility = Visibility::Transparent;
  EXPECT_TRUE(types.add(properties).has_value());
  return types;
}

Scene random_scene(Random& random, DVec3 away) {
  Scene scene;
  scene.types = stone_and_ghost();
  std::vector<GridHandle> grids;
  for (int i = 0; i < 3; ++i) {
    SceneGrid grid;
    grid.pivot = random.vector() * 4.0;
    for (int voxel = 0; voxel < 80; ++voxel) {
      grid.grid.set(IVec3(random.vector() * 6.0), static_cast<VoxelType>(1 + (voxel % 5 == 0)));
    }
    grids.push_back(scene.add_grid(std::move(grid)));
  }
  for (int i = 0; i < 40; ++i) {
    Instance instance;
    instance.grid = grids[static_cast<std::size_t>(i % 3)];
    instance.position = away + random.vector() * 30.0;
    instance.rotation = random.rotation();
    instance.voxel_size = 1.0 + 0.5 * random.share();
    instance.mirrored = i % 4 == 0;
    scene.add_instance(instance);
  }
  return scene;
}

// A voxel of an instance, with its corners in the world relative to `away`.
struct PlainVoxel {
  InstanceHandle instance;
  IVec3 voxel;
  VoxelType type;
  DVec3 low;                   // a corner
  std::array<DVec3, 3> edges;  // edges that start at `low`
};

std::vector<PlainVoxel> all_voxels(const Scene& scene, DVec3 away) {
  std::vector<PlainVoxel> all;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid& grid = scene.grids()[instance.grid];
    Instance near = instance;
    near.position -= away;
    grid.grid.for_each([&](IVec3 voxel, VoxelType type) {
      const auto at = [&](IVec3 p) { return world_from_grid(near, grid, DVec3(p)); };
      const DVec3 low = at(voxel);
      all.push_back(
          {handle,
           voxel,
           type,
           low,
           {at(voxel + IVec3(1, 0, 0)) - low, at(voxel + IVec3(0, 1, 0)) - low, at(voxel + IVec3(0, 0, 1)) - low}});
    });
  }
  return all;
}

// Returns the ray distance to the entry into the voxel; infinity if it misses.
double entry(const PlainVoxel& voxel, DVec3 origin, DVec3 direction) {
  double low = 0.0;
  double high = std::numeric_limits<double>::infinity();
  for (const DVec3& edge : voxel.edges) {
    const double squared = glm::dot(edge, edge);
    const double o = glm::dot(origin - voxel.low, edge) / squared;
    const double d = glm::dot(direction, edge) / squared;
    const double a = -o / d;
    const double b = (1.0 - o) / d;
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
  }
  return low <= high ? low : std::numeric_limits<double>::infinity();
}

TEST(SceneQuery, FirstHitIsNearestVoxel) {
  for (const DVec3 away : {DVec3(0.0), DVec3(1e9, -1e9, 1e9)}) {
    Random random(5);
    const Scene scene = random_scene(random, away);
    const SceneTracer tracer(scene);
    const std::vector<PlainVoxel> voxels = all_voxels(scene, away);
    int hits = 0;
    for (int i = 0; i < 400; ++i) {
      // Positions that are exact at a distance of 10^9.
      const DVec3 origin = DVec3(IVec3(random.vector() * 200.0)) / 4.0;
      const DVec3 direction = random.vector() * 2.0;
      double nearest = std::numeric_limits<double>::infinity();
      for (const PlainVoxel& voxel : voxels) nearest = std::min(nearest, entry(voxel, origin, direction));
      const auto hit = first_hit(tracer, {away + origin, direction});
      ASSERT_EQ(hit.has_value(), std::isfinite(nearest)) << i;
      ASSERT_EQ(any_hit(tracer, {away + origin, direction}), std::isfinite(nearest)) << i;
      if (!hit) continue;
      ++hits;
      EXPECT_NEAR(hit->t, nearest, away == DVec3(0.0) ? 1e-9 : 1e-6);
      EXPECT_EQ(hit->type, scene.grids()[scene.instances()[hit->instance].grid].grid.get(hit->voxel));
      EXPECT_NE(hit->type, kAir);
      EXPECT_LT(glm::length(hit->position - away - origin - nearest * direction), 1e-5);
      EXPECT_FALSE(first_hit(tracer, {away + origin, direction}, nearest * 0.999 - 1e-6).has_value());
      EXPECT_FALSE(any_hit(tracer, {away + origin, direction}, nearest * 0.999 - 1e-6));
      EXPECT_TRUE(any_hit(tracer, {away + origin, direction}, nearest * 1.001 + 1e-6));
    }
    EXPECT_GT(hits, 50);
  }
}

TEST(SceneQuery, RejectsInvalidRays) {
  Random random(1);
  const Scene scene = random_scene(random, DVec3(0.0));
  const SceneTracer tracer(scene);
  const double nan = std::nan("");
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(first_hit(tracer, {DVec3(nan), DVec3(1.0)}).has_value());
  EXPECT_FALSE(first_hit(tracer, {DVec3(0.0), DVec3(0.0)}).has_value());
  EXPECT_FALSE(first_hit(tracer, {DVec3(0.0), DVec3(infinity, 0.0, 0.0)}).has_value());
  EXPECT_FALSE(first_hit(tracer, {DVec3(0.0), DVec3(1.0)}, nan).has_value());
  EXPECT_FALSE(any_hit(tracer, {DVec3(nan), DVec3(1.0)}));
  EXPECT_FALSE(any_hit(tracer, {DVec3(0.0), DVec3(0.0)}));
  EXPECT_FALSE(any_hit(tracer, {DVec3(0.0), DVec3(1.0)}, nan));
  EXPECT_FALSE(any_hit(tracer, {DVec3(0.0), DVec3(1.0)}, -1.0));
  EXPECT_TRUE(overlaps(tracer, DVec3(nan), 1.0).empty());
  EXPECT_TRUE(overlaps(tracer, DVec3(0.0), -1.0).empty());
  EXPECT_TRUE(overlaps(tracer, {DVec3(0.0), DVec3(nan), {}}).empty());
}

TEST(SceneQuery, PickAndDepthFindSameVoxel) {
  Random random(9);
  const Scene scene = random_scene(random, DVec3(0.0));
  const SceneTracer tracer(scene);
  const auto camera = look_at({70, 40, 60}, {0, 0, 0}, 0.9);
  ASSERT_TRUE(camera.has_value());
  int hits = 0;
  for (int i = 0; i < 1'000; ++i) {
    const double x = 160.0 + 160.0 * random.share();
    const double y = 120.0 + 120.0 * random.share();
    const auto picked = pick(tracer, *camera, {x, y, 320, 240});
    if (!picked) continue;
    const auto again = voxel_at_depth(tracer, *camera, {x, y, 320, 240}, static_cast<float>(picked->t));
    ASSERT_TRUE(again.has_value());
    EXPECT_EQ(again->instance, picked->instance);
    EXPECT_EQ(again->voxel, picked->voxel);
    EXPECT_NEAR(again->t, picked->t, 1e-4);
    ++hits;
  }
  EXPECT_GT(hits, 100);
  EXPECT_FALSE(voxel_at_depth(tracer, *camera, {160, 120, 320, 240}, 1.0F).has_value());
  EXPECT_FALSE(
      voxel_at_depth(tracer, *camera, {160, 120, 320, 240}, std::numeric_limits<float>::infinity()).has_value());
}

// Returns the minimum distance of a sphere's centre from a voxel, by projection onto its edges.
double distance_to(const PlainVoxel& voxel, DVec3 point) {
  DVec3 nearest = voxel.low;
  for (const DVec3& edge : voxel.edges) {
    nearest += edge * std::clamp(glm::dot(point - voxel.low, edge) / glm::dot(edge, edge), 0.0, 1.0);
  }
  return glm::length(point - nearest);
}

std::vector<InstanceHandle> instances_of(const std::vector<SceneOverlap>& overlaps) {
  std::vector<InstanceHandle> all;
  for (const SceneOverlap& overlap : overlaps) all.push_back(overlap.instance);
  return all;
}

template <class Meets>
std::vector<InstanceHandle> plain_overlaps(const std::vector<PlainVoxel>& voxels, Meets meets) {
  std::vector<InstanceHandle> all;
  for (const PlainVoxel& voxel : voxels) {
    if (voxel.type == 1 && (all.empty() || all.back() != voxel.instance) && meets(voxel)) all.push_back(voxel.instance);
  }
  return all;
}

TEST(SceneQuery, SpheresOverlapVoxelsWithinRadius) {
  Random random(21);
  const Scene scene = random_scene(random, DVec3(0.0));
  const SceneTracer tracer(scene);
  const std::vector<PlainVoxel> voxels = all_voxels(scene, DVec3(0.0));
  std::size_t found = 0;
  for (int i = 0; i < 200; ++i) {
    const DVec3 centre = random.vector() * 35.0;
    const double radius = 4.0 + 3.9 * random.share();
    const auto expected =
        plain_overlaps(voxels, [&](const PlainVoxel& voxel) { return distance_to(voxel, centre) < radius; });
    EXPECT_EQ(instances_of(overlaps(tracer, centre, radius)), expected);
    found += expected.size();
  }
  EXPECT_GT(found, 100U);
}

// Returns true if a box contains a point of the voxel. Clipping would be too complex for an oracle. A dense lattice of
// points finds all overlaps except the shallowest.
bool holds_a_point(const OrientedBox& box, const PlainVoxel& voxel) {
  constexpr int kPoints = 12;
  if (glm::length(voxel.low - box.centre) > glm::length(box.half_size) + 3.0) return false;
  const DQuat to_box = glm::conjugate(box.rotation);
  for (int i = 0; i <= kPoints; ++i) {
    for (int j = 0; j <= kPoints; ++j) {
      for (int k = 0; k <= kPoints; ++k) {
        const DVec3 p =
            voxel.low +
            (voxel.edges[0] * double(i) + voxel.edges[1] * double(j) + voxel.edges[2] * double(k)) / double(kPoints);
        const DVec3 local = glm::abs(to_box * (p - box.centre));
        if (local.x < box.half_size.x && local.y < box.half_size.y && local.z < box.half_size.z) return true;
      }
    }
  }
  return false;
}

TEST(SceneQuery, BoxesOverlapIntersectedVoxels) {
  Random random(33);
  const Scene scene = random_scene(random, DVec3(0.0));
  const SceneTracer tracer(scene);
  const std::vector<PlainVoxel> voxels = all_voxels(scene, DVec3(0.0));
  std::size_t found = 0;
  std::size_t shallow = 0;
  for (int i = 0; i < 60; ++i) {
    const OrientedBox box{random.vector() * 30.0, glm::abs(random.vector()) * 5.0 + 0.3, random.rotation()};
    const auto expected = plain_overlaps(voxels, [&](const PlainVoxel& voxel) { return holds_a_point(box, voxel); });
    const auto answer = instances_of(overlaps(tracer, box));
    for (const InstanceHandle handle : expected)
      EXPECT_NE(std::find(answer.begin(), answer.end(), handle), answer.end());
    // Other results must be shallow: a slightly smaller box does not overlap them.
    const OrientedBox smaller{box.centre, box.half_size - 0.25, box.rotation};
    const auto deep = instances_of(overlaps(tracer, smaller));
    for (const InstanceHandle handle : deep)
      EXPECT_NE(std::find(expected.begin(), expected.end(), handle), expected.end());
    found += expected.size();
    shallow += answer.size() - expected.size();
  }
  EXPECT_GT(found, 30U);
  EXPECT_LT(shallow, found / 5);
}

TEST(SceneQuery, TouchingIsNotOverlapping) {
  Scene scene;
  scene.types = stone_and_ghost();
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, 1);
  grid.grid.set({0, 5, 0}, 2);
  Instance instance;
  instance.grid = scene.add_grid(std::move(grid));
  scene.add_instance(instance);
  const SceneTracer tracer(scene);
  EXPECT_TRUE(overlaps(tracer, {2.0, 0.5, 0.5}, 1.0).empty());
  EXPECT_EQ(overlaps(tracer, {2.0, 0.5, 0.5}, 1.001).size(), 1U);
  EXPECT_TRUE(overlaps(tracer, {DVec3(2.0, 0.5, 0.5), DVec3(1.0), {1, 0, 0, 0}}).empty());
  EXPECT_EQ(overlaps(tracer, {DVec3(2.0, 0.5, 0.5), DVec3(1.001), {1, 0, 0, 0}}).size(), 1U);
  // A zero rotation counts as the identity; the ghost above does not collide.
  EXPECT_EQ(overlaps(tracer, {DVec3(2.0, 0.5, 0.5), DVec3(1.001), {0, 0, 0, 0}}).size(), 1U);
  EXPECT_TRUE(overlaps(tracer, {0.5, 5.5, 0.5}, 2.0).empty());
}

TEST(SceneQuery, FindsHalvedGridsAsTraced) {
  Scene scene;
  scene.types = stone_and_ghost();
  SceneGrid grid;
  grid.pivot = DVec3(5.0, 2.0, 1.0);
  grid.grid.fill_box({{0, 0, 0}, {32, 32, 32}}, 1);
  Instance instance;
  instance.grid = scene.add_grid(std::move(grid));
  instance.position = DVec3(100.0, 0.0, 0.0);
  const InstanceHandle handle = scene.add_instance(instance);
  const SceneTracer full(scene);
  const SelectedInstance selected{handle, Detail::Mid, 1, 0.0};
  const SceneTracer halved = full.with_detail({&selected, 1});
  ASSERT_EQ(placed_in(halved).at(0).level, 1);
  const Ray ray{{110.3, 200.0, 10.2}, {0.0, -1.0, 0.0}};
  const auto expected = first_hit(full, ray);
  const auto hit = first_hit(halved, ray);
  ASSERT_TRUE(expected.has_value() && hit.has_value());
  EXPECT_NEAR(hit->t, expected->t, 1e-9);
  EXPECT_EQ(hit->type, 1);
  EXPECT_EQ(hit->voxel, expected->voxel / 2);
  const OrientedBox box{{110.3, 40.0, 10.2}, DVec3(0.5), {1, 0, 0, 0}};
  EXPECT_TRUE(overlaps(halved, box).empty());
  EXPECT_EQ(overlaps(halved, {{110.3, 29.0, 10.2}, DVec3(0.5), {1, 0, 0, 0}}).size(), 1U);
}

}  // namespace
}  // namespace quoin
