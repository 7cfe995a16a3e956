#include <quoin/scene/volume_scene.h>

#include <cmath>
#include <limits>

#include <glm/gtc/matrix_transform.hpp>
#include <gtest/gtest.h>

#include <quoin/scene/scene_query.h>
#include <quoin/scene/scene_tracer.h>

namespace quoin {
namespace {

// A ball of radius 12 about (20, 30, -10) in the world; values increase inwards.
Volume ball(IVec3 size, const glm::dmat4& world_from_voxel) {
  Volume volume;
  volume.size = size;
  volume.name = "ball";
  volume.world_from_voxel = world_from_voxel;
  volume.min = std::numeric_limits<float>::infinity();
  volume.max = -volume.min;
  for (int k = 0; k < size.z; ++k) {
    for (int j = 0; j < size.y; ++j) {
      for (int i = 0; i < size.x; ++i) {
        const DVec3 at(world_from_voxel * glm::dvec4(i, j, k, 1));
        const auto value = static_cast<float>(100.0 - 3.0 * glm::distance(at, DVec3{20, 30, -10}));
        volume.values.push_back(value);
        volume.min = std::min(volume.min, value);
        volume.max = std::max(volume.max, value);
      }
    }
  }
  return volume;
}

glm::dmat4 placed(const glm::dmat3& axes, DVec3 spacing, IVec3 size) {
  glm::dmat4 matrix(1.0);
  for (int axis = 0; axis < 3; ++axis) matrix[axis] = glm::dvec4(axes[axis] * spacing[axis], 0.0);
  const DVec3 middle = 0.5 * DVec3(size - 1);
  matrix[3] = glm::dvec4(DVec3{20, 30, -10} - DVec3(matrix * glm::dvec4(middle, 0.0)), 1.0);
  return matrix;
}

TEST(VolumeScene, RejectsSpacingWithTooManySamples) {
  for (const double spacing : {1e-7, 1e-9, 1e-25}) {
    const auto scene = scene_from_volume(ball({2, 2, 2}, placed(glm::dmat3(1.0), {spacing, 1, 1}, {2, 2, 2})), {64.0F});
    ASSERT_FALSE(scene);
    EXPECT_EQ(scene.error().code, ErrorCode::LimitExceeded) << scene.error().message;
  }
}

TEST(VolumeScene, FollowsTransformOfVolume) {
  const glm::dmat3 turned(glm::rotate(glm::dmat4(1.0), 0.6, DVec3{1, 2, -1}));
  glm::dmat3 mirrored = turned;
  mirrored[1] = -mirrored[1];
  for (const glm::dmat3& axes : {glm::dmat3(1.0), turned, mirrored}) {
    for (const DVec3 spacing : {DVec3(0.8), DVec3{0.8, 1.1, 2.5}}) {
      const IVec3 size(glm::ceil(34.0 / spacing));
      const auto scene = scene_from_volume(ball(size, placed(axes, spacing, size)), {64.0F});
      ASSERT_TRUE(scene) << scene.error().message;
      EXPECT_EQ(scene->grids()[scene->grids().handles()[0]].name, "ball");
      const SceneTracer tracer(*scene);
      for (const DVec3 out : {DVec3{1, 0, 0}, DVec3{0, -1, 0}, DVec3{0, 0, 1}, DVec3{-1, 2, 3}, DVec3{3, -1, -2}}) {
        const DVec3 away = glm::normalize(out);
        const auto hit = first_hit(tracer, {DVec3{20, 30, -10} + away * 60.0, -away});
        ASSERT_TRUE(hit);
        // One axis is coarse: interpolation between its samples cuts corners.
        EXPECT_NEAR(hit->t, 60.0 - 12.0, spacing.z > 2.0 ? 0.15 : 0.03);
        EXPECT_GT(glm::dot(hit->normal, away), 0.97);
      }
    }
  }
}

TEST(VolumeScene, RefusesInvalidTransforms) {
  const auto code_of = [](const glm::dmat4& world_from_voxel) {
    Volume volume = ball({4, 4, 4}, glm::dmat4(1.0));
    volume.world_from_voxel = world_from_voxel;
    const auto scene = scene_from_volume(volume, {64.0F});
    return scene ? std::optional<ErrorCode>() : std::optional(scene.error().code);
  };
  glm::dmat4 matrix(1.0);
  EXPECT_EQ(code_of(matrix), std::nullopt);
  matrix[1][0] = 0.3;
  EXPECT_EQ(code_of(matrix), ErrorCode::Unsupported);
  EXPECT_EQ(code_of(glm::dmat4(0.0)), ErrorCode::InvalidArgument);
  matrix[1][0] = std::nan("");
  EXPECT_EQ(code_of(matrix), ErrorCode::InvalidArgument);
  Volume none;
  EXPECT_FALSE(scene_from_volume(none));
  Volume lacking = ball({4, 4, 4}, placed(glm::dmat3(1.0), {1, 1, 2}, {4, 4, 4}));
  lacking.values.pop_back();
  EXPECT_FALSE(scene_from_volume(lacking, {64.0F}));
  // No value is above the threshold: the scene is empty.
  const auto empty = scene_from_volume(ball({4, 4, 4}, glm::dmat4(1.0)), {1e6F});
  ASSERT_TRUE(empty);
  EXPECT_TRUE(empty->bounds().empty());
}

}  // namespace
}  // namespace quoin
