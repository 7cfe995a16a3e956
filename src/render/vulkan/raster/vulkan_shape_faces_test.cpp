// Rasterised images show shapes of voxel types, cubes that their state turns, and cutout and translucent texels.
// Compiling pipelines takes most of the time, so tests that need further ones run nightly.

#include <array>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <glm/gtc/quaternion.hpp>

#include "core/work/nightly_for_tests.h"
#include "grid/shapes/shape_types_for_tests.h"
#include "render/cpu/cave_for_tests.h"
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
using vulkan_test::mesh_options;
using vulkan_test::with_mesh_light;
using vulkan_test::without_shadows;

// Returns light without shadows and occlusion: a mesh also darkens corners inside of voxels, and by shapes.
RenderOptions plain_light(int width, int height) {
  RenderOptions options = without_shadows(sized(width, height));
  options.light.occlusion_mode = OcclusionMode::Off;
  return options;
}

// A texture of noise. About a third of its texels is invisible, or they have any alpha.
Texture holed_texture(int size, unsigned seed, FaceAlpha alpha = FaceAlpha::Cutout) {
  std::mt19937 random(seed);
  AlphaImage image{size, size, {}};
  for (int i = 0; i < size * size; ++i) {
    for (int c = 0; c < 3; ++c) image.rgba.push_back(static_cast<std::uint8_t>(random()));
    const auto number = static_cast<std::uint8_t>(random());
    image.rgba.push_back(alpha == FaceAlpha::Translucent ? number : std::uint8_t(number < 90 ? 0 : 255));
  }
  return Texture::from_image("holed", image).value();
}

VoxelProperties seen_through(std::string name, const VoxelFaces& faces) {
  VoxelProperties type{.name = std::move(name), .visibility = Visibility::Transparent};
  type.faces = faces;
  return type;
}

class VulkanShapeFaces : public vulkan_test::VulkanMeshTest {};

/// Ground with shapes of opaque types on it, in two chunks.
struct Yard {
  Scene scene;
  ShapeTypes types{scene.types};
  VoxelType textured_stairs = kAir;
  VoxelType textured_fence = kAir;
  GridHandle grid;

  Yard() {
    VoxelProperties stairs = scene.types[types.stairs];
    stairs.name = "textured stairs";
    stairs.faces = random_faces(5);
    textured_stairs = scene.types.add(stairs).value();
    // Its elements have looks of their own.
    VoxelFace look{.texture = random_texture(32, 7), .turn = 1, .tint = {255, 200, 90}};
    ShapeElement post{.min = {5, 0, 5}, .max = {11, 16, 11}};
    ShapeElement board{.min = {1, 9, 7}, .max = {15, 12, 9}, .turn = ElementTurn{.axis = 0, .degrees = 22.5F}};
    look.emission_share = 102;
    for (ElementFace& face : post.faces) face.face = look;
    look.mirrored = true;
    look.emission_share = 255;
    for (ElementFace& face : board.faces) face.face = look;
    VoxelProperties fence{.name = "textured fence", .emission = 0.75F};
    // A look without a texture has the colour of its tint.
    ShapeElement cap{.min = {3, 13, 3}, .max = {13, 15, 13}};
    for (ElementFace& face : cap.faces) face.face = VoxelFace{.tint = {40, 200, 120}, .emission_share = 0};
    fence.shapes = *VoxelShape::from_elements({post, board, cap});
    textured_fence = scene.types.add(fence).value();
    SceneGrid yard;
    yard.pivot = {0.5, 0.25, -0.5};
    yard.grid.fill_box({{-8, -2, -8}, {9, 0, 9}}, types.stone);
    const std::array kinds = {types.slab, types.stairs,    types.fence,    types.torch,     types.flower, types.door,
                              types.beam, textured_stairs, textured_fence, textured_stairs, types.rubble};
    std::uint32_t state = 0;
    for (int z = -7; z < 8; z += 3) {
      for (int x = -7; x < 8; x += 2, ++state) {
        const VoxelType type = kinds[state % kinds.size()];
        yard.grid.set({x, 0, z}, type, {.state = state * 5 % (scene.types[type].state_bits == 2 ? 4 : 6)});
      }
    }
    for (int x = -6; x < 4; ++x) yard.grid.set({x, 0, -2}, types.fence);
    for (int x = -4; x < 4; ++x) yard.grid.set({x, 1, 5}, x < 0 ? types.stairs : types.slab);
    grid = scene.add_grid(std::move(yard));
    scene.add_instance({"", grid});
  }

  static constexpr IVec3 kChunk{0};  // has shapes
  [[nodiscard]] std::shared_ptr<ChunkSurface> surface() const {
    return vulkan_test::blocky_surface(scene.grids()[grid].grid, scene.types, kChunk);
  }

  /// Adds a turned, mirrored instance of another voxel size.
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

TEST_F(VulkanShapeFaces, FacesOfShapesMatchCpu) {
  Yard yard;
  yard.add_turned({-3.0, 9.5, 2.0});
  compare(yard.scene, towards({9, 8, 14}, {0, 1, 0}), plain_light(240, 180), "shapes_near");
  compare(yard.scene, towards({-6, 1.6, 4}, {2, 0.5, -3}), plain_light(160, 120), "shapes_eye_height");
  compare(yard.scene, towards({60, 40, 90}, {0, 1, 0}, 0.3), plain_light(160, 120), "shapes_distant");
  compare(yard.scene, from_above(0.31, 30, -0.43, 15.7), plain_light(160, 120), "shapes_flat");
}

// A roof of cubes casts its shadow on slabs. Lamps are above it.
TEST_F(VulkanShapeFaces, ShadowsOnShapesMatchCpu) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Scene scene;
  const ShapeTypes types(scene.types);
  Grid grid;
  grid.fill_box({{-6, -1, -6}, {7, 0, 7}}, types.stone);
  grid.fill_box({{-4, 0, -4}, {5, 1, 5}}, types.slab);
  grid.fill_box({{-3, 4, -3}, {2, 5, 2}}, types.stone);
  place(scene, std::move(grid));
  RenderOptions options = sized(120, 90);
  options.light.occlusion_mode = OcclusionMode::Off;
  compare(scene, towards({9, 9, 12}, {0, 0, 0}), options, "shadows");
}

TEST_F(VulkanShapeFaces, PropagatedLightOnShapesMatchesCpu) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  const Hall hall(true);
  compare(hall.scene, Hall::inside(), propagated(200, 150), "propagated");
}

TEST_F(VulkanShapeFaces, CubesTurnedByStateMatchCpu) {
  Scene scene;
  VoxelProperties furnace{.name = "furnace", .state_bits = 6};
  furnace.faces = random_faces(3);
  for (int i = 0; i < AxisOrientation::kCount; ++i) furnace.orientations.by_value.push_back(AxisOrientation::at(i));
  const VoxelType type = scene.types.add(furnace).value();
  Grid grid;
  for (std::uint32_t i = 0; i < AxisOrientation::kCount; ++i) {
    const auto at = static_cast<int>(i);
    grid.set({at % 7 * 2, at / 7 % 4, at / 28 * 3}, type, {.state = i});
  }
  place(scene, std::move(grid));
  compare(scene, towards({22, 9, 17}, {6, 2, 2}), without_shadows(sized(200, 150)), "turned_front");
  compare(scene, towards({-9, -7, -13}, {6, 1, 2}), without_shadows(sized(200, 150)), "turned_back");
}

TEST_F(VulkanShapeFaces, CutoutTexelsMatchCpu) {
  Scene scene;
  const VoxelType stone = add_type(scene, {150, 140, 130});
  const VoxelType leaves =
      *scene.types.add(seen_through("leaves", VoxelFace{.texture = holed_texture(16, 2), .alpha = FaceAlpha::Cutout}));
  Grid grid;
  grid.fill_box({{-6, -1, -6}, {7, 0, 7}}, stone);
  grid.fill_box({{-3, 0, -3}, {3, 3, 1}}, leaves);
  grid.fill_box({{-1, 0, -1}, {1, 2, 0}}, stone);
  grid.set({4, 1, 4}, leaves);
  place(scene, std::move(grid));
  RenderOptions options = plain_light(200, 150);
  compare(scene, towards({7, 5, 9}, {0, 1, 0}), options, "cutout_near");
  compare(scene, towards({-50, 30, -45}, {0, 1, 0}, 0.2), options, "cutout_distant");
  if (!is_nightly()) return;
  options.light.shading = Shading::Normals;
  compare(scene, towards({7, 5, 9}, {0, 1, 0}), options, "cutout_normals");
}

// Looks towards -Z; every ray passes straight through a pane.
Camera facing_panes(DVec3 position, double view_height) {
  Camera camera;
  camera.position = position;
  camera.projection = Camera::Projection::Orthographic;
  camera.view_height = view_height;
  return camera;
}

// Panes of translucent texels, cubes and shapes, before a wall; each counts as a voxel of glass.
TEST_F(VulkanShapeFaces, TranslucentFacesMatchCpu) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Scene scene;
  const ShapeTypes types(scene.types);
  const VoxelFace stained{.texture = holed_texture(16, 4, FaceAlpha::Translucent), .alpha = FaceAlpha::Translucent};
  const VoxelType glass = *scene.types.add(seen_through("glass", stained));
  VoxelProperties thin = seen_through("stained pane", stained);
  thin.shapes = VoxelShape::box({0, 0, 7}, {16, 16, 9});
  const VoxelType pane = *scene.types.add(thin);
  Grid grid;
  grid.fill_box({{0, 0, -6}, {16, 8, -5}}, types.stone);
  grid.fill_box({{1, 1, 0}, {5, 5, 1}}, glass);
  grid.fill_box({{6, 1, 0}, {10, 5, 1}}, pane);
  grid.fill_box({{8, 3, 3}, {15, 7, 4}}, types.pane);
  place(scene, std::move(grid));
  const RenderOptions options = vulkan_test::of_day(plain_light(128, 96));
  const Camera camera = facing_panes({8.03, 4.02, 60}, 9.0);
  put(scene, vulkan_test::blocky_surfaces(scene));
  MeshImageOptions meshes = mesh_options(options);
  meshes.glass_by_rays = false;
  expect_like(drawn(camera, meshes), render_test::taken(scene, camera, options), "translucent");
}

TEST_F(VulkanShapeFaces, CutoutPlatesAreSeenFromBothSides) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Scene scene;
  const ShapeTypes types(scene.types);
  VoxelProperties plant = seen_through("plant", VoxelFace{.texture = holed_texture(16, 9), .alpha = FaceAlpha::Cutout});
  plant.shapes = VoxelShape::crossed_plates();
  const VoxelType crossed = *scene.types.add(plant);
  // A plate that has one side, and a box that has no top.
  ShapeElement leaf{.min = {0, 8, 0}, .max = {16, 8, 16}};
  leaf.faces[static_cast<std::size_t>(Direction::NegY)].is_drawn = false;
  plant.name = "leaf";
  plant.shapes = *VoxelShape::from_elements({leaf});
  const VoxelType single = *scene.types.add(plant);
  ShapeElement tub{.min = {2, 0, 2}, .max = {14, 12, 14}};
  tub.faces[static_cast<std::size_t>(Direction::PosY)].is_drawn = false;
  VoxelProperties open{.name = "tub", .colour = {200, 120, 60}};
  open.shapes = *VoxelShape::from_elements({tub});
  const VoxelType box = *scene.types.add(open);
  Grid grid;
  grid.fill_box({{-4, -1, -4}, {5, 0, 5}}, types.stone);
  for (int x = -3; x < 5; x += 2) {
    for (int z = -3; z < 5; z += 2) grid.set({x, 0, z}, x < 0 ? crossed : z < 0 ? box : single);
  }
  place(scene, std::move(grid));
  compare(scene, towards({4, 5, 7}, {0, 0, 0}), plain_light(200, 150), "plates_above");
  compare(scene, towards({-5, 0.3, -4}, {2, 0.6, 1}), plain_light(200, 150), "plates_below");
}

// Texture and tint of a type's faces are those of its last update, without new meshes.
TEST_F(VulkanShapeFaces, EditsMatchCpu) {
  Yard yard;
  const Camera camera = towards({9, 8, 14}, {0, 1, 0});
  const RenderOptions options = vulkan_test::of_day(plain_light(160, 120));
  put(yard.scene, vulkan_test::blocky_surfaces(yard.scene));
  VoxelProperties stairs = yard.scene.types[yard.textured_stairs];
  stairs.faces = VoxelFace{.texture = random_texture(16, 99), .turn = 3, .tint = {120, 255, 120}};
  stairs.emission = 0.5F;
  yard.scene.types.replace(yard.textured_stairs, stairs);
  VoxelProperties slab = yard.scene.types[yard.types.slab];
  slab.colour = {20, 90, 220};
  yard.scene.types.replace(yard.types.slab, slab);
  put(yard.scene, {});
  expect_like(drawn(camera, mesh_options(options)), render_test::taken(yard.scene, camera, options), "edited_types");
  yard.scene.edit(yard.grid).grid.fill_box({{-3, 0, 5}, {2, 1, 6}}, yard.types.door);
  yard.scene.edit(yard.grid).grid.fill_box({{-6, 0, -2}, {-2, 1, -1}}, kAir);
  put(yard.scene, vulkan_test::blocky_surfaces(yard.scene));
  expect_like(drawn(camera, mesh_options(options)), render_test::taken(yard.scene, camera, options), "edited_voxels");
}

// Cells of halved grids have the mean colour of their shapes' sides.
TEST_F(VulkanShapeFaces, HalvedShapesMatchCpu) {
  Yard yard;
  Grid& grid = yard.scene.edit(yard.grid).grid;
  grid.fill_box({{-16, -16, -16}, {16, 0, 16}}, yard.types.stone);
  grid.fill_box({{-12, 0, -12}, {-2, 8, -2}}, yard.textured_stairs);
  grid.fill_box({{0, 0, -12}, {12, 6, -4}}, yard.textured_fence);
  grid.fill_box({{0, 0, 0}, {10, 8, 10}}, yard.types.slab);
  const Camera camera = towards({60, 45, 80}, {0, 0, 0}, 0.6);
  RenderOptions options = plain_light(128, 96);
  options.detail.policy =
      DetailPolicy{.rule = DetailPolicy::Rule::ByPixels, .voxel_pixels = 1e6, .cell_pixels = 12, .far_pixels = 0};
  compare(yard.scene, camera, options, "halved");
  const std::int64_t triangles = meshes_->stats().drawn_triangles;
  options.light.occlusion_mode = OcclusionMode::Vertex;
  compare(yard.scene, camera, options, "halved_vertex");
  RenderOptions whole = options;
  whole.detail.policy.reset();
  (void)drawn(camera, mesh_options(vulkan_test::of_day(whole)));
  EXPECT_LT(triangles, meshes_->stats().drawn_triangles);
  // Types keep their colour, their shapes get another one.
  const Image before = drawn(camera, mesh_options(vulkan_test::of_day(options)));
  VoxelProperties slab = yard.scene.types[yard.types.slab];
  ShapeElement half{.min = {0, 0, 0}, .max = {16, 8, 16}};
  for (ElementFace& face : half.faces) face.face = VoxelFace{.tint = {40, 90, 230}};
  slab.shapes = *VoxelShape::from_elements({half});
  yard.scene.types.replace(yard.types.slab, slab);
  compare(yard.scene, camera, options, "halved_blue");
  const Image after = drawn(camera, mesh_options(vulkan_test::of_day(options)));
  EXPECT_GT(vulkan_test::bytes_that_differ(before, after, 20), 50);
  if (!is_nightly()) return;
  compare(yard.scene, camera, with_mesh_light(options), "halved_lit");
}

TEST_F(VulkanShapeFaces, NormalsMatchCpu) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Yard yard;
  yard.add_turned({-3.0, 9.5, 2.0});
  RenderOptions options = plain_light(120, 90);
  options.light.shading = Shading::Normals;
  compare(yard.scene, towards({9, 8, 14}, {0, 1, 0}), options, "normals");
}

TEST_F(VulkanShapeFaces, DrawsEdgesOfShapes) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Scene scene;
  const ShapeTypes types(scene.types);
  Grid grid;
  grid.set({0, 0, 0}, types.stairs);
  place(scene, std::move(grid));
  put(scene, vulkan_test::blocky_surfaces(scene));
  MeshImageOptions options = mesh_options(plain_light(64, 64));
  const Camera camera = towards({2, 2, 3}, {0.5, 0.5, 0.5});
  const Image filled = drawn(camera, options);
  options.wireframe = Wireframe::Over;
  const Image over = drawn(camera, options);
  EXPECT_GT(vulkan_test::bytes_that_differ(over, filled, 20), 300);
  options.wireframe = Wireframe::Only;
  EXPECT_GT(vulkan_test::bytes_that_differ(drawn(camera, options), over, 20), 300);
}

// A cube as a shape has the light and the occlusion of a cube.
TEST_F(VulkanShapeFaces, CubeAsShapeIsLitLikeCube) {
  const auto image = [&](bool is_shape, const LightOptions& light) {
    Scene scene;
    const VoxelType stone = add_type(scene, {150, 140, 130});
    VoxelProperties cube{.name = "cube"};
    cube.faces = random_faces(8);
    if (is_shape) cube.shapes = VoxelShape::box({0, 0, 0}, {16, 16, 16});
    const VoxelType type = *scene.types.add(cube);
    Grid grid;
    grid.fill_box({{-6, -1, -6}, {7, 0, 7}}, stone);
    grid.fill_box({{-2, 0, -2}, {2, 2, 1}}, type);
    grid.set({3, 0, 2}, type);
    grid.fill_box({{-6, 5, -6}, {-1, 6, 7}}, stone);
    place(scene, std::move(grid));
    put(scene, vulkan_test::blocky_surfaces(scene, false));
    RenderOptions options = vulkan_test::of_day(with_mesh_light(sized(160, 120)));
    options.light = light;
    options.light.occlusion_mode = OcclusionMode::Vertex;
    return drawn(towards({9, 7, 12}, {0, 1, 0}), mesh_options(options));
  };
  LightOptions light;
  light.shadows = false;
  const int bytes = static_cast<int>(image(false, light).rgb.size());
  EXPECT_LT(vulkan_test::bytes_that_differ(image(true, light), image(false, light), 2), bytes / 200);
  if (!is_nightly()) return;
  light.shading = Shading::Occlusion;
  EXPECT_LT(vulkan_test::bytes_that_differ(image(true, light), image(false, light), 2), bytes / 200);
}

TEST_F(VulkanShapeFaces, StoresFacesCompactly) {
  Yard yard;
  put(yard.scene, vulkan_test::blocky_surfaces(yard.scene));
  const std::size_t textures = renderer_->impl().texels.size();
  const auto before = meshes_->stats();
  // Each face once more: those of models are stored once per chunk.
  const auto doubled = yard.surface();
  const std::size_t own = doubled->shapes.size();
  ASSERT_GT(own, 50U);
  for (std::size_t i = 0; i < own; ++i) doubled->shapes.push_back(ShapeFace(doubled->shapes[i]));
  doubled->opaque_shapes = doubled->shapes.size();
  const SurfaceUpdate update{yard.grid, Yard::kChunk, doubled};
  ASSERT_TRUE(meshes_->put({&update, 1}));
  EXPECT_EQ(meshes_->stats().triangles, before.triangles + 2 * static_cast<std::int64_t>(own));
  EXPECT_LE(meshes_->stats().bytes, before.bytes + 8 * own + 32);
  meshes_->clear();
  EXPECT_EQ(meshes_->stats().bytes, 0U);
  ASSERT_TRUE(meshes_->put({&update, 1}));
  EXPECT_EQ(renderer_->impl().texels.size(), textures);
}

// Meshes of former types stay until they are replaced.
TEST_F(VulkanShapeFaces, DrawsShapesOfTypesThatAreGone) {
  const Yard yard;
  Scene bare;
  Grid grid;
  grid.set({0, 0, 0}, add_type(bare, {150, 140, 130}));
  place(bare, std::move(grid));
  put(bare, vulkan_test::blocky_surfaces(yard.scene));
  const Image image = drawn(towards({9, 8, 14}, {0, 1, 0}), mesh_options(plain_light(64, 48)));
  EXPECT_EQ(image.width, 64);
}

TEST_F(VulkanShapeFaces, RefusesFacesOutOfRange) {
  Yard yard;
  put(yard.scene, {});
  const auto put_changed = [&](const auto& change) {
    const auto surface = yard.surface();
    change(*surface);
    const SurfaceUpdate update{yard.grid, Yard::kChunk, surface};
    const Status done = meshes_->put({&update, 1});
    return done ? ErrorCode::Cancelled : done.error().code;
  };
  constexpr ErrorCode kRefused = ErrorCode::InvalidArgument;
  EXPECT_EQ(put_changed([](ChunkSurface& of) { of.opaque_shapes = of.shapes.size() + 1; }), kRefused);
  EXPECT_EQ(put_changed([](ChunkSurface& of) { of.shapes[0].model = nullptr; }), kRefused);
  EXPECT_EQ(put_changed([](ChunkSurface& of) { of.shapes[0].face = 999; }), kRefused);
}

}  // namespace
}  // namespace quoin
