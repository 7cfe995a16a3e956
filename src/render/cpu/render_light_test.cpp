// Images with analytically known light.

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <glm/gtc/quaternion.hpp>

#include "render/cpu/environment_for_tests.h"
#include "render/cpu/render_test_support.h"

namespace quoin {
namespace {

using namespace render_test;

constexpr Rgba8 kGrey{188, 188, 188, 255};

// The y = 0 plane is the top of a floor from -40 to 40.
Grid floor_of(VoxelType type) {
  Grid grid;
  grid.fill_box({{-40, -1, -40}, {40, 0, 40}}, type);
  return grid;
}

// Returns the cosine of the sun on each axis, with the renderer's rounding.
Vec3 cosines(DVec3 sun) {
  return Vec3(glm::normalize(sun));
}

TEST(RenderLight, OpenFloorReceivesExactAmbientAndSun) {
  Scene scene;
  place(scene, floor_of(add_type(scene, kGrey)));
  const float sun = cosines(Environment::reference().sun.direction).y;
  for (const int rays : {1, 6, 9, 32}) {
    RenderOptions options = sized(16, 16);
    options.light.occlusion_rays = rays;
    const RenderedImage image = taken(scene, from_above(0, 30, 0, 20), options);
    const Pixel expected = encoded(linear(kGrey) * (0.15F + sun));
    for (int i = 0; i < 256; ++i) ASSERT_EQ(pixel_at(image, i % 16, i / 16), expected);
    EXPECT_EQ(image.rays, 256 * (2 + rays));
  }
}

TEST(RenderLight, AmbientIsOneTenthWithoutOcclusion) {
  Scene scene;
  place(scene, floor_of(add_type(scene, kGrey)));
  RenderOptions options = sized(4, 4);
  options.light.occlusion_mode = OcclusionMode::Off;
  environment_in(options).sun.direction = {0, 2, 0};
  environment_in(options).exposure = 0.5;
  EXPECT_EQ(pixel_at(taken(scene, from_above(0, 30, 0, 20), options), 1, 1), encoded(linear(kGrey) * 0.55F));
}

TEST(RenderLight, SmallClosedBoxIsBlackInside) {
  Scene scene;
  Grid grid;
  const VoxelType type = add_type(scene, kGrey);
  grid.fill_box({{-2, -2, -2}, {3, 3, 3}}, type);
  grid.fill_box({{-1, -1, -1}, {2, 2, 2}}, kAir);
  place(scene, std::move(grid));
  for (const int rays : {6, 9, 17}) {
    RenderOptions options = sized(24, 24);
    options.light.occlusion_rays = rays;
    const RenderedImage image = taken(scene, towards({0.5, 0.5, 1.5}, {0.3, 0.4, -5}, 2.0), options);
    for (const std::uint8_t byte : image.colour.rgb) ASSERT_EQ(byte, 0);
    EXPECT_EQ(image.pixels_hit, 24 * 24);
    options.light.occlusion_affects = OcclusionAffects::All;
    environment_in(options).exposure = 4.0;
    EXPECT_EQ(pixel_at(taken(scene, towards({0.5, 0.5, 1.5}, {0.3, 0.4, -5}, 2.0), options), 3, 3),
              encoded(linear(kGrey) * 0.15F * 0.25F * 4.0F));
  }
}

TEST(RenderLight, CubeShadowIsExactToPixel) {
  Scene scene;
  const VoxelType type = add_type(scene, kGrey);
  Grid grid = floor_of(type);
  const DVec3 low{1, 6, -2};
  const DVec3 high{4, 8, 1};
  grid.fill_box({{1, 6, -2}, {4, 8, 1}}, type);
  place(scene, std::move(grid));
  RenderOptions options = sized(160, 160);
  options.light.occlusion_mode = OcclusionMode::Off;
  const DVec3 sun = environment_in(options).sun.direction;
  const RenderedImage image = taken(scene, from_above(0, 30, 0, 32), options);
  const Pixel lit = encoded(linear(kGrey) * (0.1F + cosines(sun).y));
  const Pixel dark = encoded(linear(kGrey) * 0.1F);
  int shadow = 0;
  for (int row = 0; row < 160; ++row) {
    for (int column = 0; column < 160; ++column) {
      const DVec3 at{(column + 0.5) / 5 - 16, 0.01, (row + 0.5) / 5 - 16};
      if (at.x > low.x && at.x < high.x && at.z > low.z && at.z < high.z) continue;  // the cube itself
      // The interval of the ray to the sun within each pair of the cube's planes.
      const DVec3 a = (low - at) / sun;
      const DVec3 b = (high - at) / sun;
      const DVec3 enter = glm::min(a, b);
      const DVec3 leave = glm::max(a, b);
      const bool is_dark = std::max({enter.x, enter.y, enter.z}) < std::min({leave.x, leave.y, leave.z});
      ASSERT_EQ(pixel_at(image, column, row), is_dark ? dark : lit) << column << ", " << row;
      shadow += is_dark;
    }
  }
  EXPECT_GT(shadow, 200);
}

TEST(RenderLight, ShadowsEndAtDistanceInVoxels) {
  Scene scene;
  const VoxelType type = add_type(scene, kGrey);
  Grid grid = floor_of(type);
  grid.fill_box({{-9, 10, -9}, {9, 11, 9}}, type);
  const InstanceHandle instance = place(scene, std::move(grid));
  scene.edit(instance).voxel_size = 0.25;
  RenderOptions options = sized(1, 1);
  options.light.occlusion_mode = OcclusionMode::Off;
  environment_in(options).sun.direction = {0, 0.001, 0};  // any length
  Camera camera = from_above(0, 1, 0, 0.1);
  const Pixel dark = encoded(linear(kGrey) * 0.1F);
  options.light.shadow_distance_voxels = 9.98;
  EXPECT_NE(pixel_at(taken(scene, camera, options), 0, 0), dark);
  options.light.shadow_distance_voxels = 10.0;
  EXPECT_EQ(pixel_at(taken(scene, camera, options), 0, 0), dark);
  options.light.shadows = false;
  EXPECT_NE(pixel_at(taken(scene, camera, options), 0, 0), dark);
}

TEST(RenderLight, OcclusionEndsAtDistance) {
  Scene scene;
  const VoxelType type = add_type(scene, kGrey);
  Grid grid = floor_of(type);
  grid.fill_box({{-40, 6, -40}, {40, 7, 40}}, type);
  place(scene, std::move(grid));
  RenderOptions options = sized(1, 1);
  options.light.shadows = false;
  environment_in(options).sun.direction = {1, 0, 0};
  // Only the ray along the normal reaches the ceiling.
  EXPECT_EQ(pixel_at(taken(scene, from_above(0, 5, 0, 1), options), 0, 0),
            encoded(linear(kGrey) * 0.15F * (8.0F / 9.0F)));
  options.light.occlusion_distance_voxels = 5.98;
  EXPECT_EQ(pixel_at(taken(scene, from_above(0, 5, 0, 1), options), 0, 0), encoded(linear(kGrey) * 0.15F));
}

// Every ray of this image hits one point, where a wall hides part of the sky.
TEST(RenderLight, SamplesUseDifferentOcclusionRays) {
  Scene scene;
  const VoxelType type = add_type(scene, kGrey);
  Grid grid = floor_of(type);
  grid.fill_box({{1, 0, -40}, {2, 10, 40}}, type);
  place(scene, std::move(grid));
  RenderOptions options = sized(1, 1);
  environment_in(options).sun.direction = {0, -1, 0};
  options.light.occlusion_rays = 1;
  const Camera camera = from_above(0.9, 5, 0.5, 1e-6);
  const Pixel open = encoded(linear(kGrey) * 0.15F);
  const std::uint8_t one = pixel_at(taken(scene, camera, options), 0, 0)[0];
  EXPECT_TRUE(one == 0 || one == open[0]);
  options.samples = 200;
  const std::uint8_t many = pixel_at(taken(scene, camera, options), 0, 0)[0];
  EXPECT_GT(many, open[0] / 4);
  EXPECT_LT(many, open[0] - 5);
}

TEST(RenderLight, SunBelowHorizonLightsFacingSurfaces) {
  Scene scene;
  place(scene, floor_of(add_type(scene, kGrey)));
  RenderOptions options = sized(4, 4);
  environment_in(options).sun.direction = {0, -1, 0};
  EXPECT_EQ(pixel_at(taken(scene, from_above(0, 30, 0, 20), options), 1, 1), encoded(linear(kGrey) * 0.15F));
  Camera camera = from_above(0, -30, 0, 20);
  camera.forward = {0, 1, 0};
  camera.up = {0, 0, 1};
  EXPECT_EQ(pixel_at(taken(scene, camera, options), 1, 1), encoded(linear(kGrey) * 1.15F));
}

TEST(RenderLight, EmissionShinesInDarkAndScalesWithExposure) {
  Scene scene;
  const Rgba8 amber{200, 140, 60, 255};
  place(scene, floor_of(add_type(scene, amber, Visibility::Opaque, 0.5F)));
  RenderOptions options = sized(2, 2);
  environment_in(options).sun.direction = {0, -1, 0};
  environment_in(options).exposure = 0.25;
  EXPECT_EQ(pixel_at(taken(scene, from_above(0, 30, 0, 20), options), 0, 0),
            encoded((linear(amber) * 0.5F + linear(amber) * 0.15F) * 0.25F));
}

// Next to a wall, where the corner occlusion falls from 2 to 0 across one voxel.
TEST(RenderLight, VertexOcclusionMatchesMesh) {
  Scene scene;
  const VoxelType type = add_type(scene, kGrey);
  Grid grid = floor_of(type);
  grid.fill_box({{4, 0, -40}, {5, 6, 40}}, type);
  place(scene, std::move(grid));
  RenderOptions options = sized(40, 1);
  options.light.occlusion_mode = OcclusionMode::Vertex;
  options.light.shadows = false;
  environment_in(options).sun.direction = {-1, 1, 0};
  const float sun = cosines(environment_in(options).sun.direction).y;
  for (const auto affects : {OcclusionAffects::Ambient, OcclusionAffects::All}) {
    options.light.occlusion_affects = affects;
    // One column of voxels fills the image: x from 3 to 4.
    Camera camera = from_above(3.5, 3, 0.5, 1.0 / 40);
    const RenderedImage image = taken(scene, camera, options);
    for (int column = 0; column < 40; ++column) {
      const float level = 2.0F * ((static_cast<float>(column) + 0.5F) / 40.0F);
      const float light = affects == OcclusionAffects::Ambient ? 0.15F * (1.0F - level / 3.0F) + sun
                                                               : (0.15F + sun) * (1.0F - 0.25F * level);
      const Pixel expected = encoded(linear(kGrey) * light);
      EXPECT_NEAR(pixel_at(image, column, 0)[0], expected[0], 1) << column;
    }
  }
}

// The voxel at the foot of a wall, as in the mesh: its light falls towards the wall only if the wall's type occludes.
TEST(RenderLight, OnlyTypesThatOccludeDarkenCorners) {
  RenderOptions options = sized(40, 1);
  options.light.shading = Shading::Occlusion;
  const Camera camera = from_above(3.5, 3, 0.5, 1.0 / 40);
  for (const bool occludes : {false, true}) {
    Scene scene;
    Grid grid = floor_of(add_type(scene, kGrey));
    const auto wall = scene.types.add({.name = "wall", .colour = kGrey, .occludes = occludes});
    ASSERT_TRUE(wall);
    grid.fill_box({{4, 0, -40}, {5, 6, 40}}, *wall);
    place(scene, std::move(grid));
    options.light.occlusion_mode = OcclusionMode::Vertex;
    const RenderedImage image = taken(scene, camera, options);
    const int dark = occludes ? 85 : 255;
    EXPECT_NEAR(pixel_at(image, 0, 0)[0], 255, 3);
    EXPECT_NEAR(pixel_at(image, 39, 0)[0], dark, 3);
    options.light.occlusion_mode = OcclusionMode::Rays;
    EXPECT_LT(pixel_at(taken(scene, camera, options), 39, 0)[0], 255) << "rays meet each opaque voxel";
  }
}

TEST(RenderLight, SolidFromInsideShowsOwnColour) {
  Scene scene;
  place(scene, floor_of(add_type(scene, kGrey)));
  const RenderedImage image = taken(scene, towards({0.5, -0.5, 0.5}, {0, -0.7, -4}), sized(5, 5));
  for (int i = 0; i < 25; ++i) {
    EXPECT_EQ(pixel_at(image, i % 5, i / 5), encoded(linear(kGrey)));
    EXPECT_EQ(depth_at(image, i % 5, i / 5), 0.0F);
  }
  EXPECT_EQ(image.rays, 25) << "there is nothing to light";
}

TEST(RenderLight, UnregisteredTypesAreMagenta) {
  Scene scene;
  add_type(scene, kGrey);
  place(scene, floor_of(777));
  RenderOptions options = sized(2, 2);
  options.light.shading = Shading::Unlit;
  EXPECT_EQ(pixel_at(taken(scene, from_above(0, 9, 0, 4), options), 0, 0), (Pixel{255, 0, 255}));
}

TEST(RenderLight, SixthOcclusionRayMatchesReference) {
  for (const Direction face : kDirections) {
    SCOPED_TRACE(static_cast<int>(face));
    Scene scene;
    const Camera camera = sixth_ray_blocked(scene, face);
    RenderOptions options = sized(1, 1);
    options.light.occlusion_rays = 6;
    options.light.shading = Shading::Occlusion;
    EXPECT_NEAR(pixel_at(taken(scene, camera, options), 0, 0)[0], 255.0 * 5 / 6, 0.51);
  }
}

// A floor with a step along x = 5, where vertex occlusion falls from 2 to 0 within one voxel.
Scene with_step(Rgba8 colour) {
  Scene scene;
  const VoxelType type = add_type(scene, colour);
  Grid grid;
  grid.fill_box({{0, -1, 0}, {10, 0, 10}}, type);
  grid.fill_box({{0, 0, 0}, {5, 1, 10}}, type);
  place(scene, std::move(grid));
  return scene;
}

TEST(RenderLight, OcclusionModeIsGreyAndDarkensUnlitColours) {
  const Rgba8 colour{200, 120, 40, 255};
  const Scene scene = with_step(colour);
  const Camera camera = from_above(5, 30, 5, 10);
  RenderOptions options = sized(200, 200);
  options.light.occlusion_mode = OcclusionMode::Vertex;
  environment_in(options).exposure = 3.0;  // exposure has no effect
  options.light.shading = Shading::Occlusion;
  const RenderedImage grey = taken(scene, camera, options);
  options.light.shading = Shading::UnlitWithOcclusion;
  const RenderedImage classic = taken(scene, camera, options);
  options.light.shading = Shading::Unlit;
  const RenderedImage unlit = taken(scene, camera, options);
  EXPECT_EQ(pixel_at(unlit, 101, 100), (Pixel{colour.r, colour.g, colour.b}));
  EXPECT_EQ(classic.rays, unlit.rays) << "one to each pixel";
  for (const int x : {101, 105, 110, 118, 150}) {
    const float open = std::min(1.0F / 3.0F + 2.0F / 3.0F * (static_cast<float>(x) + 0.5F - 100.0F) / 20.0F, 1.0F);
    const Pixel found = pixel_at(grey, x, 95);
    EXPECT_NEAR(found[0], 255.0F * open, 0.51F) << x;
    EXPECT_TRUE(found[0] == found[1] && found[1] == found[2]);
    const Pixel expected = encoded(linear(colour) * (0.25F + 0.75F * open));
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(pixel_at(classic, x, 95)[c], expected[c], 1) << x;
  }
  options.light.occlusion_mode = OcclusionMode::Off;
  options.light.shading = Shading::UnlitWithOcclusion;
  EXPECT_EQ(taken(scene, camera, options).colour.rgb, unlit.colour.rgb);
  options.light.shading = Shading::Occlusion;
  EXPECT_EQ(pixel_at(taken(scene, camera, options), 101, 100), (Pixel{255, 255, 255}));
}

TEST(RenderLight, OcclusionModeShowsOpenShareOfRays) {
  const Scene scene = with_step({200, 120, 40, 255});
  RenderOptions options = sized(100, 1);
  options.light.shading = Shading::Occlusion;
  const RenderedImage image = taken(scene, from_above(6, 30, 5, 0.04), options);
  std::set<int> levels;
  for (int x = 0; x < 100; ++x) levels.insert(pixel_at(image, x, 0)[0]);
  for (const int level : levels) {
    EXPECT_LT(std::abs(std::remainder(level * 9.0 / 255.0, 1.0)), 0.02) << level;
  }
  EXPECT_GT(levels.size(), 1U);
  options.light.occlusion_distance_voxels = 0.0;
  const RenderedImage open = taken(scene, from_above(6, 30, 5, 0.04), options);
  EXPECT_EQ(pixel_at(open, 45, 0)[0], 255) << "rays of no length";
}

// With the nine unchanged directions there would be steps of a ninth at any number of samples.
TEST(RenderLight, ManySamplesLeaveNoBandsNextToWall) {
  Scene scene;
  const VoxelType type = add_type(scene, kGrey);
  Grid grid = floor_of(type);
  grid.fill_box({{-1, 0, -40}, {0, 30, 40}}, type);
  place(scene, std::move(grid));
  RenderOptions options = sized(160, 1);
  options.light.shading = Shading::Occlusion;
  const Camera camera = from_above(4.3, 20, 0.37, 0.05);
  const auto largest_step = [&](int samples) {
    options.samples = samples;
    const RenderedImage image = taken(scene, camera, options);
    int largest = 0;
    for (int x = 1; x < 160; ++x) {
      largest = std::max(largest, std::abs(pixel_at(image, x, 0)[0] - pixel_at(image, x - 1, 0)[0]));
    }
    return largest;
  };
  EXPECT_GE(largest_step(1), 28);
  EXPECT_LE(largest_step(64), 12);
}

// The ray along the normal ends at the slab's edge: upright in all samples, it would leave a step of a ninth there.
TEST(RenderLight, ManySamplesLeaveNoBandBelowSlab) {
  Scene scene;
  const VoxelType type = add_type(scene, kGrey);
  Grid grid = floor_of(type);
  grid.fill_box({{-40, 3, -40}, {0, 4, 40}}, type);
  place(scene, std::move(grid));
  RenderOptions options = sized(160, 1);
  options.light.shading = Shading::Occlusion;
  // Seen from below the slab.
  Camera camera = from_above(0, 2.5, 0.37, 0.025);
  const auto largest_step = [&](int samples) {
    options.samples = samples;
    const RenderedImage image = taken(scene, camera, options);
    int largest = 0;
    for (int x = 1; x < 160; ++x) {
      largest = std::max(largest, std::abs(pixel_at(image, x, 0)[0] - pixel_at(image, x - 1, 0)[0]));
    }
    return largest;
  };
  EXPECT_GE(largest_step(1), 28);
  EXPECT_LE(largest_step(64), 6);
}

TEST(RenderLight, ShowsWorldNormalsOfStoneAndGlass) {
  Scene scene;
  const VoxelType glass = add_type(scene, {60, 140, 220, 100}, Visibility::Transparent);
  Grid grid = floor_of(glass);
  const InstanceHandle instance = place(scene, std::move(grid));
  RenderOptions options = sized(3, 3);
  options.light.shading = Shading::Normals;
  const Camera camera = from_above(0, 30, 0, 2);
  EXPECT_EQ(pixel_at(taken(scene, camera, options), 1, 1), (Pixel{128, 255, 128}));
  scene.edit(instance).rotation = glm::angleAxis(0.5, DVec3(0, 0, 1));
  const Pixel turned = pixel_at(taken(scene, camera, options), 1, 1);
  EXPECT_NEAR(turned[0], 255 * (0.5 - 0.5 * std::sin(0.5)), 0.6);
  EXPECT_NEAR(turned[1], 255 * (0.5 + 0.5 * std::cos(0.5)), 0.6);
  options.light.shading = Shading::Occlusion;
  EXPECT_EQ(pixel_at(taken(scene, camera, options), 1, 1), (Pixel{255, 255, 255}));
  Camera inside = camera;
  inside.position.y = -0.5;
  inside.position.x = 0.1;
  EXPECT_NE(pixel_at(taken(scene, inside, options), 1, 1), (Pixel{255, 255, 255})) << "what one looks from is nothing";
}

}  // namespace
}  // namespace quoin
