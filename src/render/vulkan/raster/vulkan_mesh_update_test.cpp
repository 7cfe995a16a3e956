// Adding and removing surfaces; invalid surfaces are rejected.

#include <algorithm>
#include <cmath>
#include <random>

#include <glm/vec2.hpp>

#include "render/cpu/environment_for_tests.h"
#include "render/vulkan/raster/mesh_for_tests.h"

namespace quoin {
namespace {

using render_test::add_type;
using render_test::place;
using render_test::sized;
using render_test::towards;
using vulkan_test::blocky_surface;
using vulkan_test::blocky_surfaces;
using vulkan_test::byte_at;
using vulkan_test::mesh_options;
using vulkan_test::without_shadows;

class VulkanMeshUpdate : public vulkan_test::VulkanMeshTest {
 protected:
  void expect_error(const Status& status, ErrorCode code, const std::string& message) {
    ASSERT_FALSE(status) << message;
    EXPECT_EQ(status.error().code, code);
    EXPECT_NE(status.error().message.find(message), std::string::npos) << status.error().message;
  }
};

// Returns two boxes, in the chunks (0, 0, 0) and (2, 0, 0).
Scene boxes() {
  Scene scene;
  const VoxelType red = add_type(scene, {200, 40, 40});
  Grid grid;
  grid.fill_box({{10, 10, 10}, {30, 30, 30}}, red);
  grid.fill_box({{138, 10, 10}, {158, 30, 30}}, red);
  place(scene, std::move(grid));
  return scene;
}
Camera before_boxes() {
  return towards({84, 40, 220}, {84, 20, 20});
}

TEST_F(VulkanMeshUpdate, ReplacesAndRemovesSurfaces) {
  Scene scene = boxes();
  const RenderOptions options = without_shadows(sized(160, 90));
  compare(scene, before_boxes(), options, "two_boxes");
  EXPECT_EQ(meshes_->stats().chunks, 2U);
  EXPECT_EQ(meshes_->stats().triangles, 24);
  EXPECT_EQ(meshes_->stats().bytes, 2U * 64U) << "six quads of 8 bytes, in places of multiples of 32";
  SurfaceUpdate update = blocky_surfaces(scene)[0];
  Grid& grid = scene.edit(update.grid).grid;
  const auto expect_current = [&](const std::string& name) {
    vulkan_test::VulkanMeshTest::expect_like(drawn(before_boxes(), mesh_options(options)),
                                             render_test::taken(scene, before_boxes(), options), name);
  };
  grid.fill_box({{10, 30, 10}, {15, 41, 15}}, 1);
  update.surface = blocky_surface(grid, scene.types, {0, 0, 0});
  ASSERT_TRUE(meshes_->put(std::vector{update}));
  expect_current("replaced");
  EXPECT_EQ(meshes_->stats().chunks, 2U);
  grid.fill_box({{0, 0, 0}, {64, 64, 64}}, kAir);
  update.surface = nullptr;
  ASSERT_TRUE(meshes_->put(std::vector{update, update}));
  expect_current("removed");
  EXPECT_EQ(meshes_->stats().chunks, 1U);
  EXPECT_EQ(meshes_->stats().drawn_triangles, 8) << "of four directions: the camera is between top and bottom";
  meshes_->clear();
  EXPECT_EQ(meshes_->stats().chunks, 0U);
  EXPECT_EQ(meshes_->stats().bytes, 0U);
}

TEST_F(VulkanMeshUpdate, LastUpdateOfChunkApplies) {
  const Scene scene = boxes();
  const std::vector<SurfaceUpdate> right = blocky_surfaces(scene);
  SurfaceUpdate wrong = right[0];
  Grid other;
  other.fill_box({{0, 0, 0}, {61, 61, 61}}, 1);
  wrong.surface = blocky_surface(other, scene.types, {0, 0, 0});
  const RenderOptions options = without_shadows(sized(160, 90));
  put(scene, {wrong, right[0], wrong, right[0], right[1]});
  expect_like(drawn(before_boxes(), mesh_options(options)), render_test::taken(scene, before_boxes(), options), "last");
  EXPECT_EQ(meshes_->stats().chunks, 2U);
}

TEST_F(VulkanMeshUpdate, InstancesFollowTheScene) {
  Scene scene = boxes();
  const RenderOptions options = without_shadows(sized(160, 90));
  const std::vector<SurfaceUpdate> surfaces = blocky_surfaces(scene);
  put(scene, surfaces);
  Instance second{"", surfaces[0].grid, {0, 30, -50}};
  const InstanceHandle handle = scene.add_instance(second);
  const auto expect_current = [&](const std::string& name) {
    ASSERT_TRUE(meshes_->update(scene));
    expect_like(drawn(before_boxes(), mesh_options(options)), render_test::taken(scene, before_boxes(), options), name);
  };
  expect_current("two_instances");
  scene.edit(handle).position = {0, -40, 0};
  expect_current("moved");
  VoxelProperties green = scene.types[1];
  green.colour = {30, 160, 50, 255};
  scene.types.replace(1, green);
  expect_current("recoloured");
  scene.edit(handle).visible = false;
  const Image hidden = (expect_current("hidden"), drawn(before_boxes(), mesh_options(options)));
  ASSERT_TRUE(meshes_->update(scene, InstanceFilter::All));
  EXPECT_NE(drawn(before_boxes(), mesh_options(options)).rgb, hidden.rgb);
  scene.remove_grid(surfaces[0].grid);
  expect_current("no_grid");
}

TEST_F(VulkanMeshUpdate, ExtremeInstancesDisturbNoOthers) {
  Scene scene = boxes();
  const GridHandle grid = blocky_surfaces(scene)[0].grid;
  for (const double far : {1e30, 1e150, 1e300, -1.7e308}) scene.add_instance({"", grid, {84, 40, far}});
  Instance large{"", grid, {0, 0, 1e6}};
  large.voxel_size = 1e300;
  scene.add_instance(large);
  Instance no_place{"", grid, {0, NAN, 0}};
  scene.add_instance(no_place);
  Camera camera = before_boxes();
  const MeshImageOptions options = mesh_options(without_shadows(sized(160, 90)));
  const Scene alone = boxes();
  for (const auto projection : {Camera::Projection::Perspective, Camera::Projection::Orthographic}) {
    camera.projection = projection;
    camera.view_height = 150;
    meshes_->clear();
    put(alone, blocky_surfaces(alone));
    const Image expected = drawn(camera, options);
    put(scene, blocky_surfaces(scene));
    const Image image = drawn(camera, options);
    int different = 0;
    for (std::size_t i = 0; i < image.rgb.size(); i += 3) different += image.rgb[i] != expected.rgb[i];
    EXPECT_LE(different, 10) << "orthographic " << static_cast<int>(projection);
  }
}

TEST_F(VulkanMeshUpdate, ImagesTakeTheSizeOfEachDrawing) {
  const Scene scene = boxes();
  put(scene, blocky_surfaces(scene));
  VulkanImage rendered(*renderer_);
  EXPECT_FALSE(rendered.read());
  for (const glm::ivec2 size : {glm::ivec2(33, 7), glm::ivec2(200, 100), glm::ivec2(1, 1), glm::ivec2(64, 64)}) {
    const RenderOptions options = without_shadows(sized(size.x, size.y));
    MeshImageOptions mesh = mesh_options(options);
    mesh.samples = size.x % 2 == 0 ? 4 : 1;
    ASSERT_TRUE(meshes_->draw(rendered, before_boxes(), mesh));
    EXPECT_EQ(rendered.width(), size.x);
    EXPECT_EQ(rendered.height(), size.y);
    EXPECT_EQ(rendered.samples(), mesh.samples);
    EXPECT_EQ(rendered.rays(), 0);
    const Image image = rendered.read().value();
    EXPECT_EQ(image.rgb.size(), 3U * static_cast<std::size_t>(size.x * size.y));
    const Vec3 middle = byte_at(image, size.x / 2, 0);
    EXPECT_GT(middle.z, 100.0F) << "sky";
  }
}

TEST_F(VulkanMeshUpdate, DrawsFromInsideAndNearFaces) {
  const Scene scene = boxes();
  put(scene, blocky_surfaces(scene));
  const MeshImageOptions options = mesh_options(without_shadows(sized(32, 32)));
  drawn(towards({20, 20, 20}, {21, 20, 20}), options);
  // Two thousandths of a voxel in front of a face are not too near.
  const Image near = drawn(towards({20, 30.002, 20}, {20.001, 20, 20}), options);
  EXPECT_EQ(byte_at(near, 16, 16), byte_at(near, 2, 29));
}

TEST_F(VulkanMeshUpdate, AddsReplacesAndRemovesManyChunks) {
  Scene scene;
  add_type(scene, {200, 40, 40});
  const GridHandle grid = scene.add_grid({});
  scene.add_instance({"", grid});
  const unsigned seed = 8;
  std::mt19937 random(seed);
  std::size_t bytes = 0;
  std::vector<SurfaceUpdate> updates;
  for (int round = 0; round < 3; ++round) {
    updates.clear();
    bytes = 0;
    for (int i = 0; i < 10'000; ++i) {
      const auto surface = std::make_shared<ChunkSurface>();
      surface->quads.resize(1 + random() % 300, Quad{std::uint64_t{1} << Quad::kTypeShift});
      surface->opaque_quads = surface->quads.size();
      bytes += (surface->quads.size() * sizeof(Quad) + 31) / 32 * 32;
      updates.push_back({grid, {i % 100, i / 100, 0}, surface});
    }
    std::shuffle(updates.begin(), updates.end(), random);
    put(scene, updates);
    EXPECT_EQ(meshes_->stats().chunks, 10'000U);
    EXPECT_EQ(meshes_->stats().bytes, bytes) << "seed " << seed;
  }
  for (SurfaceUpdate& update : updates) update.surface = nullptr;
  put(scene, updates);
  EXPECT_EQ(meshes_->stats().chunks, 0U);
  EXPECT_EQ(meshes_->stats().bytes, 0U);
  EXPECT_EQ(meshes_->stats().triangles, 0);
}

TEST_F(VulkanMeshUpdate, RejectsInvalidSurfacesWithoutChanges) {
  const Scene scene = boxes();
  std::vector<SurfaceUpdate> surfaces = blocky_surfaces(scene);
  put(scene, surfaces);
  const auto expect_refused = [&](std::shared_ptr<ChunkSurface> surface, const std::string& message) {
    surfaces[1].surface = std::move(surface);
    expect_error(meshes_->put(surfaces), ErrorCode::InvalidArgument, message);
    EXPECT_EQ(meshes_->stats().triangles, 24);
  };
  const auto blocky = blocky_surface(scene.grids()[surfaces[0].grid].grid, scene.types, {2, 0, 0});
  blocky->opaque_quads = 7;
  expect_refused(blocky, "surface: more opaque quads than quads");
  DensityGrid field;
  field.add_sphere({32, 32, 32}, 10, 1);
  const auto smooth = [&] { return vulkan_test::smooth_surface(field, scene.types, {0, 0, 0}); };
  const auto short_albedo = smooth();
  short_albedo->albedo.pop_back();
  expect_refused(short_albedo, "surface: its vertex arrays have different lengths");
  const auto outside = smooth();
  outside->smooth.indices.data()[5] = static_cast<std::uint32_t>(outside->types.size());
  expect_refused(outside, "surface: an index is out of range");
  surfaces[1].surface = smooth();
  EXPECT_TRUE(meshes_->put(surfaces));
}

TEST_F(VulkanMeshUpdate, RejectsInvalidImages) {
  const Scene scene = boxes();
  put(scene, blocky_surfaces(scene));
  VulkanImage image(*renderer_);
  const MeshImageOptions right = mesh_options(without_shadows(sized(16, 16)));
  const auto expect_refused = [&](const Camera& camera, const MeshImageOptions& options, const std::string& message) {
    expect_error(meshes_->draw(image, camera, options), ErrorCode::InvalidArgument, message);
  };
  const auto with = [&](auto change) {
    MeshImageOptions options = right;
    change(options);
    return options;
  };
  const Camera camera = before_boxes();
  expect_refused(camera, with([](auto& o) { o.width = 0; }), "size: width and height must be positive");
  expect_refused(camera, with([](auto& o) { o.height = -4; }), "size: width and height must be positive");
  expect_refused(camera, with([](auto& o) { o.width = o.height = 1 << 20; }), "size: more than");
  expect_refused(camera, with([](auto& o) { o.width = 1 << 24; }), "draws meshes of at most");
  for (const int samples : {0, 3, -1, 16}) {
    expect_refused(camera, with([=](auto& o) { o.samples = samples; }), "samples: must be 1, 2, 4 or 8 for meshes");
  }
  expect_refused(camera, with([](auto& o) { environment_in(o).sun.direction = DVec3(0.0); }), "sun");
  Camera wrong = camera;
  wrong.up *= 2.0;
  expect_refused(wrong, right, "camera: directions must be unit vectors");
  wrong.up = wrong.right;
  expect_refused(wrong, right, "camera: directions must not lie in one plane");
  auto other = VulkanRenderer::create();
  ASSERT_TRUE(other);
  VulkanImage elsewhere(*other);
  expect_error(meshes_->draw(elsewhere, camera, right), ErrorCode::InvalidArgument, "belongs to another renderer");
  EXPECT_TRUE(meshes_->draw(image, camera, right));
}

}  // namespace
}  // namespace quoin
