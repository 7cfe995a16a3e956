// Tests the requirements of scene and camera functions.

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/mesh/blocky.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/render/propagated_light.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>
#include <quoin/scene/scene_faces.h>
#include <quoin/scene/scene_query.h>
#include <quoin/scene/scene_tracer.h>
#include <quoin/scene/solid_shapes.h>
#include <quoin/scene/sweep.h>
#include <quoin/terrain/noise.h>
#include <quoin/trace/occupancy_tree.h>
#include <quoin/trace/ray.h>

#include "core/death_for_tests.h"

namespace quoin {
namespace {

TEST(SceneDeathTest, AssertsOnInvalidHandle) {
  Scene scene;
  const GridHandle gone = scene.add_grid({});
  scene.remove_grid(gone);
  QUOIN_EXPECT_MISTAKE(scene.edit(gone).name = "x", "the handle names an element");
  QUOIN_EXPECT_MISTAKE((void)scene.instances()[InstanceHandle{}], "the handle names an element");
  QUOIN_EXPECT_MISTAKE((void)scene.edit(InstanceHandle{}), "the handle names an element");
  QUOIN_EXPECT_MISTAKE((void)scene.edit(GroupHandle{}), "the handle names an element");
  QUOIN_EXPECT_MISTAKE((void)scene.edit(LayerHandle{}), "the handle names an element");
  QUOIN_EXPECT_MISTAKE(move_group(scene, {}, DVec3(0.0), DQuat(1, 0, 0, 0)), "the handle names an element");
}

// A grid with one instance, in a group and on a layer.
struct Built {
  Scene scene;
  GridHandle grid = scene.add_grid({.name = "grid"});
  GroupHandle group = scene.add_group({.name = "group"});
  LayerHandle layer = scene.add_layer({.name = "layer"});
  InstanceHandle instance = scene.add_instance({.name = "", .grid = grid, .group = group, .layer = layer});
};

void expect_to_name_nothing(Scene& scene, const Built& other) {
  const char* const wanted = "the handle names an element";
  QUOIN_EXPECT_MISTAKE((void)scene.edit(other.grid), wanted);
  QUOIN_EXPECT_MISTAKE((void)scene.edit(other.instance), wanted);
  QUOIN_EXPECT_MISTAKE((void)scene.edit(other.group), wanted);
  QUOIN_EXPECT_MISTAKE((void)scene.edit(other.layer), wanted);
  QUOIN_EXPECT_MISTAKE((void)scene.grids()[other.grid], wanted);
  QUOIN_EXPECT_MISTAKE((void)scene.instances()[other.instance], wanted);
  QUOIN_EXPECT_MISTAKE(move_group(scene, other.group, DVec3(0.0), DQuat(1, 0, 0, 0)), wanted);
  EXPECT_EQ(scene.grids().find(other.grid), nullptr);
  EXPECT_FALSE(scene.remove_grid(other.grid) || scene.remove_instance(other.instance) ||
               scene.remove_group(other.group) || scene.remove_layer(other.layer));
}

TEST(SceneDeathTest, AssertsOnHandleOfOtherScene) {
  Built ours;
  const Built other;
  ASSERT_EQ(ours.grid.index, other.grid.index);
  ASSERT_EQ(ours.instance.index, other.instance.index);
  expect_to_name_nothing(ours.scene, other);
  EXPECT_EQ(ours.scene.grids().size() + ours.scene.instances().size(), 2U);
}

TEST(SceneDeathTest, AssertsOnHandleAddedAfterSnapshot) {
  Built ours;
  Built other{.scene = ours.scene.snapshot()};
  ASSERT_EQ(ours.scene.grids().size(), 1U);
  ASSERT_EQ(other.grid.index, 1U);
  EXPECT_EQ(other.scene.edit(ours.grid).name, "grid") << "handles from before the snapshot stay valid";
  (void)ours.scene.add_grid({});
  (void)ours.scene.add_instance({});
  (void)ours.scene.add_group({});
  (void)ours.scene.add_layer({});
  expect_to_name_nothing(ours.scene, other);
}

// The instance counts as not placed.
TEST(SceneDeathTest, IgnoresInstanceOfOtherScenesGrid) {
  Built ours;
  Built other;
  ours.scene.edit(ours.grid).grid.set({0, 0, 0}, 1);
  other.scene.edit(other.grid).grid.set({0, 0, 0}, 1);
  ours.scene.edit(ours.instance).grid = other.grid;
  EXPECT_TRUE(ours.scene.bounds().empty());
  EXPECT_FALSE(first_hit(SceneTracer(ours.scene), {{-5.0, 0.5, 0.5}, {1.0, 0.0, 0.0}}).has_value());
  EXPECT_TRUE(first_hit(SceneTracer(other.scene), {{-5.0, 0.5, 0.5}, {1.0, 0.0, 0.0}}).has_value());
}

TEST(SceneDeathTest, AssertsOnInvalidGroupRotation) {
  Scene scene;
  const GroupHandle group = scene.add_group({});
  const GroupHandle unturned = scene.add_group({});
  scene.edit(unturned).rotation = DQuat(0, 0, 0, 0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const DQuat none(1, 0, 0, 0);
  QUOIN_EXPECT_MISTAKE(move_group(scene, group, DVec3(0.0), DQuat(0, 0, 0, 0)), "finite and not zero");
  QUOIN_EXPECT_MISTAKE(move_group(scene, group, DVec3(0.0), DQuat(nan, 0, 0, 1)), "finite and not zero");
  QUOIN_EXPECT_MISTAKE(move_group(scene, unturned, DVec3(0.0), none), "finite and not zero");
}

TEST(SceneDeathTest, AssertsOnMovedFromSceneOrTree) {
  Scene scene;
  const Scene moved = std::move(scene);
  QUOIN_EXPECT_MISTAKE(scene.add_grid({}), "a scene that was not moved from");  // NOLINT(bugprone-use-after-move)
  QUOIN_EXPECT_MISTAKE((void)scene.cursor(), "a scene that was not moved from");
  QUOIN_EXPECT_MISTAKE((void)scene.snapshot(), "a scene that was not moved from");
  OccupancyTree tree;
  const OccupancyTree moved_tree = std::move(tree);
  QUOIN_EXPECT_MISTAKE((void)tree.bounds(), "a tree that was not moved from");  // NOLINT(bugprone-use-after-move)
  QUOIN_EXPECT_MISTAKE((void)tree.is_occupied(IVec3(0)), "a tree that was not moved from");
  QUOIN_EXPECT_MISTAKE((void)first_hit(tree, Ray{}), "a tree that was not moved from");
}

// NOLINTBEGIN(bugprone-use-after-move): tested here
TEST(SceneDeathTest, AssertsOnOtherMovedFromObjects) {
  const char* const wanted = "an object that was not moved from";
  const auto leave = [](auto& object) { [[maybe_unused]] const auto taken = std::move(object); };
  Scene scene;
  SceneTracer tracer(scene);
  leave(tracer);
  QUOIN_EXPECT_MISTAKE((void)tracer.scene(), wanted);
  QUOIN_EXPECT_MISTAKE((void)first_hit(tracer, {{}, {1, 0, 0}}), wanted);
  QUOIN_EXPECT_MISTAKE((void)sweep_box(tracer, {}, {1, 0, 0}), wanted);
  CpuRenderer renderer(scene);
  leave(renderer);
  QUOIN_EXPECT_MISTAKE(renderer.update(), wanted);
  QUOIN_EXPECT_MISTAKE((void)renderer.render({}), wanted);
  PropagatedLight light;
  leave(light);
  QUOIN_EXPECT_MISTAKE((void)light.at({}), wanted);
  QUOIN_EXPECT_MISTAKE(light.update({}, {}), wanted);
  QUOIN_EXPECT_MISTAKE((void)light.snapshot(), wanted);
  SceneLight lights;
  leave(lights);
  QUOIN_EXPECT_MISTAKE((void)lights.of({}), wanted);
  SolidShapes shapes;
  leave(shapes);
  QUOIN_EXPECT_MISTAKE((void)shapes.boxes({}), wanted);
  SceneFaces faces;
  leave(faces);
  QUOIN_EXPECT_MISTAKE((void)faces.update(scene), wanted);
  DetailSelector selector;
  leave(selector);
  std::vector<SelectedInstance> selected;
  QUOIN_EXPECT_MISTAKE(selector.select(scene, {}, 5, 5, {}, selected), wanted);
  BlockyMesher mesher;
  leave(mesher);
  QuadBuffer quads;
  QUOIN_EXPECT_MISTAKE(mesher.mesh({}, {}, {}, quads), wanted);
}

// Objects that refer to a scene need it at its original address.
TEST(SceneDeathTest, AssertsOnUpdateAfterSceneMoved) {
  Scene scene;
  SceneTracer tracer(scene);
  CpuRenderer renderer(scene);
  const Scene elsewhere = std::move(scene);
  QUOIN_EXPECT_MISTAKE(tracer.update(), "that was not moved from");
  QUOIN_EXPECT_MISTAKE(renderer.update(), "that was not moved from");
}
// NOLINTEND(bugprone-use-after-move)

TEST(SceneDeathTest, AssertsOnSlideWithoutContacts) {
  const Scene scene;
  const SceneTracer tracer(scene);
  SlideOptions options;
  options.max_contacts = 0;
  QUOIN_EXPECT_MISTAKE((void)move_and_slide(tracer, OrientedBox(), DVec3(1.0), options), "at least one contact");
}

TEST(CameraDeathTest, AssertsOnEmptyImage) {
  QUOIN_EXPECT_MISTAKE((void)ray_through({}, {0.0, 0.0, 0, 5}), "a positive image size");
  DetailSelector selector;
  std::vector<SelectedInstance> selected;
  const Scene scene;
  QUOIN_EXPECT_MISTAKE((void)pick(SceneTracer(scene), {}, {0.0, 0.0, 5, 0}), "a positive image size");
  QUOIN_EXPECT_MISTAKE(selector.select(Scene(), {}, 5, -1, {}, selected), "a positive image size");
}

TEST(CameraDeathTest, AssertsOnInvalidBoundsOrAspect) {
  const double infinity = std::numeric_limits<double>::infinity();
  QUOIN_EXPECT_MISTAKE((void)frame_view({DVec3(0.0), DVec3(infinity)}, View::Top, 1.0), "finite bounds");
  QUOIN_EXPECT_MISTAKE((void)frame_view({DVec3(0.0), DVec3(1.0)}, View::Top, -1.0), "a positive, finite aspect");
  QUOIN_EXPECT_MISTAKE((void)frame_scene(Scene(), View::Top, infinity), "a positive, finite aspect");
}

TEST(CameraDeathTest, RejectsFramingByInvalidInput) {
  const DVec3 forward = direction_of(View::Iso);
  QUOIN_EXPECT_MISTAKE(SceneFraming(2.0 * forward, 1.0), "a unit direction");
  QUOIN_EXPECT_MISTAKE(SceneFraming(DVec3(0.0), 1.0), "a unit direction");
  QUOIN_EXPECT_MISTAKE(SceneFraming(forward, 0.0), "a positive, finite aspect");
  QUOIN_EXPECT_MISTAKE(SceneFraming(forward, 1.0, 0), "a positive number of turns");
  const SceneFraming framing(forward, 1.0, 3);
  QUOIN_EXPECT_MISTAKE((void)framing.camera(3), "one of the turns");
  QUOIN_EXPECT_MISTAKE((void)framing.camera(-1), "one of the turns");
}

TEST(NoiseDeathTest, AssertsOnPointsBeyondLattice) {
  QUOIN_EXPECT_MISTAKE((void)noise2(1, 2e9, 0.0), "2.30");
  QUOIN_EXPECT_MISTAKE((void)noise3(1, 0.0, 0.0, -2e9), "2.30");
  const double edge = 1 << 24;  // the limit for five octaves
  EXPECT_LE(std::abs(fractal2(1, edge - 1.0, 1.0 - edge, 5)), 2.0);
  QUOIN_EXPECT_MISTAKE((void)fractal2(1, 0.0, edge, 5), "29 - octaves");
  QUOIN_EXPECT_MISTAKE((void)fractal2(1, 0.0, 0.0, 30), "29 - octaves");
  QUOIN_EXPECT_MISTAKE((void)ridged2(1, -edge, 0.0, 5), "29 - octaves");
  QUOIN_EXPECT_MISTAKE((void)ridged2(1, 0.0, 0.0, -1), "29 - octaves");
}

}  // namespace
}  // namespace quoin
