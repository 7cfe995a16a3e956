#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include <quoin/io/vox.h>

#include "io/vox/vox_for_tests.h"
#include "io/vox/write/vox_parts.h"

namespace quoin::vox {
namespace {

using vox_test::FileBuilder;

constexpr double kDegree = std::numbers::pi / 180.0;

// One voxel at the origin, without a file.
LoadedScene scene_of_a_voxel() {
  LoadedScene loaded;
  VoxelProperties red;
  red.colour = {200, 0, 0, 255};
  const VoxelType type = loaded.scene.types.add(red).value();
  SceneGrid grid;
  grid.grid.set({0, 0, 0}, type);
  Instance instance;
  instance.grid = loaded.scene.add_grid(std::move(grid));
  loaded.scene.add_instance(std::move(instance));
  return loaded;
}

LoadedScene written(const LoadedScene& loaded) {
  return read_vox(write_vox(loaded).value().bytes).value();
}

Camera turned(double pitch, double yaw, double roll) {
  const auto about = [](DVec3 axis, double angle) { return glm::angleAxis(angle, axis); };
  const DQuat turn = about({0, 1, 0}, yaw) * about({1, 0, 0}, pitch) * about({0, 0, 1}, roll);
  Camera camera;
  camera.right = turn * DVec3(1, 0, 0);
  camera.up = turn * DVec3(0, 1, 0);
  camera.forward = turn * DVec3(0, 0, -1);
  return camera;
}

void expect_same(const Camera& found, const Camera& wanted, const char* what) {
  EXPECT_LT(glm::length(found.position - wanted.position), 1e-3) << what;
  EXPECT_LT(glm::length(found.right - wanted.right), 1e-5) << what;
  EXPECT_LT(glm::length(found.up - wanted.up), 1e-5) << what;
  EXPECT_LT(glm::length(found.forward - wanted.forward), 1e-5) << what;
  EXPECT_EQ(found.projection, wanted.projection) << what;
}

TEST(VoxViewWriting, RoundTripsAnyCamera) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-180.0, 180.0);
  LoadedScene loaded = scene_of_a_voxel();
  for (int i = 0; i < 200; ++i) {
    const double pitch = i % 10 == 0 ? (i % 20 == 0 ? 90.0 : -90.0) : any(random) / 2.0;
    FileCamera one{i, turned(pitch * kDegree, any(random) * kDegree, any(random) * kDegree), 0.0};
    one.camera.position = {any(random), any(random), any(random)};
    one.camera.vertical_fov_radians = (1.0 + std::abs(any(random)) / 1.1) * kDegree;
    one.focus_distance = i % 3 == 0 ? 0.0 : std::abs(any(random));
    loaded.cameras.push_back(one);
  }
  const LoadedScene again = written(loaded);
  ASSERT_EQ(again.cameras.size(), loaded.cameras.size());
  for (std::size_t i = 0; i < again.cameras.size(); ++i) {
    EXPECT_EQ(again.cameras[i].number, loaded.cameras[i].number);
    expect_same(again.cameras[i].camera, loaded.cameras[i].camera, std::to_string(i).c_str());
    EXPECT_NEAR(again.cameras[i].focus_distance, loaded.cameras[i].focus_distance, 1e-4);
    EXPECT_NEAR(again.cameras[i].camera.vertical_fov_radians, loaded.cameras[i].camera.vertical_fov_radians, 1e-6);
  }
}

TEST(VoxViewWriting, RoundTripsCameraThatLooksUnset) {
  LoadedScene loaded = scene_of_a_voxel();
  for (const double focus : {0.0, 1.0}) {
    FileCamera one{static_cast<int>(focus), {}, focus};
    one.camera.position = {0.0, 0.0, focus};
    loaded.cameras.push_back(one);
  }
  const LoadedScene again = written(loaded);
  ASSERT_EQ(again.cameras.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) expect_same(again.cameras[i].camera, loaded.cameras[i].camera, "unset");
}

TEST(VoxViewWriting, RoundTripsOrthographicCamera) {
  LoadedScene loaded = scene_of_a_voxel();
  FileCamera one{3, turned(-0.5, 0.7, 0.1), 0.0};
  one.camera.projection = Camera::Projection::Orthographic;
  one.camera.view_height = 12.5;
  one.camera.position = DVec3(0.5) - one.camera.forward * 40.0;
  loaded.cameras.push_back(one);
  const LoadedScene again = written(loaded);
  ASSERT_EQ(again.cameras.size(), 1U);
  expect_same(again.cameras[0].camera, one.camera, "orthographic");
  EXPECT_NEAR(again.cameras[0].camera.view_height, 12.5, 1e-4);
}

TEST(VoxViewWriting, AssignsFreeNumberToFirstCamera) {
  LoadedScene loaded = scene_of_a_voxel();
  loaded.cameras.push_back({0, turned(0.1, 0.2, 0.3), 5.0});
  loaded.camera = turned(0.3, 0.2, 0.1);
  const LoadedScene again = written(loaded);
  ASSERT_EQ(again.cameras.size(), 2U);
  EXPECT_EQ(again.cameras[0].number, 1);
  expect_same(again.cameras[0].camera, *loaded.camera, "first");
}

TEST(VoxViewWriting, RoundTripsSun) {
  LoadedScene loaded = scene_of_a_voxel();
  loaded.scene.environment = Environment::natural(glm::normalize(DVec3(-3, 2, 1)));
  LoadedScene again = written(loaded);
  ASSERT_TRUE(again.render_settings.has_value());
  const Sun& first = again.render_settings->environment.sun;
  EXPECT_LT(glm::length(first.direction - loaded.scene.environment->sun.direction), 1e-6);
  EXPECT_NEAR(first.brightness, 1.0, 1e-6);

  const Sun wanted{.direction = {0, -1, 0},
                   .brightness = 3.0,
                   .colour = {2.0F, 1.0F, 0.0F},
                   .angle_radians = 0.25,
                   .is_visible = false};
  loaded.scene.environment->sun = wanted;
  again = written(loaded);
  EXPECT_TRUE(write_vox(loaded).value().warnings.empty());
  const Sun& found = again.render_settings.value().environment.sun;
  EXPECT_LT(glm::length(found.direction - wanted.direction), 1e-6);
  // Values brighter than white become brightness.
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(static_cast<double>(found.colour[i]) * found.brightness, static_cast<double>(wanted.colour[i]) * 3.0,
                0.03);
  }
  EXPECT_NEAR(found.angle_radians, 0.25, 1e-6);
  EXPECT_FALSE(found.is_visible);

  loaded.scene.environment->fog = Fog{};
  EXPECT_EQ(write_vox(loaded).value().warnings, std::vector<std::string>{"render settings left out, except the sun's"});
  EXPECT_EQ(vox_unsupported_features(loaded).value().size(), 1U);
}

// Returns a file with two configured cameras, one unused camera, and a sun; other keys are kept.
std::vector<std::byte> file_with_views() {
  FileBuilder file;
  file.model(1, 1, 1, {{0, 0, 0, 1}});
  file.with("rOBJ", [](auto& out) { out.dict({{"_type", "_inf"}, {"_i", "0.5"}, {"_other", "7"}}); });
  file.with("rOBJ", [](auto& out) { out.dict({{"_type", "_bloom"}, {"_mix", "0.25"}}); });
  for (int i = 0; i < 3; ++i) {
    file.with("rCAM", [&](auto& out) {
      out.i32(i);
      if (i == 1)
        out.dict({{"_mode", "pers"}, {"_focus", "0 0 0"}, {"_angle", "0 0 0"}, {"_radius", "0"}, {"_fov", "45"}});
      else
        out.dict({{"_mode", "free"}, {"_focus", "1 2 3"}, {"_radius", "9"}, {"_note", "kept"}});
    });
  }
  return file.file();
}

std::size_t count_of(const std::vector<std::byte>& bytes, std::string_view text) {
  const std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::size_t count = 0;
  for (std::size_t at = all.find(text); at != std::string_view::npos; at = all.find(text, at + 1)) ++count;
  return count;
}

TEST(VoxViewWriting, WritesTheSameFileWithoutChanges) {
  const std::vector<std::byte> file = file_with_views();
  EXPECT_EQ(write_vox(read_vox(file).value()).value().bytes, file);
}

TEST(VoxViewWriting, RewritesOnlyChanges) {
  LoadedScene loaded = read_vox(file_with_views()).value();
  ASSERT_EQ(loaded.cameras.size(), 2U);
  loaded.cameras[1].camera.position.x += 5.0;                 // number 2
  loaded.cameras.push_back({1, turned(0.2, 0.4, 0.0), 7.0});  // the unused camera
  loaded.cameras.push_back({6, turned(0.2, 0.5, 0.0), 7.0});
  loaded.render_settings->environment.sun.brightness = 2.0;
  const std::vector<std::byte> bytes = write_vox(loaded).value().bytes;
  EXPECT_EQ(count_of(bytes, "rCAM"), 4U);
  EXPECT_EQ(count_of(bytes, "rOBJ"), 2U);
  EXPECT_EQ(count_of(bytes, "_note"), 2U);
  EXPECT_EQ(count_of(bytes, "_other"), 1U);
  EXPECT_EQ(count_of(bytes, "free"), 1U);
  const LoadedScene again = read_vox(bytes).value();
  ASSERT_EQ(again.cameras.size(), 4U);
  EXPECT_EQ(again.cameras[0].camera, loaded.cameras[0].camera);
  expect_same(again.cameras[1].camera, loaded.cameras[2].camera, "1");
  expect_same(again.cameras[2].camera, loaded.cameras[1].camera, "2");
  expect_same(again.cameras[3].camera, loaded.cameras[3].camera, "6");
  EXPECT_NEAR(again.render_settings->environment.sun.brightness, 2.0, 1e-6);
  EXPECT_EQ(again.render_settings->environment.bloom, loaded.render_settings->environment.bloom);

  loaded = read_vox(file_with_views()).value();
  loaded.cameras.erase(loaded.cameras.begin());
  const std::vector<std::byte> without = write_vox(loaded).value().bytes;
  EXPECT_EQ(count_of(without, "rCAM"), 2U);
  EXPECT_EQ(read_vox(without).value().cameras.front().number, 2);
}

}  // namespace
}  // namespace quoin::vox
