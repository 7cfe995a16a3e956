// Transparent surfaces, drawn face by face from back to front.

#include <algorithm>
#include <cmath>

#include "render/vulkan/raster/mesh_for_tests.h"
#include "tests/golden_views.h"

namespace quoin {
namespace {

using render_test::add_type;
using render_test::place;
using render_test::sized;
using render_test::towards;
using vulkan_test::blocky_surface;
using vulkan_test::blocky_surfaces;
using vulkan_test::mesh_options;
using vulkan_test::without_shadows;

class VulkanMeshGlass : public vulkan_test::VulkanMeshTest {
 protected:
  /// Compares glass as single faces and glass by rays with the CPU's image: for panes of one voxel they are equal.
  void compare_both(const Scene& scene, const Camera& camera, const RenderOptions& options, const std::string& name) {
    const RenderedImage cpu = render_test::taken(scene, camera, options);
    meshes_->clear();
    put(scene, blocky_surfaces(scene));
    MeshImageOptions meshes = mesh_options(options);
    expect_like(drawn(camera, meshes), cpu, name + "_by_rays");
    meshes.glass_by_rays = false;
    expect_like(drawn(camera, meshes), cpu, name);
  }
};

struct Types {
  VoxelType wall, blue, red, glowing;
};

Types add_types(Scene& scene) {
  return {add_type(scene, {200, 180, 150}), add_type(scene, {60, 140, 230, 90}, Visibility::Transparent),
          add_type(scene, {220, 40, 30, 150}, Visibility::Transparent),
          add_type(scene, {255, 220, 120, 100}, Visibility::Transparent, 0.5F)};
}

// Looks towards -Z; every ray passes straight through a pane.
Camera straight(DVec3 position, double view_height) {
  Camera camera;
  camera.position = position;
  camera.projection = Camera::Projection::Orthographic;
  camera.view_height = view_height;
  return camera;
}

// A wall with panes in front of it, the farthest first, each one voxel thick and 40 voxels apart: in separate chunks.
Scene panes(const std::vector<VoxelType Types::*>& panes) {
  Scene scene;
  const Types types = add_types(scene);
  Grid grid;
  grid.fill_box({{0, 0, -5}, {40, 40, 0}}, types.wall);
  grid.fill_box({{0, 20, 0}, {40, 21, 1}}, types.wall);
  int z = 10;
  for (const auto type : panes) {
    grid.fill_box({{4, 4, z}, {36, 36, z + 1}}, types.*type);
    z += 70;
  }
  place(scene, std::move(grid));
  return scene;
}

TEST_F(VulkanMeshGlass, OneVoxelPanesMatchCpu) {
  RenderOptions options = vulkan_test::of_day(without_shadows(sized(120, 120)));
  const Camera camera = straight({20.03, 20.02, 500}, 44);
  for (const bool is_lit : {true, false}) {
    options.light.shading = is_lit ? Shading::Lit : Shading::Unlit;
    const std::string name = is_lit ? "lit" : "unlit";
    const auto expect_same = [&](const std::vector<VoxelType Types::*>& types, const std::string& which) {
      compare_both(panes(types), camera, options, which + name);
    };
    expect_same({&Types::blue}, "pane_");
    expect_same({&Types::blue, &Types::red}, "blue_red_");
    expect_same({&Types::red, &Types::blue}, "red_blue_");
    expect_same({&Types::glowing, &Types::red, &Types::glowing}, "glowing_");
  }
}

// A pane behind two bars. Only the upper bar darkens the corners next to it.
TEST_F(VulkanMeshGlass, TypesThatDoNotOccludeMatchCpu) {
  Scene scene;
  const Types types = add_types(scene);
  const auto bar = scene.types.add({.name = "bar", .colour = {90, 90, 90, 255}, .occludes = false});
  ASSERT_TRUE(bar);
  Grid grid;
  grid.fill_box({{0, 0, -5}, {20, 20, 0}}, types.wall);
  grid.fill_box({{0, 9, 0}, {20, 10, 1}}, *bar);
  grid.fill_box({{4, 4, 10}, {16, 16, 11}}, types.blue);
  grid.fill_box({{4, 6, 11}, {16, 7, 12}}, *bar);
  grid.fill_box({{4, 12, 11}, {16, 13, 12}}, types.wall);
  place(scene, std::move(grid));
  RenderOptions options = vulkan_test::of_day(without_shadows(sized(80, 80)));
  options.light.occlusion_mode = OcclusionMode::Vertex;
  compare_both(scene, straight({10.03, 10.02, 50}, 26), options, "bars");
}

TEST_F(VulkanMeshGlass, OrdersGlassByCamera) {
  Scene scene;
  const Types types = add_types(scene);
  const auto pane = [&](VoxelType type, double z) {
    Grid grid;
    grid.fill_box({{0, 0, 0}, {20, 20, 1}}, type);
    place(scene, std::move(grid), {0, 0, z});
  };
  pane(types.red, 10);
  pane(types.blue, 0);
  pane(types.glowing, 5);
  const RenderOptions options = without_shadows(sized(80, 80));
  compare_both(scene, straight({10.03, 10.02, 50}, 26), options, "panes_before");
  Camera behind = straight({10.03, 10.02, -50}, 26);
  behind.forward = {0, 0, 1};
  behind.right = {-1, 0, 0};
  compare_both(scene, behind, options, "panes_behind");
  compare_both(scene, towards({12, 11, 400}, {10, 10, 5}, 0.06), options, "panes_perspective");
}

TEST_F(VulkanMeshGlass, SolidVoxelsHideGlassBehindThem) {
  Scene scene;
  const Types types = add_types(scene);
  Grid grid;
  grid.fill_box({{0, 0, 0}, {20, 20, 1}}, types.red);
  grid.fill_box({{0, 0, 10}, {10, 20, 11}}, types.wall);
  place(scene, std::move(grid));
  compare_both(scene, straight({10.03, 10.02, 50}, 26), without_shadows(sized(80, 80)), "hidden_pane");
}

// Drawn face by face, water of any depth differs from the CPU's, which counts its voxels; all other pixels match.
TEST_F(VulkanMeshGlass, MatchesCpuExceptThroughGlass) {
  Scene scene = golden::terrain_scene();
  const golden::GoldenView& view = golden::kViews[0];
  const Camera camera = golden::camera_for(view);
  const RenderOptions options = without_shadows(golden::options_for(view));
  put(scene, blocky_surfaces(scene));
  MeshImageOptions by_faces = mesh_options(options);
  by_faces.glass_by_rays = false;
  const Image image = drawn(camera, by_faces);
  const RenderedImage cpu = render_test::taken(scene, camera, options);
  // Gives water another colour to identify it.
  for (std::size_t type = 1; type < scene.types.size(); ++type) {
    VoxelProperties properties = scene.types[static_cast<VoxelType>(type)];
    if (properties.visibility != Visibility::Transparent) continue;
    properties.colour = {255, 0, 255, properties.colour.a};
    scene.types.replace(static_cast<VoxelType>(type), properties);
  }
  const RenderedImage marked = render_test::taken(scene, camera, options);
  int waters = 0;
  RenderedImage mesh;
  mesh.colour = image;
  mesh.depth = cpu.depth;
  for (std::size_t i = 0; i < cpu.colour.rgb.size(); i += 3) {
    const auto at = [&](const RenderedImage& rendered) {
      return std::vector(&rendered.colour.rgb[i], &rendered.colour.rgb[i] + 3);
    };
    if (at(cpu) == at(marked)) continue;
    ++waters;
    std::copy_n(&cpu.colour.rgb[i], 3, &mesh.colour.rgb[i]);
  }
  EXPECT_GT(waters, 1000);
  expect_like(mesh.colour, cpu, "beside_water");
  if (std::getenv("QUOIN_WRITE_VULKAN") != nullptr) {
    EXPECT_TRUE(write_png(image, QUOIN_BINARY_DIR "/mesh_water.vulkan.png"));
  }
}

TEST_F(VulkanMeshGlass, DrawsTooManyQuadsByChunk) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  const Scene shown = panes({&Types::red, &Types::blue, &Types::glowing});
  MeshImageOptions options = mesh_options(without_shadows(sized(120, 120)));
  options.glass_by_rays = false;
  const Camera camera = straight({20.03, 20.02, 500}, 44);
  std::vector<SurfaceUpdate> surfaces = blocky_surfaces(shown);
  put(shown, surfaces);
  const Image sorted = drawn(camera, options);
  EXPECT_LT(meshes_->stats().drawn_triangles, 1000);
  // A million quads that face away.
  Grid back;
  constexpr VoxelType kRed = 3;  // the third type that was added
  back.set({30, 30, 30}, kRed);
  const auto surface = blocky_surface(back, shown.types, {0, 0, 0});
  ASSERT_EQ(surface->opaque_quads, 0U);
  const auto away = std::find_if(surface->quads.begin(), surface->quads.end(),
                                 [](const Quad& quad) { return quad.direction() == Direction::NegZ; });
  ASSERT_NE(away, surface->quads.end());
  surface->quads = QuadBuffer((1 << 20) + 1, Quad(*away));
  surfaces.push_back({surfaces[0].grid, {0, 0, 3}, surface});
  put(shown, surfaces);
  const Image by_chunk = drawn(camera, options);
  EXPECT_GT(meshes_->stats().drawn_triangles, 1 << 21);
  EXPECT_EQ(by_chunk.rgb, sorted.rgb);
}

}  // namespace
}  // namespace quoin
