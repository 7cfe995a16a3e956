#include <quoin/scene/camera.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <gtest/gtest.h>
#include <quoin/scene/scene.h>

#include "core/not_finite_for_tests.h"

namespace quoin {
namespace {

constexpr View kAllViews[] = {View::Front, View::Back, View::Left, View::Right, View::Top, View::Iso};

void expect_near(DVec3 a, DVec3 b, double tolerance = 1e-12) {
  EXPECT_LE(glm::length(a - b), tolerance)
      << a.x << ", " << a.y << ", " << a.z << " for " << b.x << ", " << b.y << ", " << b.z;
}

void expect_orthonormal(const Camera& camera) {
  for (const DVec3 axis : {camera.right, camera.up, camera.forward}) EXPECT_NEAR(glm::length(axis), 1.0, 1e-14);
  expect_near(camera.right, glm::cross(camera.forward, camera.up));
}

/// The position of a point in the image: -1 to 1 from left to right and from bottom to top.
struct InImage {
  double x, y, depth;
};

InImage project(const Camera& camera, double aspect, DVec3 point) {
  const DVec3 offset = point - camera.position;
  const double depth = glm::dot(offset, camera.forward);
  const double half = camera.projection == Camera::Projection::Perspective
                          ? depth * std::tan(0.5 * camera.vertical_fov_radians)
                          : 0.5 * camera.view_height;
  return {glm::dot(offset, camera.right) / (half * aspect), glm::dot(offset, camera.up) / half, depth};
}

/// The extent of the box's corners on each side of the image, and the least depth.
struct Extent {
  double left = 0, right = 0, low = 0, high = 0, depth = kInfinity;
};

Extent extent_of(const Camera& camera, double aspect, const DBox& box) {
  Extent extent;
  for (unsigned i = 0; i < 8; ++i) {
    const DVec3 corner{(i & 1U) != 0 ? box.max.x : box.min.x, (i & 2U) != 0 ? box.max.y : box.min.y,
                       (i & 4U) != 0 ? box.max.z : box.min.z};
    const InImage p = project(camera, aspect, corner);
    extent.left = std::max(extent.left, -p.x);
    extent.right = std::max(extent.right, p.x);
    extent.low = std::max(extent.low, -p.y);
    extent.high = std::max(extent.high, p.y);
    extent.depth = std::min(extent.depth, p.depth);
  }
  return extent;
}

TEST(Camera, LooksAtTargetUpright) {
  const auto camera = look_at({3, 5, 8}, {-1, 2, 0.5}, 1.0);
  ASSERT_TRUE(camera);
  expect_orthonormal(*camera);
  EXPECT_EQ(camera->right.y, 0.0);
  EXPECT_GT(camera->up.y, 0.0);
  EXPECT_EQ(camera->vertical_fov_radians, 1.0);
  const InImage target = project(*camera, 1.5, {-1, 2, 0.5});
  EXPECT_NEAR(target.x, 0.0, 1e-12);
  EXPECT_NEAR(target.y, 0.0, 1e-12);
  EXPECT_NEAR(target.depth, std::sqrt(16 + 9 + 56.25), 1e-12);
  EXPECT_GT(project(*camera, 1.5, {-1, 3, 0.5}).y, 0.0) << "higher points are higher in the image";
  EXPECT_GT(project(*look_at({0, 0, 5}, {0, 0, 0}, 1.0), 1.0, {1, 0, 0}).x, 0.0) << "not mirrored";
}

TEST(Camera, ViewMatrixMatchesRays) {
  const Camera camera = *look_at({3, 4, 5}, {-7, 1, 20}, 0.8);
  const glm::dmat4 view = camera_from_world(camera);
  expect_near(DVec3(view * glm::dvec4(camera.position, 1.0)), DVec3(0.0));
  const int width = 640;
  const int height = 360;
  const glm::dmat4 clip = glm::perspective(camera.vertical_fov_radians, double{width} / height, 0.1, 1e3) * view;
  for (const DVec3 at : {DVec3(0, 0, 1), DVec3(640, 0, 9), DVec3(100, 333, 50)}) {
    const Ray ray = ray_through(camera, {at.x, at.y, width, height});
    const glm::dvec4 point = clip * glm::dvec4(ray.origin + ray.direction * at.z, 1.0);
    EXPECT_NEAR(point.x / point.w, at.x / width * 2.0 - 1.0, 1e-12);
    EXPECT_NEAR(point.y / point.w, 1.0 - at.y / height * 2.0, 1e-12);
  }
}

TEST(Camera, DefinesTopOfVerticalViews) {
  const auto down = look_at({1, 9, 2}, {1, -4, 2}, 1.0);
  expect_near(down->forward, {0, -1, 0});
  expect_near(down->up, {0, 0, -1});
  expect_near(down->right, {1, 0, 0});
  const auto up = look_at({1, 9, 2}, {1, 10, 2}, 1.0);
  expect_near(up->forward, {0, 1, 0});
  expect_near(up->up, {0, 0, 1});
  expect_near(up->right, {1, 0, 0});
  expect_orthonormal(*look_at({1e-200, 9, 0}, {0, 0, 0}, 1.0));
}

TEST(Camera, LooksAlongDirectionOfAnyLength) {
  for (const double length : {1e-300, 1.0, 7.0, 1e300}) {
    const auto camera = look_along({1, 2, 3}, length * DVec3{1, 0.5, -0.75}, 0.7);
    ASSERT_TRUE(camera);
    expect_orthonormal(*camera);
    const Camera at = *look_at({1, 2, 3}, {3, 3, 1.5}, 0.7);
    EXPECT_LT(glm::distance(camera->forward, at.forward), 1e-12);
    EXPECT_EQ(camera->position, at.position);
    EXPECT_EQ(camera->vertical_fov_radians, 0.7);
  }
  for (const DVec3 bad : {DVec3{0.0}, DVec3{kNan, 0, 1}, DVec3{0, kInfinity, 0}}) {
    EXPECT_FALSE(look_along({1, 1, 1}, bad, 1.0));
  }
  EXPECT_FALSE(look_along({1, kNan, 1}, {1, 0, 0}, 1.0));
  EXPECT_FALSE(look_along({1, 1, 1}, {1, 0, 0}, 0.0));
}

TEST(Camera, AcceptsPositionsOfAnySize) {
  constexpr double kMost = std::numeric_limits<double>::max();
  for (const auto& [position, target] : {std::pair{DVec3{-kMost, 0, kMost}, DVec3{kMost, 1, -kMost}},
                                         std::pair{DVec3{0.0}, DVec3{1e-300, 1e-300, 1e-300}},
                                         std::pair{DVec3{1e9, 1e9, 1e9}, DVec3{1e9 + 1, 1e9 - 1, 1e9}}}) {
    const auto camera = look_at(position, target, 1e-9);
    ASSERT_TRUE(camera);
    expect_orthonormal(*camera);
  }
}

TEST(Camera, RejectsInvalidCameras) {
  const auto refused = [](DVec3 position, DVec3 target, double fov) {
    const auto camera = look_at(position, target, fov);
    return !camera && camera.error().code == ErrorCode::InvalidArgument;
  };
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    EXPECT_TRUE(refused({0, bad, 0}, {1, 1, 1}, 1.0));
    EXPECT_TRUE(refused({1, 1, 1}, {0, 0, bad}, 1.0));
    EXPECT_TRUE(refused({1, 1, 1}, {0, 0, 0}, bad));
  }
  EXPECT_TRUE(refused({1, 2, 3}, {1, 2, 3}, 1.0));
  for (const double fov : {0.0, -1.0, std::numbers::pi, 4.0}) EXPECT_TRUE(refused({1, 1, 1}, {0, 0, 0}, fov)) << fov;
}

TEST(Camera, FindsViewsByName) {
  EXPECT_EQ(view_of_name("front"), View::Front);
  EXPECT_EQ(view_of_name("back"), View::Back);
  EXPECT_EQ(view_of_name("left"), View::Left);
  EXPECT_EQ(view_of_name("right"), View::Right);
  EXPECT_EQ(view_of_name("top"), View::Top);
  EXPECT_EQ(view_of_name("iso"), View::Iso);
  for (const char* name : {"", "Front", "bottom", "iso "}) EXPECT_EQ(view_of_name(name), std::nullopt);
}

TEST(Camera, ViewsShowNamedSide) {
  const DBox box{{-2, -1, -3}, {2, 5, 3}};
  const auto camera = [&](View view) { return frame_view(box, view, 1.6); };
  expect_near(camera(View::Front).forward, {0, 0, -1});
  EXPECT_GT(camera(View::Front).position.z, 3.0);
  expect_near(camera(View::Back).forward, {0, 0, 1});
  EXPECT_LT(camera(View::Back).position.z, -3.0);
  expect_near(camera(View::Left).forward, {1, 0, 0});
  EXPECT_LT(camera(View::Left).position.x, -2.0);
  expect_near(camera(View::Right).forward, {-1, 0, 0});
  EXPECT_GT(camera(View::Right).position.x, 2.0);
  expect_near(camera(View::Top).forward, {0, -1, 0});
  expect_near(camera(View::Top).up, {0, 0, -1});
  EXPECT_GT(camera(View::Top).position.y, 5.0);
  const DVec3 iso = camera(View::Iso).position;
  EXPECT_GT(iso.x, 2.0);
  EXPECT_GT(iso.y, 5.0);
  EXPECT_GT(iso.z, 3.0);
  for (const View view : kAllViews) expect_orthonormal(camera(view));
}

void expect_framed(const DBox& box, View view, double aspect) {
  const Extent extent = extent_of(frame_view(box, view, aspect), aspect, box);
  constexpr double kFull = 0.92;  // a margin of 4 % on each side
  // Positions far from the origin have the rounding error of the box's own coordinates.
  const double size = std::max({box.max.x - box.min.x, box.max.y - box.min.y, box.max.z - box.min.z});
  const double far = std::max(glm::length(box.min), glm::length(box.max));
  const double tolerance = 1e-9 + 1e-14 * far / std::min(size, extent.depth);
  const auto message = ::testing::Message()
                       << "view " << static_cast<int>(view) << ", aspect " << aspect << ", box " << box.min.x << " "
                       << box.min.y << " " << box.min.z << " to " << box.max.x << " " << box.max.y << " " << box.max.z;
  SCOPED_TRACE(message);
  EXPECT_GT(extent.depth, 0.0);
  for (const double side : {extent.left, extent.right, extent.low, extent.high}) EXPECT_LE(side, kFull + tolerance);
  const bool is_wide = std::min(extent.left, extent.right) > kFull - tolerance;
  const bool is_high = std::min(extent.low, extent.high) > kFull - tolerance;
  EXPECT_TRUE(is_wide || is_high) << extent.left << " " << extent.right << " " << extent.low << " " << extent.high;
}

TEST(Camera, FramesBoxesTightly) {
  std::mt19937_64 random(2024);
  const auto between = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  for (int i = 0; i < 2'000; ++i) {
    const DVec3 size{std::exp2(between(-3, 20)), std::exp2(between(-3, 20)), std::exp2(between(-3, 20))};
    const double far = i % 3 == 0 ? 0.0 : std::exp2(between(0, 31));
    const DVec3 low{between(-far, far), between(-far, far), between(-far, far)};
    for (const View view : kAllViews) expect_framed({low, low + size}, view, std::exp2(between(-4, 4)));
  }
  for (const View view : kAllViews) {
    for (const double aspect : {0.01, 1.0, 16.0 / 9.0, 100.0}) {
      expect_framed({{0, 0, 0}, {1, 1, 1}}, view, aspect);
      expect_framed({{0, 0, 0}, {1e6, 1, 1e6}}, view, aspect);
      expect_framed({{0, 0, 0}, {1, 1e6, 1}}, view, aspect);
      expect_framed({{-2e9, -2e9, -2e9}, {2e9, 2e9, 2e9}}, view, aspect);
      expect_framed({{1e9, -1e9, 1e9}, {1e9 + 1, -1e9 + 1, 1e9 + 1}}, view, aspect);
    }
  }
}

/// Returns a few voxels in grids that are turned, mirrored and of different sizes.
Scene scattered_scene(std::mt19937_64& random) {
  const auto between = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  Scene scene;
  for (int i = 0; i < 3; ++i) {
    SceneGrid grid;
    grid.pivot = {between(-50, 50), between(-50, 50), between(-50, 50)};
    for (int j = 0; j < 40; ++j) {
      const DVec3 voxel{between(-90, 90), between(-40, 40), between(-90, 90)};
      grid.grid.set(IVec3(voxel), 1);
    }
    Instance instance;
    instance.grid = scene.add_grid(std::move(grid));
    instance.position = {between(-1e6, 1e6), between(-100, 100), between(-100, 100)};
    instance.rotation = glm::normalize(DQuat(between(-1, 1), between(-1, 1), between(-1, 1), between(-1, 1)));
    instance.voxel_size = std::exp2(between(-2, 2));
    instance.mirrored = i == 1;
    instance.visible = i != 2;
    scene.add_instance(instance);
  }
  return scene;
}

/// Returns the extent of the scene's voxels on each side of the image.
Extent extent_of(const Camera& camera, double aspect, const Scene& scene, InstanceFilter filter) {
  Extent all;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    const SceneGrid& grid = scene.grids()[instance.grid];
    if (!passes(filter, scene, instance)) continue;
    grid.grid.for_each([&](IVec3 voxel, VoxelType) {
      for (unsigned i = 0; i < 8; ++i) {
        const DVec3 corner = DVec3(voxel) + DVec3{i & 1U, i >> 1U & 1U, i >> 2U & 1U};
        const InImage p = project(camera, aspect, world_from_grid(instance, grid, corner));
        all.left = std::max(all.left, -p.x);
        all.right = std::max(all.right, p.x);
        all.low = std::max(all.low, -p.y);
        all.high = std::max(all.high, p.y);
        all.depth = std::min(all.depth, p.depth);
      }
    });
  }
  return all;
}

TEST(Camera, ImagePointInvertsRay) {
  for (const auto projection : {Camera::Projection::Perspective, Camera::Projection::Orthographic}) {
    Camera camera = look_at({3.0, -2.0, 7.0}, {40.0, 12.0, -5.0}, 0.9).value();
    camera.projection = projection;
    camera.view_height = 20.0;
    for (const auto& [x, y] : {std::pair{0.5, 0.5}, {640.0, 360.0}, {1279.5, 12.25}, {-40.0, 900.0}}) {
      const Ray ray = ray_through(camera, {x, y, 1280, 720});
      const auto seen = image_point(camera, ray.origin + 37.0 * ray.direction, 1280, 720);
      ASSERT_TRUE(seen);
      EXPECT_NEAR(seen->x, x, 1e-9);
      EXPECT_NEAR(seen->y, y, 1e-9);
    }
    const bool is_perspective = projection == Camera::Projection::Perspective;
    EXPECT_EQ(image_point(camera, camera.position - camera.forward, 64, 64).has_value(), !is_perspective);
    EXPECT_EQ(image_point(camera, camera.position, 64, 64).has_value(), !is_perspective);
    EXPECT_FALSE(image_point(camera, DVec3(std::nan("")), 64, 64));
  }
}

TEST(Camera, FramesScenesTightly) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 30; ++i) {
    const Scene scene = scattered_scene(random);
    const InstanceFilter filter = i % 2 == 0 ? InstanceFilter::All : InstanceFilter::Visible;
    for (const View view : kAllViews) {
      const double aspect = i % 3 == 0 ? 0.6 : 1.8;
      const Extent extent = extent_of(frame_scene(scene, view, aspect, filter), aspect, scene, filter);
      EXPECT_GT(extent.depth, 0.0);
      for (const double side : {extent.left, extent.right, extent.low, extent.high}) EXPECT_LE(side, 0.92 + 1e-6);
      EXPECT_TRUE(std::min(extent.left, extent.right) > 0.92 - 1e-6 || std::min(extent.low, extent.high) > 0.92 - 1e-6)
          << "view " << static_cast<int>(view);
    }
  }
  EXPECT_EQ(frame_scene({}, View::Iso, 1.5).position, frame_view({}, View::Iso, 1.5).position);
}

TEST(Camera, FramesEmptyBoxAndPointAsUnitCube) {
  for (const View view : kAllViews) {
    const Camera nothing = frame_view({}, view, 1.5);
    expect_near(nothing.position, frame_view({{0, 0, 0}, {1, 1, 1}}, view, 1.5).position);
    const Camera point = frame_view({{7, 8, 9}, {7, 8, 9}}, view, 1.5);
    expect_near(point.position - DVec3(6.5, 7.5, 8.5), nothing.position);
  }
}

// Every frame of a turn, and every scene, fits into the image; the camera keeps its distance from the axis.
TEST(Framing, FitsAllScenesAndTurns) {
  std::mt19937 random(18);
  const auto number = [&](int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); };
  for (int round = 0; round < 20; ++round) {
    std::array<Scene, 2> scenes;
    for (Scene& scene : scenes) {
      SceneGrid grid;
      for (int i = 0; i < 30; ++i) grid.grid.set({number(40), number(20), number(30)}, 1);
      const GridHandle handle = scene.add_grid(std::move(grid));
      scene.add_instance({.name = "", .grid = handle});
    }
    const int turns = 1 + number(8);
    const double aspect = 0.5 + 0.25 * number(8);
    SceneFraming framing(direction_of(number(360), number(120) - 60), aspect, turns);
    for (const Scene& scene : scenes) framing.add(scene);
    const DBox first = scenes[0].bounds();
    const DVec3 middle = first.min + 0.5 * (first.max - first.min);
    const double distance = glm::length(framing.camera().position - middle);
    for (int turn = 0; turn < turns; ++turn) {
      const Camera camera = framing.camera(turn);
      EXPECT_NEAR(glm::length(camera.position - middle), distance, 1e-9 * distance);
      for (const Scene& scene : scenes) {
        const Extent extent = extent_of(camera, aspect, scene, InstanceFilter::Visible);
        EXPECT_LE(std::max({extent.left, extent.right, extent.low, extent.high}), 0.92 + 1e-6) << "round " << round;
      }
    }
  }
}

}  // namespace
}  // namespace quoin
