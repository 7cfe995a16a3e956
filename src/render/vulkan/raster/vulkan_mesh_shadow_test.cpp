// Shadows, glass and lamps on meshes, by rays through the renderer's voxels.

#include <glm/gtc/quaternion.hpp>

#include "render/cpu/environment_for_tests.h"
#include "render/vulkan/raster/mesh_for_tests.h"
#include "tests/golden_views.h"

namespace quoin {
namespace {

using render_test::add_type;
using render_test::from_above;
using render_test::place;
using render_test::sized;
using render_test::towards;
using vulkan_test::blocky_surfaces;
using vulkan_test::byte_at;
using vulkan_test::bytes_that_differ;
using vulkan_test::mesh_options;
using vulkan_test::with_mesh_light;
using vulkan_test::without_shadows;

class VulkanMeshShadow : public vulkan_test::VulkanMeshTest {};

// A floor with a tower, and next to them a rotated beam as a separate instance.
Scene yard(DVec3 at = DVec3(0.0)) {
  Scene scene;
  const VoxelType stone = add_type(scene, {200, 180, 150});
  const VoxelType wood = add_type(scene, {150, 90, 40});
  Grid grid;
  grid.fill_box({{-40, 0, -40}, {40, 1, 40}}, stone);
  grid.fill_box({{0, 1, 0}, {6, 20, 6}}, wood);
  grid.fill_box({{-20, 1, 10}, {-14, 8, 30}}, stone);
  place(scene, std::move(grid), at);
  SceneGrid beam;
  beam.grid.fill_box({{-20, 0, 0}, {20, 3, 3}}, wood);
  Instance turned{"", scene.add_grid(std::move(beam)), at + DVec3(-5, 14, 20),
                  glm::angleAxis(0.6, glm::normalize(DVec3(0.3, 1, 0.2)))};
  turned.voxel_size = 0.8;
  scene.add_instance(turned);
  turned.position += DVec3(30, 3, -30);
  turned.mirrored = true;
  scene.add_instance(turned);
  return scene;
}

TEST_F(VulkanMeshShadow, GoldenViewsMatchCpu) {
  Scene scene = golden::terrain_scene();
  for (std::size_t type = 1; type < scene.types.size(); ++type) {
    VoxelProperties properties = scene.types[static_cast<VoxelType>(type)];
    properties.visibility = Visibility::Opaque;
    scene.types.replace(static_cast<VoxelType>(type), properties);
  }
  for (const golden::GoldenView& view : golden::kViews) {
    compare(scene, golden::camera_for(view), with_mesh_light(golden::options_for(view)),
            std::string("shadows_") + view.name);
  }
}

TEST_F(VulkanMeshShadow, ShadowsBetweenInstancesMatchCpu) {
  const Scene scene = yard();
  for (const DVec3 sun : {DVec3(1, 1.2, 0.5), DVec3(-0.8, 0.6, 1), DVec3(0.2, 3, -0.4)}) {
    RenderOptions options = with_mesh_light(sized(320, 180));
    environment_in(options).sun.direction = sun;
    compare(scene, towards({40, 45, 60}, {0, 4, 5}), options, "yard");
  }
}

TEST_F(VulkanMeshShadow, MatchesCpuFarFromOriginAndOrthographic) {
  const DVec3 far{1e9, -1e9, 1e9};
  const RenderOptions options = with_mesh_light(sized(320, 180));
  compare(yard(far), towards(far + DVec3(40, 45, 60), far + DVec3(0, 4, 5)), options, "yard_far");
  Camera camera = towards({40, 45, 60}, {0, 4, 5});
  camera.projection = Camera::Projection::Orthographic;
  camera.view_height = 80;
  compare(yard(), camera, options, "yard_orthographic");
}

TEST_F(VulkanMeshShadow, EndsAtShadowDistance) {
  const Scene scene = yard();
  RenderOptions options = with_mesh_light(sized(320, 180));
  options.light.shadow_distance_voxels = 6.0;
  compare(scene, towards({40, 45, 60}, {0, 4, 5}), options, "yard_short");
}

// Points of a merged floor next to a wall lie on its edge and must not start rays inside the wall.
TEST_F(VulkanMeshShadow, WallBaseHasNoFalseShadow) {
  Scene scene;
  const VoxelType stone = add_type(scene, {200, 200, 200});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {40, 1, 40}}, stone);
  grid.fill_box({{0, 1, 0}, {10, 12, 40}}, stone);
  place(scene, std::move(grid));
  put(scene, blocky_surfaces(scene));
  RenderOptions options = with_mesh_light(sized(400, 400));
  environment_in(options).sun.direction = {1, 1, 0.2};  // shines on the wall and on the floor in front of it
  options.light.occlusion_mode = OcclusionMode::Off;
  const Camera camera = towards({31.3, 17.7, 22.1}, {9, 2, 19}, 0.5);
  const Image with = drawn(camera, mesh_options(options));
  options.light.shadows = false;
  EXPECT_EQ(bytes_that_differ(with, drawn(camera, mesh_options(options)), 1), 0);
}

TEST_F(VulkanMeshShadow, GlassTintsTheSun) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Scene scene;
  const VoxelType floor = add_type(scene, {220, 220, 220});
  const VoxelType red = add_type(scene, {230, 40, 30, 120}, Visibility::Transparent);
  const VoxelType blue = add_type(scene, {40, 60, 230, 90}, Visibility::Transparent);
  Grid grid;
  grid.fill_box({{0, 0, 0}, {60, 1, 60}}, floor);
  grid.fill_box({{20, 10, 0}, {21, 30, 30}}, red);
  grid.fill_box({{20, 10, 30}, {23, 30, 60}}, blue);
  place(scene, std::move(grid));
  RenderOptions options = with_mesh_light(sized(120, 120));
  environment_in(options).sun.direction = {-1, 1, 0};
  // Only the floor behind the panes is in the image.
  const Camera camera = from_above(41, 9, 30, 36);
  compare(scene, camera, options, "tinted");
  const Image image = drawn(camera, mesh_options(options));
  const Vec3 behind_red = byte_at(image, 50, 30);
  EXPECT_GT(behind_red.x, behind_red.z + 15);
  const Vec3 behind_blue = byte_at(image, 50, 90);
  EXPECT_GT(behind_blue.z, behind_blue.x + 10);
}

TEST_F(VulkanMeshShadow, LampsShineOnMeshes) {
  Scene scene = yard();
  const VoxelType glow = add_type(scene, {255, 190, 90}, Visibility::Opaque, 6.0F);
  scene.edit(scene.instances()[scene.instances().handles().front()].grid)
      .grid.fill_box({{12, 1, 20}, {14, 6, 22}}, glow);
  RenderOptions options = with_mesh_light(sized(320, 180));
  environment_in(options).sun.brightness = 0.0;
  environment_in(options).sky.brightness = 0.1;
  options.light.max_lamps = 64;
  compare(scene, towards({40, 45, 60}, {0, 4, 5}), options, "lamps");
  const Image lit = drawn(towards({40, 45, 60}, {0, 4, 5}), mesh_options(options));
  options.light.max_lamps = 0;
  EXPECT_GT(bytes_that_differ(lit, drawn(towards({40, 45, 60}, {0, 4, 5}), mesh_options(options)), 20), 5000);
}

TEST_F(VulkanMeshShadow, SkyAndLightFollowSun) {
  const Scene scene = yard();
  RenderOptions options = with_mesh_light(sized(320, 180));
  environment_in(options).sky.model = SkyModel::Gradient;
  int hour = 0;
  for (const double height : {1.0, 0.15, -0.05, -0.5}) {
    environment_in(options).sun.direction = {-0.8, height, 0.6};
    compare(scene, towards({40, 25, 60}, {0, 14, 5}), options, "hour_" + std::to_string(hour++));
  }
}

// A slab over a plain, and a cliff behind a gentle slope: shadows equal those of blocks, without additional ones.
TEST_F(VulkanMeshShadow, SmoothSurfacesCastShadowsOfBlocks) {
  Scene scene;
  const VoxelType stone = add_type(scene, {200, 190, 170});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {64, 8, 64}}, stone);
  grid.fill_box({{24, 20, 24}, {40, 23, 40}}, stone);
  for (int i = 0; i < 20; ++i) grid.fill_box({{44, 8, 4}, {64 - i, 9 + i / 3, 60}}, stone);
  place(scene, std::move(grid));
  RenderOptions options = with_mesh_light(sized(256, 256));
  environment_in(options).sun.direction = {0.3, 1, 0.1};
  const Camera camera = from_above(32, 60, 32, 60);
  const auto shadows = [&](const std::vector<SurfaceUpdate>& surfaces, const char* name) {
    meshes_->clear();
    put(scene, surfaces);
    options.light.shadows = true;
    const Image with = drawn(camera, mesh_options(options));
    options.light.shadows = false;
    const Image without = drawn(camera, mesh_options(options));
    if (std::getenv("QUOIN_WRITE_VULKAN") != nullptr) {
      EXPECT_TRUE(write_png(with, QUOIN_BINARY_DIR "/mesh_shadows_" + std::string(name) + ".png"));
    }
    std::vector<bool> is_darker;
    for (std::size_t i = 0; i < with.rgb.size(); i += 3) is_darker.push_back(with.rgb[i] + 20 < without.rgb[i]);
    return is_darker;
  };
  const std::vector<bool> blocks = shadows(blocky_surfaces(scene), "of_blocks");
  const std::vector<bool> smooth = shadows(vulkan_test::live_surfaces(scene, SurfaceStyle::Smooth), "smooth");
  int in_both = 0;
  int of_blocks = 0;
  int on_plain = 0;
  int on_slope = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const std::size_t x = i % 256;
    const std::size_t y = i / 256;
    of_blocks += blocks[i];
    in_both += blocks[i] && smooth[i];
    if (x < 70 || (x > 105 && x < 165 && y > 170)) on_plain += smooth[i];
    if (x > 190 && x < 250 && y > 30 && y < 230) on_slope += smooth[i];
  }
  EXPECT_GT(in_both * 10, of_blocks * 7);
  EXPECT_EQ(on_plain, 0);
  EXPECT_EQ(on_slope, 0);
}

TEST_F(VulkanMeshShadow, RequiresVoxelsOfSameScene) {
  const Scene scene = yard();
  const Scene other = yard();
  ASSERT_TRUE(meshes_->update(scene));
  ASSERT_TRUE(meshes_->put(blocky_surfaces(scene)));
  VulkanImage image(*renderer_);
  const Camera camera = towards({40, 45, 60}, {0, 4, 5});
  MeshImageOptions options = mesh_options(with_mesh_light(sized(32, 32)));
  const auto refused = [&] {
    const Status done = meshes_->draw(image, camera, options);
    return !done && done.error().code == ErrorCode::InvalidArgument;
  };
  EXPECT_TRUE(refused()) << "nothing was updated";
  ASSERT_TRUE(renderer_->update(other));
  EXPECT_TRUE(refused()) << "another scene";
  ASSERT_TRUE(renderer_->update(scene, InstanceFilter::All));
  EXPECT_TRUE(refused()) << "another filter";
  options.light.shadows = false;
  EXPECT_FALSE(refused()) << "it needs no voxels";
  options.detail.policy.emplace();
  EXPECT_TRUE(refused()) << "levels do";
  ASSERT_TRUE(renderer_->update(scene));
  options.light.shadows = true;
  EXPECT_TRUE(meshes_->draw(image, camera, options));
}

TEST_F(VulkanMeshShadow, EdgesAndUnlitModesHaveNoShadows) {
  const Scene scene = yard();
  put(scene, blocky_surfaces(scene));
  const Camera camera = towards({40, 45, 60}, {0, 4, 5});
  for (const Shading shading :
       {Shading::Unlit, Shading::UnlitWithOcclusion, Shading::Normals, Shading::Occlusion, Shading::Lit}) {
    MeshImageOptions options = mesh_options(with_mesh_light(sized(160, 90)));
    options.light.shading = shading;
    if (shading == Shading::Lit) options.wireframe = Wireframe::Only;
    const Image with = drawn(camera, options);
    options.light.shadows = false;
    EXPECT_EQ(with.rgb, drawn(camera, options).rgb);
  }
}

}  // namespace
}  // namespace quoin
