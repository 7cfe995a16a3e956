// Compares a device's images of density fields with the CPU renderer's.

#include <array>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include "core/work/nightly_for_tests.h"
#include "render/cpu/environment_for_tests.h"
#include "render/vulkan/device/vulkan_for_tests.h"
#include "render/vulkan/lakeside_for_tests.h"

namespace quoin {
namespace {

using namespace render_test;
using namespace vulkan_test;

// Returns hills over several chunks, some with solid chunks below.
DensityGrid hills(const FieldTypes& types, int edge) {
  DensityGrid field;
  field.edit({{-edge, -100, -edge}, {edge, 40, edge}}, [&](IVec3 p, DensitySample) {
    const double height = 12.0 * std::sin(0.05 * p.x) * std::cos(0.06 * p.z) + 3.0 * std::sin(0.31 * p.x + 0.23 * p.z);
    const auto type = p.y > 6 || (p.x / 8 + p.z / 8) % 3 == 0 ? types.stone : types.ground;
    return DensitySample{static_cast<float>(0.8 * (p.y - height)), type};
  });
  field.add_sphere({0.0, 30.0, 0.0}, 9.0, types.glow);
  field.remove_sphere({20.0, 5.0, 10.0}, 11.0);
  return field;
}

SceneGrid village(const FieldTypes& types) {
  SceneGrid grid;
  grid.field = hills(types, 90);
  grid.grid.fill_box({{30, -2, 30}, {44, 22, 44}}, types.stone);
  grid.grid.fill_box({{33, 4, 44}, {41, 14, 45}}, types.glass);
  grid.grid.fill_box({{-40, 20, -10}, {-20, 21, 30}}, types.glass);
  // By day all images with glass use the shader for glass of fields, since a further one takes 15 s to compile.
  if (!is_nightly()) grid.field.add_sphere({60.0, 34.0, -40.0}, 5.0, types.glass);
  return grid;
}

InstanceHandle place_grid(Scene& scene, SceneGrid grid) {
  return scene.add_instance({"", scene.add_grid(std::move(grid)), DVec3(0.0)});
}

class VulkanField : public VulkanTest {
 protected:
  void compare(const Scene& scene, const Camera& camera, const RenderOptions& whole, const std::string& name) {
    const RenderOptions options = of_day(whole);
    expect_equal(taken(scene, camera, options), render_test::taken(scene, camera, options), name);
  }
};

TEST_F(VulkanField, HillsWithHouseAndGlassMatchCpu) {
  Scene scene;
  const FieldTypes types = add_field_types(scene);
  place_grid(scene, village(types));
  const Camera camera = towards({110, 70, 130}, {10, 0, 10});
  RenderOptions options = sized(160, 120);
  compare(scene, camera, options, "field_village");
  options.light.field_occlusion_reach = 3.0;
  compare(scene, camera, options, "field_village_reach");
  options.light.occlusion_rays = 16;
  compare(scene, camera, options, "field_village_16");
  options.light.occlusion_mode = OcclusionMode::Vertex;
  compare(scene, camera, options, "field_village_vertex");
  for (const Shading shading : {Shading::Unlit, Shading::UnlitWithOcclusion, Shading::Occlusion, Shading::Normals}) {
    options.light.shading = shading;
    compare(scene, camera, options, "field_village_shading_" + std::to_string(static_cast<int>(shading)));
  }
}

TEST_F(VulkanField, MatchesCpuFromInsideAndAbove) {
  Scene scene;
  const FieldTypes types = add_field_types(scene);
  place_grid(scene, village(types));
  compare(scene, towards({20.0, 4.0, 10.0}, {60.0, 8.0, 30.0}), sized(96, 72), "field_pit");
  compare(scene, towards({0.3, -40.0, 0.2}, {30.0, -40.0, 10.0}), sized(32, 24), "field_in_stone");
  compare(scene, from_above(0.3, 100, -0.7, 150), sized(96, 96), "field_from_above");
  RenderOptions options = sized(96, 72);
  options.light.max_lamps = 8;
  environment_in(options).sun.brightness = 0.0;
  compare(scene, towards({50, 40, 60}, {0, 10, 0}), options, "field_lamps");
}

// Emissive balls over hills, a house and a lantern: near, halved and from an impostor.
TEST_F(VulkanField, EmissiveSamplesLightSurroundings) {
  Scene scene;
  const FieldTypes types = add_field_types(scene);
  SceneGrid grid = village(types);
  grid.field.add_sphere({25.0, 20.0, 60.0}, 4.0, types.glow);
  grid.field.remove_box({22.0, 22.0, 50.0}, {60.0, 30.0, 70.0});
  place_grid(scene, std::move(grid));
  RenderOptions options = sized(128, 96);
  options.light.max_lamps = 24;
  environment_in(options).sun.brightness = 0.1;
  environment_in(options).sky.brightness = 0.1;
  const Camera camera = towards({90, 60, 110}, {10, 5, 20});
  compare(scene, camera, options, "field_glow");
  const RenderedImage with = render_test::taken(scene, camera, options);
  options.light.max_lamps = 0;
  EXPECT_GT(render_test::count_different(with, render_test::taken(scene, camera, options), 8), 800);
  options.light.max_lamps = 24;
  options.detail.policy.emplace().far_pixels = 0;
  options.detail.policy->cell_pixels = 4.0;
  compare(scene, camera, options, "field_glow_halved");
  options.detail.policy->far_pixels = 1000;
  compare(scene, camera, options, "field_glow_far");
}

TEST_F(VulkanField, TransformedFieldsFarAwayMatchCpu) {
  Scene scene;
  const FieldTypes types = add_field_types(scene);
  // By day with the shader of VulkanTextures.
  if (!is_nightly()) (void)scene.types.add({.faces = render_test::random_faces(1)});
  const DVec3 far{3e6, -2e5, 7e5};
  SceneGrid ground;
  ground.field = hills(types, 60);
  const GridHandle hill = scene.add_grid(std::move(ground));
  SceneGrid ball;
  ball.field.add_sphere({0, 0, 0}, 10, types.stone);
  ball.field.remove_box({-20, 2, -20}, {20, 20, 20}, 0.0, 2.0);
  const GridHandle bowl = scene.add_grid(std::move(ball));
  Instance instance;
  instance.grid = hill;
  instance.position = far;
  instance.rotation = glm::angleAxis(0.3, glm::normalize(DVec3(1.0, 2.0, 0.5)));
  scene.add_instance(instance);
  for (int i = 0; i < 5; ++i) {
    instance.grid = bowl;
    instance.position = far + DVec3(20.0 * i - 50.0, 40.0, 10.0 * (i % 2));
    instance.rotation = glm::angleAxis(0.7 * i, glm::normalize(DVec3(0.3, 0.2, 1.0)));
    instance.voxel_size = 0.4 + 0.3 * i;
    scene.add_instance(instance);
  }
  Grid blocks;
  blocks.fill_box({{0, 0, 0}, {20, 20, 20}}, types.stone);
  SceneGrid house;
  house.grid = std::move(blocks);
  instance.grid = scene.add_grid(std::move(house));
  instance.position = far + DVec3(-40.0, 10.0, 30.0);
  instance.voxel_size = 1.0;
  scene.add_instance(instance);
  compare(scene, towards(far + DVec3(90, 80, 110), far), sized(160, 120), "field_instances");
}

TEST_F(VulkanField, FollowsEdits) {
  Scene scene;
  const FieldTypes types = add_field_types(scene);
  const InstanceHandle placed = place_grid(scene, village(types));
  const GridHandle handle = scene.instances()[placed].grid;
  const Camera camera = towards({80, 70, 90}, {0, 0, 0});
  const RenderOptions options = sized(80, 60);
  compare(scene, camera, options, "field_before");
  const std::uint64_t all = renderer_->uploaded_bytes();
  DensityGrid& field = scene.edit(handle).field;
  std::mt19937 random(5);
  for (int i = 0; i < 6; ++i) {
    const auto at = [&] { return static_cast<double>(random() % 120) - 60.0; };
    field.remove_sphere({at(), 4.0, at()}, 7.0);
    field.add_sphere({at(), 12.0, at()}, 6.0, types.stone, 3.0);
    // Across the corner of eight chunks.
    field.add_box({-4.0 - i, 0.0, -3.0}, {3.0, 24.0 + i, 5.0}, types.ground);
    compare(scene, camera, options, "field_edited");
    EXPECT_LT(renderer_->uploaded_bytes(), all);
  }
  // Lower fields, regions with only blocks, and regions with only a field.
  field.add_sphere({-200.0, -150.0, 0.0}, 20.0, types.stone);
  compare(scene, camera, options, "field_moved_origin");
  scene.edit(handle).grid.clear();
  compare(scene, camera, options, "field_alone");
  scene.edit(handle).grid.fill_box({{-10, 0, -10}, {10, 10, 10}}, types.stone);
  field.clear();
  compare(scene, camera, options, "field_gone");
  scene.edit(handle).grid.clear();
  EXPECT_EQ(taken(scene, camera, options).pixels_hit, 0);
  field.add_sphere({0.0, 0.0, 0.0}, 20.0, types.stone);
  compare(scene, camera, options, "field_again");
}

TEST_F(VulkanField, LakeAndGlassBallsMatchCpu) {
  Scene scene;
  const FieldTypes types = add_field_types(scene);
  place_grid(scene, lakeside(types, add_water(scene)));
  const Camera camera = towards({110, 70, 130}, {10, 0, 10});
  RenderOptions options = sized(160, 120);
  const RenderedImage plain = render_test::taken(scene, camera, options);
  compare(scene, camera, options, "field_lake");
  options.light.glass_surfaces = true;
  compare(scene, camera, options, "field_lake_surfaces");
  EXPECT_GT(render_test::count_different(plain, render_test::taken(scene, camera, options), 3), 1000);
  compare(scene, from_above(0.3, 100, -0.7, 150), options, "field_lake_from_above");
  compare(scene, towards({-60, -1.5, 60}, {-32, 0, 20}), options, "field_lake_low");
  compare(scene, towards({-50, -6, 30}, {-32, 0, 20}), options, "field_lake_from_within");
  options.light.occlusion_rays = 16;
  options.light.max_lamps = 8;
  compare(scene, camera, options, "field_lake_lamps");
  for (const Shading shading : {Shading::Unlit, Shading::UnlitWithOcclusion, Shading::Occlusion, Shading::Normals}) {
    options.light.shading = shading;
    compare(scene, camera, options, "field_lake_shading_" + std::to_string(static_cast<int>(shading)));
  }
  // The image differs if everything is opaque.
  options = sized(160, 120);
  for (const VoxelType type : {types.glass, static_cast<VoxelType>(types.glass + 1)}) {
    VoxelProperties opaque = scene.types[type];
    opaque.visibility = Visibility::Opaque;
    scene.types.replace(type, opaque);
  }
  compare(scene, camera, options, "field_lake_opaque");
  EXPECT_GT(render_test::count_different(plain, render_test::taken(scene, camera, options), 8), 1000);
}

// Every cell has several transparent materials, and opaque ones.
TEST_F(VulkanField, MixedGlassMatchesCpu) {
  Scene scene;
  const FieldTypes types = add_field_types(scene);
  const VoxelType water = add_water(scene);
  VoxelProperties amber;
  amber.colour = {230, 150, 20, 60};
  amber.visibility = Visibility::Transparent;
  const VoxelType third = scene.types.add(amber).value();
  SceneGrid grid;
  grid.field.edit({{44, 44, 44}, {84, 84, 84}}, [&](IVec3 p, DensitySample) {
    const double ball = glm::distance(DVec3(p), DVec3(64.3)) - 15.0;
    const IVec3 part = p / 8;
    const std::array all{types.glass, water, third, types.stone, types.glass, water, third};
    const auto type = all[static_cast<std::size_t>((part.x + 3 * part.y + 5 * part.z) % 7)];
    return DensitySample{static_cast<float>(ball), type};
  });
  place_grid(scene, std::move(grid));
  RenderOptions options = sized(120, 120);
  options.light.shading = Shading::Unlit;
  compare(scene, towards({100, 94, 104}, {64, 64, 64}), options, "field_mixed_glass_unlit");
  options.light.shading = Shading::Lit;
  options.light.glass_surfaces = true;
  compare(scene, towards({100, 94, 104}, {64, 64, 64}), options, "field_mixed_glass");
}

TEST_F(VulkanField, TransformedGlassFarAwayMatchesCpu) {
  Scene scene;
  const FieldTypes types = add_field_types(scene);
  const DVec3 far{3e6, -2e5, 7e5};
  SceneGrid ground;
  ground.field = hills(types, 60);
  Instance instance;
  instance.grid = scene.add_grid(std::move(ground));
  instance.position = far;
  instance.rotation = glm::angleAxis(0.3, glm::normalize(DVec3(1.0, 2.0, 0.5)));
  scene.add_instance(instance);
  SceneGrid ball;
  ball.field.add_sphere({0, 0, 0}, 10, types.glass);
  ball.field.remove_box({-20, 2, -20}, {20, 20, 20}, 0.0, 2.0);
  instance.grid = scene.add_grid(std::move(ball));
  for (int i = 0; i < 5; ++i) {
    instance.position = far + DVec3(20.0 * i - 50.0, 40.0, 10.0 * (i % 2));
    instance.rotation = glm::angleAxis(0.7 * i, glm::normalize(DVec3(0.3, 0.2, 1.0)));
    instance.voxel_size = 0.4 + 0.3 * i;
    scene.add_instance(instance);
  }
  RenderOptions options = sized(160, 120);
  options.light.glass_surfaces = true;
  compare(scene, towards(far + DVec3(90, 80, 110), far), options, "field_glass_instances");
  options.detail.policy.emplace().far_pixels = 0;
  options.detail.policy->cell_pixels = 4.0;
  compare(scene, towards(far + DVec3(90, 80, 110), far), options, "field_glass_halved");
  options.detail.policy->far_pixels = 1000;
  compare(scene, towards(far + DVec3(90, 80, 110), far), options, "field_glass_far");
}

TEST_F(VulkanField, FollowsGlassEdits) {
  Scene scene;
  const FieldTypes types = add_field_types(scene);
  const VoxelType water = add_water(scene);
  const InstanceHandle placed = place_grid(scene, village(types));
  const GridHandle handle = scene.instances()[placed].grid;
  const Camera camera = towards({80, 70, 90}, {0, 0, 0});
  RenderOptions options = sized(80, 60);
  options.light.glass_surfaces = true;
  compare(scene, camera, options, "field_glass_none");
  DensityGrid& field = scene.edit(handle).field;
  const auto paint = [&](IBox box, VoxelType type) {
    field.edit(box, [&](IVec3, DensitySample now) {
      now.material = type;
      return now;
    });
  };
  paint({{-20, -100, -20}, {60, 40, 30}}, water);
  compare(scene, camera, options, "field_painted_water");
  const std::uint64_t all = renderer_->uploaded_bytes();
  std::mt19937 random(5);
  for (int i = 0; i < 4; ++i) {
    const auto at = [&] { return static_cast<double>(random() % 100) - 50.0; };
    field.remove_sphere({at(), 4.0, at()}, 7.0);
    field.add_sphere({at(), 12.0, at()}, 6.0, i % 2 == 0 ? water : types.glass, 3.0);
    compare(scene, camera, options, "field_glass_edited");
    EXPECT_LT(renderer_->uploaded_bytes(), all);
  }
  paint({{-100, -100, -100}, {100, 60, 100}}, types.stone);
  compare(scene, camera, options, "field_all_stone");
  paint({{-100, -100, -100}, {100, 60, 100}}, water);
  compare(scene, camera, options, "field_all_water");
  field.clear();
  compare(scene, camera, options, "field_glass_gone");
}

TEST_F(VulkanField, TakesMaterialsFromChunkOfSample) {
  Scene scene;
  std::vector<VoxelType> all;
  for (int i = 0; i < 40; ++i) {
    all.push_back(add_type(scene, {static_cast<std::uint8_t>(37 * i), static_cast<std::uint8_t>(61 * i), 80, 255}));
  }
  SceneGrid grid;
  grid.field.edit({{40, 40, 40}, {90, 90, 90}}, [&](IVec3 p, DensitySample) {
    const DVec3 d = DVec3(p) - 64.3;
    const auto type = all[static_cast<std::size_t>((p.x + 3 * p.y + 7 * p.z) % 40)];
    return DensitySample{static_cast<float>(std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z) - 14.0), type};
  });
  place_grid(scene, std::move(grid));
  RenderOptions options = sized(120, 120);
  options.light.shading = Shading::Unlit;
  compare(scene, towards({100, 94, 104}, {64, 64, 64}), options, "field_materials");
}

}  // namespace
}  // namespace quoin
