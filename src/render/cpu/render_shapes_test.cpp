// Shapes of voxel types in ray-traced images.

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <quoin/mesh/blocky.h>
#include <quoin/scene/scene_query.h>

#include "core/work/nightly_for_tests.h"
#include "grid/shapes/shape_types_for_tests.h"
#include "render/cpu/render_test_support.h"
#include "render/light/glass_bodies.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {
namespace {

using namespace render_test;

// Red, green, blue and white quarters, so that each turn and mirror looks different.
Texture quarters() {
  AlphaImage image{16, 16, {}};
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      const bool is_right = x >= 8;
      const bool is_low = y >= 8;
      const std::array<std::uint8_t, 4> texel = {std::uint8_t(!is_right || is_low ? 255 : 0),
                                                 std::uint8_t(is_right ? 255 : 0), std::uint8_t(is_low ? 255 : 0), 255};
      image.rgba.insert(image.rgba.end(), texel.begin(), texel.end());
    }
  }
  return Texture::from_image("quarters", image).value();
}

// A texture whose left half is invisible.
Texture right_half(std::uint8_t alpha_of_left = 0) {
  AlphaImage image{16, 16, {}};
  for (int i = 0; i < 256; ++i) {
    const std::array<std::uint8_t, 4> texel = {30, 200, 30, i % 16 >= 8 ? std::uint8_t{255} : alpha_of_left};
    image.rgba.insert(image.rgba.end(), texel.begin(), texel.end());
  }
  return Texture::from_image("half", image).value();
}

// Random cubes, of types that are cubes or have a shape that is one.
Scene cubes(bool with_shapes, bool has_textures) {
  std::mt19937 random(3);
  Scene scene;
  std::vector<VoxelType> types;
  for (int i = 0; i < 4; ++i) {
    VoxelProperties properties{.name = std::to_string(i)};
    properties.colour = {static_cast<std::uint8_t>(60 * i), 200, static_cast<std::uint8_t>(255 - 50 * i), 255};
    if (has_textures) {
      std::array<VoxelFace, 6> faces;
      for (VoxelFace& face : faces) {
        face.texture = quarters();
        face.turn = static_cast<std::uint8_t>(random() % 4);
        face.mirrored = random() % 2 == 0;
      }
      properties.faces = VoxelFaces(faces);
    }
    if (with_shapes && i > 0) properties.shapes = VoxelShape::box({0, 0, 0}, {16, 16, 16});
    types.push_back(*scene.types.add(properties));
  }
  Grid grid;
  grid.fill_box({{-20, -3, -20}, {20, 0, 20}}, types[0]);
  for (int i = 0; i < 200; ++i) {
    const auto at = [&](int size) { return static_cast<int>(random() % static_cast<unsigned>(size)); };
    grid.set({at(36) - 18, at(5), at(36) - 18}, types[random() % 4]);
  }
  const InstanceHandle first = place(scene, grid.snapshot());
  scene.edit(first).rotation = glm::angleAxis(0.3, DVec3(0.0, 1.0, 0.0));
  place(scene, std::move(grid), {10.0, 12.0, 0.0});
  scene.lamps.push_back({.position = {3.2, 7.1, 4.3}, .intensity = 60.0});
  return scene;
}

TEST(RenderShapes, CubeAsShapeLooksLikeCube) {
  const Camera camera = towards({22.0, 20.0, 31.0}, {0.0, 2.0, 0.0});
  for (const bool has_textures : {false, true}) {
    for (const bool has_lamps : {false, true}) {
      RenderOptions options = sized(96, 64);
      if (has_lamps) options.light = natural_light();
      const RenderedImage a = taken(cubes(true, has_textures), camera, options);
      const RenderedImage b = taken(cubes(false, has_textures), camera, options);
      EXPECT_EQ(count_different(a, b, 1), 0) << "textures " << has_textures << ", lamps " << has_lamps;
      int depths = 0;
      for (std::size_t i = 0; i < a.depth.values.size(); ++i) {
        depths += std::abs(a.depth.values[i] - b.depth.values[i]) > 1e-4F ? 1 : 0;
      }
      EXPECT_EQ(depths, 0);
    }
  }
}

TEST(RenderShapes, SlabShowsItsSidesAtTheirDistance) {
  Scene scene;
  const ShapeTypes types(scene.types);
  Grid grid;
  grid.set({0, 0, 0}, types.slab);
  place(scene, std::move(grid));
  const RenderedImage image = taken(scene, from_above(0.5, 10.0, 0.5, 2.0), unlit(16, 16));
  EXPECT_EQ(pixel_at(image, 8, 8), encoded(linear(scene.types[types.slab].colour)));
  EXPECT_FLOAT_EQ(depth_at(image, 8, 8), 9.5F);
  EXPECT_TRUE(std::isinf(depth_at(image, 1, 1)));
}

// A slab two voxels above the ground casts a shadow whose edges lie where its sides are.
TEST(RenderShapes, CastsHardShadowsOfItsForm) {
  Scene scene;
  const ShapeTypes types(scene.types);
  VoxelProperties post{.name = "post"};
  post.shapes = VoxelShape::box({4, 0, 4}, {12, 16, 12});
  const VoxelType type = *scene.types.add(post);
  Grid grid;
  grid.fill_box({{-8, -1, -8}, {8, 0, 8}}, types.stone);
  grid.set({0, 2, 0}, type);
  place(scene, std::move(grid));
  scene.environment = Environment{};
  scene.environment->sun.direction = {0.0, 1.0, 0.0};
  RenderOptions options = sized(64, 64);
  options.light.occlusion_mode = OcclusionMode::Off;
  // From below the post, so that the camera sees the ground under it.
  Camera camera = from_above(0.5, 1.5, 0.5, 2.0);
  const RenderedImage image = taken(scene, camera, options);
  const Pixel lit = pixel_at(image, 2, 2);
  const Pixel dark = pixel_at(image, 32, 32);
  EXPECT_GT(lit[0], dark[0] + 20);
  int wrong = 0;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const bool is_below = x >= 24 && x < 40 && y >= 24 && y < 40;
      wrong += pixel_at(image, x, y) == (is_below ? dark : lit) ? 0 : 1;
    }
  }
  EXPECT_EQ(wrong, 0);
}

TEST(RenderShapes, RaysAndShadowsPassCutoutTexels) {
  Scene scene;
  const ShapeTypes types(scene.types);
  VoxelProperties leaf{.name = "leaf", .visibility = Visibility::Transparent};
  leaf.faces = VoxelFaces(VoxelFace{.texture = right_half(), .alpha = FaceAlpha::Cutout});
  leaf.shapes = *VoxelShape::from_elements({{.min = {0, 8, 0}, .max = {16, 8, 16}}});  // a plate
  const VoxelType type = *scene.types.add(leaf);
  Grid grid;
  grid.fill_box({{-4, -1, -4}, {4, 0, 4}}, types.stone);
  grid.set({0, 0, 0}, type);
  place(scene, std::move(grid));
  const RenderedImage image = taken(scene, from_above(0.5, 10.0, 0.5, 1.0), unlit(32, 32));
  int near = 0;
  for (const float depth : image.depth.values) near += depth == 9.5F ? 1 : 0;
  EXPECT_EQ(near, 32 * 16);
  EXPECT_EQ(std::count(image.depth.values.begin(), image.depth.values.end(), 10.0F), 32 * 16);
  // Rays to the sun look at the lower side of the plate, whose visible half is at +X.
  scene.environment = Environment{};
  scene.environment->sun.direction = {0.0, 1.0, 0.0};
  RenderOptions options = sized(32, 32);
  options.light.occlusion_mode = OcclusionMode::Off;
  const RenderedImage below = taken(scene, from_above(0.5, 0.4, 0.5, 1.0), options);
  int wrong = 0;
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) wrong += (pixel_at(below, x, y)[0] < 100) == (x >= 16) ? 0 : 1;
  }
  EXPECT_EQ(wrong, 0);
}

// Leaves next to shapes: a shape hides a face only if it covers the whole side, as in the mesh.
TEST(RenderShapes, ShapesHideTheFacesOfCellsThatTheyCover) {
  Scene scene;
  const ShapeTypes types(scene.types);
  VoxelProperties leaves{.name = "leaves", .visibility = Visibility::Transparent};
  leaves.faces = VoxelFaces(VoxelFace{.texture = quarters(), .alpha = FaceAlpha::Cutout});
  const VoxelType leaf = *scene.types.add(leaves);
  const std::array<VoxelType, 8> near = {kAir,         types.stone, types.slab,  types.stairs,
                                         types.stairs, types.water, types.fence, types.door};
  std::mt19937 random(17);
  Grid grid;
  for (int i = 0; i < 12 * 12 * 12; ++i) {
    const IVec3 at = IVec3{i % 12, i / 12 % 12, i / 144} + 4;
    const bool is_leaf = random() % 3 == 0;
    const VoxelType type = is_leaf ? leaf : near.at(random() % near.size());
    grid.set(at, type, {.state = static_cast<std::uint32_t>(random() % (type == types.stairs ? 8 : 1))});
  }
  std::set<std::array<int, 4>> drawn;
  QuadBuffer quads;
  ShapeFaceBuffer faces;
  BlockyMesher().mesh(grid.neighbourhood(IVec3(0)), scene.types, {}, quads, faces);
  for (const Quad& quad : quads) {
    if (quad.type() != leaf) continue;
    const FaceFrame& frame = frame_of(quad.direction());
    for (int i = 0; i < quad.size_u() * quad.size_v(); ++i) {
      IVec3 at = quad.voxel();
      at[frame.u] += i % quad.size_u();
      at[frame.v] += i / quad.size_u();
      drawn.insert({at.x, at.y, at.z, static_cast<int>(quad.direction())});
    }
  }
  const Grid voxels = grid.snapshot();
  place(scene, std::move(grid));
  const SceneTracer tracer(scene);
  const Surfaces surfaces(scene.types);
  int next_to_shapes = 0;
  int covered = 0;
  SeenThrough seen;
  voxels.for_each([&](IVec3 at, VoxelType type) {
    if (type != leaf) return;
    for (const Direction direction : kDirections) {
      const IVec3 front = at + normal_of(direction);
      // Into the voxel and out of it, from half a voxel away.
      const DVec3 outside = DVec3(at) + 0.47 + 0.8 * DVec3(normal_of(direction));
      const DVec3 inside = DVec3(at) + 0.47;
      const SceneView view(tracer, DVec3(0.0));
      const bool is_drawn = drawn.contains({at.x, at.y, at.z, static_cast<int>(direction)});
      find_transparent(view, surfaces, {outside, -DVec3(normal_of(direction))}, 0.8, seen);
      const auto is_outer = [&](const MetFace& met) { return met.voxel == at && met.type == leaf; };
      EXPECT_EQ(std::ranges::any_of(seen.faces, is_outer), is_drawn) << at.x << " " << at.y << " " << at.z;
      find_transparent(view, surfaces, {inside, DVec3(normal_of(direction))}, 0.8, seen);
      const auto is_inner = [&](const MetFace& met) { return met.voxel == front && met.type == leaf; };
      EXPECT_EQ(std::ranges::any_of(seen.faces, is_inner), is_drawn) << at.x << " " << at.y << " " << at.z;
      const VoxelType other = voxels.get(front);
      if (!scene.types.is_shaped(other) || other == types.water) continue;
      ++next_to_shapes;
      covered += is_drawn ? 0 : 1;
    }
  });
  EXPECT_GT(covered, 100);
  EXPECT_GT(next_to_shapes, 3 * covered);
}

TEST(RenderShapes, PanesTintWhatIsBehind) {
  Scene scene;
  const ShapeTypes types(scene.types);
  Grid grid;
  grid.fill_box({{-4, 0, -4}, {4, 4, -3}}, types.stone);
  for (int y = 0; y < 4; ++y) {
    for (int x = -4; x < 0; ++x) grid.set({x, y, 0}, types.pane);
  }
  place(scene, std::move(grid));
  const RenderedImage image = taken(scene, towards({0.0, 2.0, 6.0}, {0.0, 2.0, 0.0}), unlit(64, 64));
  const Pixel through = pixel_at(image, 26, 32);
  const Pixel beside = pixel_at(image, 38, 32);
  EXPECT_GT(through[0], through[1] + 20) << "the pane is red";
  EXPECT_LE(std::abs(beside[0] - beside[1]), 1);
  // The pane's front is 9/16 behind its voxel's.
  EXPECT_NEAR(depth_at(image, 26, 32), 6.0F - 9.0F / 16.0F, 0.05F);
}

TEST(RenderShapes, WaterTintsByItsDepth) {
  Scene scene;
  const ShapeTypes types(scene.types);
  Grid grid;
  grid.fill_box({{-8, -5, -8}, {8, -4, 8}}, types.stone);
  grid.fill_box({{-8, -4, -8}, {8, 0, 0}}, types.water);
  place(scene, std::move(grid));
  const RenderedImage image = taken(scene, from_above(0.0, 10.0, 0.0, 8.0), unlit(32, 32));
  // Sources are 8/9 high.
  EXPECT_NEAR(depth_at(image, 16, 4), 10.0 + 1.0 - 14.0 / 16.0, 0.05);
  const Pixel wet = pixel_at(image, 16, 4);
  EXPECT_GT(wet[2], wet[0] + 20);
  EXPECT_FLOAT_EQ(depth_at(image, 16, 28), 14.0F);
}

// Glass, as cubes or as shapes that are cubes.
Scene glass_blocks(bool with_shapes, bool has_textures, bool has_other_side) {
  std::mt19937 random(4);
  Scene scene;
  const VoxelType stone = *scene.types.add({.name = "stone", .colour = {160, 150, 140}});
  VoxelProperties glass{.name = "glass", .colour = {60, 160, 220, 90}, .visibility = Visibility::Transparent};
  if (has_textures) glass.faces = VoxelFaces({.texture = right_half(90), .alpha = FaceAlpha::Translucent});
  if (with_shapes) {
    ShapeElement element;
    if (has_other_side) element.faces[2].face = VoxelFace{.tint = {250, 10, 10}, .alpha = FaceAlpha::Translucent};
    glass.shapes = *VoxelShape::from_elements({element});
  }
  const VoxelType type = *scene.types.add(glass);
  Grid grid;
  grid.fill_box({{-20, -3, -20}, {20, 0, 20}}, stone);
  grid.fill_box({{-12, 0, -12}, {-2, 6, 4}}, type);
  for (int i = 0; i < 120; ++i) {
    const auto at = [&](int size) { return static_cast<int>(random() % static_cast<unsigned>(size)); };
    grid.set({at(24) - 12, at(6), at(24) - 12}, random() % 4 == 0 ? stone : type);
  }
  place(scene, std::move(grid));
  return scene;
}

TEST(RenderShapes, GlassCubesAsShapesGiveTheSamePixels) {
  const Camera camera = towards({22.0, 20.0, 31.0}, {0.0, 2.0, 0.0});
  for (const bool has_textures : {false, true}) {
    const RenderedImage cube = taken(glass_blocks(false, has_textures, false), camera, sized(96, 64));
    const RenderedImage shape = taken(glass_blocks(true, has_textures, false), camera, sized(96, 64));
    EXPECT_EQ(cube.colour.rgb, shape.colour.rgb) << "textures " << has_textures;
    EXPECT_EQ(cube.depth.values, shape.depth.values);
    const RenderedImage other = taken(glass_blocks(true, has_textures, true), camera, sized(96, 64));
    EXPECT_GT(count_different(cube, other, 8), 100) << "a side with another look is no cube";
  }
}

// Panes that reach into glass on both sides of them, and glass that goes on below.
TEST(RenderShapes, PanesInGlassDoNotSplitIt) {
  for (const bool has_texture : {false, true}) {
    Scene scene;
    VoxelProperties of_glass{
        .name = "glass", .colour = {200, 220, 230, 40}, .visibility = Visibility::Transparent, .ior = 1.5F};
    AlphaImage image{16, 16, std::vector<std::uint8_t>(1'024, 40)};
    const Texture grey = Texture::from_image("grey", image).value();
    if (has_texture) of_glass.faces = VoxelFace{.texture = grey, .alpha = FaceAlpha::Translucent};
    const VoxelType glass = *scene.types.add(of_glass);
    VoxelProperties of_pane{.name = "pane", .colour = {90, 200, 90, 90}, .visibility = Visibility::Transparent};
    of_pane.shapes = *VoxelShape::from_elements({{.min = {-16, 4, 4}, .max = {32, 8, 8}}});
    const VoxelType pane = *scene.types.add(of_pane);
    Grid grid;
    grid.fill_box({{0, 0, 0}, {8, 1, 1}}, glass);
    grid.set({8, 0, 0}, pane);
    grid.fill_box({{9, 0, 0}, {16, 1, 1}}, glass);
    place(scene, std::move(grid));
    const SceneTracer tracer(scene);
    const SceneView view(tracer, DVec3(0.0));
    for (const double sign : {1.0, -1.0}) {
      SeenThrough seen;
      find_transparent(view, Surfaces(scene.types), {{8.5 - 12.5 * sign, 0.3, 0.3}, {sign, 0.0, 0.0}}, 100.0, seen);
      ASSERT_EQ(seen.bodies.size(), 3U) << has_texture << " " << sign;
      const std::array<VoxelType, 3> types = {glass, pane, glass};
      const std::array<double, 3> begins = sign > 0.0 ? std::array{4.0, 11.0, 13.0} : std::array{5.0, 11.0, 13.0};
      const std::array<double, 3> lengths = sign > 0.0 ? std::array{8.0, 3.0, 7.0} : std::array{7.0, 3.0, 8.0};
      for (std::size_t i = 0; i < 3; ++i) {
        const GlassBody& body = seen.bodies[i];
        EXPECT_EQ(body.type, types.at(i));
        EXPECT_NEAR(body.t_enter, begins.at(i), 1e-9);
        EXPECT_NEAR(body.t_exit, begins.at(i) + lengths.at(i), 1e-9);
        EXPECT_NEAR(body.voxels, lengths.at(i), 1e-9);
        EXPECT_EQ(body.is_textured, has_texture && body.type == glass);
        EXPECT_EQ(body.exit_in_shape, body.type == pane);
      }
    }
  }
}

// A pool of two types of water, with fences in it.
struct Pool {
  Scene scene;
  VoxelType fence = kAir;

  Pool(std::uint32_t second_groups, std::uint32_t fence_state) {
    const auto water = [&](std::uint8_t red, std::uint32_t groups) {
      return *scene.types.add(
          {.name = "water",
           .colour = {red, 90, 200, 120},
           .visibility = Visibility::Transparent,
           .state_bits = 4,
           .shapes = *VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid, .groups = groups})});
    };
    const VoxelType first = water(40, 2);
    const VoxelType second = water(90, second_groups);
    ShapeRules rules = shapes_for_tests::fence().rules();
    rules.fluid = ContainedFluid{.groups = 2, .when = {{.state_mask = 1, .state = 1}}};
    fence = *scene.types.add({.name = "fence", .state_bits = 1, .shapes = *VoxelShapes::from_rules(std::move(rules))});
    Grid grid;
    grid.fill_box({{0, 0, 0}, {6, 3, 8}}, first);
    grid.fill_box({{6, 0, 0}, {12, 3, 8}}, second);
    grid.set({3, 1, 4}, fence, {.state = fence_state});
    grid.set({3, 2, 6}, fence, {.state = fence_state});
    place(scene, std::move(grid));
  }

  [[nodiscard]] std::vector<GlassBody> bodies_along(const Ray& ray) const {
    const SceneTracer tracer(scene);
    const SceneView view(tracer, DVec3(0.0));
    SeenThrough seen;
    find_transparent(view, Surfaces(scene.types), ray, 100.0, seen);
    return seen.bodies;
  }
};

TEST(RenderShapes, FluidsOfOneKindAreOneBody) {
  for (const double y : {0.5, 1.5, 2.5}) {
    const Ray ray{{-4.0, y, 1.5}, {1.0, 0.0, 0.0}};
    const auto joined = Pool(2, 1).bodies_along(ray);
    ASSERT_EQ(joined.size(), 1U) << y;
    EXPECT_NEAR(joined[0].voxels, 12.0, 1e-9);
    EXPECT_EQ(joined[0].type, 1) << "the one that the ray enters";
    EXPECT_EQ(Pool(4, 1).bodies_along(ray).size(), 2U) << "of other kinds";
  }
}

// Every other ray starts above the surface of the water, within its voxel.
TEST(RenderShapes, PacketsFindTheSameWaterAsSingleRays) {
  const Pool pool(2, 1);
  const SceneTracer tracer(pool.scene);
  const Surfaces surfaces(pool.scene.types);
  const SceneView view(tracer, DVec3(0.0));
  std::mt19937 random(5);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  int met = 0;
  int skipped = 0;
  for (int round = 0; round < cases(200, 5000); ++round) {
    RayPacket rays;
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      const double y = lane % 2 == 0 ? between(2.9, 3.0) : between(-1.0, 5.0);
      const DVec3 direction{between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0)};
      rays.set(lane, {{between(-3.0, 15.0), y, between(-3.0, 11.0)}, direction}, lane == 3 ? 2.0 : 100.0);
    }
    ThroughHits hits;
    view.find_through(rays, hits);
    ASSERT_TRUE(hits.has_first);
    EXPECT_EQ(hits.glass & ~view.any_transparent(rays), 0U);
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      const double max_t = rays.max_t[static_cast<std::size_t>(lane)];
      SeenThrough expected;
      find_transparent(view, surfaces, rays.ray(lane), max_t, expected);
      if ((hits.glass >> lane & 1U) == 0) {
        ASSERT_TRUE(expected.bodies.empty());
        skipped += placed_in(tracer)[0].glass_voxels->is_occupied(voxel_of(rays.ray(lane).origin)) ? 1 : 0;
        continue;
      }
      SeenThrough found;
      find_transparent(view, surfaces, hits, lane, max_t, found);
      ASSERT_EQ(found.bodies.size(), expected.bodies.size());
      for (std::size_t i = 0; i < found.bodies.size(); ++i) {
        EXPECT_EQ(found.bodies[i].type, expected.bodies[i].type);
        EXPECT_EQ(found.bodies[i].voxel, expected.bodies[i].voxel);
        EXPECT_EQ(found.bodies[i].starts_inside, expected.bodies[i].starts_inside);
        EXPECT_EQ(found.bodies[i].exit_in_shape, expected.bodies[i].exit_in_shape);
        EXPECT_NEAR(found.bodies[i].t_enter, expected.bodies[i].t_enter, 1e-9);
        EXPECT_NEAR(found.bodies[i].voxels, expected.bodies[i].voxels, 1e-6);
        ++met;
      }
    }
  }
  EXPECT_GT(met, 500);
  EXPECT_GT(skipped, 50);
}

TEST(RenderShapes, WaterSurroundsShapesThatContainIt) {
  // Past the post of a fence below the surface, and of one at the surface.
  for (const IVec3 at : {IVec3{3, 1, 4}, IVec3{3, 2, 6}}) {
    const Ray ray{{-4.0, at.y + 0.5, at.z + 0.1}, {1.0, 0.0, 0.0}};
    const auto wet = Pool(2, 1).bodies_along(ray);
    ASSERT_EQ(wet.size(), 1U);
    EXPECT_NEAR(wet[0].voxels, 12.0, 1e-9);
    const auto dry = Pool(2, 0).bodies_along(ray);
    ASSERT_EQ(dry.size(), 2U);
    EXPECT_NEAR(dry[0].voxels, 3.0, 1e-9);
  }
  // Queries are about the fence.
  const Pool pool(2, 1);
  const SceneTracer tracer(pool.scene);
  const auto hit = first_hit(tracer, Ray{{3.5, 2.5, 20.0}, {0.0, 0.0, -1.0}});
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->voxel, IVec3(3, 2, 7)) << "water";
  const auto post = first_hit(tracer, Ray{{3.5, 9.0, 6.5}, {0.0, -1.0, 0.0}});
  ASSERT_TRUE(post);
  EXPECT_EQ(post->t, 6.0) << "the top of the post, above the water";
}

// A cube whose state turns it looks like the cube in a turned grid.
TEST(RenderShapes, StateTurnsFacesOfCubes) {
  for (std::uint32_t state = 0; state < 4; ++state) {
    const auto scene_of = [&](std::uint32_t of_voxel, double angle, bool with_shapes) {
      Scene scene;
      VoxelProperties furnace{.name = "furnace", .state_bits = 2};
      std::array<VoxelFace, 6> faces;
      for (std::size_t i = 0; i < 6; ++i) {
        faces[i].texture = quarters();
        faces[i].tint = {static_cast<std::uint8_t>(255 - 40 * i), static_cast<std::uint8_t>(40 * i + 20), 200};
      }
      furnace.faces = VoxelFaces(faces);
      furnace.orientations = StateOrientations::about_y();
      if (with_shapes) furnace.shapes = VoxelShape::box({0, 0, 0}, {16, 16, 16});
      const VoxelType type = *scene.types.add(furnace);
      SceneGrid grid;
      grid.pivot = DVec3(0.5);
      grid.grid.set({0, 0, 0}, type, {of_voxel, {}});
      const InstanceHandle handle = scene.add_instance({.grid = scene.add_grid(std::move(grid))});
      scene.edit(handle).rotation = glm::angleAxis(angle, DVec3(0.0, 1.0, 0.0));
      return scene;
    };
    const Camera camera = towards({2.0, 1.7, 2.6}, DVec3(0.0));
    const double angle = state * 1.5707963267948966;
    const RenderedImage turned_grid = taken(scene_of(0, angle, false), camera, unlit(64, 64));
    const RenderedImage turned_cube = taken(scene_of(state, 0.0, false), camera, unlit(64, 64));
    const RenderedImage turned_shape = taken(scene_of(state, 0.0, true), camera, unlit(64, 64));
    // Texels at edges may round to either side.
    EXPECT_LT(count_different(turned_cube, turned_grid, 1), 8) << state;
    EXPECT_LT(count_different(turned_shape, turned_grid, 1), 8) << state;
  }
}

}  // namespace
}  // namespace quoin
