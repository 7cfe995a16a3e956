#include "io/vox/vox_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>
#include <random>

#include "io/vox/vox_for_tests.h"

namespace quoin::vox {
namespace {

using vox_test::Entries;
using vox_test::FileBuilder;

constexpr double kDegree = std::numbers::pi / 180.0;

/// A file with one voxel at the origin and these cameras, numbered from 0.
LoadedScene file_with(const std::vector<Entries>& cameras) {
  FileBuilder file;
  file.model(1, 1, 1, {{0, 0, 0, 1}});
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    file.with("rCAM", [&](auto& out) {
      out.i32(static_cast<std::int32_t>(i));
      out.dict(cameras[i]);
    });
  }
  return read_vox(file.file()).value();
}

Camera only_camera(const Entries& entries) {
  const LoadedScene loaded = file_with({entries});
  EXPECT_EQ(loaded.cameras.size(), 1U);
  EXPECT_TRUE(loaded.warnings.empty());
  return loaded.cameras.empty() ? Camera{} : loaded.cameras.front().camera;
}

std::string three(DVec3 v) {
  return std::to_string(v.x) + " " + std::to_string(v.y) + " " + std::to_string(v.z);
}

double distance_of(DVec3 a, DVec3 b) {
  return glm::length(a - b);
}

TEST(VoxCameras, FaceFrontWithoutAngles) {
  const Camera camera = only_camera({{"_mode", "pers"}, {"_focus", "1 2 3"}, {"_radius", "10"}, {"_fov", "60"}});
  EXPECT_EQ(camera.projection, Camera::Projection::Perspective);
  EXPECT_LT(distance_of(camera.forward, {0, 0, -1}), 1e-12);
  EXPECT_LT(distance_of(camera.right, {1, 0, 0}), 1e-12);
  EXPECT_LT(distance_of(camera.up, {0, 1, 0}), 1e-12);
  EXPECT_LT(distance_of(camera.position, {1, 3, 8}), 1e-12);
  EXPECT_NEAR(camera.vertical_fov_radians, 60 * kDegree, 1e-12);
}

// Turns in MagicaVoxel's axes, in this order, as matrices: roll, pitch, yaw.
TEST(VoxCameras, MatchMatricesAtRandomAngles) {
  std::mt19937 random(42);
  std::uniform_real_distribution<double> degrees(-360.0, 360.0);
  for (int i = 0; i < 500; ++i) {
    const DVec3 angle(degrees(random), degrees(random), degrees(random));
    const Camera camera = only_camera({{"_angle", three(angle)}, {"_focus", "5 -7 9"}, {"_radius", "20"}});
    glm::dmat4 turn = glm::rotate(glm::dmat4(1.0), angle.z * kDegree, DVec3(0, -1, 0));
    turn = glm::rotate(glm::dmat4(1.0), angle.x * kDegree, DVec3(1, 0, 0)) * turn;
    turn = glm::rotate(glm::dmat4(1.0), angle.y * kDegree, DVec3(0, 0, 1)) * turn;
    const auto in_quoin = [](DVec3 v) { return DVec3(v.x, v.z, -v.y); };
    const DVec3 forward = in_quoin(DVec3(turn * glm::dvec4(0, 1, 0, 0)));
    EXPECT_LT(distance_of(camera.forward, forward), 1e-5);
    EXPECT_LT(distance_of(camera.right, in_quoin(DVec3(turn * glm::dvec4(1, 0, 0, 0)))), 1e-5);
    EXPECT_LT(distance_of(camera.up, in_quoin(DVec3(turn * glm::dvec4(0, 0, 1, 0)))), 1e-5);
    EXPECT_LT(distance_of(camera.position, in_quoin({5, -7, 9}) - 20.0 * forward), 1e-3);
    EXPECT_LT(distance_of(glm::cross(camera.forward, camera.up), camera.right), 1e-12);
  }
}

TEST(VoxCameras, MatchOrthographicAndPerspectiveAtFocus) {
  const Camera camera = only_camera({{"_mode", "orth"}, {"_focus", "0 50 0"}, {"_radius", "3"}, {"_fov", "90"}});
  EXPECT_EQ(camera.projection, Camera::Projection::Orthographic);
  EXPECT_NEAR(camera.view_height, 6.0, 1e-9);
  EXPECT_GT(camera.position.z, 0.5) << "before the voxel, which is far nearer than the focus";
}

TEST(VoxCameras, IgnoreUnsetCameras) {
  const Entries newer = {{"_mode", "pers"}, {"_focus", "0 0 0"}, {"_angle", "0 0 0"}, {"_radius", "0"}, {"_fov", "45"}};
  const Entries older = {{"_mode", "pers"}, {"_focus", "0 0 0"}, {"_angle", "0 0 0"}, {"_radius", "1"}, {"_fov", "45"}};
  const LoadedScene loaded = file_with({newer, older, {}, {{"_radius", "7"}}, {{"_angle", "0 0 1"}}});
  ASSERT_EQ(loaded.cameras.size(), 2U);
  EXPECT_EQ(loaded.cameras[0].number, 3);
  EXPECT_EQ(loaded.cameras[1].number, 4);
  EXPECT_TRUE(loaded.warnings.empty());
}

TEST(VoxCameras, SkipAndNameUnsupportedCameras) {
  const LoadedScene loaded = file_with({{{"_mode", "pano"}, {"_radius", "5"}},
                                        {{"_angle", "1 2"}},
                                        {{"_focus", "1 2 nan"}},
                                        {{"_fov", "180"}, {"_radius", "5"}},
                                        {{"_radius", "-1"}},
                                        {{"_mode", "iso"}, {"_focus", "1 1 1"}}});
  EXPECT_TRUE(loaded.cameras.empty());
  EXPECT_EQ(loaded.warnings,
            (std::vector<std::string>{"camera 0 skipped: _mode \"pano\" is not supported",
                                      "camera 1 skipped: _angle is \"1 2\"", "camera 2 skipped: _focus is \"1 2 nan\"",
                                      "camera 3 skipped: _fov is not between 0 and 180",
                                      "camera 4 skipped: _radius is below 0", "camera 5 skipped: _radius is 0"}));
}

TEST(VoxCameras, SkipCamerasWithInvalidIds) {
  FileBuilder file;
  file.model(1, 1, 1, {{0, 0, 0, 1}});
  for (const std::int32_t id : {-1, 4, 4}) {
    file.with("rCAM", [&](auto& out) {
      out.i32(id);
      out.dict({{"_radius", "9"}});
    });
  }
  const LoadedScene loaded = read_vox(file.file()).value();
  ASSERT_EQ(loaded.cameras.size(), 1U);
  EXPECT_EQ(loaded.warnings, (std::vector<std::string>{"camera -1 skipped: its id is below 0",
                                                       "camera 4 skipped: its id is a duplicate"}));
}

TEST(VoxCameras, KeepVoxelsDespiteDamagedCamera) {
  FileBuilder file;
  file.model(1, 1, 1, {{0, 0, 0, 1}});
  file.with("rCAM", [](auto& out) {
    out.i32(3);
    out.u32(1'000'000);
  });
  const std::vector<std::byte> bytes = file.file();
  const LoadedScene loaded = read_vox(bytes).value();
  EXPECT_TRUE(loaded.cameras.empty());
  ASSERT_EQ(loaded.warnings.size(), 1U);
  EXPECT_NE(loaded.warnings[0].find("a camera skipped"), std::string::npos);
  EXPECT_EQ(loaded.scene.voxel_count(), 1);
  EXPECT_EQ(write_vox(loaded).value().bytes, bytes) << "kept as it is";
}

}  // namespace
}  // namespace quoin::vox
