#include "camera_control.h"

#include <cmath>

#include <gtest/gtest.h>

namespace quoin::viewer {
namespace {

/// Level ground up to y = 0, steps of one voxel from x = 10 on, a wall at x = 20, and a hill of densities at z = -20.
Scene steps_and_hill() {
  Scene scene;
  EXPECT_TRUE(scene.types.add({}).has_value());
  SceneGrid land;
  land.grid.fill_box({{-30, -4, -8}, {40, 0, 8}}, 1);
  land.grid.fill_box({{10, 0, -8}, {40, 1, 8}}, 1);
  land.grid.fill_box({{14, 1, -8}, {40, 2, 8}}, 1);
  land.grid.fill_box({{20, 2, -8}, {22, 9, 8}}, 1);
  land.field.edit({{-30, -8, -40}, {40, 12, -7}}, [](IVec3 p, DensitySample) {
    const double height = 4.0 * std::sin(0.2 * p.x);
    return DensitySample{static_cast<float>((p.y - height) / 1.3), VoxelType{1}};
  });
  Instance instance;
  instance.grid = scene.add_grid(std::move(land));
  scene.add_instance(instance);
  return scene;
}

class Walking : public ::testing::Test {
 protected:
  Walking() : scene_(steps_and_hill()), tracer_(scene_) {
    Camera camera;
    camera.forward = {1.0, 0.0, 0.0};  // looks along +x
    camera.right = {0.0, 0.0, 1.0};
    control_.set(camera, scene_.bounds());
    control_.mode = CameraMode::Walk;
  }

  void walk(double seconds, const CameraPush& push, double frame = 1.0 / 60.0) {
    for (double t = 0.0; t < seconds - 1e-9; t += frame) {
      walker_.advance(frame, push, 1.0, control_, [&](const OrientedBox& box, DVec3 way, const SlideOptions& options) {
        return std::optional(move_and_slide(tracer_, box, way, options));
      });
    }
  }

  Scene scene_;
  SceneTracer tracer_;
  CameraControl control_;
  Walker walker_;
};

constexpr CameraPush kAhead{0.0, 0.0, 1.0};

TEST_F(Walking, FallsToGroundAndStands) {
  walker_.stand({0.5, 6.0, 0.5}, scene_.bounds());
  EXPECT_TRUE(walker_.is_moving());
  walk(3.0, {});
  EXPECT_NEAR(walker_.feet().y, 0.0, 0.01);
  EXPECT_FALSE(walker_.is_moving());
  EXPECT_EQ(control_.camera().position, walker_.eyes());
  EXPECT_GT(walker_.eyes().y, 1.5);
}

TEST_F(Walking, ClimbsStepsAndStopsAtWall) {
  walker_.stand({2.5, 0.5, 0.5}, scene_.bounds());
  walk(12.0, kAhead);
  EXPECT_NEAR(walker_.feet().y, 2.0, 0.01) << "two steps";
  EXPECT_NEAR(walker_.feet().x, 20.0 - 0.5 * 0.33 * walker_.height(), 0.01);
  EXPECT_NEAR(walker_.feet().z, 0.5, 0.01);
}

TEST_F(Walking, JumpsAndLands) {
  walker_.stand({-10.5, 0.0, 0.5}, scene_.bounds());
  walk(1.0, {});
  double highest = 0.0;
  for (int frame = 0; frame < 90; ++frame) {
    walk(1.0 / 60.0, frame == 0 ? CameraPush{0.0, 1.0, 0.0} : CameraPush{});
    highest = std::max(highest, walker_.feet().y);
  }
  EXPECT_NEAR(highest, 0.75 * walker_.height(), 0.1 * walker_.height());
  EXPECT_NEAR(walker_.feet().y, 0.0, 0.01);
}

TEST_F(Walking, FollowsSmoothGround) {
  walker_.stand({-20.0, 8.0, -20.0}, scene_.bounds());
  walk(2.0, {});
  for (int i = 0; i < 100; ++i) {
    walk(0.05, kAhead);
    const double ground = 4.0 * std::sin(0.2 * walker_.feet().x);
    EXPECT_NEAR(walker_.feet().y, ground, 0.7) << walker_.feet().x;
  }
  EXPECT_GT(walker_.feet().x, -10.0);
}

TEST_F(Walking, WalksAlikeAtAnyFrameRate) {
  walker_.stand({2.5, 0.5, 0.5}, scene_.bounds());
  const Walker before = walker_;
  walk(2.0, kAhead, 1.0 / 240.0);
  const DVec3 at = walker_.feet();
  walker_ = before;
  walk(2.0, kAhead, 1.0 / 30.0);
  EXPECT_LT(glm::length(walker_.feet() - at), 0.1);
}

TEST_F(Walking, StopsAtWorldBottom) {
  walker_.stand({500.0, 3.0, 0.5}, scene_.bounds());
  walk(6.0, kAhead);
  EXPECT_EQ(walker_.feet().y, scene_.bounds().min.y);
  EXPECT_FALSE(walker_.is_moving());
  walker_.grow(3.0);
  EXPECT_GT(walker_.height(), 1.8);
  walker_.grow(-1e9);
  EXPECT_EQ(walker_.height(), 0.5);
}

}  // namespace
}  // namespace quoin::viewer
