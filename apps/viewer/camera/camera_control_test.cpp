#include "camera_control.h"

#include <cmath>
#include <limits>
#include <random>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace quoin::viewer {
namespace {

const DBox kBounds{DVec3{-20.0, 0.0, -30.0}, DVec3{40.0, 25.0, 10.0}};

CameraControl framed(View view = View::Iso) {
  CameraControl control;
  control.set(frame_view(kBounds, view, 1.5), kBounds);
  return control;
}

void expect_upright(const Camera& camera) {
  EXPECT_NEAR(glm::length(camera.forward), 1.0, 1e-12);
  EXPECT_NEAR(glm::length(camera.right), 1.0, 1e-12);
  EXPECT_NEAR(glm::length(camera.up), 1.0, 1e-12);
  EXPECT_NEAR(glm::dot(camera.right, camera.forward), 0.0, 1e-12);
  EXPECT_EQ(camera.right.y, 0.0) << "rolled";
  EXPECT_GE(camera.up.y, -1e-12) << "upside down";
  EXPECT_TRUE(is_finite(camera.position));
}

TEST(CameraControl, AdoptsEveryView) {
  for (const View view : {View::Front, View::Back, View::Left, View::Right, View::Top, View::Iso}) {
    const Camera camera = frame_view(kBounds, view, 1.5);
    CameraControl control;
    control.set(camera, kBounds);
    EXPECT_LT(glm::length(control.camera().forward - camera.forward), 1e-9);
    EXPECT_LT(glm::length(control.camera().right - camera.right), 1e-9);
    EXPECT_LT(glm::length(control.camera().up - camera.up), 1e-9);
    EXPECT_EQ(control.camera().position, camera.position);
  }
}

TEST(CameraControl, KeepsViewDirectionOfRolledCamera) {
  CameraControl control;
  Camera camera = look_at({10, 20, 30}, {1, 2, 3}, 0.7).value();
  const DVec3 right = camera.right;
  camera.right = camera.up;
  camera.up = -right;
  control.set(camera, {{0, 0, 0}, {5, 5, 5}});
  EXPECT_LT(glm::length(control.camera().forward - camera.forward), 1e-12);
  EXPECT_LT(glm::length(control.camera().right - right), 1e-12) << "upright";
  camera.right = -right;
  camera.up = glm::cross(camera.right, camera.forward);
  control.set(camera, {{0, 0, 0}, {5, 5, 5}});
  EXPECT_LT(glm::length(control.camera().forward - camera.forward), 1e-12) << "upside down";
  EXPECT_LT(glm::length(control.camera().right - right), 1e-12);
}

TEST(CameraControl, MovesAlikeAtAnyFrameRate) {
  const CameraPush push{0.3, -0.2, 1.0};
  CameraControl coarse = framed();
  CameraControl fine = framed();
  for (CameraControl* control : {&coarse, &fine}) {
    const int frames = control == &coarse ? 20 : 400;
    control->zoom(3.0);
    for (int i = 0; i < frames; ++i) control->advance(2.0 / frames, push, 2.0);
    for (int i = 0; i < frames; ++i) control->advance(1.0 / frames, {}, 1.0);
  }
  const double moved = glm::length(coarse.camera().position - framed().camera().position);
  EXPECT_GT(moved, 10.0);
  // Not exact to the bit: the zoom target moves along, and the ends of glides are cut off.
  EXPECT_LT(glm::length(coarse.camera().position - fine.camera().position), 0.02 * moved);
}

TEST(CameraControl, FliesExactlyAtAnyFrameRate) {
  CameraControl coarse = framed();
  CameraControl fine = framed();
  for (int i = 0; i < 10; ++i) coarse.advance(0.1, {0.0, 0.0, 1.0});
  for (int i = 0; i < 1'000; ++i) fine.advance(0.001, {0.0, 0.0, 1.0});
  EXPECT_LT(glm::length(coarse.camera().position - fine.camera().position), 1e-8);
}

TEST(CameraControl, GlidesToAStop) {
  CameraControl control = framed();
  EXPECT_FALSE(control.is_gliding());
  control.advance(0.5, {1.0, 0.0, 0.0});
  control.zoom(2.0);
  EXPECT_TRUE(control.is_gliding());
  for (int i = 0; i < 300; ++i) control.advance(0.016, {});
  EXPECT_FALSE(control.is_gliding());
}

TEST(CameraControl, OrbitKeepsPivotInViewSpace) {
  CameraControl control = framed();
  control.mode = CameraMode::Orbit;
  const DVec3 pivot{3.0, 5.0, -7.0};
  control.set_pivot(pivot);
  const auto seen_at = [&] {
    const DVec3 offset = pivot - control.camera().position;
    return DVec3{glm::dot(offset, control.camera().right), glm::dot(offset, control.camera().up),
                 glm::dot(offset, control.camera().forward)};
  };
  const DVec3 before = seen_at();
  std::mt19937 random(5);
  std::uniform_real_distribution<double> pixels(-300.0, 300.0);
  for (int i = 0; i < 500; ++i) {
    control.turn(pixels(random), pixels(random), 700);
    ASSERT_LT(glm::length(seen_at() - before), 1e-6);
    expect_upright(control.camera());
  }
}

TEST(CameraControl, FacesGivenPoint) {
  CameraControl control = framed();
  const DVec3 position = control.camera().position;
  for (const DVec3 point : {DVec3{3.0, 4.0, 5.0}, position + DVec3{0.0, -9.0, 0.0}, position + DVec3{-5.0, 0.0, 0.0}}) {
    control.face(point);
    EXPECT_EQ(control.camera().position, position);
    EXPECT_LT(glm::length(control.camera().forward - glm::normalize(point - position)), 1e-9);
    EXPECT_EQ(control.pivot(), point);
    expect_upright(control.camera());
  }
  control.face(position);
  EXPECT_NE(control.pivot(), position) << "nowhere to look";
}

TEST(CameraControl, TurnsInPlaceWhileFlying) {
  CameraControl control = framed(View::Front);
  control.mode = CameraMode::Fly;
  const DVec3 position = control.camera().position;
  control.turn(100.0, 0.0, 700);
  EXPECT_EQ(control.camera().position, position);
  EXPECT_GT(control.camera().forward.x, 0.0) << "a drag to the right looks to the right";
  control.turn(0.0, 100.0, 700);
  EXPECT_LT(control.camera().forward.y, 0.0) << "a drag down looks down";
}

TEST(CameraControl, StaysUprightAtPoles) {
  for (const double dy : {1e6, -1e6}) {
    for (const CameraMode mode : {CameraMode::Fly, CameraMode::Orbit}) {
      CameraControl control = framed(View::Top);
      control.mode = mode;
      control.turn(50.0, dy, 700);
      expect_upright(control.camera());
      control.turn(-3e5, -dy / 1e4, 700);
      expect_upright(control.camera());
    }
  }
}

TEST(CameraControl, LimitsZoom) {
  for (const double notches : {1.0, -1.0}) {
    CameraControl control = framed();
    for (int i = 0; i < 2'000; ++i) {
      control.zoom(notches);
      control.advance(0.05, {});
    }
    const double distance = glm::length(control.camera().position - control.pivot());
    EXPECT_GT(distance, 1e-4);
    EXPECT_LT(distance, 1e4);
    const double at_bound = distance;
    for (int i = 0; i < 50; ++i) {
      control.zoom(-notches);
      control.advance(0.05, {});
    }
    const double back = glm::length(control.camera().position - control.pivot());
    EXPECT_TRUE(notches > 0 ? back > 2.0 * at_bound : back < 0.5 * at_bound) << "stuck at the bound";
  }
}

TEST(CameraControl, ZoomsTowardsTarget) {
  CameraControl control = framed();
  const DVec3 target{10.0, 3.0, 2.0};
  const DVec3 direction = glm::normalize(target - control.camera().position);
  const double before = glm::length(target - control.camera().position);
  control.zoom(5.0, target);
  for (int i = 0; i < 100; ++i) control.advance(0.02, {});
  EXPECT_LT(glm::length(target - control.camera().position), 0.6 * before);
  EXPECT_LT(glm::length(glm::normalize(target - control.camera().position) - direction), 1e-9);
}

TEST(CameraControl, PanKeepsPivotUnderMouse) {
  CameraControl control = framed(View::Front);
  const int height = 700;
  const DVec3 pivot = control.pivot();
  control.pan(60.0, -25.0, height);
  const DVec3 offset = pivot - control.camera().position;
  const double ahead = glm::dot(offset, control.camera().forward);
  const double pixels = height / (2.0 * ahead * std::tan(control.camera().vertical_fov_radians / 2.0));
  EXPECT_NEAR(glm::dot(offset, control.camera().right) * pixels, 60.0, 1e-6);
  EXPECT_NEAR(glm::dot(offset, control.camera().up) * pixels, 25.0, 1e-6);
}

TEST(CameraControl, IgnoresInvalidInput) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double odd : {nan, infinity, -infinity}) {
    CameraControl control = framed();
    const Camera before = control.camera();
    control.turn(odd, 1.0, 700);
    control.turn(1.0, 1.0, 0);
    control.pan(odd, odd, 700);
    control.zoom(odd);
    control.zoom(0.0, DVec3{odd});
    control.set_pivot(DVec3{odd, 0.0, 0.0});
    control.change_speed(odd);
    control.advance(odd, {1.0, 0.0, 0.0});
    control.advance(0.1, {odd, 0.0, 0.0});
    control.advance(0.1, {}, odd);
    Camera wrong = before;
    wrong.position.x = odd;
    control.set(wrong, kBounds);
    EXPECT_EQ(control.camera().position, before.position);
    EXPECT_EQ(control.camera().forward, before.forward);
    expect_upright(control.camera());
  }
}

TEST(CameraControl, StaysFiniteUnderRandomInput) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::normal_distribution<double> number(0.0, 50.0);
  CameraControl control = framed();
  for (int i = 0; i < 3'000; ++i) {
    control.mode = (random() & 1U) != 0 ? CameraMode::Fly : CameraMode::Orbit;
    switch (random() % 6) {
      case 0:
        control.turn(number(random), number(random), 500);
        break;
      case 1:
        control.pan(number(random), number(random), 500);
        break;
      case 2:
        control.zoom(number(random) / 20.0);
        break;
      case 3:
        control.change_speed(number(random));
        break;
      case 4:
        control.zoom(1.0, control.camera().position);
        break;
      default:
        control.advance(std::abs(number(random)) / 100.0, {number(random), number(random), number(random)}, 3.0);
    }
    ASSERT_NO_FATAL_FAILURE(expect_upright(control.camera()));
  }
}

TEST(CameraControl, AcceptsEmptyScene) {
  CameraControl control;
  control.set(frame_view({}, View::Iso, 1.0), {});
  control.turn(10.0, 10.0, 300);
  control.advance(0.1, {1.0, 1.0, 1.0});
  expect_upright(control.camera());
  EXPECT_GT(control.speed(), 0.0);
}

}  // namespace
}  // namespace quoin::viewer
