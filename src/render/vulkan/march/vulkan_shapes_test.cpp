// Marched images show the shapes of voxel types as the CPU renderer does.

#include <array>
#include <string>
#include <utility>

#include <glm/gtc/quaternion.hpp>

#include <quoin/render/propagated_light.h>

#include "grid/shapes/shape_types_for_tests.h"
#include "render/cpu/cave_for_tests.h"
#include "render/vulkan/device/vulkan_for_tests.h"
#include "render/vulkan/march/renderer_impl.h"

namespace quoin {
namespace {

using render_test::random_faces;
using render_test::sized;
using render_test::towards;
using vulkan_test::expect_equal;
using vulkan_test::noise_with_alpha;

// A garden with a street of shapes; the types with glass are optional.
struct Garden {
  Scene scene;
  ShapeTypes types{scene.types};
  VoxelType textured = kAir;  // stairs, turned by their state
  VoxelType leaf = kAir;      // crossed plates with cutout texels
  VoxelType stained = kAir;   // translucent texels
  GridHandle grid;

  explicit Garden(bool has_glass, DVec3 position = DVec3(0.0)) {
    VoxelProperties stairs{.name = "textured", .emission = 0.6F, .state_bits = 3};
    stairs.faces = random_faces(5);
    stairs.orientations = StateOrientations::about_y_and_upside_down();
    stairs.shapes = scene.types[types.stairs].shapes;
    textured = *scene.types.add(stairs);
    VoxelProperties crossed{.name = "leaf", .visibility = Visibility::Transparent};
    crossed.faces = VoxelFaces(VoxelFace{.texture = noise_with_alpha(3, 0), .alpha = FaceAlpha::Cutout});
    crossed.shapes = VoxelShape::crossed_plates();
    leaf = *scene.types.add(crossed);
    VoxelProperties pane{.name = "stained", .visibility = Visibility::Transparent};
    pane.faces = VoxelFaces(VoxelFace{.texture = noise_with_alpha(4, 90), .alpha = FaceAlpha::Translucent});
    pane.shapes = VoxelShape::box({0, 0, 7}, {16, 16, 9});
    stained = *scene.types.add(pane);
    SceneGrid garden;
    garden.grid = voxels(has_glass);
    garden.pivot = {0.5, 0.25, -0.5};
    grid = scene.add_grid(std::move(garden));
    scene.add_instance({"", grid, position});
  }

  [[nodiscard]] Grid voxels(bool has_glass) const {
    Grid g;
    g.fill_box({{-8, -1, -8}, {9, 0, 9}}, types.stone);
    for (int i = -5; i < 6; ++i) g.set({i, 0, -5}, types.fence);
    for (int i = -4; i < 3; ++i) g.set({-5, 0, i}, types.fence);
    for (std::uint32_t i = 0; i < 8; ++i) {
      g.set({static_cast<int>(i) - 4, 0, -3}, i % 2 == 0 ? types.stairs : textured, {.state = i});
    }
    g.fill_box({{-4, 0, -1}, {-1, 1, 1}}, types.slab);
    g.fill_box({{0, 0, -1}, {1, 2, 0}}, types.stone);
    for (std::uint32_t i = 0; i < 6; ++i) g.set({static_cast<int>(i) - 3, 1, -6}, types.torch, {.state = i});
    g.set({1, 1, -1}, types.torch, {.state = 0});
    g.set({-3, 0, 2}, types.flower);
    g.fill_box({{2, 0, 0}, {5, 1, 2}}, leaf);
    for (int y = 0; y < 2; ++y) g.set({2, y, -2}, types.door, {.state = 1});
    g.set({3, 3, 3}, types.beam);
    g.set({-6, 0, 5}, types.beam);
    g.fill_box({{-8, 0, -8}, {9, 1, -7}}, types.rubble);
    g.fill_box({{7, 0, -6}, {9, 2, 8}}, types.rubble);
    if (!has_glass) return g;
    for (std::uint32_t i = 0; i < 5; ++i) g.set({static_cast<int>(i) - 3, 0, 4}, types.water, {.state = i});
    g.fill_box({{-4, -2, 5}, {0, 0, 7}}, types.water);
    g.fill_box({{3, 0, 5}, {6, 3, 6}}, types.pane);
    g.fill_box({{0, 0, 6}, {3, 2, 7}}, stained);
    return g;
  }
  // Adds a turned, mirrored instance of another voxel size.
  void add_turned(DVec3 position) {
    Instance instance;
    instance.grid = grid;
    instance.position = position;
    instance.rotation = glm::angleAxis(2.3, glm::normalize(DVec3(3, 1, 2)));
    instance.voxel_size = 0.6;
    instance.mirrored = true;
    scene.add_instance(instance);
  }
};

class VulkanShapes : public vulkan_test::VulkanTest {
 protected:
  void compare(const Scene& scene, const Camera& camera, const RenderOptions& whole, const std::string& name) {
    const RenderOptions options = vulkan_test::of_day(whole);
    expect_equal(taken(scene, camera, options), render_test::taken(scene, camera, options), "shapes_" + name);
  }
};

TEST_F(VulkanShapes, NearAndDistantShapesMatchCpu) {
  Garden garden(false);
  garden.add_turned({-3.0, 7.5, 2.0});
  const RenderOptions options = sized(240, 180);
  compare(garden.scene, towards({6, 5, 9}, {0, 0, 0}), options, "near");
  compare(garden.scene, towards({-2.5, 0.8, 3.2}, {-1, 0.3, -3}), options, "eye");
  compare(garden.scene, towards({60, 40, 90}, {0, 1, 0}, 0.3), options, "distant");
  compare(garden.scene, render_test::from_above(0.31, 30, -0.43, 15.7), options, "flat");
}

// Drivers for processors compile the light behind glass for half a minute.
TEST_F(VulkanShapes, GlassOfShapesMatchesCpu) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Garden garden(true);
  garden.add_turned({-3.0, 7.5, 2.0});
  const RenderOptions options = sized(240, 180);
  compare(garden.scene, towards({6, 5, 12}, {0, 0, 2}), options, "glass");
  compare(garden.scene, towards({-1.2, 0.7, 4.4}, {3, 0.4, 5}), options, "in_water");
}

// Edits of voxels, of states and next to shapes that follow their neighbours.
TEST_F(VulkanShapes, EditedShapesMatchCpu) {
  Garden garden(is_nightly());
  const Camera camera = towards({6, 5, 9}, {0, 0, 0});
  const RenderOptions options = sized(160, 120);
  compare(garden.scene, camera, options, "before_edits");
  const auto all = renderer_->uploaded_bytes();
  Grid& grid = garden.scene.edit(garden.grid).grid;
  grid.set({0, 0, -4}, garden.types.stone);  // next to the fence
  compare(garden.scene, camera, options, "next_to_fence");
  EXPECT_GT(renderer_->uploaded_bytes(), 0U);
  EXPECT_LT(renderer_->uploaded_bytes(), all);
  garden.scene.edit(garden.grid).grid.set_data({-2, 0, -3}, {.state = 1});
  garden.scene.edit(garden.grid).grid.set_data({2, 0, -2}, {.state = 2});
  compare(garden.scene, camera, options, "states");
  garden.scene.edit(garden.grid).grid.set({3, 3, 3}, kAir);
  garden.scene.edit(garden.grid).grid.set({20, 2, 3}, garden.types.beam);
  compare(garden.scene, camera, options, "moved_beam");
  VoxelProperties changed = garden.scene.types[garden.types.slab];
  changed.shapes = VoxelShape::box({2, 0, 2}, {14, 12, 14});
  garden.scene.types.replace(garden.types.slab, changed);
  compare(garden.scene, camera, options, "other_shape");
  garden.scene.edit(garden.grid).grid.fill_box({{-40, 0, -40}, {40, 40, 40}}, kAir);
  garden.scene.edit(garden.grid).grid.fill_box({{-40, -2, 5}, {40, 0, 7}}, kAir);
  compare(garden.scene, camera, options, "no_shapes");
}

TEST_F(VulkanShapes, LightOfShapesMatchesCpu) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Garden garden(false);
  garden.scene.lamps.push_back({.position = {2.2, 3.1, 1.3}, .intensity = 60.0});
  const Camera camera = towards({5, 4, 7}, {0, 0, -1});
  RenderOptions options = sized(160, 120);
  options.light = natural_light();
  compare(garden.scene, camera, options, "natural");
  options = sized(160, 120);
  options.light.occlusion_mode = OcclusionMode::Vertex;
  compare(garden.scene, camera, options, "vertex");
  compare(Hall(true).scene, Hall::inside(), propagated(200, 150), "propagated");
  for (const Shading shading : {Shading::Unlit, Shading::Normals, Shading::Occlusion}) {
    options = sized(96, 72);
    options.light.shading = shading;
    compare(garden.scene, camera, options, "shading_" + std::to_string(static_cast<int>(shading)));
  }
}

// Cells of halved grids have the mean colour of their shapes' sides.
TEST_F(VulkanShapes, HalvedShapesMatchCpu) {
  Garden garden(false);
  Grid& grid = garden.scene.edit(garden.grid).grid;
  grid.fill_box({{-16, -16, -16}, {16, 0, 16}}, garden.types.stone);
  grid.fill_box({{-12, 0, -12}, {-2, 8, -2}}, garden.textured);
  grid.fill_box({{0, 0, -12}, {12, 6, -4}}, garden.types.slab);
  grid.fill_box({{0, 0, 0}, {10, 8, 10}}, garden.leaf);
  grid.fill_box({{-12, 0, 2}, {-4, 6, 10}}, garden.types.stairs);
  garden.add_turned({-30.0, 7.5, 2.0});
  const Camera camera = towards({60, 45, 80}, {-4, 0, 0}, 0.6);
  RenderOptions options = sized(128, 96);
  const RenderedImage whole = render_test::taken(garden.scene, camera, vulkan_test::of_day(options));
  options.detail.policy =
      DetailPolicy{.rule = DetailPolicy::Rule::ByPixels, .voxel_pixels = 1e6, .cell_pixels = 12, .far_pixels = 0};
  compare(garden.scene, camera, options, "halved");
  const RenderedImage halved = taken_as_is(camera, vulkan_test::of_day(options));
  EXPECT_NE(halved.depth.values, whole.depth.values);
  options.light.occlusion_mode = OcclusionMode::Vertex;
  compare(garden.scene, camera, options, "halved_vertex");
  // Types keep their colour, their shapes get another one.
  options.light.occlusion_mode = RenderOptions().light.occlusion_mode;
  VoxelProperties slab = garden.scene.types[garden.types.slab];
  ShapeElement half{.min = {0, 0, 0}, .max = {16, 8, 16}};
  for (ElementFace& face : half.faces) face.face = VoxelFace{.tint = {40, 90, 230}};
  slab.shapes = *VoxelShape::from_elements({half});
  garden.scene.types.replace(garden.types.slab, slab);
  const RenderedImage blue = render_test::taken(garden.scene, camera, vulkan_test::of_day(options));
  EXPECT_GT(vulkan_test::differences(halved, blue).pixels, 50);
  compare(garden.scene, camera, options, "halved_blue");
}

// Impostors show sides of shapes in the means of their textures.
TEST_F(VulkanShapes, ImpostorsOfShapesMatchCpu) {
  Garden garden(false);
  garden.add_turned({-3.0, 12.5, 2.0});
  const vulkan::DeviceDetail& detail = renderer_->impl().detail;
  RenderOptions options = sized(128, 96);
  const Camera camera = towards({40, 30, 60}, {0, 1, 0}, 0.4);
  const RenderedImage whole = render_test::taken(garden.scene, camera, vulkan_test::of_day(options));
  options.detail.policy = DetailPolicy{.far_pixels = 1000};
  compare(garden.scene, camera, options, "impostors");
  EXPECT_GT(detail.impostor_bytes(), 0U);
  const RenderedImage far = taken_as_is(camera, vulkan_test::of_day(options));
  EXPECT_GT(vulkan_test::differences(far, whole).pixels, 50);
  compare(garden.scene, towards({200, 150, 300}, {0, 1, 0}, 0.1), options, "impostors_cells");
  options.light.occlusion_mode = OcclusionMode::Vertex;
  compare(garden.scene, camera, options, "impostors_vertex");
  options.light.shading = Shading::Normals;
  compare(garden.scene, camera, options, "impostors_normals");
  // Edits of voxels and of types.
  options.light.shading = Shading::Lit;
  garden.scene.edit(garden.grid).grid.set({2, 0, -5}, kAir);
  compare(garden.scene, camera, options, "impostors_edited");
  VoxelProperties slab = garden.scene.types[garden.types.slab];
  slab.emission = 0.7F;
  garden.scene.types.replace(garden.types.slab, slab);
  compare(garden.scene, camera, options, "impostors_other_type");
  slab.shapes = VoxelShape::box({2, 0, 2}, {14, 12, 14});
  garden.scene.types.replace(garden.types.slab, slab);
  compare(garden.scene, camera, options, "impostors_other_shape");
}

// Blocks of leaves, stained glass, and cells with faces of all kinds.
TEST_F(VulkanShapes, CutoutAndTranslucentCubesMatchCpu) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Scene scene;
  const auto add = [&](VoxelFaces faces, Visibility visibility) {
    VoxelProperties type{.visibility = visibility};
    type.faces = std::move(faces);
    return *scene.types.add(type);
  };
  const VoxelFace cutout{.texture = noise_with_alpha(1, 0), .turn = 1, .alpha = FaceAlpha::Cutout};
  const VoxelFace translucent{
      .texture = noise_with_alpha(2, 60), .tint = {255, 180, 90}, .alpha = FaceAlpha::Translucent};
  const VoxelType stone = add(random_faces(5), Visibility::Opaque);
  const VoxelType leaves = add(VoxelFaces(cutout), Visibility::Transparent);
  const VoxelType stained = add(VoxelFaces(translucent), Visibility::Transparent);
  const VoxelType mixed =
      add(VoxelFaces(cutout, VoxelFace{render_test::random_texture(16, 3)}, translucent), Visibility::Transparent);
  const VoxelType glass = render_test::add_type(scene, {120, 200, 230, 90}, Visibility::Transparent);
  SceneGrid garden;
  garden.grid.fill_box({{-8, -1, -8}, {9, 0, 9}}, stone);
  garden.grid.fill_box({{-4, 0, -4}, {-1, 3, -1}}, leaves);
  garden.grid.fill_box({{1, 0, -3}, {5, 2, -1}}, stained);
  garden.grid.fill_box({{-3, 0, 2}, {0, 2, 4}}, mixed);
  garden.grid.fill_box({{2, 0, 1}, {4, 2, 4}}, glass);
  garden.grid.set({2, 1, 2}, leaves);
  garden.grid.set({-1, 0, 0}, leaves);
  garden.grid.set({0, 0, 2}, stained);
  const GridHandle grid = scene.add_grid(std::move(garden));
  scene.add_instance({"", grid});
  Instance turned;
  turned.grid = grid;
  turned.position = {-3.0, 8.5, 2.0};
  turned.rotation = glm::angleAxis(2.3, glm::normalize(DVec3(3, 1, 2)));
  turned.voxel_size = 0.6;
  scene.add_instance(turned);
  const RenderOptions options = sized(240, 180);
  compare(scene, towards({6, 5, 9}, {0, 0, 0}), options, "cells");
  compare(scene, towards({-2.5, 0.8, 1.2}, {-1, 0.6, 3}), options, "cells_near");
  compare(scene, towards({60, 40, 90}, {0, 1, 0}, 0.3), options, "cells_distant");
  RenderOptions unlit = options;
  unlit.light.shading = Shading::Unlit;
  compare(scene, towards({-2.4, 1.3, -2.6}, {4, 1, 3}, 1.2), unlit, "cells_inside");
}

// A shape hides the faces of leaves next to it only where it covers the whole side.
TEST_F(VulkanShapes, CellsNextToShapesMatchCpu) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Scene scene;
  const ShapeTypes types(scene.types);
  VoxelProperties of_leaves{.name = "leaves", .visibility = Visibility::Transparent};
  of_leaves.faces = VoxelFaces(VoxelFace{.texture = noise_with_alpha(1, 0), .alpha = FaceAlpha::Cutout});
  const VoxelType leaves = *scene.types.add(of_leaves);
  SceneGrid garden;
  for (int i = 0; i < 6 * 3 * 6; ++i) {
    const IVec3 at{i % 6, i / 6 % 3, i / 18};
    const std::array<VoxelType, 5> some = {leaves, leaves, types.stairs, types.slab, types.door};
    const VoxelType type = some[static_cast<std::size_t>((at.x + 2 * at.y + 3 * at.z + at.x * at.z) % 5)];
    garden.grid.set(at, type, {.state = static_cast<std::uint32_t>(type == types.stairs ? i % 8 : 0)});
  }
  scene.add_instance({"", scene.add_grid(std::move(garden))});
  RenderOptions unlit = sized(160, 120);
  unlit.light.shading = Shading::Unlit;
  compare(scene, towards({9, 7, 11}, {3, 1, 3}), unlit, "leaves");
  compare(scene, towards({-4, 0.4, -6}, {3, 1.5, 3}), unlit, "leaves_below");
}

}  // namespace
}  // namespace quoin
