// Path-traced images of scenes with analytically known light.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/core/hash.h>
#include <quoin/grid/grid.h>
#include <quoin/render/path_tracer.h>

#include "core/instruction_sets_for_tests.h"
#include "core/srgb.h"
#include "render/cpu/environment_for_tests.h"
#include "render/cpu/render_test_support.h"
#include "render/path/town_for_tests.h"

namespace quoin {
namespace {

using render_test::add_type;
using render_test::from_above;
using render_test::of_town;
using render_test::path_image;
using render_test::place;
using render_test::towards;
using render_test::town;
using render_test::under_even_sky;

constexpr Rgba8 kWhite{255, 255, 255, 255};
constexpr Rgba8 kGrey{188, 188, 188, 255};
constexpr double kPi = std::numbers::pi;

Vec3 mean(const PathImage& image) {
  DVec3 sum(0.0);
  for (const Vec3& light : image.radiance) sum += DVec3(light);
  return Vec3(sum / static_cast<double>(image.radiance.size()));
}

Scene cube_of(Rgba8 colour, int edge = 8, float emission = 0.0F) {
  Scene scene;
  const VoxelType type = add_type(scene, colour, Visibility::Opaque, emission);
  Grid grid;
  grid.fill_box({IVec3(0), IVec3(edge)}, type);
  place(scene, std::move(grid));
  return scene;
}

// Returns a closed room of inner edge `edge` whose wall towards +y has another type; the camera is inside.
Scene room(int edge, VoxelProperties walls, VoxelProperties ceiling) {
  Scene scene;
  const VoxelType wall = scene.types.add(walls).value_or(kAir);
  const VoxelType top = scene.types.add(ceiling).value_or(kAir);
  Grid grid;
  grid.fill_box({IVec3(-1), IVec3(edge + 1)}, wall);
  grid.fill_box({{-1, edge, -1}, {edge + 1, edge + 1, edge + 1}}, top);
  grid.fill_box({IVec3(0), IVec3(edge)}, kAir);
  place(scene, std::move(grid));
  return scene;
}

VoxelProperties of_colour(Rgba8 colour, float emission = 0.0F) {
  VoxelProperties properties;
  properties.colour = colour;
  properties.emission = emission;
  return properties;
}

Camera looking(DVec3 position, DVec3 forward, DVec3 up, double view_height) {
  Camera camera;
  camera.position = position;
  camera.forward = forward;
  camera.up = up;
  camera.right = glm::cross(forward, up);
  camera.projection = Camera::Projection::Orthographic;
  camera.view_height = view_height;
  return camera;
}

TEST(PathTracer, ConvexBodyUnderUniformSkyShowsAlbedo) {
  const Scene scene = cube_of(kGrey);
  const PathImage image = path_image(scene, from_above(4.0, 20.0, 4.0, 6.0), under_even_sky(16, 16, 4));
  for (const Vec3& light : image.radiance) EXPECT_NEAR(light.x, linear_from_srgb(std::uint8_t{188}), 1e-6F);
  EXPECT_EQ(image.pixels_hit, 256);
}

// E (1 - a^(n+1)) / (1 - a) after n bounces.
TEST(PathTracer, EmissiveBoxFillsWithLight) {
  const float albedo = linear_from_srgb(std::uint8_t{188});
  const Scene scene = room(6, of_colour(kGrey, 1.0F), of_colour(kGrey, 1.0F));
  for (const int bounces : {0, 1, 2, 5, 40}) {
    PathOptions options = under_even_sky(16, 16, 64);
    options.max_bounces = bounces;
    const float light = mean(path_image(scene, towards({3.0, 3.0, 3.0}, {3.0, 2.0, 0.0}), options)).x;
    const float expected = albedo * (1.0F - std::pow(albedo, static_cast<float>(bounces + 1))) / (1.0F - albedo);
    EXPECT_NEAR(light / expected, 1.0F, 0.01F) << bounces;
  }
}

// The fraction of light from one wall of a cube that reaches another wall.
TEST(PathTracer, MatchesFormFactorsOfCube) {
  constexpr int kEdge = 8;
  const Scene scene = room(kEdge, of_colour(kGrey), of_colour({255, 255, 255, 255}, 1.0F));
  const float albedo = linear_from_srgb(std::uint8_t{188});
  PathOptions options = under_even_sky(32, 32, 256);
  options.max_bounces = 1;
  const PathImage opposite = path_image(scene, looking(DVec3(4.0), {0, -1, 0}, {0, 0, -1}, kEdge), options);
  EXPECT_NEAR(mean(opposite).x / albedo, 0.199825F, 0.001F);
  const PathImage adjacent = path_image(scene, looking(DVec3(4.0), {1, 0, 0}, {0, 1, 0}, kEdge), options);
  EXPECT_NEAR(mean(adjacent).x / albedo, 0.200044F, 0.001F);
}

// Above black ground a surface inclined by phi sees (1 + cos phi) / 2 of a uniform sky.
TEST(PathTracer, SlopeReceivesVisibleShareOfSky) {
  for (const double degrees : {0.0, 30.0, 60.0, 90.0}) {
    Scene scene = cube_of(kGrey, 4);
    const double angle = degrees * kPi / 180.0;
    const InstanceHandle handle = scene.instances().handles().front();
    Instance& moved = scene.edit(handle);
    moved.rotation = glm::angleAxis(angle, DVec3(1, 0, 0));
    const DVec3 normal = moved.rotation * DVec3(0, 1, 0);
    const DVec3 middle = moved.position + moved.rotation * DVec3(2, 4, 2);
    PathOptions options = under_even_sky(8, 8, 256);
    options.max_bounces = 1;
    physical_in(options).ground.emplace();
    physical_in(options).ground->colour = Vec3(0.0F);
    physical_in(options).ground->height = -1000.0;
    const Camera camera = looking(middle + normal * 3.0, -normal, moved.rotation * DVec3(0, 0, -1), 2.0);
    const float light = mean(path_image(scene, camera, options)).x / linear_from_srgb(std::uint8_t{188});
    EXPECT_NEAR(light, 0.5 * (1.0 + std::cos(angle)), 0.01) << degrees;
  }
}

// A square lamp above a plate, by Lambert's formula.
TEST(PathTracer, SquareLampMatchesLambertFormula) {
  Scene scene;
  const VoxelType plate = add_type(scene, kGrey);
  const VoxelType lamp = add_type(scene, kWhite, Visibility::Opaque, 3.0F);
  const VoxelType black = add_type(scene, {0, 0, 0, 255});
  Grid grid;
  grid.fill_box({{-20, 0, -20}, {21, 1, 21}}, plate);
  grid.fill_box({{-2, 6, -2}, {3, 7, 3}}, lamp);
  grid.fill_box({{-3, 7, -3}, {4, 8, 4}}, black);
  grid.fill_box({{-3, 6, -3}, {4, 7, -2}}, black);
  grid.fill_box({{-3, 6, 3}, {4, 7, 4}}, black);
  grid.fill_box({{-3, 6, -3}, {-2, 7, 4}}, black);
  grid.fill_box({{3, 6, -3}, {4, 7, 4}}, black);
  place(scene, std::move(grid));
  PathOptions options = under_even_sky(8, 8, 64);
  physical_in(options).sky.colour = Vec3(0.0F);
  options.max_bounces = 1;
  for (const double x : {0.5, 6.5, 15.5}) {
    const DVec3 point{x, 1.0, 0.5};
    double sum = 0.0;
    const DVec3 corners[] = {{-2, 6, -2}, {3, 6, -2}, {3, 6, 3}, {-2, 6, 3}};
    for (int i = 0; i < 4; ++i) {
      const DVec3 a = glm::normalize(corners[i] - point);
      const DVec3 b = glm::normalize(corners[(i + 1) % 4] - point);
      sum += std::acos(glm::dot(a, b)) * glm::normalize(glm::cross(a, b)).y;
    }
    const double expected = linear_from_srgb(std::uint8_t{188}) / kPi * std::abs(sum) * 0.5 * 3.0;
    const Camera camera = looking(point + DVec3(0, 2, 0), {0, -1, 0}, {0, 0, -1}, 0.05);
    EXPECT_NEAR(mean(path_image(scene, camera, options)).x / expected, 1.0, 0.01) << x;
  }
}

TEST(PathTracer, SunLightFollowsCosine) {
  Scene scene = cube_of(kGrey);
  PathOptions options = under_even_sky(8, 8, 16);
  physical_in(options).sky.colour = Vec3(0.0F);
  physical_in(options).sun.brightness = 1.0;
  physical_in(options).sun.direction = {0.0, 1.0, 1.0};
  for (const double angle : {0.0, 0.0093}) {
    physical_in(options).sun.angle_radians = angle;
    const float light = mean(path_image(scene, from_above(4.0, 20.0, 4.0, 6.0), options)).x;
    EXPECT_NEAR(light, linear_from_srgb(std::uint8_t{188}) * std::sqrt(0.5F), 1e-3F);
  }
}

// A penumbra is as wide as the sun's disc times the distance of the occluder.
TEST(PathTracer, PenumbraGrowsWithDistance) {
  Scene scene;
  const VoxelType type = add_type(scene, kWhite);
  Grid grid;
  grid.fill_box({{-20, 0, -20}, {20, 1, 20}}, type);
  grid.fill_box({{-20, 101, -20}, {0, 102, 20}}, type);
  place(scene, std::move(grid));
  PathOptions options = under_even_sky(256, 1, 256);
  physical_in(options).sky.colour = Vec3(0.0F);
  physical_in(options).sun.brightness = 1.0;
  physical_in(options).sun.direction = {0.0, 1.0, 0.0};
  options.max_bounces = 1;
  // 256 pixels across 5.12 voxels; the plate above ends at x = 0.
  const Camera camera = looking({0.0, 50.0, 0.0}, {0, -1, 0}, {0, 0, -1}, 5.12 / 256.0);
  const PathImage image = path_image(scene, camera, options);
  const auto share = [&](double x) { return image.radiance[static_cast<std::size_t>(x / 5.12 * 256.0 + 128.0)].x; };
  const double width = 0.0093 * 100.0;
  EXPECT_NEAR(share(-0.6 * width), 0.0F, 1e-3F);
  EXPECT_NEAR(share(0.0), 0.5F, 0.05F);
  EXPECT_NEAR(share(0.6 * width), 1.0F, 1e-3F);
  // The area of a disc beyond a chord at a quarter of its diameter from its edge.
  EXPECT_NEAR(share(-0.25 * width), 1.0 / 3.0 - std::sqrt(3.0) / (4.0 * kPi), 0.03);
}

Grid voxel_sphere(int radius, VoxelType type) {
  Grid grid;
  for (int z = -radius; z <= radius; ++z) {
    for (int y = -radius; y <= radius; ++y) {
      for (int x = -radius; x <= radius; ++x) {
        if (x * x + y * y + z * z <= radius * radius) grid.set({x, y, z}, type);
      }
    }
  }
  return grid;
}

// White furnace: a surface that reflects all light is invisible at any gloss.
TEST(PathTracer, WhiteBallVanishesInWhiteSky) {
  for (const auto& [rough, metal] : {std::pair{1.0F, 0.0F}, {0.4F, 0.0F}, {0.4F, 1.0F}, {0.0F, 1.0F}}) {
    Scene scene;
    VoxelProperties properties = of_colour(kWhite);
    properties.roughness = rough;
    properties.metalness = metal;
    place(scene, voxel_sphere(6, scene.types.add(properties).value_or(kAir)));
    PathOptions options = under_even_sky(32, 32, 256);
    options.max_bounces = 1024;
    const PathImage image = path_image(scene, towards({0.5, 8.0, 25.0}, DVec3(0.5), 0.6), options);
    EXPECT_NEAR(mean(image).x, 1.0F, 0.01F) << rough << " " << metal;
    for (const Vec3& light : image.radiance) EXPECT_NEAR(light.x, 1.0F, 0.15F);
  }
}

// Clear glass absorbs no light, with any refraction and reflection.
TEST(PathTracer, ClearGlassVanishesInWhiteSky) {
  Scene scene;
  VoxelProperties properties = of_colour({255, 255, 255, 0});
  properties.visibility = Visibility::Transparent;
  properties.ior = 1.5F;
  place(scene, voxel_sphere(6, scene.types.add(properties).value_or(kAir)));
  PathOptions options = under_even_sky(32, 32, 64);
  const PathImage image = path_image(scene, towards({0.5, 8.0, 25.0}, DVec3(0.5), 0.6), options);
  EXPECT_NEAR(mean(image).x, 1.0F, 0.003F);
}

TEST(PathTracer, GlassRefractsBackground) {
  // A thick pane in front of a wall that is black on one half: seen at an angle, the edge is displaced.
  const auto rendered_of = [](float ior) {
    Scene scene;
    const VoxelType black = add_type(scene, {0, 0, 0, 255});
    const VoxelType white = add_type(scene, kWhite, Visibility::Opaque, 1.0F);
    VoxelProperties properties = of_colour({255, 255, 255, 0});
    properties.visibility = Visibility::Transparent;
    properties.ior = ior;
    const VoxelType glass = scene.types.add(properties).value_or(kAir);
    Grid grid;
    grid.fill_box({{-40, -40, -1}, {0, 40, 0}}, black);
    grid.fill_box({{0, -40, -1}, {40, 40, 0}}, white);
    grid.fill_box({{-40, -40, 2}, {40, 40, 12}}, glass);
    place(scene, std::move(grid));
    PathOptions options = under_even_sky(200, 1, 64);
    physical_in(options).sky.colour = Vec3(0.0F);
    const DVec3 forward = glm::normalize(DVec3(1, 0, -1));
    return path_image(scene, looking(DVec3(0, 0, 0) - forward * 40.0, forward, {0, 1, 0}, 20.0 / 200.0), options);
  };
  const auto edge_of = [](const PathImage& image) {
    float sum = 0.0F;
    for (const Vec3& light : image.radiance) sum += std::min(light.x / 0.9F, 1.0F);
    return 200.0F - sum;  // white lies to the right
  };
  const PathImage plain = rendered_of(1.0F);
  const PathImage bent = rendered_of(1.5F);
  // The displacement of a ray at 45 degrees by glass of thickness 10 and index 1.5, seen across: in pixels of 0.1.
  const double inside = std::asin(std::sin(kPi / 4.0) / 1.5);
  const double moved = 10.0 * std::sin(kPi / 4.0 - inside) / std::cos(inside) / 0.1;
  EXPECT_NEAR(std::abs(edge_of(bent) - edge_of(plain)), moved, 6.0);
}

TEST(PathTracer, ClosedRoomWithoutLampsIsBlack) {
  const Scene scene = room(6, of_colour(kWhite), of_colour(kWhite));
  PathOptions options = under_even_sky(16, 16, 16);
  physical_in(options).sun.brightness = 1.0;
  options.max_bounces = 16;
  for (const Vec3& light : path_image(scene, towards({3.0, 3.0, 3.0}, {3.0, 2.0, 0.0}), options).radiance) {
    EXPECT_EQ(light.x, 0.0F);
  }
}

TEST(PathTracer, ExtremeLampStaysFinite) {
  const Scene scene = room(6, of_colour(kGrey), of_colour(kWhite, 1e9F));
  const PathImage image = path_image(scene, towards({3.0, 3.0, 3.0}, {3.0, 5.0, 0.0}), under_even_sky(16, 16, 32));
  for (const Vec3& light : image.radiance) {
    EXPECT_TRUE(std::isfinite(light.x));
    EXPECT_GE(light.x, 0.0F);
    EXPECT_LE(light.x, 1e9F * 4.0F);
  }
  EXPECT_TRUE(develop(image).has_value());
}

// Light from lamp hits and from lamp samples agrees: here a lamp without gloss next to mirrors.
TEST(PathTracer, LampAndPathSamplingAgreeOnGloss) {
  for (const float rough : {0.15F, 0.35F, 0.6F}) {
    VoxelProperties walls = of_colour(kGrey);
    walls.roughness = rough;
    walls.metalness = 0.5F;
    // Everything except the floor emits, and the room is closed, so that any path ends in light of 1.
    Scene scene = room(8, walls, of_colour(kWhite, 1.0F));
    PathOptions options = under_even_sky(16, 16, 256);
    options.max_bounces = 1;
    const float by_both = mean(path_image(scene, towards({4.0, 4.0, 4.0}, {4.5, 0.0, 4.2}), options)).x;
    // The same light from an environment: with the ceiling removed and a sky of 1, only chance finds it.
    Scene open = room(8, walls, of_colour(kWhite));
    open.edit(open.grids().handles().front()).grid.fill_box({{-1, 8, -1}, {9, 9, 9}}, kAir);
    const float by_chance = mean(path_image(open, towards({4.0, 4.0, 4.0}, {4.5, 0.0, 4.2}), options)).x;
    EXPECT_NEAR(by_both / by_chance, 1.0F, 0.03F) << rough;
  }
}

PathOptions quick() {
  PathOptions options;
  options.width = 70;
  options.height = 45;
  options.samples = 6;
  options.layers = true;
  return options;
}

TEST(PathTracer, GivesSameBitsForAnyThreadsAndInstructions) {
  const Scene scene = town();
  const PathImage expected = path_image(scene, of_town(), quick(), {1});
  for (const InstructionSet set : sets_of_this_machine()) {
    const InstructionSetOverride over(set);
    const PathImage image = path_image(scene, of_town(), quick(), {3});
    EXPECT_EQ(image.radiance, expected.radiance) << name_in_tests(set);
    EXPECT_EQ(image.alpha, expected.alpha);
    EXPECT_EQ(image.normal, expected.normal);
    EXPECT_EQ(image.depth.values, expected.depth.values);
    EXPECT_EQ(image.rays, expected.rays);
  }
}

TEST(PathTracer, MatchesImageFarFromOrigin) {
  const Scene near = town();
  Scene far = town();
  const DVec3 there{3e6, -1e6, 7e6};
  for (const InstanceHandle handle : far.instances().handles()) {
    Instance& moved = far.edit(handle);
    moved.position += there;
  }
  for (Lamp& lamp : far.lamps) lamp.position += there;
  Camera camera = of_town();
  const Vec3 expected = mean(path_image(near, camera, quick()));
  camera.position += there;
  const Vec3 light = mean(path_image(far, camera, quick()));
  EXPECT_NEAR(light.x / expected.x, 1.0F, 0.02F);
}

TEST(PathTracer, FollowsEditsOfVoxelsTypesAndInstances) {
  Scene scene = town();
  PathTracer tracer(scene);
  ASSERT_TRUE(tracer.render(of_town(), quick()).has_value());
  scene.edit(scene.grids().handles().front()).grid.fill_box({{14, 2, 8}, {16, 4, 10}}, VoxelType{3});
  VoxelProperties red = scene.types[1];
  red.colour = {220, 30, 30, 255};
  scene.types.replace(1, red);
  const InstanceHandle ship = scene.instances().handles().back();
  Instance& moved = scene.edit(ship);
  moved.position.y += 3.0;
  tracer.update();
  const auto followed = tracer.render(of_town(), quick());
  ASSERT_TRUE(followed.has_value());
  EXPECT_EQ(followed->radiance, path_image(scene, of_town(), quick()).radiance);
}

TEST(PathTracer, LayersDescribePixels) {
  const Scene scene = cube_of(kGrey);
  PathOptions options = under_even_sky(16, 16, 4);
  options.layers = true;
  const PathImage image = path_image(scene, from_above(4.0, 20.0, 4.0, 16.0), options);
  const std::size_t middle = 8 * 16 + 8;
  EXPECT_NEAR(image.albedo[middle].x, linear_from_srgb(std::uint8_t{188}), 1e-6F);
  EXPECT_NEAR(image.normal[middle].y, 1.0F, 1e-6F);
  EXPECT_NEAR(image.depth.values[middle], 12.0F, 1e-4F);
  EXPECT_EQ(image.types[middle], 1);
  EXPECT_EQ(image.instances[middle], 1U + scene.instances().handles().front().index);
  EXPECT_EQ(image.alpha[middle], 1.0F);
  EXPECT_EQ(image.alpha[0], 0.0F);
  EXPECT_EQ(image.types[0], kAir);
  EXPECT_EQ(image.depth.values[0], std::numeric_limits<float>::infinity());
  EXPECT_EQ(image.scene[0], Vec3(0.0F));
  EXPECT_EQ(image.radiance[0], Vec3(1.0F));
}

TEST(PathTracer, InvisibleGroundCatchesShadows) {
  const Scene scene = cube_of(kGrey);
  PathOptions options = under_even_sky(64, 64, 64);
  physical_in(options).sun.brightness = 1.0;
  physical_in(options).sun.direction = {1.0, 1.0, 0.0};
  physical_in(options).ground.emplace();
  physical_in(options).ground->only_shadows = true;
  const PathImage image = path_image(scene, from_above(4.0, 30.0, 4.0, 64.0), options);
  const auto at = [](int x, int y) { return static_cast<std::size_t>(y * 64 + x); };
  // Far away the image shows only the background.
  EXPECT_NEAR(image.radiance[at(60, 4)].x, 1.0F, 0.03F);
  EXPECT_NEAR(image.alpha[at(60, 4)], 0.0F, 0.03F);
  // The cube's shadow lies to the left of the cube: the pixel's right is +x.
  EXPECT_LT(image.radiance[at(25, 32)].x, 0.7F);
  EXPECT_GT(image.alpha[at(25, 32)], 0.3F);
  EXPECT_EQ(image.alpha[at(32, 32)], 1.0F);
}

TEST(PathTracer, FocusedObjectsStaySharp) {
  Scene scene;
  const VoxelType black = add_type(scene, {0, 0, 0, 255});
  const VoxelType white = add_type(scene, kWhite, Visibility::Opaque, 1.0F);
  Grid grid;
  grid.fill_box({{-40, -40, 0}, {0, 40, 1}}, black);
  grid.fill_box({{0, -40, 0}, {40, 40, 1}}, white);
  place(scene, std::move(grid));
  PathOptions options = under_even_sky(64, 4, 64);
  physical_in(options).sky.colour = Vec3(0.0F);
  options.lens.radius = 1.0;
  const auto grey_pixels = [&](double focus) {
    options.lens.focus_distance = focus;
    int grey = 0;
    for (const Vec3& light : path_image(scene, towards({0.013, 0.0, 21.0}, {0.013, 0.0, 0.0}, 0.02), options).scene) {
      grey += light.x > 0.05F && light.x < 0.95F;
    }
    return grey;
  };
  EXPECT_LE(grey_pixels(20.0), 8);
  EXPECT_GT(grey_pixels(10.0), 50);
}

TEST(PathTracer, OnePixelEnvironmentIsUniformSky) {
  const Scene scene = cube_of(kGrey);
  PathOptions options = under_even_sky(8, 8, 256);
  physical_in(options).sky.model = SkyModel::Image;
  physical_in(options).sky.image = std::make_shared<const RadianceImage>(RadianceImage{1, 1, {0.5F, 0.5F, 0.5F}});
  const float light = mean(path_image(scene, from_above(4.0, 20.0, 4.0, 6.0), options)).x;
  EXPECT_NEAR(light, 0.5F * linear_from_srgb(std::uint8_t{188}), 0.01F);
}

// Random walls and covered lamps on a floor of 256 voxels; everything is black except the floor.
Scene dim_yard() {
  Scene scene;
  const VoxelType floor = add_type(scene, kGrey);
  const VoxelType lamp = add_type(scene, kWhite, Visibility::Opaque, 8.0F);
  const VoxelType black = add_type(scene, {0, 0, 0, 255});
  std::uint32_t state = 1;
  const auto below = [&](std::uint32_t count) {
    return static_cast<int>((state = mix_bits(state + 0x9E37'79B9U)) % count);
  };
  constexpr int kEdge = 256;
  Grid grid;
  grid.fill_box({{0, -1, 0}, {kEdge, 0, kEdge}}, floor);
  for (int x = 0; x < kEdge; x += 16) {
    for (int z = 0; z < kEdge; z += 16) {
      if (below(2) != 0) grid.fill_box({{x, 0, z}, {x + 1, 7, z + 14}}, black);
      if (below(2) != 0) grid.fill_box({{x, 0, z}, {x + 14, 7, z + 1}}, black);
    }
  }
  for (int i = 0; i < 60; ++i) {
    const IVec3 at{below(kEdge), 2 + below(4), below(kEdge)};
    grid.set(at, lamp);
    grid.set(at + IVec3{0, 1, 0}, black);
  }
  place(scene, std::move(grid));
  return scene;
}

// Each pixel covers one position, so the position learns from the pixel's own samples.
TEST(PathTracer, LearnedLampSharesKeepBrightness) {
  const Scene scene = dim_yard();
  const PathTracer tracer(scene);
  PathOptions options = under_even_sky(32, 32, 4);
  physical_in(options).sky.brightness = 0.0;
  options.max_bounces = 1;
  double forgetful = 0.0;  // the first four samples have learned no shares
  double remembering = 0.0;
  for (options.seed = 0; options.seed < 100; ++options.seed) {
    for (const int samples : {4, 8}) {
      options.samples = samples;
      const auto image = tracer.render(from_above(128.0, 100.0, 128.0, 256.0), options);
      ASSERT_TRUE(image.has_value());
      (samples == 4 ? forgetful : remembering) += static_cast<double>(mean(*image).x);
    }
  }
  EXPECT_NEAR(remembering / forgetful, 1.0, 0.02);
}

TEST(PathTracer, RejectsInvalidInput) {
  const Scene scene = cube_of(kGrey);
  const PathTracer tracer(scene);
  const Camera camera = from_above(4.0, 20.0, 4.0, 6.0);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [&](auto change) {
    PathOptions options = under_even_sky(4, 4, 1);
    change(options);
    const auto image = tracer.render(camera, options);
    return !image && image.error().code == ErrorCode::InvalidArgument;
  };
  EXPECT_FALSE(refused([](PathOptions&) {}));
  EXPECT_TRUE(refused([](PathOptions& o) { o.width = 0; }));
  EXPECT_TRUE(refused([](PathOptions& o) { o.samples = 0; }));
  EXPECT_TRUE(refused([](PathOptions& o) { o.max_bounces = -1; }));
  EXPECT_TRUE(refused([](PathOptions& o) { physical_in(o).sun.direction = DVec3(0.0); }));
  EXPECT_TRUE(refused([](PathOptions& o) { physical_in(o).sun.direction.x = kNan; }));
  EXPECT_TRUE(refused([](PathOptions& o) { physical_in(o).sun.angle_radians = -0.1; }));
  EXPECT_TRUE(refused([](PathOptions& o) { physical_in(o).sun.brightness = kNan; }));
  EXPECT_TRUE(refused([](PathOptions& o) { physical_in(o).sky.brightness = -1.0; }));
  EXPECT_TRUE(refused([](PathOptions& o) { physical_in(o).lamp_brightness = 1e10; }));
  EXPECT_TRUE(refused([](PathOptions& o) { physical_in(o).sky.colour.y = -1.0F; }));
  EXPECT_TRUE(refused([](PathOptions& o) { physical_in(o).sky.air.mie = kNan; }));
  EXPECT_TRUE(refused([](PathOptions& o) { o.lens.radius = kNan; }));
  EXPECT_TRUE(refused([](PathOptions& o) { o.lens.focus_distance = 0.0; }));
  EXPECT_TRUE(refused([](PathOptions& o) { physical_in(o).sky.model = SkyModel::Image; }));
  EXPECT_TRUE(refused([](PathOptions& o) { physical_in(o).ground.emplace().height = kNan; }));
  EXPECT_TRUE(refused([](PathOptions& o) { physical_in(o).ground.emplace().colour = Vec3(2.0F); }));
  Camera wrong = camera;
  wrong.position.x = kNan;
  EXPECT_FALSE(tracer.render(wrong, under_even_sky(4, 4, 1)).has_value());
}

TEST(PathTracer, StopsWhenCancelled) {
  const Scene scene = town();
  int calls = 0;
  const auto image = PathTracer(scene).render(of_town(), quick(), {2}, [&](double) { return ++calls < 3; });
  ASSERT_FALSE(image.has_value());
  EXPECT_EQ(image.error().code, ErrorCode::Cancelled);
  EXPECT_LE(calls, 4);
}

TEST(PathTracer, DrawsSkyForEmptyScene) {
  const Scene scene;
  PathOptions options = under_even_sky(8, 8, 2);
  physical_in(options).ground.emplace();
  const PathImage image = path_image(scene, towards({0.0, 5.0, 10.0}, {0.0, 5.0, 0.0}), options);
  EXPECT_EQ(image.radiance.front(), Vec3(1.0F));
  EXPECT_NEAR(image.radiance.back().x, 0.5F, 1e-6F);
}

}  // namespace
}  // namespace quoin
