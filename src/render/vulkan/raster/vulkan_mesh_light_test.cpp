// Blocky meshes match the CPU's images.

#include <cmath>
#include <numbers>

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
using vulkan_test::without_shadows;

class VulkanMeshLight : public vulkan_test::VulkanMeshTest {};

// Returns a hut with a lamp in front of it, without glass.
Grid hut(Scene& scene) {
  const VoxelType wall = add_type(scene, {200, 180, 150});
  const VoxelType roof = add_type(scene, {150, 40, 30});
  const VoxelType lamp = add_type(scene, {255, 220, 120}, Visibility::Opaque, 0.4F);
  Grid grid;
  grid.fill_box({{0, 0, 0}, {20, 1, 20}}, wall);
  grid.fill_box({{4, 1, 4}, {16, 9, 16}}, wall);
  grid.fill_box({{5, 1, 5}, {15, 9, 15}}, kAir);
  for (int i = 0; i < 5; ++i) grid.fill_box({{3 + i, 9 + i, 3 + i}, {17 - i, 10 + i, 17 - i}}, roof);
  grid.fill_box({{8, 3, 15}, {12, 7, 16}}, kAir);
  grid.set({10, 1, 17}, lamp);
  return grid;
}

// Returns one hut as it is, one turned and small, one mirrored and large.
Scene huts(DVec3 at) {
  Scene scene;
  SceneGrid grid;
  grid.grid = hut(scene);
  grid.pivot = {10, 0, 10};
  const GridHandle handle = scene.add_grid(std::move(grid));
  scene.add_instance({"", handle, at});
  Instance turned{"", handle, at + DVec3(30, 3, 4), glm::angleAxis(0.7, glm::normalize(DVec3(1, 2, 0.5)))};
  turned.voxel_size = 0.6;
  scene.add_instance(turned);
  Instance mirrored{"", handle, at + DVec3(-34, 0, -6), glm::angleAxis(0.3, DVec3(0, 1, 0))};
  mirrored.voxel_size = 1.4;
  mirrored.mirrored = true;
  scene.add_instance(mirrored);
  return scene;
}

TEST_F(VulkanMeshLight, GoldenViewsMatchCpu) {
  Scene scene = golden::terrain_scene();
  // Transparent surfaces have their own tests.
  for (std::size_t type = 1; type < scene.types.size(); ++type) {
    VoxelProperties properties = scene.types[static_cast<VoxelType>(type)];
    properties.visibility = Visibility::Opaque;
    scene.types.replace(static_cast<VoxelType>(type), properties);
  }
  for (const golden::GoldenView& view : golden::kViews) {
    compare(scene, golden::camera_for(view), without_shadows(golden::options_for(view)), view.name);
  }
}

TEST_F(VulkanMeshLight, TransformedInstancesMatchCpu) {
  const RenderOptions options = without_shadows(sized(240, 135));
  compare(huts({0, 0, 0}), towards({10, 40, 70}, {0, 4, 0}), options, "huts");
  compare(huts({0, 0, 0}), towards({-60, 15, 30}, {-20, 4, 0}, 0.5), options, "huts_left");
}

TEST_F(VulkanMeshLight, MatchesCpuFarFromOrigin) {
  const DVec3 far{1e9, -1e9, 1e9};
  const RenderOptions options = without_shadows(sized(240, 135));
  compare(huts(far), towards(far + DVec3(10, 40, 70), far + DVec3(0, 4, 0)), options, "huts_far");
}

TEST_F(VulkanMeshLight, MatchesCpuFarFromCamera) {
  const DVec3 eye{400'000, 300'000, 600'000};
  const RenderOptions options = without_shadows(sized(240, 135));
  compare(huts({0, 0, 0}), towards(eye, {0, 4, 0}, 80.0 / 780'000), options, "huts_telephoto");
}

TEST_F(VulkanMeshLight, MatchesCpuInOrthographicImages) {
  const RenderOptions options = without_shadows(sized(160, 160));
  compare(huts({0, 0, 0}), from_above(0.013, 60, 0.017, 90), options, "huts_above");
  Camera camera = towards({50, 40, 60}, {0, 4, 0});
  camera.projection = Camera::Projection::Orthographic;
  camera.view_height = 60;
  compare(huts({0, 0, 0}), camera, options, "huts_orthographic");
}

TEST_F(VulkanMeshLight, MatchesCpuForEveryLightOption) {
  const Scene scene = huts({0, 0, 0});
  const Camera camera = towards({10, 40, 70}, {0, 4, 0});
  RenderOptions options = without_shadows(sized(160, 90));
  options.light.occlusion_affects = OcclusionAffects::All;
  environment_in(options).sun.direction = {-1, 2, 0.5};
  compare(scene, camera, options, "affects_all");
  options.light.occlusion_mode = OcclusionMode::Off;
  compare(scene, camera, options, "no_occlusion");
  environment_in(options).exposure = 2.5;
  compare(scene, camera, options, "exposed");
  options.light.occlusion_mode = OcclusionMode::Vertex;
  options.light.shading = Shading::UnlitWithOcclusion;
  compare(scene, camera, options, "unlit_with_occlusion");
  options.light.shading = Shading::Normals;
  compare(scene, camera, options, "normals");
  options.light.shading = Shading::Unlit;
  compare(scene, camera, options, "unlit");
}

TEST_F(VulkanMeshLight, BrightnessHasNoLimit) {
  Scene scene;
  const VoxelType sun = add_type(scene, {255, 255, 255}, Visibility::Opaque, std::numeric_limits<float>::infinity());
  const VoxelType black = add_type(scene, {0, 0, 0});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {5, 5, 5}}, sun);
  grid.fill_box({{5, 0, 0}, {10, 5, 5}}, black);
  place(scene, std::move(grid));
  RenderOptions options = without_shadows(sized(64, 64));
  environment_in(options).exposure = 1e300;
  compare(scene, towards({5, 9, 20}, {5, 2, 2}), options, "bright");
}

TEST_F(VulkanMeshLight, UnregisteredTypesAreMagenta) {
  Scene scene;
  Grid grid;
  grid.fill_box({{0, 0, 0}, {5, 5, 5}}, 77);
  grid.fill_box({{5, 0, 0}, {10, 5, 5}}, 65'535);
  place(scene, std::move(grid));
  compare(scene, towards({5, 9, 20}, {5, 2, 2}), without_shadows(sized(64, 64)), "unregistered");
}

TEST_F(VulkanMeshLight, SmoothSurfacesMatchReferenceLight) {
  Scene scene;
  const VoxelType lamp = add_type(scene, {200, 120, 60}, Visibility::Opaque, 0.125F);
  DensityGrid field;
  field.add_box({0, 0, 0}, {60, 10, 60}, lamp);
  const GridHandle grid = scene.add_grid({});
  scene.add_instance({"", grid});
  put(scene, vulkan_test::smooth_surfaces(grid, field, scene.types));
  // Looks at the middle of a flat face, which is fully open.
  const Camera camera = from_above(30, 50, 30, 8);
  MeshImageOptions options = mesh_options(without_shadows(sized(8, 8)));
  const Vec3 colour = render_test::linear({200, 120, 60});
  const auto up = static_cast<float>(glm::normalize(environment_in(options).sun.direction).y);
  const auto expect = [&](Vec3 light, const char* what) {
    const render_test::Pixel pixel = render_test::encoded(light);
    EXPECT_LE(glm::length(byte_at(drawn(camera, options), 4, 4) - Vec3(pixel[0], pixel[1], pixel[2])), 2.0F) << what;
  };
  expect(colour * (0.15F + up) + colour * 0.125F, "lit");
  options.light.occlusion_affects = OcclusionAffects::All;
  expect(colour * (0.15F + up) + colour * 0.125F, "all of it is open");
  environment_in(options).exposure = 0.5;
  expect(0.5F * (colour * (0.15F + up) + colour * 0.125F), "exposed");
  options.light.occlusion_mode = OcclusionMode::Off;
  expect(0.5F * (colour * (0.10F + up) + colour * 0.125F), "without occlusion");
  environment_in(options).sun.direction = {0, -1, 0};
  expect(0.5F * (colour * 0.10F + colour * 0.125F), "the sun below");
  options.light.shading = Shading::Unlit;
  expect(colour, "unlit");
}

TEST_F(VulkanMeshLight, MergedQuadsLookLikeSingleFaces) {
  const Scene scene = huts({0, 0, 0});
  const Camera camera = towards({10, 40, 70}, {0, 4, 0});
  const MeshImageOptions options = mesh_options(without_shadows(sized(320, 180)));
  put(scene, blocky_surfaces(scene, false));
  const std::int64_t faces = meshes_->stats().triangles;
  const Image single = drawn(camera, options);
  put(scene, blocky_surfaces(scene, true));
  EXPECT_LT(meshes_->stats().triangles, faces);
  const Image merged = drawn(camera, options);
  const int different = bytes_that_differ(single, merged, 2);
  EXPECT_LE(different, 20) << "of " << single.rgb.size();
}

TEST_F(VulkanMeshLight, EmptySceneShowsSky) {
  const Scene scene;
  Camera camera = towards({3, 4, 5}, {20, 1, 2}, 1.6);
  const RenderOptions options = without_shadows(sized(96, 64));
  EXPECT_TRUE(meshes_->update(scene));
  for (const auto projection : {Camera::Projection::Perspective, Camera::Projection::Orthographic}) {
    camera.projection = projection;
    camera.view_height = 30;
    RenderedImage mesh;
    mesh.colour = drawn(camera, mesh_options(options));
    const RenderedImage cpu = render_test::taken(scene, camera, options);
    mesh.depth = cpu.depth;
    EXPECT_EQ(vulkan_test::differences(mesh, cpu).pixels, 0);
  }
}

TEST_F(VulkanMeshLight, ShowsExactValues) {
  Scene scene;
  const VoxelType stone = add_type(scene, {140, 140, 150});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {10, 1, 10}}, stone);
  grid.fill_box({{0, 1, 0}, {5, 2, 10}}, stone);
  place(scene, std::move(grid));
  put(scene, blocky_surfaces(scene));
  // From above, 20 pixels per voxel; x = 5 to 6 is one step lower and dark along its left side.
  const Camera camera = from_above(5, 10, 5, 10);
  MeshImageOptions options = mesh_options(sized(200, 200));
  options.light.shading = Shading::Normals;
  EXPECT_LE(glm::length(byte_at(drawn(camera, options), 150, 100) - Vec3(127.5F, 255.0F, 127.5F)), 2.0F);
  options.light.shading = Shading::Occlusion;
  const Image grey = drawn(camera, options);
  EXPECT_EQ(byte_at(grey, 180, 100), Vec3(255.0F));
  // Voxels on both sides touch the corners at x = 5: level 2, so openness 1/3, and 1 one voxel further.
  for (const int x : {101, 105, 110, 118}) {
    const float openness = 1.0F / 3.0F + 2.0F / 3.0F * (static_cast<float>(x) + 0.5F - 100.0F) / 20.0F;
    EXPECT_NEAR(byte_at(grey, x, 95).x, 255.0F * openness, 1.5F) << x;
  }
}

}  // namespace
}  // namespace quoin
