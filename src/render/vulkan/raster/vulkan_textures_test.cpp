// Marched and rasterised images show the textures of types as the CPU renderer does.

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include <glm/gtc/quaternion.hpp>

#include "core/work/nightly_for_tests.h"
#include "render/vulkan/march/renderer_impl.h"
#include "render/vulkan/raster/mesh_for_tests.h"

namespace quoin {
namespace {

using render_test::add_type;
using render_test::from_above;
using render_test::place;
using render_test::random_faces;
using render_test::random_texture;
using render_test::sized;
using render_test::towards;
using vulkan_test::expect_equal;
using vulkan_test::mesh_options;
using vulkan_test::with_mesh_light;
using vulkan_test::without_shadows;

VoxelType add_textured(Scene& scene, const VoxelFaces& faces, float emission = 0.0F) {
  VoxelProperties properties;
  properties.faces = faces;
  properties.emission = emission;
  return scene.types.add(properties).value();
}

/// Blocks of two textured types and a plain one. Faces of the textured types merge to quads of several voxels.
struct Blocks {
  VoxelType first, second, plain;
  GridHandle grid;
};

Blocks add_blocks(Scene& scene, DVec3 position = DVec3(0.0)) {
  Blocks made{};
  made.plain = add_type(scene, {90, 160, 210});
  made.first = add_textured(scene, random_faces(11));
  made.second = add_textured(scene, random_faces(25), 0.3F);
  SceneGrid blocks;
  blocks.grid.fill_box({{-6, -2, -6}, {7, 0, 7}}, made.first);
  blocks.grid.fill_box({{-5, 0, -5}, {-1, 4, -1}}, made.second);
  blocks.grid.fill_box({{1, 0, -4}, {5, 2, 5}}, made.first);
  blocks.grid.fill_box({{2, 2, -3}, {4, 5, 0}}, made.plain);
  blocks.grid.set({3, 2, 3}, made.second);
  blocks.pivot = {0.5, 0.25, -0.5};
  made.grid = scene.add_grid(std::move(blocks));
  scene.add_instance({"", made.grid, position});
  return made;
}

/// Adds a turned, mirrored instance of another voxel size, which shows other sides.
void add_turned(Scene& scene, GridHandle grid, DVec3 position) {
  Instance instance;
  instance.grid = grid;
  instance.position = position;
  instance.rotation = glm::angleAxis(2.3, glm::normalize(DVec3(3, 1, 2)));
  instance.voxel_size = 0.6;
  instance.mirrored = true;
  scene.add_instance(instance);
}

class VulkanTextures : public vulkan_test::VulkanMeshTest {
 protected:
  /// Compares the scene's images with those of the CPU: marched, and rasterised with and without shadows.
  void compare_both(const Scene& scene, const Camera& camera, const RenderOptions& options, const std::string& name) {
    compare_marched(scene, camera, options, name);
    compare(scene, camera, with_mesh_light(options), name + "_lit");
    compare(scene, camera, without_shadows(options), name + "_plain");
  }
  void compare_marched(const Scene& scene, const Camera& camera, const RenderOptions& whole, const std::string& name) {
    const RenderOptions options = vulkan_test::of_day(whole);
    expect_equal(taken(scene, camera, options), render_test::taken(scene, camera, options), "textures_" + name);
  }
  /// Returns the number of textures in device memory.
  [[nodiscard]] std::size_t texel_count() const { return renderer_->impl().texels.size(); }
};

/// Hills of four materials that blend: textures of three sizes and slopes, one of them emissive, and one plain colour.
DensityGrid add_hills(Scene& scene, float edge) {
  std::array<VoxelType, 4> types{};
  for (std::size_t i = 0; i < 3; ++i) {
    VoxelProperties material;
    material.faces = random_faces(static_cast<unsigned>(40 + 7 * i));
    material.emission = i == 2 ? 0.4F : 0.0F;
    material.field_textures = {.voxels = edge * static_cast<float>(1 + i),
                               .flat_degrees = 10.0F + 10.0F * static_cast<float>(i),
                               .steep_degrees = 60.0F};
    types[i] = scene.types.add(material).value();
  }
  types[3] = add_type(scene, {90, 160, 210});
  DensityGrid field;
  field.edit({{-20, -12, -20}, {20, 12, 20}}, [&](IVec3 p, DensitySample) {
    const double height = 5.0 * std::sin(0.25 * p.x) * std::cos(0.3 * p.z);
    const auto type = types.at(static_cast<std::size_t>((p.x >= 0 ? 1 : 0) + (p.z >= p.y ? 2 : 0)));
    return DensitySample{static_cast<float>(0.7 * (p.y - height)), type};
  });
  return field;
}

TEST_F(VulkanTextures, NearAndDistantTexelsMatchCpu) {
  Scene scene;
  const Blocks blocks = add_blocks(scene);
  add_turned(scene, blocks.grid, {-3.0, 7.5, 2.0});
  const RenderOptions options = sized(160, 120);
  compare_both(scene, towards({9, 8, 14}, {0, 1, 0}), options, "near");
  compare_both(scene, towards({-10, -9, -7}, {0, 1, 0}), options, "below");
  compare_both(scene, towards({60, 40, 90}, {0, 1, 0}, 0.3), options, "distant");
  compare_both(scene, from_above(0.31, 30, -0.43, 15.7), options, "flat");
}

TEST_F(VulkanTextures, TexelsFarFromOriginMatchCpu) {
  const DVec3 far{1e9 + 0.25, -1e9 - 0.5, 1e9};
  Scene scene;
  const Blocks blocks = add_blocks(scene, far);
  add_turned(scene, blocks.grid, far + DVec3(-3.0, 7.5, 2.0));
  compare_both(scene, towards(far + DVec3(9, 8, 14), far), sized(128, 96), "far");
}

// The mean colours stay the same where only the turns change.
TEST_F(VulkanTextures, EditedTypesMatchCpu) {
  Scene scene;
  const Blocks blocks = add_blocks(scene);
  const Camera camera = towards({9, 8, 14}, {0, 1, 0});
  const RenderOptions options = sized(128, 96);
  const auto compare_edited = [&](const std::string& name) {
    compare_marched(scene, camera, options, name);
    compare(scene, camera, without_shadows(options), name);
  };
  const auto change_faces = [&](VoxelType type, const VoxelFaces& faces) {
    VoxelProperties changed = scene.types[type];
    changed.faces = faces;
    scene.types.replace(type, changed);
  };
  compare_edited("before_edits");
  std::array<VoxelFace, 6> turned;
  for (const Direction direction : kDirections) {
    VoxelFace& face = turned.at(static_cast<std::size_t>(direction));
    face = scene.types[blocks.first].faces[direction];
    face.turn = static_cast<std::uint8_t>((face.turn + 1) % 4);
  }
  change_faces(blocks.first, VoxelFaces(turned));
  compare_edited("turned");
  change_faces(blocks.first, random_texture(32, 5));
  compare_edited("other_texture");
  const VoxelType added = add_textured(scene, random_faces(77));
  scene.edit(blocks.grid).grid.fill_box({{-5, 0, 2}, {-2, 3, 5}}, added);
  compare_edited("added_type");
  const VoxelFaces all = scene.types[added].faces;
  for (const VoxelType type : {blocks.first, blocks.second, added}) change_faces(type, {});
  EXPECT_GT(texel_count(), 0U);
  compare_edited("no_textures");
  EXPECT_EQ(texel_count(), 0U);
  change_faces(added, all);
  compare_edited("textures_again");
}

// Halved grids and impostors show the mean of each face.
TEST_F(VulkanTextures, DetailMatchesCpu) {
  Scene scene;
  const VoxelType first = add_textured(scene, random_faces(3));
  const VoxelType second = add_textured(scene, random_faces(4));
  SceneGrid blocks;
  blocks.grid.fill_box({{-16, -16, -16}, {16, 0, 16}}, first);
  blocks.grid.fill_box({{-8, 0, -8}, {4, 16, 4}}, second);
  scene.add_instance({"", scene.add_grid(std::move(blocks))});
  const Camera camera = towards({60, 45, 80}, {0, 0, 0}, 0.6);
  RenderOptions halved = sized(128, 96);
  halved.detail.policy =
      DetailPolicy{.rule = DetailPolicy::Rule::ByPixels, .voxel_pixels = 1e6, .cell_pixels = 12, .far_pixels = 0};
  compare_both(scene, camera, halved, "halved");
  RenderOptions far = sized(128, 96);
  far.detail.policy = DetailPolicy{.far_pixels = 1000};
  compare_marched(scene, camera, far, "impostor");
  const RenderOptions plain = without_shadows(far);
  const RenderedImage expected = render_test::taken(scene, camera, plain);
  put(scene, {});
  expect_like(drawn(camera, mesh_options(plain)), expected, "far_impostor");
  EXPECT_GT(meshes_->stats().drawn_triangles, 0);
  // A mesh with fewer quads than the impostor is drawn in its place.
  put(scene, vulkan_test::blocky_surfaces(scene));
  expect_like(drawn(camera, mesh_options(plain)), expected, "far_mesh");
  far.detail.colours = true;
  compare_marched(scene, camera, far, "detail_colours");
}

TEST_F(VulkanTextures, SamplesAndShadingMatchCpu) {
  Scene scene;
  add_blocks(scene);
  const Camera camera = towards({30, 22, 45}, {0, 1, 0}, 0.4);
  RenderOptions options = sized(96, 72);
  options.samples = 4;
  compare_marched(scene, camera, options, "samples");
  options.samples = 1;
  for (const Shading shading : {Shading::Unlit, Shading::UnlitWithOcclusion, Shading::Occlusion, Shading::Normals}) {
    options.light.shading = shading;
    const std::string name = "shading_" + std::to_string(static_cast<int>(shading));
    compare_marched(scene, camera, options, name);
    compare(scene, camera, without_shadows(options), name);
  }
}

// From inside a voxel the image shows its own texture.
TEST_F(VulkanTextures, InsideOfVoxelMatchesCpu) {
  Scene scene;
  const Blocks blocks = add_blocks(scene);
  add_turned(scene, blocks.grid, {40.0, 0.0, 0.0});
  compare_marched(scene, towards({3.3, 0.9, 2.2}, {5, -4, 1}, 1.2), sized(64, 48), "inside");
}

TEST_F(VulkanTextures, TexelsBehindGlassMatchCpu) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Scene scene;
  const Blocks blocks = add_blocks(scene);
  const VoxelType glass = add_type(scene, {120, 200, 230, 90}, Visibility::Transparent);
  scene.edit(blocks.grid).grid.fill_box({{-2, 0, 5}, {6, 6, 6}}, glass);
  compare_marched(scene, towards({9, 8, 14}, {0, 1, 0}), sized(96, 72), "glass");
}

TEST_F(VulkanTextures, FieldsMatchCpu) {
  Scene scene;
  SceneGrid hills;
  hills.field = add_hills(scene, 2.75F);
  hills.pivot = {0.25, 0.5, 0.0};
  const GridHandle grid = scene.add_grid(std::move(hills));
  scene.add_instance({"", grid, DVec3(0.0)});
  add_turned(scene, grid, {-8.0, 22.0, 5.0});
  const Camera camera = towards({22, 18, 26}, {0, 2, 0});
  RenderOptions options = sized(160, 120);
  compare_marched(scene, camera, options, "field");
  compare_marched(scene, from_above(0.31, 30, -0.43, 25.7), options, "field_flat");
  compare_marched(scene, towards({150, 120, 190}, {0, 5, 0}, 0.2), options, "field_distant");
  options.samples = 4;
  options.light.shading = Shading::Unlit;
  compare_marched(scene, camera, options, "field_samples");
  // Slopes and edges are followed without a change of textures.
  const RenderedImage before = render_test::taken(scene, camera, options);
  for (VoxelType type = 1; type < scene.types.size(); ++type) {
    VoxelProperties changed = scene.types[type];
    changed.field_textures = {.voxels = 0.375F, .flat_degrees = 0.0F, .steep_degrees = 0.001F};
    scene.types.replace(type, changed);
  }
  compare_marched(scene, camera, options, "field_edited");
  EXPECT_GT(render_test::count_different(before, render_test::taken(scene, camera, options), 8), 500);
}

// Halved fields and impostors keep the size and the position of textures.
TEST_F(VulkanTextures, DetailOfFieldsMatchesCpu) {
  Scene scene;
  SceneGrid hills;
  hills.field = add_hills(scene, 24.5F);
  scene.add_instance({"", scene.add_grid(std::move(hills))});
  const Camera camera = towards({60, 45, 80}, {0, 0, 0}, 0.6);
  RenderOptions options = sized(128, 96);
  options.detail.policy = DetailPolicy{.far_pixels = 0};
  options.detail.policy->cell_pixels = 12;
  compare_marched(scene, camera, options, "field_halved");
  options.detail.policy = DetailPolicy{.far_pixels = 1000};
  compare_marched(scene, camera, options, "field_impostor");
}

TEST_F(VulkanTextures, FieldsFarFromOriginMatchCpu) {
  const DVec3 far{3e8, -2e5, 7e7};
  Scene scene;
  const DensityGrid near = add_hills(scene, 3.7F);
  SceneGrid hills;
  const IVec3 shift{300'000'000, -200'000, 70'000'000};
  hills.field.edit({shift - IVec3{20, 12, 20}, shift + IVec3{20, 12, 20}},
                   [&](IVec3 p, DensitySample) { return near.get(p - shift); });
  scene.add_instance({"", scene.add_grid(std::move(hills)), DVec3(0.0)});
  compare_marched(scene, towards(far + DVec3(22, 18, 26), far), sized(128, 96), "field_far");
}

// Meshes blend materials by the weights of vertices, which on flat ground are the shares of samples where these change
// along one axis only.
TEST_F(VulkanTextures, MeshesOfFlatFieldsMatchCpu) {
  Scene scene;
  (void)add_hills(scene, 2.75F);
  SceneGrid ground;
  ground.field.edit({{-40, -8, -40}, {40, 2, 40}}, [&](IVec3 p, DensitySample) {
    return DensitySample{static_cast<float>(p.y), static_cast<VoxelType>(1 + std::clamp(p.x / 4 + 2, 0, 3))};
  });
  const GridHandle grid = scene.add_grid(std::move(ground));
  scene.add_instance({"", grid, {0.25, 0.5, 0.0}});
  put(scene, vulkan_test::live_surfaces(scene, SurfaceStyle::Blocky));
  RenderOptions options = sized(160, 120);
  options.light.shading = Shading::Unlit;
  const auto compare_mesh = [&](const Camera& camera, const std::string& name) {
    expect_like(drawn(camera, mesh_options(options)), render_test::taken(scene, camera, options), name);
  };
  const Camera near = towards({4, 12, 7}, {0, 0, 0}, 0.7);
  compare_mesh(near, "field_near");
  compare_mesh(from_above(0.31, 30, -0.43, 25.7), "field_flat");
  compare_mesh(towards({40, 70, 60}, {0, 0, 0}, 0.2), "field_distant");
  options.light.shading = Shading::Lit;
  options.light.occlusion_mode = OcclusionMode::Off;
  compare_mesh(near, "field_lit");
  options.detail.colours = true;
  options.detail.policy = DetailPolicy{.far_pixels = 0};
  compare_mesh(near, "field_detail_colours");
}

// On slopes the normals and weights of meshes differ a little from those of rays. Chunks of all levels, and halved
// fields, show textures in one size.
TEST_F(VulkanTextures, MeshesOfHillsResembleCpu) {
  Scene scene;
  SceneGrid hills;
  hills.field = add_hills(scene, 5.5F);
  scene.add_instance({"", scene.add_grid(std::move(hills))});
  RenderOptions options = sized(160, 120);
  options.light.shading = Shading::Unlit;
  const Camera camera = towards({22, 18, 26}, {0, 2, 0});
  const Image expected = render_test::taken(scene, camera, options).colour;
  const auto differing = [&](const std::vector<SurfaceUpdate>& surfaces) {
    meshes_->clear();
    put(scene, surfaces);
    return vulkan_test::bytes_that_differ(drawn(camera, mesh_options(options)), expected, 40);
  };
  const int all = 160 * 120 * 3;
  EXPECT_LT(differing(vulkan_test::live_surfaces(scene, SurfaceStyle::Blocky)) * 20, all);
  // Meshes without materials show means.
  const VoxelRegistry types = scene.types;
  for (VoxelType type = 1; type < types.size(); ++type) {
    VoxelProperties plain = types[type];
    plain.faces = {};
    scene.types.replace(type, plain);
  }
  const std::vector<SurfaceUpdate> plain = vulkan_test::live_surfaces(scene, SurfaceStyle::Blocky);
  for (const SurfaceUpdate& each : plain) EXPECT_TRUE(each.surface == nullptr || each.surface->materials.empty());
  for (VoxelType type = 1; type < types.size(); ++type) scene.types.replace(type, types[type]);
  EXPECT_GT(differing(plain) * 8, all);
}

// Logs and furnaces, also of a type that is turned without any data.
TEST_F(VulkanTextures, CubesTurnedByStateMatchCpu) {
  Scene scene;
  VoxelProperties furnace{.name = "furnace", .state_bits = 3};
  furnace.faces = random_faces(11);
  furnace.orientations = StateOrientations::about_y_and_upside_down();
  const VoxelType turned = *scene.types.add(furnace);
  furnace.name = "fallen";
  furnace.orientations = {.by_value = {AxisOrientation::quarter_turns(0, 1), AxisOrientation::quarter_turns(2, 1)}};
  const VoxelType fallen = *scene.types.add(furnace);
  SceneGrid blocks;
  for (std::uint32_t i = 0; i < 8; ++i) blocks.grid.set({static_cast<int>(i) - 4, 0, 0}, turned, {.state = i});
  blocks.grid.fill_box({{-4, -2, -2}, {4, 0, 3}}, fallen);
  blocks.grid.set_data({1, -1, 2}, {.state = 1});
  const GridHandle grid = scene.add_grid(std::move(blocks));
  scene.add_instance({"", grid});
  const Camera camera = towards({4, 5, 8}, {0, 0, 0}, 0.9);
  const RenderOptions options = sized(160, 120);
  compare_marched(scene, camera, options, "turned_cubes");
  scene.edit(grid).grid.set_data({2, 0, 0}, {.state = 0});
  scene.edit(grid).grid.set_data({2, -1, 2}, {.state = 1});
  compare_marched(scene, camera, options, "turned_after_edits");
  // Halved grids and impostors show the means of the turned faces.
  Grid& below = scene.edit(grid).grid;
  below.fill_box({{-16, -16, -16}, {16, -2, 16}}, fallen);
  for (int i = 0; i < 16 * 32; ++i) below.set_data({i % 16, -3, i / 16 - 16}, {.state = 1});
  const Camera distant = towards({60, 45, 80}, {0, 0, 0}, 0.6);
  RenderOptions halved = options;
  halved.detail.policy =
      DetailPolicy{.rule = DetailPolicy::Rule::ByPixels, .voxel_pixels = 1e6, .cell_pixels = 12, .far_pixels = 0};
  compare_marched(scene, distant, halved, "turned_halved");
  halved.detail.policy = DetailPolicy{.far_pixels = 1000};
  compare_marched(scene, distant, halved, "turned_impostor");
}

// Renderers and their mesh renderers share the texels in device memory.
TEST_F(VulkanTextures, TexelsAreSentOnce) {
  Scene scene;
  const Texture texture = random_texture(256, 1);
  Grid grid;
  grid.set({0, 0, 0}, add_textured(scene, texture));
  place(scene, std::move(grid));
  ASSERT_TRUE(meshes_->update(scene));
  ASSERT_TRUE(renderer_->update(scene));
  EXPECT_EQ(texel_count(), 1U);
  EXPECT_LT(renderer_->uploaded_bytes(), texture.bytes() / 100);
  VoxelProperties other;
  other.faces = VoxelFace{.texture = texture, .tint = {90, 90, 255}};
  ASSERT_TRUE(scene.types.add(other));
  ASSERT_TRUE(renderer_->update(scene));
  EXPECT_LT(renderer_->uploaded_bytes(), texture.bytes() / 100);
  other.faces = random_texture(256, 2);
  ASSERT_TRUE(scene.types.add(other));
  ASSERT_TRUE(renderer_->update(scene));
  EXPECT_GT(renderer_->uploaded_bytes(), texture.bytes());
  EXPECT_EQ(texel_count(), 2U);
}

}  // namespace
}  // namespace quoin
