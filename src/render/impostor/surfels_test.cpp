// Compares impostors of fields with traced images.

#include <cmath>
#include <cstdio>
#include <set>
#include <string>
#include <vector>

#include <glm/gtc/quaternion.hpp>

#include <quoin/render/impostor_cache.h>

#include "core/instruction_sets_for_tests.h"
#include "render/impostor/impostor_surface.h"
#include "render/impostor/impostor_test_support.h"
#include "render/impostor/raster/impostor_faces.h"

namespace quoin {
namespace {

using namespace render_test;

constexpr std::array kSurfelModels = {Model::SmoothBall, Model::SmoothHills, Model::Village};

struct Worst {
  double overlap = 1.0;
  double difference = 0.0;
  double mean_difference = 0.0;
};

Worst worst_of(ImpostorWorld& world, int pixels, int count) {
  world.placed().rotation = glm::angleAxis(0.5, glm::normalize(DVec3(0.3, 1, 0.2)));
  const int edge = pixels + 20;
  const RenderOptions options = sized(edge, edge);
  Worst worst;
  for (int i = 0; i < count; ++i) {
    const Camera camera =
        orbiting(world, 47.0 * i * kDegree, (i % 7 - 3) * 25.0 * kDegree, 31.0 * i * kDegree, pixels, edge);
    const Likeness found = likeness(taken(world.scene, camera, options), world.drawn(camera, options));
    worst.overlap = std::min(worst.overlap, found.overlap);
    worst.difference = std::max(worst.difference, found.difference);
    worst.mean_difference += found.difference / count;
  }
  return worst;
}

// The specification requires 0.97 and 6 for blocks; the worst measured values are 0.984 and 4.4.
TEST(Surfels, LookLikeTracedField) {
  for (const Model model : kSurfelModels) {
    ImpostorWorld world(model);
    EXPECT_GT(world.impostor.faces().surfels.size(), 1'000U);
    for (const int pixels : {128, 64}) {
      const Worst found = worst_of(world, pixels, 12);
      std::printf("model %d, %d pixels: overlap %.4f, difference %.2f, mean %.2f\n", static_cast<int>(model), pixels,
                  found.overlap, found.difference, found.mean_difference);
      EXPECT_GE(found.overlap, 0.975) << static_cast<int>(model) << ' ' << pixels;
      EXPECT_LE(found.difference, 6.0) << static_cast<int>(model) << ' ' << pixels;
    }
  }
}

TEST(Surfels, MatchDepthsAndNormalsOfSurface) {
  ImpostorWorld world(Model::SmoothBall);
  const Camera camera = orbiting(world, 0.7, 0.4, 0.2, 128.0, 148);
  const RenderedImage truth = taken(world.scene, camera, sized(148, 148));
  const RenderedImage image = world.drawn(camera, sized(148, 148));
  int both = 0;
  double sum = 0.0;
  for (std::size_t i = 0; i < truth.depth.values.size(); ++i) {
    if (!std::isfinite(truth.depth.values[i]) || !std::isfinite(image.depth.values[i])) continue;
    const double off = std::abs(truth.depth.values[i] - image.depth.values[i]);
    ++both;
    sum += off;
    // At the outline, one pixel further is much deeper.
    EXPECT_LE(off, 2.5);
  }
  EXPECT_GT(both, 4'000);
  EXPECT_LE(sum / both, 0.04);
  const SurfacePieces surfels = *surfels_of(field_of(Model::SmoothBall), 100'000);
  for (std::size_t i = 0; i < surfels.faces.size(); ++i) {
    const DVec3 place = surfels.surfels[i].middle(DVec3(surfels.faces[i].voxel), surfels.faces[i].direction);
    const DVec3 out = glm::normalize(place - DVec3(20.3, 21.1, 19.7));
    EXPECT_GT(glm::dot(out, DVec3(surfels.surfels[i].normal)), 0.998);
    EXPECT_NEAR(glm::length(place - DVec3(20.3, 21.1, 19.7)), 20.0, 0.25);
  }
}

TEST(Surfels, GiveSameBitsForAnyInstructions) {
  for (const Model model : {Model::SmoothHills, Model::Village}) {
    const ImpostorWorld world(model);
    const Camera camera = orbiting(world, 0.7, 0.4, 0.2, 100.0, 120);
    std::vector<RenderedImage> images;
    for (const InstructionSet set : sets_of_this_machine()) {
      const InstructionSetOverride only(set);
      images.push_back(world.drawn(camera, sized(120, 120)));
    }
    for (const RenderedImage& image : images) {
      EXPECT_EQ(image.colour.rgb, images[0].colour.rgb);
      EXPECT_EQ(image.depth.values, images[0].depth.values);
    }
  }
}

TEST(Surfels, DrawFarFields) {
  ImpostorWorld world(Model::Village);
  const Camera camera = orbiting(world, 0.7, 0.4, 0.2, 100.0, 120);
  RenderOptions options = sized(120, 120);
  const RenderedImage traced = taken(world.scene, camera, options);
  options.detail.policy.emplace().far_pixels = 128;
  const RenderedImage far = taken(world.scene, camera, options);
  EXPECT_LT(far.rays, traced.rays / 2) << "no rays of occlusion";
  const Likeness found = likeness(traced, far);
  EXPECT_GE(found.overlap, 0.975);
  EXPECT_LE(found.difference, 6.0);
  // In front of a near field: neither drawing may depend on the other.
  SceneGrid ground;
  ground.field.add_box({-300, -90, -300}, {300, -60, 300}, 3);
  world.scene.add_instance({"", world.scene.add_grid(std::move(ground))});
  const RenderedImage near = taken(world.scene, camera, sized(120, 120));
  EXPECT_LE(likeness(near, taken(world.scene, camera, options)).difference, 6.0);
}

TEST(Surfels, RebuildAfterEdit) {
  ImpostorWorld world(Model::Village);
  ImpostorCache cache;
  const GridHandle grid = world.scene.instances()[world.instance].grid;
  EXPECT_EQ(cache.find(world.scene, grid), nullptr);
  EXPECT_EQ(cache.wait(world.scene), 0U);
  const auto before = cache.find(world.scene, grid);
  ASSERT_NE(before, nullptr);
  world.scene.edit(grid).field.remove_sphere({0, 0, 0}, 12.0);
  (void)cache.find(world.scene, grid);
  EXPECT_EQ(cache.wait(world.scene), 0U);
  const auto after = cache.find(world.scene, grid);
  EXPECT_NE(before->faces().surfels.size(), after->faces().surfels.size());
  EXPECT_EQ(after->faces().surfels.size(),
            Impostor::build(world.scene.grids()[grid], world.scene.types).faces().surfels.size());
  world.scene.edit(grid).field.clear();
  (void)cache.find(world.scene, grid);
  EXPECT_EQ(cache.wait(world.scene), 0U);
  EXPECT_TRUE(cache.find(world.scene, grid)->faces().surfels.empty());
  EXPECT_FALSE(cache.find(world.scene, grid)->empty());
}

TEST(Surfels, FallBackToTracingLargeOrThinModels) {
  EXPECT_FALSE(surfels_of(field_of(Model::SmoothBall), 100).has_value());
  const ImpostorWorld rods(Model::SmoothRods);
  EXPECT_TRUE(rods.impostor.must_be_traced());
  const Camera near = orbiting(rods, 0.7, 0.4, 0.2, 100.0, 120);
  RenderOptions in_detail = sized(120, 120);
  const RenderedImage traced = taken(rods.scene, near, in_detail);
  in_detail.detail.policy.emplace().far_pixels = 128;
  EXPECT_EQ(taken(rods.scene, near, in_detail).depth.values, traced.depth.values);
  Scene scene;
  const VoxelType type = add_type(scene, {200, 120, 60, 255});
  SceneGrid wide;
  wide.field.add_box({-500, -6, -500}, {500, 6, 500}, type);
  ImpostorOptions smallest;
  smallest.edge = 16;
  EXPECT_TRUE(Impostor::build(wide, scene.types, smallest).must_be_traced());
  scene.add_instance({"", scene.add_grid(std::move(wide))});
  RenderOptions options = sized(64, 64);
  options.detail.impostor_edge = 16;
  options.detail.policy.emplace().far_pixels = 128;
  const Camera camera = towards({3000, 2500, 4000}, {0, 0, 0}, 0.5);
  EXPECT_GT(taken(scene, camera, options).pixels_hit, 100);
}

}  // namespace
}  // namespace quoin
