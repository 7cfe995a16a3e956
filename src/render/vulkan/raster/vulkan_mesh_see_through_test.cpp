// Ray-traced glass: its fragments match the marched image.

#include <optional>
#include <utility>

#include <glm/gtc/quaternion.hpp>

#include "grid/shapes/shape_types_for_tests.h"
#include "render/vulkan/lakeside_for_tests.h"
#include "render/vulkan/raster/glass_yard_for_tests.h"
#include "render/vulkan/raster/mesh_for_tests.h"

namespace quoin {
namespace {

using render_test::add_type;
using render_test::from_above;
using render_test::place;
using render_test::sized;
using render_test::towards;
using vulkan_test::add_glass;
using vulkan_test::blocky_surfaces;
using vulkan_test::bytes_that_differ;
using vulkan_test::glass_yard;
using vulkan_test::glass_yard_options;
using vulkan_test::mesh_options;
using vulkan_test::noise_with_alpha;
using vulkan_test::over_glass_yard;

class VulkanMeshSeeThrough : public vulkan_test::VulkanMeshTest {};

TEST_F(VulkanMeshSeeThrough, GlassYardMatchesCpu) {
  RenderOptions options = glass_yard_options(160, 120);
  compare(glass_yard(), over_glass_yard(), options, "yard_of_glass");
  compare(glass_yard(), towards({30, 14, 70}, {22, 12, 20}, 0.9), options, "yard_of_glass_low");
  Camera slanted = over_glass_yard();
  slanted.projection = Camera::Projection::Orthographic;
  slanted.view_height = 50;
  compare(glass_yard(), slanted, options, "yard_of_glass_slanted");
  compare(glass_yard(), from_above(32, 60, 32, 66), options, "yard_of_glass_above");
  options.light.shadows = false;
  options.light.max_lamps = 0;
  compare(glass_yard(), over_glass_yard(), options, "yard_of_glass_plain_light");
}

TEST_F(VulkanMeshSeeThrough, MatchesCpuFarFromOrigin) {
  const DVec3 far{1e9, -1e9, 1e9};
  compare(glass_yard(far), over_glass_yard(far), glass_yard_options(160, 120), "yard_of_glass_far");
}

// The comparison fails without any one of these features.
TEST_F(VulkanMeshSeeThrough, ComparisonDetectsMissingSurfacesAndDepth) {
  const Scene scene = glass_yard();
  RenderOptions options = glass_yard_options(160, 120);
  put(scene, blocky_surfaces(scene));
  MeshImageOptions meshes = mesh_options(options);
  const Image right = drawn(over_glass_yard(), meshes);
  meshes.light.glass_surfaces = false;
  EXPECT_GT(bytes_that_differ(right, drawn(over_glass_yard(), meshes), 4), 700) << "surfaces";
  meshes = mesh_options(options);
  meshes.glass_by_rays = false;
  EXPECT_GT(bytes_that_differ(right, drawn(over_glass_yard(), meshes), 4), 2500) << "the way through bodies";
}

// Turned, mirrored and scaled instances that intersect or cover each other.
TEST_F(VulkanMeshSeeThrough, OverlappingInstancesMatchCpu) {
  Scene scene = glass_yard();
  const VoxelType amber = add_glass(scene, {240, 170, 60, 60}, 1.4F);
  SceneGrid block;
  block.grid.fill_box({{0, 0, 0}, {14, 8, 10}}, amber);
  Instance turned{
      "", scene.add_grid(std::move(block)), {40, 15, 24}, glm::angleAxis(0.6, glm::normalize(DVec3(0.3, 1, 0.2)))};
  turned.voxel_size = 0.8;
  scene.add_instance(turned);
  turned.position = {12, 7, 14};
  turned.mirrored = true;
  scene.add_instance(turned);
  compare(scene, over_glass_yard(), glass_yard_options(160, 120), "glass_in_glass");
}

// More bodies in a row than a fragment can hold at a time, in one grid and in many.
TEST_F(VulkanMeshSeeThrough, ManyPanesInRowMatchCpu) {
  Scene scene;
  const VoxelType wall = add_type(scene, {200, 180, 150});
  const VoxelType blue = add_glass(scene, {120, 190, 240, 12}, 1.3F);
  const VoxelType rose = add_glass(scene, {240, 180, 190, 12}, 1.5F);
  Grid grid;
  grid.fill_box({{0, 0, 0}, {2, 20, 20}}, wall);
  for (int i = 0; i < 20; ++i) grid.fill_box({{4 + 3 * i, 0, 0}, {5 + 3 * i, 20, 20}}, i % 2 == 0 ? blue : rose);
  place(scene, std::move(grid));
  for (int i = 0; i < 11; ++i) {
    Grid pane;
    pane.fill_box({{0, 0, 0}, {1, 16, 16}}, i % 3 == 0 ? blue : rose);
    place(scene, std::move(pane), {66.5 + 2.0 * i, 2, 2});
  }
  compare(scene, towards({130, 12, 14}, {0, 10, 10}, 0.25), glass_yard_options(160, 120), "many_panes");
}

TEST_F(VulkanMeshSeeThrough, MatchesCpuForUnlitAndPlainGlass) {
  RenderOptions options = glass_yard_options(160, 120);
  options.light.shading = Shading::Unlit;
  compare(glass_yard(), over_glass_yard(), options, "glass_unlit");
  options.light.shading = Shading::UnlitWithOcclusion;
  compare(glass_yard(), over_glass_yard(), options, "glass_unlit_with_occlusion");
  options.light.shading = Shading::Lit;
  options.light.occlusion_mode = OcclusionMode::Off;
  options.light.glass_surfaces = false;
  compare(glass_yard(), over_glass_yard(), options, "glass_without_surfaces");
}

// Stained glass, leaves and cells of faces, in front of each other and behind plain glass; and glass with shapes.
// Nightly only: its shaders take a minute to compile.
TEST_F(VulkanMeshSeeThrough, TexturesAndShapesMatchCpu) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Scene scene;
  const ShapeTypes types(scene.types);
  const auto add = [&](VoxelFaces faces, VoxelShapes shapes = {}) {
    VoxelProperties type{.visibility = Visibility::Transparent};
    type.faces = std::move(faces);
    type.shapes = std::move(shapes);
    return *scene.types.add(type);
  };
  const VoxelFace cutout{.texture = noise_with_alpha(1, 0), .turn = 1, .alpha = FaceAlpha::Cutout};
  const VoxelFace translucent{
      .texture = noise_with_alpha(2, 60), .tint = {255, 180, 90}, .alpha = FaceAlpha::Translucent};
  const VoxelType leaves = add(VoxelFaces(cutout));
  const VoxelType stained = add(VoxelFaces(translucent));
  const VoxelType mixed = add(VoxelFaces(cutout, VoxelFace{render_test::random_texture(16, 3)}, translucent));
  const VoxelType pane = add(VoxelFaces(translucent), VoxelShape::box({0, 0, 7}, {16, 16, 9}));
  const VoxelType glass = add_glass(scene, {120, 200, 230, 90}, 1.5F);
  VoxelProperties ground;
  ground.faces = render_test::random_faces(5);
  Grid cubes;
  cubes.fill_box({{-8, -1, -8}, {9, 0, 9}}, *scene.types.add(ground));
  cubes.fill_box({{-4, 0, -4}, {-1, 3, -1}}, leaves);
  cubes.fill_box({{1, 0, -3}, {5, 2, -1}}, stained);
  cubes.fill_box({{-3, 0, 2}, {0, 2, 4}}, mixed);
  cubes.fill_box({{2, 0, 1}, {4, 2, 4}}, glass);
  cubes.set({2, 1, 2}, leaves);
  cubes.set({-1, 0, 0}, leaves);
  cubes.set({0, 0, 2}, stained);
  cubes.fill_box({{-5, 0, 6}, {1, 4, 7}}, glass);
  Grid shapes;
  shapes.fill_box({{-8, -1, -8}, {9, 0, 9}}, types.stone);
  for (int i = 0; i < 4; ++i) shapes.set({2 * i - 3, 0, -2}, types.stairs, {.state = static_cast<std::uint32_t>(i)});
  shapes.fill_box({{-4, 0, 1}, {0, 2, 2}}, types.pane);
  shapes.fill_box({{1, 0, 1}, {5, 2, 2}}, pane);
  shapes.fill_box({{-3, 0, 4}, {1, 1, 6}}, types.water);
  RenderOptions options = glass_yard_options(160, 120);
  const InstanceHandle first = place(scene, std::move(cubes));
  const Camera camera = towards({6, 5, 11}, {0, 0, 0});
  compare(scene, camera, options, "textured_glass");
  compare(scene, towards({-9, 4, 8}, {0, 1, 0}), options, "textured_glass_aside");
  const Image textured = drawn(camera, mesh_options(vulkan_test::of_day(options)));
  for (const VoxelType type : {leaves, stained, mixed, pane}) {
    VoxelProperties plain = scene.types[type];
    plain.faces = {};
    scene.types.replace(type, plain);
  }
  const RenderedImage plain = render_test::taken(scene, camera, vulkan_test::of_day(options));
  EXPECT_GT(bytes_that_differ(textured, plain.colour, 4), 500);
  scene.remove_instance(first);
  place(scene, std::move(shapes));
  // A mesh also darkens corners inside of voxels, and by shapes.
  options.light.occlusion_mode = OcclusionMode::Off;
  compare(scene, towards({6, 5, 9}, {0, 0, 0}), options, "shapes_behind_glass");
}

// At seams between differently merged quads each pixel is passed once: no pixel is darker than its neighbours.
TEST_F(VulkanMeshSeeThrough, HidesSeamsBetweenQuads) {
  Scene scene;
  const VoxelType stone = add_type(scene, {230, 230, 230});
  const VoxelType water = add_glass(scene, {40, 90, 160, 90}, 1.33F);
  Grid grid;
  grid.fill_box({{0, 0, 0}, {200, 1, 200}}, stone);
  grid.fill_box({{0, 1, 0}, {200, 5, 200}}, water);
  place(scene, std::move(grid));
  RenderOptions options = vulkan_test::of_day(glass_yard_options(200, 150));
  options.light.shadows = false;
  options.light.max_lamps = 0;
  const Camera camera = towards({100.3, 60.2, 230.7}, {100, 0, 100}, 0.7);
  put(scene, blocky_surfaces(scene, false));
  const Image single = drawn(camera, mesh_options(options));
  put(scene, blocky_surfaces(scene, true));
  EXPECT_EQ(bytes_that_differ(single, drawn(camera, mesh_options(options)), 2), 0);
}

// The renderer does not know another scene at the address of a former one.
TEST_F(VulkanMeshSeeThrough, DetectsNewSceneAtSameAddress) {
  std::optional<Scene> scene(glass_yard());
  ASSERT_TRUE(renderer_->update(*scene));
  ASSERT_TRUE(meshes_->update(*scene));
  ASSERT_TRUE(meshes_->put(blocky_surfaces(*scene)));
  VulkanImage image(*renderer_);
  const MeshImageOptions options = mesh_options(glass_yard_options(32, 32));
  EXPECT_TRUE(meshes_->draw(image, over_glass_yard(), options));
  scene.emplace(glass_yard());
  ASSERT_TRUE(meshes_->update(*scene));
  ASSERT_TRUE(meshes_->put(blocky_surfaces(*scene)));
  EXPECT_EQ(meshes_->draw(image, over_glass_yard(), options).error().code, ErrorCode::InvalidArgument);
  meshes_->clear();
}

TEST_F(VulkanMeshSeeThrough, RequiresVoxelsForGlass) {
  const Scene scene = glass_yard();
  ASSERT_TRUE(meshes_->update(scene));
  VulkanImage image(*renderer_);
  MeshImageOptions options = mesh_options(glass_yard_options(32, 32));
  options.light.shadows = false;
  options.light.max_lamps = 0;
  EXPECT_TRUE(meshes_->draw(image, over_glass_yard(), options)) << "nothing of glass is there";
  ASSERT_TRUE(meshes_->put(blocky_surfaces(scene)));
  const Status refused = meshes_->draw(image, over_glass_yard(), options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
  options.light.shading = Shading::Normals;
  EXPECT_TRUE(meshes_->draw(image, over_glass_yard(), options)) << "values are not seen through";
  options.light.shading = Shading::Lit;
  options.glass_by_rays = false;
  EXPECT_TRUE(meshes_->draw(image, over_glass_yard(), options));
  ASSERT_TRUE(renderer_->update(scene));
  options.glass_by_rays = true;
  EXPECT_TRUE(meshes_->draw(image, over_glass_yard(), options));
  meshes_->clear();
}

// Glass dims the edges of objects behind it, and has edges of its own.
TEST_F(VulkanMeshSeeThrough, ShowsEdgesThroughGlass) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Scene scene;
  const VoxelType wall = add_type(scene, {230, 230, 230});
  const VoxelType glass = add_glass(scene, {120, 160, 220, 60}, 1.3F);
  Grid grid;
  grid.fill_box({{0, 0, 0}, {20, 20, 1}}, wall);
  grid.fill_box({{2, 2, 6}, {18, 18, 8}}, glass);
  place(scene, std::move(grid));
  put(scene, blocky_surfaces(scene, false));
  MeshImageOptions options = mesh_options(glass_yard_options(200, 200));
  options.light.shadows = false;
  Camera camera = from_above(10, 0, 0, 14);
  camera.position = {10.03, 10.02, 40};
  camera.forward = {0, 0, -1};
  camera.up = {0, 1, 0};
  const Image plain = drawn(camera, options);
  options.wireframe = Wireframe::Over;
  const Image edges = drawn(camera, options);
  EXPECT_GT(bytes_that_differ(plain, edges, 20), 3000);
}

// Impostors of distant instances have no glass, so its quads are drawn from the meshes.
TEST_F(VulkanMeshSeeThrough, DrawsGlassOfFarInstances) {
  Scene scene;
  const VoxelType glass = add_type(scene, {90, 120, 220, 120}, Visibility::Transparent);
  const VoxelType stone = add_type(scene, {200, 180, 150});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {40, 4, 40}}, stone);
  grid.fill_box({{0, 4, 0}, {40, 30, 1}}, glass);
  place(scene, std::move(grid));
  put(scene, blocky_surfaces(scene, false));
  const Camera camera = towards({20, 40, 300}, {20, 10, 0}, 0.3);
  RenderOptions options = vulkan_test::with_mesh_light(sized(256, 192));
  options.detail.policy.emplace().rule = DetailPolicy::Rule::ByRadius;
  options.detail.policy->near_radii = options.detail.policy->mid_radii = 0.0;
  options.detail.policy->cell_pixels = 1.0;
  options = vulkan_test::of_day(options);
  const Image far = drawn(camera, mesh_options(options));
  options.detail.policy.reset();
  const Image whole = drawn(camera, mesh_options(options));
  const int different = bytes_that_differ(far, whole, 3);
  EXPECT_LE(different * 100, static_cast<int>(far.rgb.size()));
}

// Views of the middles of glass walls, two voxels across: where bodies are smooth, no edge is near enough to be
// visible. Through the pane onto the red block; through the cube into the air; into the pool where it is 7 deep;
// through the two touching bodies.
std::vector<Camera> onto_walls() {
  constexpr double kNarrow = 0.03;
  return {towards({20, 19, 110}, {15, 15, 44}, kNarrow), towards({110, 22, 16}, {48, 18, 12}, kNarrow),
          towards({12, 70, 36}, {10, 9, 26.5}, kNarrow), towards({110, 16, 36}, {46, 15, 35}, kNarrow)};
}

// Counts pixels that differ by more than 4 of 255 from the marched image, over all views of walls.
int different_walls(const std::vector<Image>& images, const std::vector<Image>& marched) {
  int different = 0;
  for (std::size_t view = 0; view < images.size(); ++view) {
    RenderedImage a;
    RenderedImage b;
    a.colour = images[view];
    b.colour = marched[view];
    different += render_test::count_different(a, b, 4);
  }
  return different;
}

// Compares marched walls, walls of blocks and walls of smooth bodies, in light without occlusion, since smooth surfaces
// have their own.
TEST_F(VulkanMeshSeeThrough, WallsMatchMarchedWalls) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  const Scene scene = glass_yard();
  RenderOptions options = glass_yard_options(48, 36);
  options.light.occlusion_mode = OcclusionMode::Off;
  std::vector<Image> marched;
  for (const Camera& camera : onto_walls()) marched.push_back(render_test::taken(scene, camera, options).colour);
  const int all = 48 * 36 * static_cast<int>(marched.size());
  for (const SurfaceStyle style : {SurfaceStyle::Blocky, SurfaceStyle::Smooth}) {
    const std::string name = style == SurfaceStyle::Blocky ? "blocky" : "smooth";
    meshes_->clear();
    put(scene, vulkan_test::live_surfaces(scene, style));
    const auto views = [&](const MeshImageOptions& meshes) {
      std::vector<Image> images;
      for (const Camera& camera : onto_walls()) images.push_back(drawn(camera, meshes));
      return images;
    };
    MeshImageOptions meshes = mesh_options(options);
    const std::vector<Image> right = views(meshes);
    EXPECT_EQ(different_walls(right, marched), 0) << name;
    for (std::size_t i = 0; i < right.size() && ::testing::Test::HasFailure(); ++i) {
      const std::string view = QUOIN_BINARY_DIR "/walls_" + name + std::to_string(i);
      EXPECT_TRUE(write_png(right[i], view + ".vulkan.png"));
      EXPECT_TRUE(write_png(marched[i], view + ".cpu.png"));
    }
    meshes.light.glass_surfaces = false;
    EXPECT_GT(different_walls(views(meshes), marched) * 4, all) << name << " without surfaces";
    meshes = mesh_options(options);
    meshes.glass_by_rays = false;
    EXPECT_GT(different_walls(views(meshes), marched) * 2, all) << name << " without depth";
  }
}

// Pixels at shores and silhouettes differ: a mesh interpolates the normals of its vertices.
TEST_F(VulkanMeshSeeThrough, LakesAndBallsOfFieldsMatchCpu) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Scene scene;
  const vulkan_test::FieldTypes types = vulkan_test::add_field_types(scene);
  const VoxelType water = vulkan_test::add_water(scene);
  scene.add_instance({"", scene.add_grid(vulkan_test::lakeside(types, water)), DVec3(0.0)});
  RenderOptions options = glass_yard_options(120, 90);
  options.light.occlusion_mode = OcclusionMode::Off;
  put(scene, vulkan_test::live_surfaces(scene, SurfaceStyle::Smooth));
  const Camera camera = towards({110, 70, 130}, {10, 0, 10});
  const RenderedImage marched = render_test::taken(scene, camera, options);
  const auto shown = [&] {
    RenderedImage image;
    image.colour = drawn(camera, mesh_options(options));
    return image;
  };
  const int all = 120 * 90;
  const RenderedImage clear = shown();
  EXPECT_LT(render_test::count_different(clear, marched, 4) * 100, 10 * all);
  EXPECT_LT(render_test::count_different(clear, marched, 16) * 100, 4 * all);
  // As before: one opaque surface.
  VoxelProperties opaque = scene.types[water];
  opaque.visibility = Visibility::Opaque;
  scene.types.replace(water, opaque);
  put(scene, vulkan_test::live_surfaces(scene, SurfaceStyle::Smooth));
  EXPECT_GT(render_test::count_different(shown(), marched, 16) * 100, 7 * all);
}

}  // namespace
}  // namespace quoin
