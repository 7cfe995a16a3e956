// What functions of scenes and cameras require.

#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/scene/camera.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene.h>
#include <quoin/terrain/noise.h>
#include <quoin/trace/occupancy_tree.h>
#include <quoin/trace/ray.h>

#include "core/death_for_tests.h"

namespace quoin {
namespace {

TEST(SceneDeathTest, AHandleOfNothingIsAMistake) {
  Scene scene;
  const GridHandle gone = scene.add_grid({});
  scene.remove_grid(gone);
  QUOIN_EXPECT_MISTAKE(scene.edit(gone).name = "x", "the handle names an element");
  QUOIN_EXPECT_MISTAKE((void)scene.instances()[InstanceHandle{}], "the handle names an element");
}

TEST(SceneDeathTest, WhatWasMovedFromIsNotToBeUsed) {
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

TEST(CameraDeathTest, APictureWithoutPixelsIsAMistake) {
  QUOIN_EXPECT_MISTAKE((void)ray_through({}, {0.0, 0.0, 0, 5}), "a picture of positive size");
  DetailSelector selector;
  std::vector<SelectedInstance> selected;
  QUOIN_EXPECT_MISTAKE(selector.select(Scene(), {}, 5, -1, {}, selected), "a picture of positive size");
}

TEST(CameraDeathTest, BoundsAndAspectsThatAreNoneAreMistakes) {
  const double infinity = std::numeric_limits<double>::infinity();
  QUOIN_EXPECT_MISTAKE((void)frame_view({DVec3(0.0), DVec3(infinity)}, View::Top, 1.0), "finite bounds");
  QUOIN_EXPECT_MISTAKE((void)frame_view({DVec3(0.0), DVec3(1.0)}, View::Top, -1.0), "a positive, finite aspect");
}

TEST(NoiseDeathTest, PlacesBeyondTheLatticeAreMistakes) {
  QUOIN_EXPECT_MISTAKE((void)noise2(1, 2e9, 0.0), "2.30");
  QUOIN_EXPECT_MISTAKE((void)noise3(1, 0.0, 0.0, -2e9), "2.30");
}

}  // namespace
}  // namespace quoin
