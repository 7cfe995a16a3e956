#include <quoin/io/smooth_scene.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include <quoin/mesh/simplify.h>

#include "io/gltf_fixture.h"
#include "io/smooth_files_fixture.h"

namespace quoin {

namespace {

Volume volume_of(IVec3 size, const std::vector<float>& values) {
  Volume volume;
  volume.size = size;
  volume.values = values;
  volume.min = std::numeric_limits<float>::infinity();
  volume.max = -volume.min;
  for (const float value : values) {
    if (!std::isfinite(value)) continue;
    volume.min = std::min(volume.min, value);
    volume.max = std::max(volume.max, value);
  }
  return volume;
}

/// Otsu's threshold by trying every value.
double variance_within(const std::vector<float>& values, double threshold) {
  double sum[2] = {}, squares[2] = {}, count[2] = {};
  for (const double value : values) {
    const int side = value > threshold ? 1 : 0;
    sum[side] += value;
    squares[side] += value * value;
    count[side] += 1;
  }
  double within = 0.0;
  for (int side = 0; side < 2; ++side) {
    if (count[side] > 0) within += squares[side] - sum[side] * sum[side] / count[side];
  }
  return within;
}

TEST(VolumeThreshold, parts_two_groups_best) {
  const std::uint32_t seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < 20; ++round) {
    std::normal_distribution<float> low(-40.0F, 5.0F + static_cast<float>(round));
    std::normal_distribution<float> high(120.0F, 30.0F);
    std::vector<float> values;
    for (int i = 0; i < 3000; ++i) values.push_back(i % 4 == 0 ? high(random) : low(random));
    const Volume volume = volume_of({3000, 1, 1}, values);
    double least = std::numeric_limits<double>::infinity();
    for (const float value : values) least = std::min(least, variance_within(values, value));
    EXPECT_LT(variance_within(values, volume_threshold(volume)), least * 1.001);
  }
}

TEST(VolumeThreshold, lies_amid_the_gap) {
  EXPECT_EQ(volume_threshold(volume_of({4, 1, 1}, {0, 0, 255, 255})), 127.5F);
  EXPECT_NEAR(volume_threshold(volume_of({4, 1, 1}, {-1e30F, -1e30F, 3e30F, 3e30F})), 1e30F, 1e28F);
  const float huge = std::numeric_limits<float>::max();
  EXPECT_NEAR(volume_threshold(volume_of({2, 1, 1}, {-huge, huge})), 0.0F, huge * 1e-3F);
}

TEST(VolumeThreshold, parts_values_with_no_float_between_them) {
  float low = 1.0F;
  for (int i = 0; i < 4; ++i) {
    const float high = std::nextafter(low, 2.0F);
    EXPECT_EQ(volume_threshold(volume_of({2, 1, 1}, {low, high})), low) << "what is above is solid";
    low = high;
  }
}

TEST(VolumeThreshold, odd_volumes_have_one) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(volume_threshold(volume_of({3, 1, 1}, {7, 7, 7})), 7.0F);
  EXPECT_EQ(volume_threshold(volume_of({5, 1, 1}, {nan, 0, 10, INFINITY, -INFINITY})), 5.0F);
  Volume none = volume_of({1, 1, 1}, {nan});
  none.min = none.max = 0.0F;
  EXPECT_EQ(volume_threshold(none), 0.0F);
}

TEST(UnitsOfLength, have_metres) {
  EXPECT_EQ(metres_of_unit("mm"), 1e-3);
  EXPECT_EQ(metres_of_unit("um"), 1e-6);
  EXPECT_EQ(metres_of_unit("microns"), 1e-6);
  EXPECT_EQ(metres_of_unit("m"), 1.0);
  EXPECT_EQ(metres_of_unit(""), std::nullopt);
  EXPECT_EQ(metres_of_unit("furlong"), std::nullopt);
}

/// To the nearest centre of a voxel of add_asymmetric_grid.
double distance_from_voxels(const Instance& instance, const SceneGrid& grid, DVec3 point) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const IVec3 voxel : {IVec3(0, 0, 0), IVec3(0, 1, 0), IVec3(0, 2, 0), IVec3(0, 3, 0), IVec3(0, 4, 0),
                            IVec3(1, 0, 0), IVec3(2, 0, 0), IVec3(3, 0, 0), IVec3(3, 1, 0), IVec3(0, 1, 1)}) {
    nearest = std::min(nearest, glm::length(world_from_grid(instance, grid, DVec3(voxel) + 0.5) - point));
  }
  return nearest;
}

TEST(SmoothScene, surfaces_lie_around_the_voxels_of_every_instance) {
  Scene scene;
  const GridHandle grid = add_asymmetric_grid(scene, "L");
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  for (int i = 0; i < 6; ++i) {
    Instance instance;
    instance.grid = grid;
    instance.name = std::string(1, static_cast<char>('a' + i));
    instance.position = 40.0 * DVec3(any(random), any(random), any(random));
    instance.rotation = glm::normalize(DQuat(any(random), any(random), any(random), any(random)));
    instance.voxel_size = 1.5 + any(random);
    instance.mirrored = i % 2 == 1;
    instance.visible = i != 5;
    scene.add_instance(instance);
  }
  const auto smooth = smooth_scene(scene, {});
  ASSERT_TRUE(smooth) << to_string(smooth.error());
  ASSERT_EQ(smooth->parts.size(), 1U);
  EXPECT_EQ(smooth->parts[0].name, "L");
  ASSERT_EQ(smooth->parts[0].placements.size(), 5U) << "the hidden one is left out";
  const TestFolder folder("smooth_scene");
  ASSERT_TRUE(write_smooth_glb(smooth->parts, folder.file("out.glb")));
  const ParsedGlb glb = parse_glb(read_file(folder.file("out.glb")).value());
  EXPECT_EQ(glb.document["meshes"].size(), 2U);
  EXPECT_EQ(glb.document["nodes"][0]["name"], "a");
  const WorldMesh world = world_of(glb);
  EXPECT_GT(world.volume(), 0.0);
  const std::size_t vertices = world.positions.size() / 5;
  std::size_t at = 0;
  for (const InstanceHandle handle : scene.instances().handles()) {
    const Instance& instance = scene.instances()[handle];
    if (!instance.visible) continue;
    for (std::size_t i = 0; i < vertices; ++i) {
      // The surface runs between voxel centres.
      EXPECT_LT(distance_from_voxels(instance, scene.grids()[grid], world.positions[at + i]), instance.voxel_size);
    }
    at += vertices;
  }
}

TEST(SmoothScene, is_the_same_at_any_thread_count_and_can_be_cancelled) {
  Scene scene;
  place(scene, add_asymmetric_grid(scene, "a"), {1, 2, 3});
  place(scene, add_asymmetric_grid(scene, "b"), {1, 2, 3});
  const auto one = smooth_scene(scene, {}, Threads{1});
  double last = 0.0;
  const auto four = smooth_scene(scene, {}, Threads{4}, [&](double fraction) {
    EXPECT_GE(fraction, last);
    EXPECT_LE(fraction, 1.0);
    last = fraction;
    return true;
  });
  ASSERT_TRUE(one && four);
  ASSERT_EQ(one->parts.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(one->parts[i].mesh.positions, four->parts[i].mesh.positions);
    EXPECT_EQ(one->parts[i].mesh.indices, four->parts[i].mesh.indices);
    EXPECT_EQ(one->parts[i].mesh.openness, four->parts[i].mesh.openness);
  }
  const auto cancelled = smooth_scene(scene, {}, {}, [](double) { return false; });
  ASSERT_FALSE(cancelled);
  EXPECT_EQ(cancelled.error().code, ErrorCode::Cancelled);
}

/// Positive inside; samples of a ball.
Volume ball(IVec3 size, DVec3 centre, double radius) {
  std::vector<float> values;
  for (int i = 0; i < size.x * size.y * size.z; ++i) {
    const DVec3 p(i % size.x, i / size.x % size.y, i / (size.x * size.y));
    values.push_back(static_cast<float>(radius - glm::length(p - centre)));
  }
  return volume_of(size, values);
}

TEST(SmoothVolumes, a_ball_is_one_and_lies_where_the_file_says) {
  for (const double x_axis : {2.0, -2.0}) {
    Volume volume = ball({70, 30, 28}, {40, 15, 13}, 10);
    volume.world_from_voxel = glm::dmat4{{x_axis, 0, 0, 0}, {0, 0, 3, 0}, {0, 1, 0, 0}, {100, 50, 20, 1}};
    const auto smooth = smooth_volume(volume, {});
    ASSERT_TRUE(smooth) << to_string(smooth.error());
    EXPECT_NEAR(static_cast<double>(smooth->solid_samples), 4189.0, 150.0);
    const TestFolder folder("smooth_volume");
    ASSERT_TRUE(write_ply({&smooth->part, 1}, folder.file("out.ply")));
    const WorldMesh world = world_of_ply(read_file(folder.file("out.ply")).value());
    EXPECT_NEAR(world.volume(), 6.0 * 4189.0, 6.0 * 80.0) << "outside is outside, mirrored or not";
    for (const DVec3& p : world.positions) {
      const DVec3 in_voxels((p.x - 100) / x_axis, (p.z - 20) / 3, p.y - 50);
      EXPECT_NEAR(glm::length(in_voxels - DVec3(40, 15, 13)), 10.0, 0.06);
    }
  }
}

TEST(SmoothVolumes, simplifying_is_within_the_error_or_refused) {
  SmoothVolumeOptions options;
  const Volume volume = ball({40, 40, 40}, {20, 20, 20}, 15);
  const auto whole = smooth_volume(volume, options);
  options.simplify_error = 0.1F;
  const auto simple = smooth_volume(volume, options);
  ASSERT_TRUE(whole);
  ASSERT_EQ(simple.has_value(), can_simplify());
  if (!can_simplify()) GTEST_SKIP() << "this build has no meshoptimizer";
  EXPECT_LT(simple->part.mesh.indices.size(), whole->part.mesh.indices.size() / 2);
  EXPECT_GT(simple->simplify_error, 0.0F);
  EXPECT_LE(simple->simplify_error, 0.1F);
}

}  // namespace

}  // namespace quoin
