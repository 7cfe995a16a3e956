#include <quoin/scene/level_of_detail.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <quoin/trace/ray.h>

#include "core/not_finite_for_tests.h"
#include "scene/frustum.h"

namespace quoin {
namespace {

Scene cubes(int count, int edge = 20) {
  Scene scene;
  VoxelProperties properties;
  EXPECT_TRUE(scene.types.add(properties));
  SceneGrid grid;
  grid.grid.fill_box({{0, 0, 0}, IVec3(edge)}, 1);
  grid.pivot = DVec3(0.5 * edge);
  const GridHandle handle = scene.add_grid(std::move(grid));
  for (int i = 0; i < count; ++i) scene.add_instance({"", handle});
  return scene;
}

Camera looking_at_origin(double distance) {
  return look_at({0, 0, distance}, {0, 0, 0}, std::numbers::pi / 4).value();
}

DVec3 random_unit(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return glm::normalize(DVec3(normal(random), normal(random), normal(random)));
}

Camera random_camera(std::mt19937& random) {
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const DVec3 position = random_unit(random) * (60.0 * share(random));
  Camera camera = look_at(position, position + random_unit(random), 0.1 + 2.8 * share(random)).value();
  if (share(random) < 0.4) {
    camera.projection = Camera::Projection::Orthographic;
    camera.view_height = 1.0 + 60.0 * share(random);
  }
  return camera;
}

// Returns true if a ray from `origin` hits the sphere.
bool meets_sphere(const Ray& ray, DVec3 centre, double radius) {
  const DVec3 to = centre - ray.origin;
  const double along = std::max(0.0, glm::dot(to, ray.direction));
  return glm::length(to - along * ray.direction) <= radius;
}

TEST(LevelOfDetail, RadiusRuleHasSpecifiedThresholds) {
  EXPECT_EQ(detail_by_radius(0, 100), Detail::Near);
  EXPECT_EQ(detail_by_radius(100, 100), Detail::Near);
  EXPECT_EQ(detail_by_radius(100.000001, 100), Detail::Mid);
  EXPECT_EQ(detail_by_radius(1000, 100), Detail::Mid);
  EXPECT_EQ(detail_by_radius(1000.000001, 100), Detail::Far);
  EXPECT_EQ(detail_by_radius(0, 0), Detail::Near);
  EXPECT_EQ(detail_by_radius(1e-300, 0), Detail::Far);
  EXPECT_EQ(detail_by_radius(kNan, 100), Detail::Far);
  EXPECT_EQ(detail_by_radius(1, kNan), Detail::Far);
  EXPECT_EQ(detail_by_radius(kInfinity, 100), Detail::Far);
  DetailPolicy policy;
  policy.near_radii = 2.0;
  policy.mid_radii = 3.0;
  EXPECT_EQ(detail_by_radius(200, 100, policy), Detail::Near);
  EXPECT_EQ(detail_by_radius(201, 100, policy), Detail::Mid);
  EXPECT_EQ(detail_by_radius(301, 100, policy), Detail::Far);
}

TEST(LevelOfDetail, PixelRuleUsesVoxelAndObjectSize) {
  EXPECT_EQ(detail_by_pixels({1.0, 129.0}), Detail::Near);
  EXPECT_EQ(detail_by_pixels({0.999, 129.0}), Detail::Mid);
  EXPECT_EQ(detail_by_pixels({0.999, 128.0}), Detail::Far);
  EXPECT_EQ(detail_by_pixels({5.0, 128.0}), Detail::Far);
  EXPECT_EQ(detail_by_pixels({0.0, 0.0}), Detail::Far);
  EXPECT_EQ(detail_by_pixels({kNan, 500.0}), Detail::Far);
  EXPECT_EQ(detail_by_pixels({2.0, kNan}), Detail::Far);
  EXPECT_EQ(detail_by_pixels({2.0, kInfinity}), Detail::Far);
}

TEST(LevelOfDetail, ContentSphereSurroundsVoxels) {
  Grid grid;
  EXPECT_EQ(content_sphere(grid).radius, 0.0);
  grid.fill_box({{100, -7, 3}, {141, 34, 44}}, 1);  // 41 wide
  const ContentSphere sphere = content_sphere(grid);
  EXPECT_EQ(sphere.centre, DVec3(120.5, 13.5, 23.5));
  EXPECT_NEAR(sphere.radius, 20.5 * std::sqrt(3.0), 1e-12);
}

TEST(LevelOfDetail, ContentSphereIncludesField) {
  SceneGrid grid;
  grid.field.add_box({9.5, -4.5, 0.5}, {30.5, 20.5, 7.5}, 1);
  EXPECT_EQ(content_sphere(grid).centre, DVec3(20.0, 8.0, 4.0));
  EXPECT_EQ(content_sphere(grid.grid).radius, 0.0);
  grid.grid.fill_box({{-11, 0, 0}, {0, 4, 4}}, 1);
  EXPECT_EQ(content_sphere(grid).centre, DVec3(10.0, 8.0, 4.0));
  Scene scene;
  const GridHandle handle = scene.add_grid(std::move(grid));
  scene.add_instance({"", handle, DVec3(0.0)});
  const Camera camera = looking_at_origin(200.0);
  std::vector<SelectedInstance> selected;
  DetailSelector selector;
  selector.select(scene, camera, 64, 64, {}, selected);
  ASSERT_EQ(selected.size(), 1U);
  EXPECT_NEAR(selected[0].distance, glm::length(DVec3(10.0, 8.0, 4.0) - camera.position), 1e-9);
  scene.edit(handle).grid.clear();
  selector.select(scene, camera, 64, 64, {}, selected);
  ASSERT_EQ(selected.size(), 1U);
  EXPECT_NEAR(selected[0].distance, glm::length(DVec3(20.0, 8.0, 4.0) - camera.position), 1e-9);
  scene.edit(handle).field.clear();
  selector.select(scene, camera, 64, 64, {}, selected);
  EXPECT_TRUE(selected.empty());
}

TEST(LevelOfDetail, MeasuresDistanceFromPlacedContent) {
  Scene scene = cubes(1, 20);
  Instance& instance = scene.edit(scene.instances().handles()[0]);
  instance.position = {5, -3, 2};
  instance.voxel_size = 0.5;
  instance.rotation = glm::angleAxis(1.0, glm::normalize(DVec3(1, 2, 3)));
  scene.edit(instance.grid).pivot = {40, 0, 0};
  DetailPolicy policy;
  policy.rule = DetailPolicy::Rule::ByRadius;
  std::vector<SelectedInstance> selected;
  for (const bool is_mirrored : {false, true}) {
    instance.mirrored = is_mirrored;
    const DVec3 centre = world_from_grid(instance, scene.grids()[instance.grid], DVec3(10.0));
    const double radius = 5.0 * std::sqrt(3.0);
    for (const auto& [radii, expected] :
         {std::pair{0.99, Detail::Near}, {1.01, Detail::Mid}, {9.99, Detail::Mid}, {10.01, Detail::Far}}) {
      const Camera camera = look_at(centre + DVec3(0, 0, radii * radius), centre, 1.0).value();
      DetailSelector().select(scene, camera, 100, 100, policy, selected);
      ASSERT_EQ(selected.size(), 1U);
      EXPECT_EQ(selected[0].detail, expected);
      EXPECT_NEAR(selected[0].distance, radii * radius, 1e-9);
    }
  }
}

TEST(LevelOfDetail, ChoosesCoarsestCellsWithinPolicy) {
  const Scene scene = cubes(1, 600);
  const double radius = 300.0 * std::sqrt(3.0);
  DetailPolicy policy;
  policy.far_pixels = 0;
  std::vector<SelectedInstance> selected;
  int last = 0;
  for (double distance = radius + 1.0; distance < 1e5; distance *= 1.03) {
    DetailSelector().select(scene, looking_at_origin(distance), 800, 600, policy, selected);
    ASSERT_EQ(selected.size(), 1U);
    const SelectedInstance& chosen = selected[0];
    const double pixels = 300.0 / std::tan(std::numbers::pi / 8) / (distance - radius);
    const double cell = pixels * std::ldexp(1.0, chosen.level);
    EXPECT_EQ(chosen.detail, pixels < 1.0 ? Detail::Mid : Detail::Near);
    EXPECT_TRUE(chosen.level == 0 || cell <= policy.cell_pixels);
    EXPECT_TRUE(chosen.level == kMaxGridLevel || 2.0 * cell > policy.cell_pixels);
    EXPECT_GE(chosen.level, last);
    last = chosen.level;
  }
  EXPECT_EQ(last, kMaxGridLevel);
}

TEST(LevelOfDetail, CullsNothingVisible) {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  constexpr int kWidth = 48;
  constexpr int kHeight = 30;
  int seen = 0;
  int culled = 0;
  for (int round = 0; round < 400; ++round) {
    const Camera camera = random_camera(random);
    const Frustum frustum(camera, kWidth, kHeight);
    const DVec3 centre = random_unit(random) * (80.0 * std::abs(share(random)));
    const double radius = 10.0 * std::abs(share(random));
    bool is_seen = false;
    for (int y = 0; y <= 2 * kHeight && !is_seen; ++y) {
      for (int x = 0; x <= 2 * kWidth && !is_seen; ++x) {
        is_seen = meets_sphere(ray_through(camera, {0.5 * x, 0.5 * y, kWidth, kHeight}), centre, radius);
      }
    }
    const bool is_kept = frustum.meets(centre - camera.position, radius);
    EXPECT_TRUE(is_kept || !is_seen) << "round " << round;
    seen += static_cast<int>(is_seen);
    culled += static_cast<int>(!is_kept);
  }
  EXPECT_GT(seen, 50);
  EXPECT_GT(culled, 100) << "instances outside the view are culled";
}

TEST(LevelOfDetail, KeepsDetailIfCameraTrembles) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> tremor(-1.0, 1.0);
  const Scene scene = cubes(1, 400);
  const double radius = 200.0 * std::sqrt(3.0);
  const double scale = 300.0 / std::tan(std::numbers::pi / 8);
  DetailPolicy policy;
  policy.far_pixels = 40;
  // Near to Mid; no halvings to one; Mid to Far.
  const std::array<double, 3> thresholds = {radius + scale, radius + 2.0 * scale / policy.cell_pixels,
                                            2.0 * radius * scale / policy.far_pixels};
  for (const double threshold : thresholds) {
    for (const bool has_memory : {true, false}) {
      policy.hysteresis = has_memory ? 0.1 : 0.0;
      DetailSelector selector;
      std::vector<SelectedInstance> selected;
      int changes = -1;
      int last = -1;
      for (int frame = 0; frame < 300; ++frame) {
        const double distance = threshold * (1.0 + 0.02 * tremor(random));
        selector.select(scene, looking_at_origin(distance), 800, 600, policy, selected);
        ASSERT_EQ(selected.size(), 1U);
        const int now = static_cast<int>(selected[0].detail) * 10 + selected[0].level;
        changes += static_cast<int>(now != last);
        last = now;
      }
      if (has_memory) {
        EXPECT_LE(changes, 1) << threshold;
      }
      if (!has_memory) {
        EXPECT_GT(changes, 30) << threshold;
      }
    }
  }
}

TEST(LevelOfDetail, IgnoresHistoryFarBeyondAThreshold) {
  const Scene scene = cubes(1, 400);
  DetailSelector selector;
  std::vector<SelectedInstance> selected;
  const DetailPolicy policy;
  for (const double distance : {400.0, 1500.0, 1e4, 1500.0, 400.0, 1e4, 400.0}) {
    selector.select(scene, looking_at_origin(distance), 800, 600, policy, selected);
    ASSERT_EQ(selected.size(), 1U);
    const Detail expected = distance < 500 ? Detail::Near : distance < 2000 ? Detail::Mid : Detail::Far;
    EXPECT_EQ(selected[0].detail, expected) << distance;
  }
}

TEST(LevelOfDetail, ForgetsHistoryOfReusedIndex) {
  Scene scene = cubes(1, 400);
  DetailSelector selector;
  std::vector<SelectedInstance> selected;
  const double threshold = 200.0 * std::sqrt(3.0) + 300.0 / std::tan(std::numbers::pi / 8);
  selector.select(scene, looking_at_origin(threshold * 1.2), 800, 600, {}, selected);
  ASSERT_EQ(selected.at(0).detail, Detail::Mid);
  const InstanceHandle old = scene.instances().handles()[0];
  const Instance copy = scene.instances()[old];
  scene.remove_instance(old);
  ASSERT_EQ(scene.add_instance(copy).index, old.index);
  selector.select(scene, looking_at_origin(threshold * 0.99), 800, 600, {}, selected);
  EXPECT_EQ(selected.at(0).detail, Detail::Near);
}

TEST(LevelOfDetail, FollowsEdits) {
  Scene scene = cubes(1, 20);
  DetailSelector selector;
  std::vector<SelectedInstance> selected;
  selector.select(scene, looking_at_origin(1000.0), 800, 600, {}, selected);
  ASSERT_EQ(selected.at(0).detail, Detail::Far);
  scene.edit(scene.grids().handles()[0]).grid.fill_box({{0, 0, 0}, {400, 400, 400}}, 1);
  selector.select(scene, looking_at_origin(1000.0), 800, 600, {}, selected);
  EXPECT_NE(selected.at(0).detail, Detail::Far);
}

TEST(LevelOfDetail, SkipsHiddenEmptyAndInvalidInstances) {
  Scene scene = cubes(7);
  const std::vector<InstanceHandle> all = scene.instances().handles();
  scene.edit(all[1]).visible = false;
  scene.edit(all[2]).voxel_size = 0.0;
  scene.edit(all[3]).voxel_size = kNan;
  scene.edit(all[4]).position.x = kInfinity;
  scene.edit(all[5]).grid = scene.add_grid({});
  std::vector<SelectedInstance> selected(3);
  DetailPolicy policy;
  DetailSelector().select(scene, looking_at_origin(100), 80, 60, policy, selected);
  ASSERT_EQ(selected.size(), 2U);
  EXPECT_EQ(selected[0].instance, all[0]);
  EXPECT_EQ(selected[1].instance, all[6]);
  policy.instances = InstanceFilter::All;
  DetailSelector().select(scene, looking_at_origin(100), 80, 60, policy, selected);
  EXPECT_EQ(selected.size(), 3U);
}

}  // namespace
}  // namespace quoin
