// Path-traced images that continue across edits.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/hash.h>
#include <quoin/grid/grid.h>
#include <quoin/render/path_history.h>
#include <quoin/render/path_tracer.h>

#include "core/death_for_tests.h"
#include "render/cpu/environment_for_tests.h"
#include "render/cpu/render_test_support.h"
#include "render/path/path_math.h"
#include "render/path/town_for_tests.h"

namespace quoin {
namespace {

using path::pack_light;
using path::unpack_light;
using render_test::add_type;
using render_test::from_above;
using render_test::place;
using render_test::towards;
using render_test::under_even_sky;

constexpr int kImageEdge = 48;        // image size in pixels
constexpr IVec3 kTower{-16, 0, -16};  // the tower built on the meadow
constexpr std::array kSamples{1, 4, 16, 64};

float greatest_difference(const PathImage& a, const PathImage& b, int from_x = 0) {
  float most = 0.0F;
  for (std::size_t i = 0; i < a.radiance.size(); ++i) {
    if (static_cast<int>(i) % a.width < from_x) continue;
    for (int axis = 0; axis < 3; ++axis) most = std::max(most, std::abs(a.radiance[i][axis] - b.radiance[i][axis]));
  }
  return most;
}

double mean_square(const PathImage& a, const PathImage& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.radiance.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const double difference = static_cast<double>(a.radiance[i][axis]) - static_cast<double>(b.radiance[i][axis]);
      sum += difference * difference;
    }
  }
  return sum / (3.0 * static_cast<double>(a.radiance.size()));
}

/// A meadow with a wall and lamps, seen from above, with visible noise.
class PathHistoryTest : public testing::Test {
 protected:
  PathHistoryTest() : scene_(meadow(grid_)), tracer_(scene_), options_(under_even_sky(kImageEdge, kImageEdge, 1)) {
    physical_in(options_).sun.brightness = 1.0;
    physical_in(options_).sun.direction = {0.5, 0.7, 0.2};
    options_.max_bounces = 3;
  }

  static Scene meadow(GridHandle& made) {
    Scene scene;
    const VoxelType ground = add_type(scene, {120, 150, 90, 255});
    const VoxelType lamp = add_type(scene, {255, 180, 90, 255}, Visibility::Opaque, 6.0F);
    Grid grid;
    grid.fill_box({{-24, -1, -24}, {24, 0, 24}}, ground);
    grid.fill_box({{0, 0, -10}, {2, 6, 10}}, ground);
    grid.fill_box({{6, 4, 6}, {8, 5, 8}}, lamp);
    made = scene.instances()[place(scene, std::move(grid))].grid;
    return scene;
  }

  PathImage take(int edge, int samples, std::uint32_t seed = 0) {
    options_.width = edge;
    options_.height = edge;
    options_.samples = samples;
    options_.seed = seed;
    return tracer_.render(from_above(0.0, 40.0, 0.0, 48.0), options_, {2}).value();
  }

  PathImage refined(int edge, int samples, std::uint32_t seed = 0) {
    PathImage image = take(edge, samples, seed);
    history_.refine(image, samples, {2});
    return image;
  }

  void converge(std::uint32_t seed = 0) {
    for (const int samples : kSamples) static_cast<void>(refined(kImageEdge, samples, seed));
  }

  void edit(VoxelType type) {
    scene_.edit(grid_).grid.fill_box({kTower, kTower + IVec3(2, 6, 2)}, type);
    tracer_.update({2});
    history_.note_edit();
  }

  GridHandle grid_;
  Scene scene_;
  PathTracer tracer_;
  PathOptions options_;
  PathHistory history_;
};

TEST(PackedLight, RoundsWithinSmallErrorOfLargestChannel) {
  for (std::uint32_t i = 0; i < 4'096; ++i) {
    const auto any = [i](std::uint32_t of) { return static_cast<float>(mix_bits(4 * i + of) >> 8) * 0x1p-24F; };
    const float scale = std::exp2(any(3) * 24.0F - 9.0F);
    const Vec3 light = Vec3(any(0), any(1), any(2)) * scale;
    const float most = std::max({light.x, light.y, light.z});
    const Vec3 kept = unpack_light(pack_light(light));
    for (int axis = 0; axis < 3; ++axis) ASSERT_LE(std::abs(kept[axis] - light[axis]), most / 512.0F) << i;
    ASSERT_EQ(pack_light(kept), pack_light(light)) << i;
  }
}

TEST(PackedLight, ClampsOutOfRangeValues) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(pack_light(Vec3(0.0F)), 0U);
  EXPECT_EQ(unpack_light(pack_light({-1.0F, 0.0F, 1.0F})), Vec3(0.0F, 0.0F, 1.0F));
  EXPECT_EQ(unpack_light(pack_light({kInfinity, 1e9F, 0.0F})),
            Vec3(path::kMaxPackedLight, path::kMaxPackedLight, 0.0F));
  EXPECT_EQ(unpack_light(pack_light(Vec3(std::numeric_limits<float>::quiet_NaN()))), Vec3(0.0F));
  EXPECT_EQ(unpack_light(pack_light(Vec3(511.9F))), Vec3(512.0F)) << "rounded up into the next exponent";
}

TEST_F(PathHistoryTest, KeepsImagesWithoutEdits) {
  for (const int samples : kSamples) {
    const PathImage taken = take(kImageEdge, samples);
    PathImage shown = taken;
    history_.refine(shown, samples);
    EXPECT_EQ(shown.radiance, taken.radiance);
    EXPECT_FALSE(history_.has_earlier());
  }
  EXPECT_GE(history_.bytes(), 4U * kSamples.size() * kImageEdge * kImageEdge);
}

TEST_F(PathHistoryTest, KeepsPixelsUnaffectedByAnEdit) {
  converge();
  const PathImage before = take(kImageEdge, kSamples.back());
  edit(2);
  ASSERT_TRUE(history_.has_earlier());
  const PathImage plain = take(kImageEdge, 1);
  const PathImage shown = refined(kImageEdge, 1);
  const PathImage converged = take(kImageEdge, 1'024);
  // Hardly any path behind the wall passes the tower.
  EXPECT_LT(mean_square(shown, converged), 0.5 * mean_square(plain, converged));
  EXPECT_GT(greatest_difference(plain, before, kImageEdge / 2), 0.2F);
  int same = 0;
  for (std::size_t i = 0; i < shown.radiance.size(); ++i) {
    const Vec3 difference = shown.radiance[i] - before.radiance[i];
    same += std::max({std::abs(difference.x), std::abs(difference.y), std::abs(difference.z)}) < 0.01F ? 1 : 0;
  }
  EXPECT_GT(same, kImageEdge * kImageEdge / 2);
}

TEST_F(PathHistoryTest, ConvergesToImageOfNewTracer) {
  converge();
  edit(2);
  PathImage shown;
  for (const int samples : kSamples) shown = refined(kImageEdge, samples);
  EXPECT_EQ(shown.radiance, take(kImageEdge, kSamples.back()).radiance);
  EXPECT_FALSE(history_.has_earlier()) << "the new image has as many samples as the earlier one";
}

TEST_F(PathHistoryTest, RestoresEarlierImageAfterUndoneEdit) {
  converge();
  const PathImage before = take(kImageEdge, kSamples.back());
  edit(2);
  for (const int samples : {1, 4}) static_cast<void>(refined(kImageEdge, samples));
  edit(kAir);
  EXPECT_TRUE(history_.has_earlier());
  EXPECT_LT(greatest_difference(refined(kImageEdge, 1), before), 0.02F);
}

// The edit removes only little of the light.
TEST_F(PathHistoryTest, MatchesMeanOfNewScene) {
  constexpr int kTries = 24;
  std::vector<DVec3> shown(static_cast<std::size_t>(kImageEdge) * kImageEdge, DVec3(0.0));
  for (std::uint32_t seed = 1; seed <= kTries; ++seed) {
    history_.clear();
    converge(seed);
    edit(2);
    const PathImage image = refined(kImageEdge, 1, seed);
    for (std::size_t i = 0; i < shown.size(); ++i) shown[i] += DVec3(image.radiance[i]) / static_cast<double>(kTries);
    edit(kAir);
  }
  edit(2);
  const PathImage converged = take(kImageEdge, 1'024);
  DVec3 all(0.0);
  DVec3 right(0.0);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    all += shown[i];
    right += DVec3(converged.radiance[i]);
  }
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(all[axis] / right[axis], 1.0, 0.008);
}

// Few samples find a light behind a window: samples that miss it do not show that the window is gone.
TEST(PathHistory, DarkensClosedRoomWithinFewSamples) {
  constexpr IBox kWindow{{32, 12, 12}, {33, 18, 18}};
  Scene scene;
  const VoxelType wall = add_type(scene, {200, 200, 200, 255});
  Grid grid;
  grid.fill_box({{-1, -1, -1}, {33, 25, 33}}, wall);
  grid.fill_box({{0, 0, 0}, {32, 24, 32}}, kAir);
  grid.fill_box(kWindow, kAir);
  const GridHandle room = scene.instances()[place(scene, std::move(grid))].grid;
  PathTracer tracer(scene);
  PathOptions options = under_even_sky(kImageEdge, kImageEdge, 1);
  options.max_bounces = 4;
  PathHistory history;
  const auto mean_shown = [&](int samples) {
    options.samples = samples;
    PathImage image = tracer.render(towards({2, 16, 2}, {20, 6, 18}, 1.1), options, {2}).value();
    history.refine(image, samples, {2});
    double sum = 0.0;
    for (const Vec3& light : image.radiance) sum += static_cast<double>(light.y);
    return sum / static_cast<double>(image.radiance.size());
  };
  double before = 0.0;
  for (const int samples : kSamples) before = mean_shown(samples);
  ASSERT_GT(before, 0.01);
  scene.edit(room).grid.fill_box(kWindow, wall);
  tracer.update({2});
  history.note_edit();
  EXPECT_LT(mean_shown(1), 0.3 * before);
  EXPECT_LT(mean_shown(4), 0.2 * before);
  EXPECT_LT(mean_shown(16), 0.08 * before);
  EXPECT_EQ(mean_shown(kSamples.back()), 0.0);
}

TEST_F(PathHistoryTest, RefinesSmallImagesFromLargerOnes) {
  for (const int edge : {kImageEdge / 4, kImageEdge / 2, kImageEdge}) static_cast<void>(refined(edge, 1));
  converge();
  const PathImage before = take(kImageEdge, kSamples.back());
  EXPECT_FALSE(history_.knows(kImageEdge / 4, kImageEdge / 4, 1)) << "only images of earlier scenes are known";
  edit(2);
  ASSERT_TRUE(history_.knows(kImageEdge / 4, kImageEdge / 4, 1));
  EXPECT_FALSE(history_.knows(kImageEdge / 3, kImageEdge / 3, 1));
  const PathImage small = take(kImageEdge / 4, 1);
  PathImage plain = before;
  for (int i = 0; i < kImageEdge * kImageEdge; ++i)
    plain.radiance[static_cast<std::size_t>(i)] =
        small.radiance[static_cast<std::size_t>(i / kImageEdge / 4 * (kImageEdge / 4) + i % kImageEdge / 4)];
  const PathImage shown = refined(kImageEdge / 4, 1);
  ASSERT_EQ(shown.width, kImageEdge);
  ASSERT_EQ(shown.radiance.size(), before.radiance.size());
  ASSERT_EQ(shown.alpha.size(), before.radiance.size());
  const PathImage converged = take(kImageEdge, 1'024);
  EXPECT_LT(mean_square(shown, converged), 0.5 * mean_square(plain, converged));
  EXPECT_GT(greatest_difference(shown, before), 0.1F) << "and the tower is there";
}

TEST_F(PathHistoryTest, KeepsImagesOfUnknownSampleCounts) {
  converge();
  edit(2);
  const PathImage taken = take(kImageEdge, 2);
  EXPECT_EQ(refined(kImageEdge, 2).radiance, taken.radiance);
  history_.clear();
  EXPECT_FALSE(history_.has_earlier());
  EXPECT_EQ(history_.bytes(), 0U);
}

TEST_F(PathHistoryTest, KeepsLayersOfFullSizeImages) {
  options_.layers = true;
  for (const int edge : {kImageEdge / 2, kImageEdge}) static_cast<void>(refined(edge, 1));
  converge();
  edit(2);
  EXPECT_TRUE(refined(kImageEdge / 2, 1).albedo.empty());
  const PathImage taken = take(kImageEdge, 1);
  const PathImage shown = refined(kImageEdge, 1);
  EXPECT_EQ(shown.albedo, taken.albedo);
  EXPECT_EQ(shown.depth.values, taken.depth.values);
  EXPECT_EQ(shown.alpha, taken.alpha);
  EXPECT_EQ(shown.rays, taken.rays);
}

TEST(PathHistoryDeathTest, RejectsImageWithoutOneValuePerPixel) {
  PathHistory history;
  PathImage image;
  image.width = image.height = 4;
  QUOIN_EXPECT_MISTAKE(history.refine(image, 1), "one value per pixel");
}

}  // namespace
}  // namespace quoin
