// Meshes have no holes, face the right way, and have the right position.

#include <cmath>
#include <optional>
#include <random>

#include <glm/gtc/quaternion.hpp>

#include "render/vulkan/raster/mesh_for_tests.h"

namespace quoin {
namespace {

using render_test::add_type;
using render_test::from_above;
using render_test::place;
using render_test::sized;
using render_test::towards;
using vulkan_test::blocky_surfaces;
using vulkan_test::byte_at;
using vulkan_test::mesh_options;
using vulkan_test::smooth_surfaces;

class VulkanMeshShape : public vulkan_test::VulkanMeshTest {};

int pixels_that_are_not(const Image& image, std::uint8_t byte) {
  int count = 0;
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
    count += image.rgb[i] != byte || image.rgb[i + 1] != byte || image.rgb[i + 2] != byte;
  }
  return count;
}

// A white room in white stone across eight chunks, with small bumps on flat walls: merged faces of all sizes, with
// corners on the edges of others.
Scene white_room(std::mt19937& random) {
  Scene scene;
  const VoxelType white = add_type(scene, {255, 255, 255});
  Grid grid;
  grid.fill_box({{-48, -48, -48}, {48, 48, 48}}, white);
  grid.fill_box({{-40, -40, -40}, {40, 40, 40}}, kAir);
  const auto within = [&](int low, int high) {
    return low + static_cast<int>(random() % static_cast<unsigned>(high - low + 1));
  };
  for (int i = 0; i < 3000; ++i) {
    IVec3 at{within(-40, 39), within(-40, 39), within(-40, 39)};
    const int axis = within(0, 2);
    at[axis] = within(0, 1) == 0 ? -40 : 39;
    grid.set(at, white);
  }
  place(scene, std::move(grid));
  return scene;
}

TEST_F(VulkanMeshShape, MergedFacesHaveNoHoles) {
  const unsigned seed = 5;
  std::mt19937 random(seed);
  const Scene scene = white_room(random);
  put(scene, blocky_surfaces(scene));
  MeshImageOptions options = mesh_options(sized(320, 180));
  options.light.shading = Shading::Unlit;
  std::uniform_real_distribution<double> anywhere(-36, 36);
  int holes = 0;
  for (int i = 0; i < 40; ++i) {
    const DVec3 eye{anywhere(random), anywhere(random), anywhere(random)};
    const DVec3 target{anywhere(random), anywhere(random), anywhere(random)};
    holes += pixels_that_are_not(drawn(towards(eye, target, 1.2), options), 255);
  }
  if (std::getenv("QUOIN_WRITE_VULKAN") != nullptr) std::printf("%d holes\n", holes);
  EXPECT_EQ(holes, 0) << "seed " << seed;
}

// Returns the normal that a sphere's image shows at a pixel; nullopt at and outside its rim.
std::optional<DVec3> normal_at(const Camera& camera, int x, int y, DVec3 centre, double radius) {
  const Ray ray = ray_through(camera, {x + 0.5, y + 0.5, 160, 160});
  const DVec3 to_centre = centre - ray.origin;
  const double along = glm::dot(to_centre, ray.direction);
  const double squared = glm::dot(to_centre, to_centre) - along * along;
  if (squared > radius * radius * 0.97) return std::nullopt;
  const DVec3 at = ray.origin + ray.direction * (along - std::sqrt(radius * radius - squared));
  return (at - centre) / radius;
}

TEST_F(VulkanMeshShape, SmoothSpheresHaveSphereNormals) {
  Scene scene;
  const VoxelType stone = add_type(scene, {200, 60, 40});
  DensityGrid field;
  field.add_sphere({64, 64, 64}, 30, stone);  // across eight chunks
  SceneGrid grid;
  grid.pivot = {64.5, 64.5, 64.5};  // sample (i, j, k) is the centre of a voxel
  const GridHandle handle = scene.add_grid(std::move(grid));
  Instance instance{"", handle, {5, 6, 7}, glm::angleAxis(0.7, glm::normalize(DVec3(1, 2, 0.5)))};
  instance.voxel_size = 0.5;
  const InstanceHandle placed = scene.add_instance(instance);
  MeshImageOptions options = mesh_options(sized(160, 160));
  options.light.shading = Shading::Normals;
  const Camera camera = towards({40, 30, 50}, {5, 6, 7}, 0.6);
  for (const bool mirrored : {false, true}) {
    scene.edit(placed).mirrored = mirrored;
    put(scene, smooth_surfaces(handle, field, scene.types));
    const Image image = drawn(camera, options);
    int inside = 0;
    float most = 0.0F;
    for (int y = 0; y < 160; ++y) {
      for (int x = 0; x < 160; ++x) {
        const auto normal = normal_at(camera, x, y, {5, 6, 7}, 15.0);
        if (!normal) continue;
        ++inside;
        const Vec3 expected = 255.0F * (0.5F + 0.5F * Vec3(*normal));
        const Vec3 off = glm::abs(byte_at(image, x, y) - expected);
        most = std::max({most, off.x, off.y, off.z});
      }
    }
    EXPECT_GT(inside, 4000);
    EXPECT_LT(most, 3.0F) << "mirrored " << mirrored;
  }
}

// Sample (i, j, k) of a field is the point (i, j, k) of its grid, as in marched images.
TEST_F(VulkanMeshShape, FieldsLieAtTheirSamples) {
  Scene scene;
  const VoxelType stone = add_type(scene, {200, 60, 40});
  SceneGrid grid;
  grid.field.add_sphere({64, 64, 64}, 20, stone);  // across eight chunks
  grid.pivot = {64, 64, 64};
  Instance instance{"", scene.add_grid(std::move(grid)), {5, 6, 7}};
  instance.voxel_size = 0.75;
  scene.add_instance(instance);
  put(scene, vulkan_test::live_surfaces(scene, SurfaceStyle::Smooth));
  MeshImageOptions options = mesh_options(sized(160, 160));
  options.light.shading = Shading::Normals;
  const Camera camera = towards({40, 30, 50}, {5, 6, 7}, 0.6);
  const Image image = drawn(camera, options);
  int inside = 0;
  DVec3 sum{0.0};
  for (int y = 0; y < 160; ++y) {
    for (int x = 0; x < 160; ++x) {
      const auto normal = normal_at(camera, x, y, {5, 6, 7}, 15.0);
      if (!normal) continue;
      ++inside;
      sum += DVec3(byte_at(image, x, y)) - 255.0 * (0.5 + 0.5 * *normal);
    }
  }
  EXPECT_GT(inside, 4000);
  const DVec3 mean = sum / static_cast<double>(inside);
  // An offset of half a sample would give 3.2.
  EXPECT_LT(glm::length(mean), 1.0) << mean.x << ' ' << mean.y << ' ' << mean.z;
}

TEST_F(VulkanMeshShape, SmoothSurfacesAreClosed) {
  Scene scene;
  const VoxelType white = add_type(scene, {255, 255, 255});
  DensityGrid field;
  field.add_box({-40, -40, -40}, {150, 90, 150}, white);
  field.remove_box({-20, -20, -20}, {130, 70, 130}, 5.0);
  for (int i = 0; i < 30; ++i) field.add_sphere({-20 + i * 5, -20, 11 * (i % 12)}, 4 + i % 7, white);
  const GridHandle handle = scene.add_grid({});
  scene.add_instance({"", handle});
  put(scene, smooth_surfaces(handle, field, scene.types));
  MeshImageOptions options = mesh_options(sized(320, 180));
  options.light.shading = Shading::Unlit;
  const unsigned seed = 6;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> anywhere(5, 55);
  for (int i = 0; i < 10; ++i) {
    const DVec3 eye{anywhere(random), anywhere(random), anywhere(random)};
    const DVec3 target{anywhere(random), anywhere(random) - 30, anywhere(random)};
    EXPECT_EQ(pixels_that_are_not(drawn(towards(eye, target, 1.2), options), 255), 0) << "seed " << seed;
  }
}

// A cube of 10 voxels, 5 pixels each, in the middle of 100 x 100 pixels, seen from above.
Scene white_cube() {
  Scene scene;
  const VoxelType white = add_type(scene, {255, 255, 255});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {10, 10, 10}}, white);
  place(scene, std::move(grid));
  return scene;
}

TEST_F(VulkanMeshShape, WireframesShowEdgesInPlace) {
  const Scene scene = white_cube();
  put(scene, blocky_surfaces(scene));
  // Shifted by a quarter of a pixel, so that no edge runs between two pixels.
  const Camera camera = from_above(5.05, 30, 5.05, 20);
  MeshImageOptions options = mesh_options(sized(100, 100));
  options.light.shading = Shading::Unlit;
  options.wireframe = Wireframe::Only;
  const auto is_dark = [](const Image& image, int x, int y) { return byte_at(image, x, y).x < 60.0F; };
  const Image only = drawn(camera, options);
  options.wireframe = Wireframe::Over;
  const Image over = drawn(camera, options);
  options.wireframe = Wireframe::Off;
  const Image off = drawn(camera, options);
  int diagonal = 0;
  int other_diagonal = 0;
  for (int i = 28; i < 72; ++i) {
    for (const Image* image : {&only, &over}) {
      EXPECT_TRUE(is_dark(*image, i, 24) || is_dark(*image, i, 25)) << i;
      EXPECT_TRUE(is_dark(*image, i, 74) || is_dark(*image, i, 75)) << i;
      EXPECT_TRUE(is_dark(*image, 24, i) || is_dark(*image, 25, i)) << i;
      EXPECT_TRUE(is_dark(*image, 74, i) || is_dark(*image, 75, i)) << i;
    }
    for (int j = -1; j <= 1; ++j) diagonal += is_dark(over, i + j, i);
    for (int j = -1; j <= 1; ++j) other_diagonal += is_dark(over, 99 - i + j, i);
    if (std::abs(i - 50) < 3) continue;
    EXPECT_EQ(byte_at(over, i, 50), Vec3(255.0F));
    EXPECT_LT(glm::length(byte_at(only, i, 50) - byte_at(off, 5, 50)), 4.0F) << "the sky between edges";
  }
  EXPECT_GE(std::max(diagonal, other_diagonal), 40);
  EXPECT_LE(std::min(diagonal, other_diagonal), 6) << "where they cross";
}

TEST_F(VulkanMeshShape, EdgesCoverTheirSurfaces) {
  // Only a floor of unmerged faces, so that no edge is hidden.
  Scene scene;
  const VoxelType white = add_type(scene, {255, 255, 255});
  Grid grid;
  grid.fill_box({{0, 0, 0}, {16, 1, 16}}, white);
  place(scene, std::move(grid));
  const SurfaceUpdate slab = blocky_surfaces(scene, false)[0];
  const auto floor = std::make_shared<ChunkSurface>();
  for (const Quad& quad : slab.surface->quads) {
    if (quad.direction() == Direction::PosY) floor->quads.push_back(quad);
  }
  floor->opaque_quads = floor->quads.size();
  put(scene, {{slab.grid, slab.chunk, floor}});
  MeshImageOptions options = mesh_options(sized(400, 300));
  options.light.shading = Shading::Unlit;
  // From above, at a flat angle, and from far away; also orthographic.
  for (const DVec3 eye : {DVec3(9, 30, 21), DVec3(9, 3, 26), DVec3(5000, 3000, 8000)}) {
    Camera camera = towards(eye, {8, 1, 8}, 0.9 * 30 / std::max(30.0, glm::length(eye)));
    camera.view_height = 20;
    for (const auto projection : {Camera::Projection::Perspective, Camera::Projection::Orthographic}) {
      camera.projection = projection;
      options.wireframe = Wireframe::Only;
      const Image only = drawn(camera, options);
      options.wireframe = Wireframe::Over;
      const Image over = drawn(camera, options);
      int edges = 0;
      int lost = 0;
      for (std::size_t i = 0; i < only.rgb.size(); i += 3) {
        if (only.rgb[i] > 60) continue;
        ++edges;
        lost += over.rgb[i] > 60;
      }
      EXPECT_GT(edges, 2000);
      EXPECT_LE(lost * 100, edges) << eye.x << ' ' << lost << " of " << edges;
    }
  }
}

TEST_F(VulkanMeshShape, SamplesAreResolvedInLinearLight) {
  const Scene scene = white_cube();
  put(scene, blocky_surfaces(scene));
  // The cube's edges run through pixel centres.
  const Camera camera = from_above(5.1, 30, 5.1, 20);
  MeshImageOptions options = mesh_options(sized(100, 100));
  options.light.shading = Shading::Unlit;
  VulkanImage rendered(*renderer_);
  for (const int samples : {1, 2, 4, 8}) {
    options.samples = samples;
    ASSERT_TRUE(meshes_->draw(rendered, camera, options));
    EXPECT_LE(rendered.samples(), samples);
    EXPECT_GE(rendered.samples(), samples >= 4 ? 4 : 1) << "every device has 4";
    if (rendered.samples() == 1) continue;
    const Image image = rendered.read().value();
    // The background straight down is nearly uniform.
    const Vec3 sky = byte_at(image, 10, 50);
    const SrgbEncoder& encode = SrgbEncoder::shared();
    const float half = 0.5F + 0.5F * linear_from_srgb(static_cast<std::uint8_t>(sky.x));
    for (const int x : {24, 74}) EXPECT_NEAR(byte_at(image, x, 50).x, encode(half), 3.0F) << samples;
  }
}

}  // namespace
}  // namespace quoin
