// Images in propagated light match those of CpuRenderer.

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include <quoin/render/propagated_light.h>

#include "render/cpu/cave_for_tests.h"
#include "render/cpu/environment_for_tests.h"
#include "render/vulkan/device/vulkan_for_tests.h"

namespace quoin {
namespace {

using namespace render_test;
using namespace vulkan_test;

class VulkanPropagated : public VulkanTest {};

TEST_F(VulkanPropagated, CaveMatchesCpu) {
  Cave cave;
  RenderOptions options = propagated(240, 160);
  expect_equal(taken(cave.scene, Cave::inside(), options), render_test::taken(cave.scene, Cave::inside(), options),
               "cave");
  options.light.occlusion_mode = OcclusionMode::Vertex;
  environment_in(options).sky.model = SkyModel::Gradient;
  environment_in(options).sun.direction = {0.5, 0.1, 0.2};
  environment_in(options).lamp_brightness = 1.6;
  options.light.least_light = 0.02;
  environment_in(options).exposure = 1.3;
  options.light.glass_surfaces = true;
  options.samples = 2;
  const Camera other = towards({26.0, -3.0, 12.0}, {-8.0, -10.0, -2.0}, 1.2);
  expect_equal(taken(cave.scene, other, options), render_test::taken(cave.scene, other, options), "cave_at_dusk");
  options.light.occlusion_mode = OcclusionMode::Rays;
  expect_equal(taken(cave.scene, other, options), render_test::taken(cave.scene, other, options), "cave_open");
}

TEST_F(VulkanPropagated, ClosedRoomIsBlackUntilOpened) {
  Cave cave;
  const Camera camera = towards(DVec3(Cave::kRoom.min) + 0.9, DVec3(Cave::kRoom.max) - 0.9, 1.4);
  const RenderOptions options = propagated(64, 48);
  const RenderedImage dark = taken(cave.scene, camera, options);
  EXPECT_EQ(*std::max_element(dark.colour.rgb.begin(), dark.colour.rgb.end()), 0);
  cave.scene.edit(cave.grid_handle).grid.fill_box({{18, -8, -14}, {19, -7, -9}}, kAir);
  const RenderedImage lit = taken(cave.scene, camera, options);
  EXPECT_GT(*std::max_element(lit.colour.rgb.begin(), lit.colour.rgb.end()), 0);
  expect_equal(lit, render_test::taken(cave.scene, camera, options), "opened_room");
}

TEST_F(VulkanPropagated, ShowsSharedLight) {
  Cave cave;
  const RenderOptions options = propagated(64, 48);
  SceneLight light;
  renderer_->use_light(&light);
  const RenderedImage open = taken(cave.scene, Cave::inside(), options);
  light.update(cave.scene);
  const RenderedImage lit = taken(cave.scene, Cave::inside(), options);
  EXPECT_NE(open.colour.rgb, lit.colour.rgb);
  expect_equal(lit, render_test::taken(cave.scene, Cave::inside(), options), "lent_light");
  renderer_->use_light(nullptr);
  EXPECT_EQ(taken(cave.scene, Cave::inside(), options).colour.rgb, lit.colour.rgb);
}

// A corridor with a lamp of each colour channel at its own end, and a shaft of sky: every level of each, on plain
// white.
TEST_F(VulkanPropagated, ColoursOfAllLevelsMatchCpu) {
  Scene scene;
  const VoxelType white = add_type(scene, {255, 255, 255, 255});
  for (const Rgba8 colour : {Rgba8{255, 0, 0, 255}, Rgba8{0, 255, 0, 255}, Rgba8{0, 0, 255, 255}}) {
    add_type(scene, colour, Visibility::Opaque, 1.0F);
  }
  Grid grid;
  grid.fill_box({{-2, -4, -4}, {20, 8, 20}}, white);
  for (int i = 0; i < 4; ++i) {
    grid.fill_box({{0, 0, 4 * i}, {18, 1, 4 * i + 1}}, kAir);
    if (i < 3) grid.set({0, 0, 4 * i}, static_cast<VoxelType>(2 + i));
    if (i == 3) grid.fill_box({{0, 0, 12}, {1, 8, 13}}, kAir);
  }
  grid.fill_box({{1, 1, -4}, {20, 8, 20}}, kAir);
  grid.fill_box({{1, 4, -4}, {20, 5, 20}}, white);  // a roof over the open area
  grid.fill_box({{1, 1, -4}, {20, 4, -3}}, white);
  grid.fill_box({{1, 1, 19}, {20, 4, 20}}, white);
  grid.fill_box({{19, 1, -4}, {20, 4, 20}}, white);
  place(scene, std::move(grid));
  const RenderOptions options = propagated(192, 192);
  Camera camera = from_above(9.0, 3.9, 7.0, 20.0);
  const RenderedImage cpu = render_test::taken(scene, camera, options);
  expect_equal(taken(scene, camera, options), cpu, "levels");
  std::array<std::set<int>, 3> seen;
  for (std::size_t i = 0; i < cpu.colour.rgb.size(); ++i) seen.at(i % 3).insert(cpu.colour.rgb[i]);
  for (const std::set<int>& channel : seen) EXPECT_GT(channel.size(), 100U) << "bytes from dark to bright";
}

TEST_F(VulkanPropagated, TransformedAndHalvedGridsMatchCpu) {
  Cave cave;
  cave.add_others();
  const Camera camera = Cave::outside();
  RenderOptions options = propagated(240, 160);
  expect_equal(taken(cave.scene, camera, options), render_test::taken(cave.scene, camera, options), "turned");
  use_halved(options);
  expect_equal(taken(cave.scene, camera, options), render_test::taken(cave.scene, camera, options), "halved");
}

TEST_F(VulkanPropagated, FieldsMatchCpu) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Scene scene;
  const VoxelType lamp = add_type(scene, {255, 160, 60, 255}, Visibility::Opaque, 1.0F);
  SceneGrid made;
  made.field.add_sphere({0.0, 0.0, 0.0}, 20.0, kAir);
  made.field.remove_sphere({6.0, 6.0, 8.0}, 13.0);
  made.grid.set({0, -3, 2}, lamp);
  scene.add_instance({"", scene.add_grid(std::move(made))});
  const Camera camera = towards({30.0, 26.0, 34.0}, {0.0, 0.0, 0.0}, 0.9);
  const RenderOptions options = propagated(200, 160);
  expect_equal(taken(scene, camera, options), render_test::taken(scene, camera, options), "field");
}

}  // namespace
}  // namespace quoin
