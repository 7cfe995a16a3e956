// Meshes in propagated light match the CPU's images.

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "render/cpu/cave_for_tests.h"
#include "render/cpu/environment_for_tests.h"
#include "render/vulkan/raster/mesh_for_tests.h"

namespace quoin {
namespace {

using render_test::towards;
using vulkan_test::blocky_surfaces;
using vulkan_test::mesh_options;

class VulkanMeshPropagated : public vulkan_test::VulkanMeshTest {};

TEST_F(VulkanMeshPropagated, CaveWithGlassMatchesCpu) {
  Cave cave;
  RenderOptions options = propagated(240, 160, OcclusionMode::Vertex);
  compare(cave.scene, Cave::inside(), options, "cave");
  options.light.least_light = 0.03;
  environment_in(options).lamp_brightness = 2.0;
  options.light.occlusion_mode = OcclusionMode::Off;
  compare(cave.scene, towards({26.0, -3.0, 12.0}, {-8.0, -10.0, -2.0}, 1.2), options, "cave_of_lamps");
}

TEST_F(VulkanMeshPropagated, TransformedAndHalvedGridsMatchCpu) {
  Cave cave;
  cave.add_others();
  const Camera camera = Cave::outside();
  RenderOptions options = propagated(240, 160, OcclusionMode::Vertex);
  compare(cave.scene, camera, options, "turned");
  use_halved(options);
  compare(cave.scene, camera, options, "halved");
}

TEST_F(VulkanMeshPropagated, EditLightsClosedRoom) {
  Cave cave;
  const Camera camera = towards(DVec3(Cave::kRoom.min) + 0.9, DVec3(Cave::kRoom.max) - 0.9, 1.4);
  const RenderOptions options = propagated(64, 48, OcclusionMode::Vertex);
  const auto brightest = [&] {
    put(cave.scene, blocky_surfaces(cave.scene));
    const Image image = drawn(camera, mesh_options(options));
    return *std::max_element(image.rgb.begin(), image.rgb.end());
  };
  EXPECT_EQ(brightest(), 0);
  cave.scene.edit(cave.grid_handle).grid.fill_box({{18, -8, -14}, {19, -7, -9}}, kAir);
  EXPECT_GT(brightest(), 0);
}

// The mesh matches the marched field except for the mesh's own shape.
TEST_F(VulkanMeshPropagated, LightsSmoothSurfacesLikeFields) {
  Scene scene;
  const VoxelType stone = render_test::add_type(scene, {180, 170, 160, 255});
  const VoxelType lamp = render_test::add_type(scene, {255, 160, 60, 255}, Visibility::Opaque, 1.0F);
  SceneGrid made;
  made.field.add_sphere({0.0, 0.0, 0.0}, 20.0, stone);
  made.field.remove_sphere({6.0, 6.0, 8.0}, 13.0);
  made.grid.set({0, -3, 2}, lamp);
  const GridHandle grid = scene.add_grid(std::move(made));
  scene.add_instance({"", grid});
  put(scene, vulkan_test::live_surfaces(scene, SurfaceStyle::Smooth));
  const Camera camera = towards({30.0, 26.0, 34.0}, {0.0, 0.0, 0.0}, 0.9);
  RenderOptions options = propagated(160, 120, OcclusionMode::Vertex);
  options.light.occlusion_mode = OcclusionMode::Off;
  const Image mesh = drawn(camera, mesh_options(options));
  const RenderedImage cpu = render_test::taken(scene, camera, options);
  int different = 0;
  for (std::size_t i = 0; i < mesh.rgb.size(); ++i) different += std::abs(mesh.rgb[i] - cpu.colour.rgb[i]) > 24;
  EXPECT_LE(different, static_cast<int>(mesh.rgb.size()) / 50);
  if (std::getenv("QUOIN_WRITE_VULKAN") != nullptr) {
    EXPECT_TRUE(write_png(mesh, QUOIN_BINARY_DIR "/mesh_smooth.vulkan.png"));
    EXPECT_TRUE(write_png(cpu.colour, QUOIN_BINARY_DIR "/mesh_smooth.cpu.png"));
  }
}

}  // namespace
}  // namespace quoin
