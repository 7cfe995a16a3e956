// Images of one world are equal for different placements.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>

#include "render/cpu/environment_for_tests.h"
#include "render/cpu/render_test_support.h"

namespace quoin {
namespace {

using namespace render_test;

struct World {
  Scene scene;
  std::vector<VoxelType> types;
  World() {
    types.push_back(add_type(scene, {200, 90, 60, 255}));
    types.push_back(add_type(scene, {60, 160, 90, 255}));
    types.push_back(add_type(scene, {90, 120, 220, 120}, Visibility::Transparent));
  }
};

// Returns blobs in a box around the origin.
Grid blobs(const World& world, unsigned seed, IVec3 shift = IVec3(0)) {
  std::mt19937 random(seed);
  Grid grid;
  for (int i = 0; i < 24; ++i) {
    const auto coordinate = [&] { return static_cast<int>(random() % 11) - 6; };
    const IVec3 at = IVec3(coordinate(), coordinate(), coordinate()) + shift;
    grid.fill_box({at, at + IVec3(static_cast<int>(random() % 3)) + 1}, world.types[random() % 3]);
  }
  return grid;
}

const Camera kCamera = towards({17, 13, 21}, {0, 0, 0}, 0.7);

// Returns all 48 ways to map three axes onto three axes; half of them mirror.
std::vector<glm::dmat3> signed_permutations() {
  std::vector<glm::dmat3> all;
  for (int code = 0; code < 27 * 8; ++code) {
    const std::array<int, 3> axis = {code % 3, code / 3 % 3, code / 9 % 3};
    if (axis[0] == axis[1] || axis[0] == axis[2] || axis[1] == axis[2]) continue;
    glm::dmat3 matrix(0.0);
    for (int column = 0; column < 3; ++column) {
      matrix[column][axis[static_cast<std::size_t>(column)]] = (code / 27 >> column & 1) != 0 ? -1.0 : 1.0;
    }
    all.push_back(matrix);
  }
  return all;
}

TEST(RenderScene, TransformedInstancesMatchTransformedVoxels) {
  const std::vector<glm::dmat3> all = signed_permutations();
  ASSERT_EQ(all.size(), 48U);
  for (std::size_t i = 0; i < all.size(); ++i) {
    World placed;
    World moved;
    Grid voxels = blobs(placed, 31);
    Grid turned;
    voxels.for_each(
        [&](IVec3 voxel, VoxelType type) { turned.set(IVec3(glm::floor(all[i] * (DVec3(voxel) + 0.5))), type); });
    Instance& instance = placed.scene.edit(place(placed.scene, std::move(voxels)));
    instance.mirrored = glm::determinant(all[i]) < 0.0;
    glm::dmat3 rotation = all[i];
    if (instance.mirrored) rotation[0] = -rotation[0];
    instance.rotation = glm::quat_cast(rotation);
    place(moved.scene, std::move(turned));
    RenderOptions options = sized(48, 48);
    for (const auto mode : {OcclusionMode::Rays, OcclusionMode::Vertex}) {
      options.light.occlusion_mode = mode;
      const RenderedImage a = taken(placed.scene, kCamera, options);
      const RenderedImage b = taken(moved.scene, kCamera, options);
      // The triangles of a face do not turn with it where all four levels count.
      EXPECT_LE(count_different(a, b, 1), mode == OcclusionMode::Rays ? 3 : 40) << i;
    }
  }
}

TEST(RenderScene, MovingEverythingByIntegersChangesNoByte) {
  World world;
  place(world.scene, blobs(world, 7));
  const RenderedImage reference = taken(world.scene, kCamera, sized(64, 64));
  for (const DVec3 by : {DVec3(3, -200, 77), DVec3(1e9, -1e9, 1e9)}) {
    World moved;
    place(moved.scene, blobs(moved, 7), by);
    Camera camera = kCamera;
    camera.position += by;
    const RenderedImage image = taken(moved.scene, camera, sized(64, 64));
    EXPECT_EQ(image.colour.rgb, reference.colour.rgb);
    EXPECT_EQ(image.depth.values, reference.depth.values);
  }
}

TEST(RenderScene, VoxelsFarFromGridOriginLookAlike) {
  World world;
  place(world.scene, blobs(world, 7));
  const RenderedImage reference = taken(world.scene, kCamera, sized(64, 64));
  const IVec3 shift{1'000'000'000, -1'000'000'000, 1'000'000'000};
  World moved;
  place(moved.scene, blobs(moved, 7, shift), -DVec3(shift));
  EXPECT_LE(count_different(taken(moved.scene, kCamera, sized(64, 64)), reference, 1), 20);
}

TEST(RenderScene, SplitWorldLooksLikeWhole) {
  World whole;
  World parted;
  Grid voxels = blobs(whole, 12);
  std::array<Grid, 8> parts;
  voxels.for_each([&](IVec3 v, VoxelType type) {
    parts.at(static_cast<std::size_t>((v.x > 0) + 2 * (v.y > 1) + 4 * (v.z > -1))).set(v, type);
  });
  place(whole.scene, std::move(voxels));
  for (Grid& part : parts) place(parted.scene, std::move(part));
  const RenderedImage a = taken(whole.scene, kCamera, sized(80, 80));
  const RenderedImage b = taken(parted.scene, kCamera, sized(80, 80));
  EXPECT_EQ(count_different(a, b, 1), 0);
  EXPECT_EQ(a.depth.values, b.depth.values);
  EXPECT_EQ(a.pixels_hit, b.pixels_hit);
}

TEST(RenderScene, IgnoresOrderOfInstances) {
  std::array<RenderedImage, 2> images;
  for (const bool is_reversed : {false, true}) {
    World world;
    std::mt19937 random(3);
    std::uniform_real_distribution<double> share(-1.0, 1.0);
    std::vector<Instance> instances(30);
    SceneGrid grid;
    grid.grid = blobs(world, 5);
    const GridHandle handle = world.scene.add_grid(std::move(grid));
    for (Instance& instance : instances) {
      instance.grid = handle;
      instance.position = DVec3(share(random), share(random), share(random)) * 9.0;
      instance.rotation = glm::angleAxis(3.0 * share(random), glm::normalize(DVec3(share(random), 0.3, share(random))));
      instance.voxel_size = 0.15;
    }
    if (is_reversed) std::reverse(instances.begin(), instances.end());
    for (const Instance& instance : instances) world.scene.add_instance(instance);
    images.at(is_reversed) = taken(world.scene, kCamera, sized(96, 96));
  }
  EXPECT_EQ(images[0].colour.rgb, images[1].colour.rgb);
  EXPECT_EQ(images[0].depth.values, images[1].depth.values);
  EXPECT_GT(images[0].pixels_hit, 500);
}

TEST(RenderScene, IgnoresGridsOutOfSight) {
  World alone;
  place(alone.scene, blobs(alone, 7));
  World among;
  place(among.scene, blobs(among, 9), {0, 0, 900});
  place(among.scene, blobs(among, 7));
  const RenderedImage a = taken(alone.scene, kCamera, sized(64, 64));
  const RenderedImage b = taken(among.scene, kCamera, sized(64, 64));
  EXPECT_EQ(a.colour.rgb, b.colour.rgb);
  EXPECT_EQ(a.depth.values, b.depth.values);
}

TEST(RenderScene, PrefersLowerHandleAtEqualDepth) {
  std::array<Pixel, 2> seen{};
  for (const bool is_reversed : {false, true}) {
    World world;
    for (const int i : {0, 1}) {
      Grid slab;
      slab.fill_box({{-3, 0, -3}, {4, 1, 4}}, world.types.at(static_cast<std::size_t>(i) ^ (is_reversed ? 1U : 0U)));
      place(world.scene, std::move(slab));
    }
    RenderOptions options = sized(8, 8);
    options.light.shading = Shading::Unlit;
    const RenderedImage image = taken(world.scene, from_above(0.5, 9, 0.5, 4), options);
    for (int i = 0; i < 64; ++i) EXPECT_EQ(pixel_at(image, i % 8, i / 8), pixel_at(image, 0, 0));
    seen.at(is_reversed) = pixel_at(image, 0, 0);
  }
  EXPECT_EQ(seen[0], (Pixel{200, 90, 60}));
  EXPECT_EQ(seen[1], (Pixel{60, 160, 90}));
}

TEST(RenderScene, NearSmallVoxelsMatchFarLargeVoxels) {
  World large;
  World small;
  place(large.scene, blobs(large, 7));
  small.scene.edit(place(small.scene, blobs(small, 7))).voxel_size = 0.125;
  Camera camera = kCamera;
  camera.position *= 0.125;
  const RenderedImage a = taken(large.scene, kCamera, sized(64, 64));
  const RenderedImage b = taken(small.scene, camera, sized(64, 64));
  EXPECT_EQ(a.colour.rgb, b.colour.rgb) << "distances of light are in voxels";
  for (std::size_t i = 0; i < a.depth.values.size(); ++i) EXPECT_EQ(a.depth.values[i] * 0.125F, b.depth.values[i]);
}

TEST(RenderScene, CastsShadowsBetweenInstances) {
  World world;
  Grid floor;
  floor.fill_box({{-9, -1, -9}, {10, 0, 10}}, world.types[0]);
  place(world.scene, std::move(floor));
  Grid roof;
  roof.fill_box({{-9, 0, -9}, {10, 1, 10}}, world.types[0]);
  RenderOptions options = sized(4, 4);
  environment_in(options).sun.direction = {0, 1, 0};
  const Camera camera = from_above(0, 2, 0, 4);
  const Pixel lit = pixel_at(taken(world.scene, camera, options), 1, 1);
  place(world.scene, std::move(roof), {0, 3, 0});
  EXPECT_LT(pixel_at(taken(world.scene, camera, options), 1, 1)[0], lit[0] / 2);
}

TEST(RenderScene, OrthographicImagesShowSky) {
  const Scene empty;
  Camera camera = towards({0, 0, 0}, {0, 0, -1});
  camera.projection = Camera::Projection::Orthographic;
  camera.view_height = 1000.0;
  const RenderedImage image = taken(empty, camera, sized(2, 101));
  EXPECT_LT(pixel_at(image, 0, 0)[0], pixel_at(image, 0, 50)[0]);
  EXPECT_LT(pixel_at(image, 0, 100)[0], pixel_at(image, 0, 50)[0]);
}

TEST(RenderScene, LooksStraightUpAndDownAndFromFarAway) {
  World world;
  Grid slab;
  slab.fill_box({{-9, 5, -9}, {10, 6, 10}}, world.types[0]);
  place(world.scene, std::move(slab));
  Camera up = from_above(0, 0, 0, 4);
  up.forward = {0, 1, 0};
  up.up = {0, 0, 1};
  EXPECT_EQ(depth_at(taken(world.scene, up, sized(4, 4)), 2, 2), 5.0F);
  up.projection = Camera::Projection::Perspective;
  up.vertical_fov_radians = 3.1;
  EXPECT_GT(taken(world.scene, up, sized(64, 64)).pixels_hit, 0);
  EXPECT_EQ(depth_at(taken(world.scene, from_above(0, 1e7, 0, 4), sized(4, 4)), 2, 2), 1e7F - 6.0F);
  Camera lost = from_above(1e308, -1e308, 1e308, 1e300);
  EXPECT_EQ(taken(world.scene, lost, sized(4, 4)).pixels_hit, 0);
}

}  // namespace
}  // namespace quoin
