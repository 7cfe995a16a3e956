// The effect of transparent voxels on images.

#include <cmath>
#include <limits>
#include <utility>

#include <glm/gtc/quaternion.hpp>

#include "render/cpu/environment_for_tests.h"
#include "render/cpu/glass_for_tests.h"
#include "render/cpu/render_test_support.h"
#include "render/light/glass_bodies.h"
#include "render/light/light_model.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {
namespace {

using namespace render_test;

// Returns the transmittance of one voxel's length of glass.
Vec3 through_one() {
  return (1.0F - kAlpha) * (Vec3(1.0F) - kAlpha * (Vec3(1.0F) - linear(kGlass)));
}

TEST(RenderGlass, PanesTintByThicknessAndShowOwnColour) {
  for (const int thickness : {1, 2, 3, 7}) {
    GlassScene s;
    Grid grid;
    grid.fill_box({{-5, -1, -5}, {6, 0, 6}}, s.stone);
    grid.fill_box({{-5, 3, -5}, {6, 3 + thickness, 6}}, s.glass);
    place(s.scene, std::move(grid));
    RenderOptions options = sized(4, 4);
    options.light.shading = Shading::Unlit;
    const RenderedImage image = taken(s.scene, from_above(0, 20, 0, 4), options);
    const auto length = static_cast<float>(thickness);
    const Vec3 expected =
        linear(kWhite) * power(through_one(), length) + linear(kGlass) * (1.0F - std::pow(1.0F - kAlpha, length));
    expect_near(pixel_at(image, 1, 2), encoded(expected), 1);
    EXPECT_FLOAT_EQ(depth_at(image, 1, 2), static_cast<float>(20 - 3 - thickness)) << "glass counts as hit";
  }
}

TEST(RenderGlass, IsVisibleAgainstBackground) {
  GlassScene s;
  Grid grid;
  grid.fill_box({{-5, 0, -5}, {6, 1, 6}}, s.glass);
  place(s.scene, std::move(grid));
  RenderOptions options = sized(2, 2);
  const RenderedImage image = taken(s.scene, from_above(0, 20, 0, 4), options);
  EXPECT_EQ(image.pixels_hit, 4);
  Scene empty;
  EXPECT_GT(count_different(image, taken(empty, from_above(0, 20, 0, 4), options), 10), 3);
}

// The same glass in one grid, across a chunk border, and in two grids that touch.
TEST(RenderGlass, HasNoSeamsBetweenEqualNeighbours) {
  const auto rendered_of = [](int shift, bool is_split) {
    GlassScene s;
    Grid grid;
    grid.fill_box({{shift - 9, -1, -9}, {shift + 10, 0, 10}}, s.stone);
    grid.fill_box({{shift - 4, 1, -4}, {shift, 5, 5}}, s.glass);
    Grid other;
    (is_split ? other : grid).fill_box({{shift, 1, -4}, {shift + 5, 5, 5}}, s.glass);
    place(s.scene, std::move(grid), {-shift, 0, 0});
    if (is_split) place(s.scene, std::move(other), {-shift, 0, 0});
    return taken(s.scene, towards({9, 8, 11}, {0, 1, 0}), sized(90, 70));
  };
  const RenderedImage whole = rendered_of(20, false);
  EXPECT_EQ(count_different(whole, rendered_of(64, false), 1), 0) << "a chunk's border";
  EXPECT_EQ(count_different(whole, rendered_of(64, true), 1), 0) << "two grids";
}

TEST(RenderGlass, SeparatesBodiesOfDifferentGlass) {
  GlassScene s;
  Grid grid;
  grid.fill_box({{0, 0, 0}, {1, 1, 2}}, s.glass);
  grid.fill_box({{0, 0, 2}, {1, 1, 4}}, s.green);
  place(s.scene, std::move(grid));
  const SceneTracer tracer(s.scene);
  const SceneView view(tracer, DVec3(0.0));
  SeenThrough seen;
  find_transparent(view, Surfaces(s.scene.types), {{0.5, 0.5, -3.0}, {0, 0, 2.0}}, 3.25, seen);
  const std::vector<GlassBody>& bodies = seen.bodies;
  ASSERT_EQ(bodies.size(), 2U);
  EXPECT_EQ(bodies[0].type, s.glass);
  EXPECT_DOUBLE_EQ(bodies[0].voxels, 2.0);
  EXPECT_EQ(bodies[1].type, s.green);
  EXPECT_DOUBLE_EQ(bodies[1].voxels, 1.5) << "as far as the ray goes";
}

TEST(RenderGlass, MeasuresLengthInVoxels) {
  GlassScene s;
  Grid grid;
  grid.fill_box({{0, 0, 0}, {1, 1, 4}}, s.glass);
  const InstanceHandle instance = place(s.scene, std::move(grid), {0, 0, 10});
  s.scene.edit(instance).voxel_size = 0.5;
  const SceneTracer tracer(s.scene);
  const SceneView view(tracer, {0.25, 0.25, 0});
  SeenThrough seen;
  find_transparent(view, Surfaces(s.scene.types), {{0, 0, 0}, {0, 0, 1}}, 100.0, seen);
  const std::vector<GlassBody>& bodies = seen.bodies;
  ASSERT_EQ(bodies.size(), 1U);
  EXPECT_DOUBLE_EQ(bodies[0].voxels, 4.0);
  EXPECT_DOUBLE_EQ(bodies[0].t_enter, 10.0);
}

TEST(RenderGlass, TintsTheSunAndDoesNotOcclude) {
  GlassScene s;
  Grid grid;
  grid.fill_box({{-9, -1, -9}, {10, 0, 10}}, s.stone);
  grid.fill_box({{-9, 3, -9}, {10, 5, 10}}, s.glass);
  place(s.scene, std::move(grid));
  RenderOptions options = sized(3, 3);
  environment_in(options).sun.direction = {0, 1, 0};
  const RenderedImage image = taken(s.scene, from_above(0, 2, 0, 4), options);
  expect_near(pixel_at(image, 1, 1), encoded(linear(kWhite) * (0.15F + power(through_one(), 2.0F))), 1);
  // Floor at 0, glass from 3 to 5.
  options.light.shadow_distance_voxels = 2.5;
  expect_near(pixel_at(taken(s.scene, from_above(0, 2, 0, 4), options), 1, 1), encoded(linear(kWhite) * 1.15F), 1);
  options.light.shadow_distance_voxels = 4.49;
  expect_near(pixel_at(taken(s.scene, from_above(0, 2, 0, 4), options), 1, 1),
              encoded(linear(kWhite) * (0.15F + power(through_one(), 1.5F))), 1);
  options.light.shadows = false;
  expect_near(pixel_at(taken(s.scene, from_above(0, 2, 0, 4), options), 1, 1), encoded(linear(kWhite) * 1.15F), 1);
}

TEST(RenderGlass, SeenFromInsideTintsOnly) {
  GlassScene s;
  Grid grid;
  grid.fill_box({{-9, -1, -9}, {10, 0, 10}}, s.stone);
  grid.fill_box({{-9, 0, -9}, {10, 10, 10}}, s.glass);
  place(s.scene, std::move(grid));
  RenderOptions options = sized(3, 3);
  options.light.shading = Shading::Unlit;
  const RenderedImage image = taken(s.scene, from_above(0, 2.5, 0, 2), options);
  expect_near(pixel_at(image, 1, 1), encoded(linear(kWhite) * power(through_one(), 2.5F)), 1);
  EXPECT_EQ(depth_at(image, 1, 1), 0.0F);
}

TEST(RenderGlass, EmissiveGlassShinesFromOutsideAndInside) {
  for (const double height : {20.0, 1.0}) {
    std::array<Pixel, 2> seen{};
    for (const float emission : {0.0F, 2.0F}) {
      Scene scene;
      const VoxelType glass = add_type(scene, kGlass, Visibility::Transparent, emission);
      Grid grid;
      grid.fill_box({{-5, 0, -5}, {6, 4, 6}}, glass);
      grid.fill_box({{-5, -1, -5}, {6, 0, 6}}, add_type(scene, {0, 0, 0, 255}));
      place(scene, std::move(grid));
      RenderOptions options = sized(2, 2);
      environment_in(options).sun.direction = {0, -1, 0};
      seen.at(emission > 0.0F) = pixel_at(taken(scene, from_above(0, height, 0, 2), options), 0, 0);
    }
    EXPECT_GT(seen[1][2], seen[0][2] + 50) << height;
  }
}

// Checks Fresnel's equations for glass of index 1.5.
TEST(RenderGlass, SurfacesReflectByFresnel) {
  GlassScene s;
  Grid grid;
  grid.fill_box({{0, 0, 0}, {1, 1, 1}}, s.glass);
  s.scene.edit(place(s.scene, std::move(grid))).rotation = glm::angleAxis(0.5, glm::normalize(DVec3(1, 2, 3)));
  const SceneTracer tracer(s.scene);
  const SceneView view(tracer, DVec3(0.0));
  const glm::dmat3& axes = placed_in(tracer)[0].world_axes;
  // Reflectance at an angle to the upper face, from outside or, with a cosine below 0, from inside.
  const auto at = [&](double cosine, float ior, float other) {
    const DVec3 direction = axes * DVec3(std::sqrt(1.0 - cosine * cosine), -cosine, 0.0);
    return mirror_at(view, {DVec3(0.0), 7.0 * direction}, 0, DVec3(0, 1, 0), ior, other);
  };
  EXPECT_NEAR(at(1.0, 1.0F, 1.5F).share, 0.04F, 1e-6F);
  EXPECT_NEAR(at(1.0, 1.0F, 1.5F).up, axes[1].y, 1e-6);
  // At Brewster's angle one polarisation is not reflected: ((n^2 - 1) / (n^2 + 1))^2 / 2 is left.
  const double brewster = 1.0 / std::sqrt(1.0 + 1.5 * 1.5);
  EXPECT_NEAR(at(brewster, 1.0F, 1.5F).share, 0.5 * (1.25 / 3.25) * (1.25 / 3.25), 1e-6);
  EXPECT_NEAR(at(0.0, 1.0F, 1.5F).share, 1.0F, 1e-6F);
  for (const double cosine : {0.0, 0.01, 0.3, 0.8, 1.0}) {
    EXPECT_NEAR(at(cosine, 1.5F, 1.0F).share, at(-cosine, 1.0F, 1.5F).share, 1e-5F) << "the same from inside";
    EXPECT_EQ(at(cosine, 1.5F, 1.5F).share, 0.0F) << "between equals there is no surface";
    EXPECT_NEAR(at(cosine, 1.3F * 1.2F, 1.3F).share, at(cosine, 1.2F, 1.0F).share, 1e-5F);
  }
}

// Compares images with and without reflecting surfaces: a pane on stone, and a pane above it.
TEST(RenderGlass, SurfacesReflectSkyAndDimBackground) {
  for (const int gap : {0, 3}) {
    GlassScene s;
    Grid grid;
    grid.fill_box({{-5, -1, -5}, {6, 0, 6}}, s.stone);
    Grid pane;
    pane.fill_box({{-5, 0, -5}, {6, 2, 6}}, s.glass);
    place(s.scene, std::move(grid));
    // A separate grid, so that the touching faces are rounded twice.
    place(s.scene, std::move(pane), {0.1, 0.1 + gap, 0.1});
    RenderOptions options = sized(4, 4);
    environment_in(options).sun.direction = {0, 1, 0};
    options.light.shadows = false;
    options.light.occlusion_mode = OcclusionMode::Off;
    options.light.glass_surfaces = true;
    const RenderedImage image = taken(s.scene, from_above(0, 20, 0, 4), options);
    const Vec3 light(1.0F + 0.1F);
    const Vec3 zenith = sky_colour(1.0F);
    const Vec3 passed = power(through_one(), 2.0F);
    Vec3 behind = linear(kWhite) * light;
    // Light that the lower surface reflects passes the pane a second time.
    if (gap != 0) behind = 0.96F * behind + 0.04F * passed * zenith;
    const float own = 1.0F - (1.0F - kAlpha) * (1.0F - kAlpha);
    expect_near(pixel_at(image, 1, 2),
                encoded(0.04F * zenith + 0.96F * (own * linear(kGlass) * light + passed * behind)), 1);
  }
}

TEST(RenderGlass, SurfacesDependOnIndexAndLitMode) {
  const auto scene_with = [](float ior, float other_ior, bool is_split) {
    GlassScene s;
    for (const auto& [type, index] : {std::pair{s.glass, ior}, std::pair{s.green, other_ior}}) {
      VoxelProperties properties = s.scene.types[type];
      properties.ior = index;
      s.scene.types.replace(type, properties);
    }
    Grid grid;
    grid.fill_box({{-9, -1, -9}, {10, 0, 10}}, s.stone);
    grid.fill_box({{-4, 1, -4}, {0, 5, 5}}, s.glass);
    Grid other;
    (is_split ? other : grid).fill_box({{0, 1, -4}, {5, 5, 5}}, s.green);
    place(s.scene, std::move(grid));
    if (is_split) place(s.scene, std::move(other));
    return std::move(s.scene);
  };
  const Camera camera = towards({9, 8, 11}, {0, 1, 0});
  RenderOptions plain = sized(90, 70);
  RenderOptions with_surfaces = plain;
  with_surfaces.light.glass_surfaces = true;
  const auto differ = [&](const Scene& a, const Scene& b) {
    return count_different(taken(a, camera, with_surfaces), taken(b, camera, with_surfaces), 1);
  };
  const Scene glass = scene_with(1.5F, 1.5F, false);
  EXPECT_GT(count_different(taken(glass, camera, plain), taken(glass, camera, with_surfaces), 2), 500);
  EXPECT_GT(differ(glass, scene_with(1.5F, 1.33F, false)), 100);
  EXPECT_EQ(differ(scene_with(1.5F, 1.33F, false), scene_with(1.5F, 1.33F, true)), 0) << "in two grids";
  // Glass with the index of air, or with an invalid index, reflects no light.
  const Scene airy = scene_with(1.0F, std::numeric_limits<float>::quiet_NaN(), false);
  EXPECT_EQ(taken(airy, camera, with_surfaces).colour.rgb, taken(airy, camera, plain).colour.rgb);
  for (const Shading shading : {Shading::Unlit, Shading::Occlusion, Shading::Normals}) {
    plain.light.shading = with_surfaces.light.shading = shading;
    EXPECT_EQ(taken(glass, camera, with_surfaces).colour.rgb, taken(glass, camera, plain).colour.rgb);
  }
}

// Fully covering glass, deep seas and grazing rays must give finite numbers.
TEST(RenderGlass, OpaqueAndDeepGlassStaysFinite) {
  Scene scene;
  const VoxelType ink = add_type(scene, {0, 0, 0, 255}, Visibility::Transparent);
  const VoxelType clear = add_type(scene, {255, 255, 255, 0}, Visibility::Transparent);
  Grid grid;
  grid.fill_box({{-50, -50, -50}, {51, 1, 1}}, ink);
  grid.fill_box({{-50, -50, 1}, {51, 1, 51}}, clear);
  place(scene, std::move(grid));
  RenderOptions options = sized(64, 48);
  const RenderedImage image = taken(scene, towards({0, 1.0, 60}, {0, 0, 0}, 1.5), options);
  Scene empty;
  const RenderedImage sky = taken(empty, towards({0, 1.0, 60}, {0, 0, 0}, 1.5), options);
  EXPECT_EQ(pixel_at(image, 32, 0), pixel_at(sky, 32, 0));
  EXPECT_GT(count_different(image, sky, 10), 100);
  const RenderedImage inside = taken(scene, towards({0, -5, -5}, {1, -6, -9}), sized(8, 8));
  for (const std::uint8_t byte : inside.colour.rgb) EXPECT_EQ(byte, 0);
}

}  // namespace
}  // namespace quoin
