// Rendered images whose far instances are drawn from impostors.

#include <array>
#include <limits>
#include <thread>
#include <vector>

#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <quoin/render/cpu_renderer.h>

#include "render/impostor/impostor_test_support.h"

namespace quoin {
namespace {

using namespace render_test;

TEST(RenderFar, TracesImpostorsThatAreNotReadyInTime) {
  const ImpostorWorld world(Model::Castle);
  RenderOptions options = sized(148, 148);
  const Camera camera = orbiting(world, 0.7, 0.6, 0.0, 100.0, 148);
  const CpuRenderer renderer(world.scene);
  const RenderedImage truth = renderer.render(camera, options).value();
  options.detail.policy = DetailPolicy{};
  options.detail.impostor_seconds = 0.0;
  EXPECT_EQ(renderer.render(camera, options)->colour.rgb, truth.colour.rgb);
  options.detail.impostor_seconds = std::numeric_limits<double>::infinity();
  EXPECT_NE(renderer.render(camera, options)->colour.rgb, truth.colour.rgb) << "occlusion is that of whole faces";
  options.detail.impostor_seconds = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(renderer.render(camera, options).has_value());
}

TEST(RenderFar, DrawsFarInstancesFromImpostors) {
  ImpostorWorld world(Model::Castle);
  Instance ground = world.placed();
  SceneGrid slab;
  slab.grid.fill_box({{-300, 0, -300}, {301, 1, 301}}, 2);
  ground.grid = world.scene.add_grid(std::move(slab));
  ground.position = {0, -15, 0};
  world.scene.add_instance(ground);
  RenderOptions options = sized(148, 148);
  const Camera camera = orbiting(world, 0.7, 0.6, 0.0, 100.0, 148);
  const RenderedImage truth = taken(world.scene, camera, options);
  options.detail.policy = DetailPolicy{};
  const RenderedImage image = taken(world.scene, camera, options);
  EXPECT_NE(truth.colour.rgb, image.colour.rgb);
  const Likeness found = likeness(truth, image);
  EXPECT_EQ(found.overlap, 1.0);
  EXPECT_LE(found.difference, 2.0) << "with the castle's shadow on the ground";
  options.detail.colours = true;
  options.light.shading = Shading::Unlit;
  const Pixel middle = pixel_at(taken(world.scene, camera, options), 74, 74);
  EXPECT_GT(middle[2], middle[0]) << "far is blue";
}

// Without this, some renderers would find impostors still being built by another one, and trace those grids.
TEST(RenderFar, ConcurrentImagesMatchSingleImage) {
  ImpostorWorld world(Model::Castle);
  for (int i = 1; i < 4; ++i) {
    Instance other = world.placed();
    SceneGrid grid;
    grid.grid = castle();
    grid.pivot = DVec3(22.0);
    other.grid = world.scene.add_grid(std::move(grid));
    other.position = DVec3{-40.0 + 30.0 * i, 0.0, 30.0};
    world.scene.add_instance(other);
  }
  RenderOptions options = sized(120, 120);
  options.detail.policy = DetailPolicy{};
  const Camera camera = orbiting(world, 0.7, 0.6, 0.0, 40.0, 120);
  const RenderedImage alone = taken(world.scene, camera, options);
  for (int round = 0; round < 4; ++round) {
    const CpuRenderer renderer(world.scene);
    std::array<RenderedImage, 3> images;
    {
      std::vector<std::jthread> threads;
      for (RenderedImage& image : images) {
        threads.emplace_back([&] { image = renderer.render(camera, options, {1}).value(); });
      }
    }
    for (const RenderedImage& image : images) EXPECT_EQ(image.colour.rgb, alone.colour.rgb) << round;
  }
}

}  // namespace
}  // namespace quoin
