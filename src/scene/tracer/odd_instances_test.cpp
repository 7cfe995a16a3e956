// Instances and queries with extreme and invalid numbers.

#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene_query.h>
#include <quoin/scene/scene_tracer.h>
#include <quoin/scene/sweep.h>

#include "core/not_finite_for_tests.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {
namespace {

// A slab at a distance from its pivot, so that its rotation has a visible effect.
struct SlabScene {
  Scene scene;
  GridHandle grid;
  SlabScene() {
    EXPECT_TRUE(scene.types.add({}).has_value());
    SceneGrid slab;
    slab.grid.fill_box({{4, 0, 0}, {21, 2, 8}}, 1);
    grid = scene.add_grid(std::move(slab));
  }
  Instance instance(DQuat rotation = {1.0, 0.0, 0.0, 0.0}) const {
    Instance made;
    made.grid = grid;
    made.rotation = rotation;
    return made;
  }
};

Camera looking_on() {
  return look_at({3, 5, 60}, {0, 0, 0}, std::numbers::pi / 3).value();
}

std::vector<SelectedInstance> selected(const Scene& scene) {
  std::vector<SelectedInstance> out;
  DetailSelector().select(scene, looking_on(), 640, 480, {}, out);
  return out;
}

TEST(OddInstances, NormalizeRotationsOfAnyLength) {
  const DQuat unit = glm::angleAxis(0.7, glm::normalize(DVec3(1, 2, 3)));
  SlabScene expected;
  expected.scene.add_instance(expected.instance(unit));
  const SceneTracer expected_tracer(expected.scene);
  const Ray ray{{0, 0, 60},
                glm::normalize(expected.scene.bounds().min + expected.scene.bounds().max - DVec3(0, 0, 120))};
  const auto expected_hit = first_hit(expected_tracer, ray);
  ASSERT_TRUE(expected_hit.has_value());
  for (const double length : {1e-300, 1e-160, 1e-5, 0.5, 3.0, -2.0, 1e160, 1e300}) {
    SCOPED_TRACE(length);
    SlabScene world;
    world.scene.add_instance(world.instance(unit * length));
    const SceneTracer tracer(world.scene);
    ASSERT_EQ(placed_in(tracer).size(), 1U);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_LT(glm::distance(placed_in(tracer)[0].world_axes[axis], placed_in(expected_tracer)[0].world_axes[axis]),
                1e-12);
    }
    const auto hit = first_hit(tracer, ray);
    ASSERT_TRUE(hit.has_value());
    EXPECT_EQ(hit->voxel, expected_hit->voxel);
    EXPECT_NEAR(hit->t, expected_hit->t, 1e-9);
    EXPECT_LT(glm::distance(world.scene.bounds().max, expected.scene.bounds().max), 1e-9);
    const auto chosen = selected(world.scene);
    ASSERT_EQ(chosen.size(), 1U);
    EXPECT_NEAR(chosen[0].distance, selected(expected.scene)[0].distance, 1e-9);
  }
}

TEST(OddInstances, TreatZeroRotationAsIdentity) {
  SlabScene world;
  world.scene.add_instance(world.instance({0.0, 0.0, 0.0, 0.0}));
  world.scene.add_instance(world.instance());
  const SceneTracer tracer(world.scene);
  ASSERT_EQ(placed_in(tracer).size(), 2U);
  EXPECT_EQ(placed_in(tracer)[0].world_axes, placed_in(tracer)[1].world_axes);
  const auto chosen = selected(world.scene);
  ASSERT_EQ(chosen.size(), 2U);
  EXPECT_EQ(chosen[0].distance, chosen[1].distance);
}

TEST(OddInstances, IgnoreNonFiniteAndSizelessInstances) {
  SlabScene world;
  std::vector<Instance> odd;
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    for (int i = 0; i < 3; ++i) odd.push_back(world.instance()), odd.back().position[i] = bad;
    for (int i = 0; i < 4; ++i) odd.push_back(world.instance()), odd.back().rotation[i] = bad;
    odd.push_back(world.instance(DQuat(bad, bad, bad, bad)));
    odd.push_back(world.instance()), odd.back().voxel_size = bad;
  }
  for (const double size : {0.0, -1.0}) odd.push_back(world.instance()), odd.back().voxel_size = size;
  for (const Instance& instance : odd) world.scene.add_instance(instance);
  world.scene.edit(world.scene.add_grid({})).pivot.x = kNan;
  const SceneTracer tracer(world.scene);
  EXPECT_TRUE(placed_in(tracer).empty());
  EXPECT_TRUE(world.scene.bounds(InstanceFilter::All).empty());
  EXPECT_TRUE(selected(world.scene).empty());
  EXPECT_FALSE(first_hit(tracer, {{10, 0.5, 60}, {0, 0, -1}}).has_value());
  EXPECT_TRUE(overlaps(tracer, DVec3(0.0), 1e9).empty());
  EXPECT_FALSE(sweep_box(tracer, {}, {100, 0, 0}).has_value());
  EXPECT_TRUE(is_finite(frame_scene(world.scene, View::Iso, 1.5, InstanceFilter::All).position));
}

TEST(OddInstances, SelectNearDetailAroundCamera) {
  SlabScene world;
  const InstanceHandle slab = world.scene.add_instance(world.instance());
  const SceneTracer tracer(world.scene);
  const ContentSphere content = content_sphere(world.scene.grids()[world.grid].grid);
  for (const auto rule : {DetailPolicy::Rule::ByPixels, DetailPolicy::Rule::ByRadius}) {
    Camera camera = look_at(content.centre, content.centre + DVec3(0, 0, -1), 1.0).value();
    std::vector<SelectedInstance> out;
    DetailPolicy policy;
    policy.rule = rule;
    DetailSelector().select(world.scene, camera, 640, 480, policy, out);
    ASSERT_EQ(out.size(), 1U);
    EXPECT_EQ(out[0].instance, slab);
    EXPECT_EQ(out[0].detail, Detail::Near);
    EXPECT_EQ(out[0].distance, 0.0);
  }
  const auto hit = first_hit(tracer, {{5.5, 0.5, 0.5}, {0, 0, -1}});
  ASSERT_TRUE(hit.has_value());
  EXPECT_TRUE(hit->starts_inside);
  EXPECT_EQ(hit->t, 0.0);
  const auto inside = sweep_box(tracer, {{5.5, 0.5, 0.5}, DVec3(0.1)}, DVec3(0.0));
  ASSERT_TRUE(inside.has_value());
  EXPECT_EQ(inside->fraction, 0.0);
}

TEST(OddInstances, InvalidQueriesHitNothing) {
  SlabScene world;
  world.scene.add_instance(world.instance());
  const SceneTracer tracer(world.scene);
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    EXPECT_FALSE(first_hit(tracer, {{bad, 0, 0}, {1, 0, 0}}).has_value());
    EXPECT_FALSE(first_hit(tracer, {{0, 0, 0}, {bad, 0, 0}}).has_value());
    EXPECT_TRUE(overlaps(tracer, DVec3(bad), 5.0).empty());
    EXPECT_TRUE(overlaps(tracer, DVec3(5.0), bad).empty());
    const OrientedBox turned{DVec3(5.0), DVec3(9.0), {bad, 0.0, 0.0, 0.0}};
    EXPECT_TRUE(overlaps(tracer, turned).empty());
    EXPECT_FALSE(sweep_box(tracer, turned, {1, 0, 0}).has_value());
    EXPECT_FALSE(sweep_box(tracer, {}, DVec3(bad)).has_value());
    EXPECT_EQ(move_and_slide(tracer, OrientedBox{}, DVec3(bad, 0, 0)).centre, DVec3(0.0));
  }
  EXPECT_FALSE(first_hit(tracer, {{0, 0, 0}, {0, 0, 0}}).has_value());
  const OrientedBox unturned{{5, 0, 0}, DVec3(9.0), {0.0, 0.0, 0.0, 0.0}};
  EXPECT_EQ(overlaps(tracer, unturned).size(), 1U);
}

// At such distances, steps of a box's own size are lost in rounding.
TEST(OddInstances, SweepsOverHugeDistancesEnd) {
  SlabScene world;
  Instance far = world.instance();
  far.position = {1e17, 0, 0};
  world.scene.add_instance(far);
  const SceneTracer tracer(world.scene);
  for (const double length : {2e17, 1e30, 1e200}) {
    const OrientedBox box{{0, 1, 3}, DVec3(0.4)};
    const auto hit = sweep_box(tracer, box, {length, 0, 0});
    if (hit) {
      EXPECT_GT(hit->fraction, 0.0);
      EXPECT_LE(hit->fraction, 1.0);
    }
    (void)move_and_slide(tracer, box, {length, 0, 0});
  }
}

}  // namespace
}  // namespace quoin
