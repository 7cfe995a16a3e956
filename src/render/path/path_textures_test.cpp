// Textures in path-traced images: texels of opaque types, paths through cutout and translucent texels, textured lamps.

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/mesh/blocky.h>
#include <quoin/render/path_tracer.h>

#include "render/cpu/environment_for_tests.h"
#include "render/cpu/render_test_support.h"
#include "render/path/path_lamps.h"
#include "render/path/town_for_tests.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {
namespace {

using render_test::add_type;
using render_test::from_above;
using render_test::path_image;
using render_test::place;
using render_test::towards;
using render_test::under_even_sky;

// A texture of 16 texels per side; `texel(x, y)` returns an Rgba8.
template <class Texel>
Texture drawn(const Texel& texel) {
  AlphaImage image{16, 16, {}};
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      const Rgba8 c = texel(x, y);
      image.rgba.insert(image.rgba.end(), {c.r, c.g, c.b, c.a});
    }
  }
  return Texture::from_image("drawn", image).value();
}
Texture noise(std::uint8_t alpha, unsigned seed = 1) {
  std::mt19937 random(seed);
  const auto byte = [&] { return static_cast<std::uint8_t>(random()); };
  return drawn([&](int, int) { return Rgba8{byte(), byte(), byte(), alpha}; });
}

VoxelProperties textured(const VoxelFace& face, Visibility visibility = Visibility::Opaque) {
  VoxelProperties properties;
  properties.faces = face;
  properties.visibility = visibility;
  return properties;
}

DVec3 mean_of(const PathImage& image) {
  DVec3 sum(0.0);
  for (const Vec3& light : image.radiance) sum += DVec3(light);
  return sum / static_cast<double>(image.radiance.size());
}

// Returns the mean difference of two images, as a share of the first one's brightness.
double difference(const PathImage& a, const PathImage& b) {
  double sum = 0.0;
  double all = 0.0;
  for (std::size_t i = 0; i < a.radiance.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      sum += std::abs(static_cast<double>(a.radiance[i][c] - b.radiance[i][c]));
      all += static_cast<double>(a.radiance[i][c]);
    }
  }
  return sum / all;
}

// Under a sky of radiance 1 a plane shows its colour, which the CPU renderer draws without light.
TEST(PathTextures, ShowsTexelsOfALitPlaneAsRaysDo) {
  Scene scene;
  VoxelProperties properties = textured({.texture = noise(255), .turn = 1, .tint = {255, 180, 90, 255}});
  const VoxelType type = scene.types.add(properties).value();
  properties.state_bits = 6;
  for (int i = 0; i < AxisOrientation::kCount; ++i) properties.orientations.by_value.push_back(AxisOrientation::at(i));
  const VoxelType turned = scene.types.add(properties).value();
  Grid grid;
  grid.fill_box({{-40, -1, -40}, {40, 0, 40}}, type);
  for (int i = 0; i < AxisOrientation::kCount; ++i) {
    grid.set({i % 7 - 2, -1, i / 7 - 2}, turned, {.state = static_cast<std::uint32_t>(i)});
  }
  place(scene, std::move(grid));
  const Camera camera = from_above(1.0, 5.0, 1.0, 2.0);
  PathOptions options = under_even_sky(32, 32, 4);
  options.layers = true;
  const PathImage image = path_image(scene, camera, options);
  RenderOptions unlit = render_test::sized(32, 32);
  unlit.light.shading = Shading::Unlit;
  const RenderedImage expected = render_test::taken(scene, camera, unlit);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) {
      const auto i = static_cast<std::size_t>(32 * y + x);
      const auto shown = render_test::pixel_at(expected, x, y);
      for (int c = 0; c < 3; ++c) {
        const float colour = linear_from_srgb(shown[static_cast<std::size_t>(c)]);
        ASSERT_NEAR(image.radiance[i][c], colour, 0.01F) << x << ' ' << y;
        ASSERT_NEAR(image.albedo[i][c], colour, 0.005F) << x << ' ' << y;
      }
    }
  }
}

// Cutout types without invisible texels look as opaque ones, and those without visible texels as air.
TEST(PathTextures, ShowsVisibleTexelsAsOpaqueOnesAndInvisibleOnesAsAir) {
  const auto image_of = [](const VoxelProperties* wall) {
    Scene scene;
    const VoxelType ground = add_type(scene, {180, 180, 170, 255});
    const VoxelType lamp = add_type(scene, {255, 190, 90, 255}, Visibility::Opaque, 3.0F);
    Grid grid;
    grid.fill_box({{-8, -1, -8}, {8, 0, 8}}, ground);
    if (wall != nullptr) {
      const VoxelType type = scene.types.add(*wall).value();
      grid.fill_box({{-3, 0, -2}, {4, 4, -1}}, type);
      grid.fill_box({{2, 0, 1}, {5, 2, 4}}, type);
    }
    grid.set({-6, 0, 5}, lamp);
    place(scene, std::move(grid));
    PathOptions options;
    options.width = 64;
    options.height = 48;
    options.samples = 16;
    physical_in(options).fog = Fog{.density = 0.005, .top = 6.0};
    return path_image(scene, towards({12, 9, 14}, {0, 1, 0}), options);
  };
  const VoxelProperties opaque = textured({.texture = noise(255)});
  const VoxelProperties visible =
      textured({.texture = noise(255), .alpha = FaceAlpha::Cutout}, Visibility::Transparent);
  const VoxelProperties invisible =
      textured({.texture = noise(0), .alpha = FaceAlpha::Cutout}, Visibility::Transparent);
  const PathImage solid = image_of(&opaque);
  const PathImage air = image_of(nullptr);
  EXPECT_GT(difference(solid, air), 0.05);
  EXPECT_LT(difference(solid, image_of(&visible)), 0.01);
  EXPECT_LT(difference(air, image_of(&invisible)), 0.001);
}

// Half of the sun's light passes a chess board of visible and invisible texels.
TEST(PathTextures, LetsLightThroughInvisibleTexels) {
  const auto light_below = [](bool has_leaves) {
    Scene scene;
    const VoxelType white = add_type(scene, {255, 255, 255, 255});
    const Texture chess = drawn([](int x, int y) {
      return Rgba8{40, 160, 40, static_cast<std::uint8_t>((x / 2 + y / 2) % 2 == 0 ? 255 : 0)};
    });
    const VoxelType leaf =
        scene.types.add(textured({.texture = chess, .alpha = FaceAlpha::Cutout}, Visibility::Transparent)).value();
    Grid grid;
    grid.fill_box({{-8, -1, -8}, {8, 0, 8}}, white);
    if (has_leaves) grid.fill_box({{-8, 2, -8}, {8, 3, 8}}, leaf);
    place(scene, std::move(grid));
    PathOptions options = under_even_sky(32, 32, 32);
    physical_in(options).sky.brightness = 0.0;
    physical_in(options).sun.brightness = 1.0;
    physical_in(options).sun.direction = {0, 1, 0};
    options.max_bounces = 1;
    return mean_of(path_image(scene, from_above(0.0, 1.5, 0.0, 4.0), options));
  };
  const DVec3 open = light_below(false);
  const DVec3 shaded = light_below(true);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(shaded[c] / open[c], 0.5, 0.03);
}

// A pane whose texels are all equal looks as one of plain glass of their colour.
TEST(PathTextures, ShowsEqualTranslucentTexelsAsGlass) {
  const auto image_of = [](bool has_texture, bool is_hollow) {
    Scene scene;
    const VoxelType ground = add_type(scene, {180, 180, 170, 255});
    const Rgba8 colour{200, 90, 40, 120};
    VoxelProperties pane;
    pane.visibility = Visibility::Transparent;
    pane.colour = colour;
    pane.ior = 1.0F;
    if (has_texture) {
      std::array<VoxelFace, 6> faces;
      for (VoxelFace& face : faces) {
        face = {.texture = drawn([&](int, int) { return colour; }), .alpha = FaceAlpha::Translucent};
      }
      // A type with one cutout face is a cell of faces.
      if (is_hollow) faces[static_cast<std::size_t>(Direction::PosX)].alpha = FaceAlpha::Cutout;
      pane.faces = VoxelFaces(faces);
    }
    const VoxelType type = scene.types.add(pane).value();
    Grid grid;
    grid.fill_box({{-8, -1, -8}, {8, 0, 8}}, ground);
    grid.fill_box({{-8, 3, -8}, {8, 4, 8}}, type);
    place(scene, std::move(grid));
    PathOptions options;
    options.width = options.height = 32;
    options.samples = 64;
    physical_in(options).sun.direction = {0.1, 1, 0.2};
    return mean_of(path_image(scene, from_above(0.0, 9.0, 0.0, 6.0), options));
  };
  const DVec3 plain = image_of(false, false);
  const DVec3 textured_glass = image_of(true, false);
  const DVec3 hollow = image_of(true, true);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(textured_glass[c] / plain[c], 1.0, 0.03) << c;
    EXPECT_NEAR(hollow[c] / plain[c], 1.0, 0.1) << c << ": oblique rays have a longer way in glass";
  }
}

// Paths that pass a translucent texel are as likely to meet the glass behind it as others.
TEST(PathTextures, MeetsGlassBehindTranslucentTexels) {
  constexpr std::uint8_t kAlpha = 150;
  const auto image_of = [](bool has_pane) {
    Scene scene;
    VoxelProperties glass;
    glass.colour = {0, 0, 0, 128};
    glass.visibility = Visibility::Transparent;
    glass.ior = 1.0F;
    const VoxelType dark = scene.types.add(glass).value();
    std::array<VoxelFace, 6> faces;
    faces.fill({.texture = drawn([](int, int) { return Rgba8{0, 0, 0, kAlpha}; }), .alpha = FaceAlpha::Translucent});
    faces[static_cast<std::size_t>(Direction::PosX)].alpha = FaceAlpha::Cutout;
    VoxelProperties hollow = textured(faces[0], Visibility::Transparent);
    hollow.faces = VoxelFaces(faces);
    const VoxelType pane = scene.types.add(hollow).value();
    Grid grid;
    grid.fill_box({{-8, 0, -8}, {8, 1, 8}}, dark);
    if (has_pane) grid.fill_box({{-8, 4, -8}, {8, 5, 8}}, pane);
    place(scene, std::move(grid));
    return mean_of(path_image(scene, from_above(0.0, 9.0, 0.0, 6.0), under_even_sky(16, 16, 64)));
  };
  constexpr double kOpen = 1.0 - kAlpha / 255.0;
  EXPECT_NEAR(image_of(true).x / (image_of(false).x * kOpen * kOpen), 1.0, 0.05);
}

// A block of visible cutout texels in a lake of another grid looks as one of opaque texels.
TEST(PathTextures, ShowsTexelsWithinGlassOfAnotherGrid) {
  const auto image_of = [](FaceAlpha alpha, std::uint8_t opacity) {
    Scene scene;
    VoxelProperties water;
    water.colour = {60, 120, 200, 30};
    water.visibility = Visibility::Transparent;
    water.ior = 1.33F;
    const VoxelType lake = scene.types.add(water).value();
    const VoxelType ground = add_type(scene, {180, 180, 170, 255});
    const Visibility visibility = alpha == FaceAlpha::Cutout ? Visibility::Transparent : Visibility::Opaque;
    const VoxelType type = scene.types.add(textured({.texture = noise(opacity), .alpha = alpha}, visibility)).value();
    Grid grid;
    grid.fill_box({{-8, -1, -8}, {8, 0, 8}}, ground);
    grid.fill_box({{-8, 0, -8}, {8, 6, 8}}, lake);
    place(scene, std::move(grid));
    Grid block;
    block.fill_box({{-2, 0, -2}, {2, 3, 2}}, type);
    place(scene, std::move(block), {0.5, 1.5, 0.5});
    PathOptions options;
    options.width = 48;
    options.height = 36;
    options.samples = 32;
    options.environment = physical_day();
    return path_image(scene, towards({9, 14, 12}, {0, 3, 0}), options);
  };
  const PathImage opaque = image_of(FaceAlpha::Opaque, 255);
  EXPECT_LT(difference(opaque, image_of(FaceAlpha::Cutout, 255)), 0.001);
  EXPECT_GT(difference(opaque, image_of(FaceAlpha::Cutout, 0)), 0.01);
}

// A dark ceiling with one lamp, whose texture lights one half, and a lamp of half the size. The lamp's state may turn
// it by a half turn about y, after the first image.
TEST(PathTextures, SamplesLightOfTexels) {
  for (const bool is_turned : {false, true}) {
    const auto image_of = [is_turned](bool has_texture) {
      Scene scene;
      const VoxelType ground = add_type(scene, {200, 200, 200, 255});
      const VoxelType bright = add_type(scene, {255, 255, 255, 255}, Visibility::Opaque, 4.0F);
      const VoxelType dark = add_type(scene, {0, 0, 0, 255});
      VoxelProperties half = textured({.texture = drawn([](int x, int) {
                                         const auto c = static_cast<std::uint8_t>(x < 8 ? 255 : 0);
                                         return Rgba8{c, c, c, 255};
                                       })});
      half.emission = 4.0F;
      half.state_bits = 2;
      half.orientations = StateOrientations::about_y();
      const VoxelType lamp = scene.types.add(half).value();
      Grid floor;
      floor.fill_box({{-8, -2, -8}, {8, -1, 8}}, ground);
      place(scene, std::move(floor));
      Grid ceiling;
      InstanceHandle handle;
      if (has_texture) {
        ceiling.fill_box({{-4, 4, -4}, {5, 5, 5}}, dark);
        ceiling.set({0, 4, 0}, lamp);
        handle = place(scene, std::move(ceiling));
      } else {
        // On the bottom, the texture's right is at +X.
        ceiling.fill_box({{-8, 8, -8}, {10, 10, 10}}, dark);
        const int x = is_turned ? 1 : 0;
        ceiling.fill_box({{x, 8, 0}, {x + 1, 9, 2}}, bright);
        scene.edit(place(scene, std::move(ceiling))).voxel_size = 0.5;
      }
      PathOptions options = under_even_sky(24, 24, 64);
      physical_in(options).sky.brightness = 0.0;
      options.max_bounces = 2;
      const Camera below = from_above(0.5, 3.5, 0.5, 5.0);
      PathTracer tracer(scene);
      if (is_turned && has_texture) {
        PathOptions few = options;
        few.samples = 1;
        EXPECT_TRUE(tracer.render(below, few));
        scene.edit(scene.instances()[handle].grid).grid.set_data({0, 4, 0}, {2, {}});
        tracer.update();
      }
      return tracer.render(below, options).value();
    };
    const PathImage a = image_of(true);
    const PathImage b = image_of(false);
    const auto part = [](const PathImage& image, int from, int to) {
      double sum = 0.0;
      for (int y = 0; y < 24; ++y) {
        for (int x = from; x < to; ++x)
          sum += static_cast<double>(image.radiance[static_cast<std::size_t>(24 * y + x)].x);
      }
      return sum;
    };
    for (int x = 0; x < 24; x += 6) EXPECT_NEAR(part(a, x, x + 6) / part(b, x, x + 6), 1.0, 0.05) << x << is_turned;
  }
}

// Shapes: paths meet their sides, with their textures.
TEST(PathShapes, CubeAsShapeIsLitLikeCube) {
  const auto image_of = [](bool with_shapes) {
    Scene scene;
    const VoxelType ground = add_type(scene, {150, 150, 150});
    VoxelProperties crate = textured({.texture = noise(255)});
    if (with_shapes) crate.shapes = VoxelShape::box({0, 0, 0}, {16, 16, 16});
    const VoxelType type = scene.types.add(crate).value();
    Grid grid;
    grid.fill_box({{-6, -1, -6}, {6, 0, 6}}, ground);
    for (const IVec3 at : {IVec3(0, 0, 0), IVec3(1, 0, 0), IVec3(0, 1, 0), IVec3(-2, 0, 2)}) grid.set(at, type);
    place(scene, std::move(grid));
    return path_image(scene, towards({4.0, 4.0, 7.0}, {0.0, 0.5, 0.0}), under_even_sky(32, 32, 64));
  };
  const PathImage cube = image_of(false);
  EXPECT_LT(difference(cube, image_of(true)), 0.01);
}

TEST(PathShapes, PathsMeetOnlyTheForm) {
  Scene scene;
  const VoxelType ground = add_type(scene, {255, 255, 255});
  VoxelProperties slab{.name = "slab", .colour = {255, 0, 0, 255}};
  slab.shapes = VoxelShape::box({0, 0, 0}, {16, 8, 8});
  const VoxelType type = scene.types.add(slab).value();
  Grid grid;
  grid.fill_box({{-4, -1, -4}, {4, 0, 4}}, ground);
  grid.set({0, 0, 0}, type);
  place(scene, std::move(grid));
  PathOptions options = under_even_sky(16, 16, 4);
  options.layers = true;
  const PathImage image = path_image(scene, from_above(0.5, 10.0, 0.5, 1.0), options);
  // The slab fills the half at -Z, the upper half of the image.
  EXPECT_EQ(image.types[16 * 4 + 8], type);
  EXPECT_EQ(image.types[16 * 12 + 8], ground);
  EXPECT_FLOAT_EQ(image.depth.values[16 * 4 + 8], 9.5F);
  EXPECT_FLOAT_EQ(image.depth.values[16 * 12 + 8], 10.0F);
}

// A white cube of emission 0.5 that emits two fifths of it from +Z and nothing from its other sides.
VoxelProperties cube_with_front() {
  VoxelProperties cube{.name = "cube", .emission = 0.5F};
  std::array<VoxelFace, 6> faces;
  for (VoxelFace& face : faces) {
    face = {.texture = drawn([](int, int) { return Rgba8{255, 255, 255, 255}; }), .emission_share = 0};
  }
  faces[static_cast<std::size_t>(Direction::PosZ)].emission_share = 102;
  cube.faces = VoxelFaces(faces);
  return cube;
}

// A thin post with a head of 2 sixteenths that emits.
VoxelProperties post_with_head(std::uint8_t head_share = 255) {
  std::vector<ShapeElement> elements{{.min = {7, 0, 7}, .max = {9, 8, 9}}, {.min = {7, 8, 7}, .max = {9, 10, 9}}};
  for (ElementFace& face : elements[0].faces) face.face = VoxelFace{.tint = {90, 60, 30}, .emission_share = 0};
  for (ElementFace& face : elements[1].faces)
    face.face = VoxelFace{.tint = {255, 220, 120}, .emission_share = head_share};
  VoxelProperties post{.name = "post", .colour = {90, 60, 30, 255}, .emission = 1.0F};
  post.shapes = *VoxelShape::from_elements(elements);
  return post;
}

double light_of_floor(const VoxelProperties& lamp, bool has_other_lamp, int samples = 256) {
  Scene scene;
  const VoxelType white = add_type(scene, {200, 200, 200});
  const VoxelType far = add_type(scene, {255, 255, 255}, Visibility::Opaque, 1.0F);
  const VoxelType type = scene.types.add(lamp).value();
  Grid grid;
  grid.fill_box({{-6, -1, -6}, {7, 0, 7}}, white);
  grid.set({0, 0, 0}, type);
  if (has_other_lamp) grid.set({0, -300, 0}, far);
  place(scene, std::move(grid));
  PathOptions options = under_even_sky(16, 16, samples);
  physical_in(options).sky.brightness = 0.0;
  options.max_bounces = 2;
  const PathImage image = path_image(scene, from_above(3.5, 20.0, 0.5, 2.0), options);
  double sum = 0.0;
  for (const Vec3& light : image.radiance) sum += static_cast<double>(light.x + light.y + light.z);
  return sum / static_cast<double>(image.radiance.size());
}

// Other lamps must not take away the light of shapes.
TEST(PathShapes, SamplesSidesThatEmit) {
  const double alone = light_of_floor(post_with_head(), false);
  EXPECT_GT(alone, 0.01);
  EXPECT_NEAR(light_of_floor(post_with_head(), true) / alone, 1.0, 0.05);
  EXPECT_NEAR(light_of_floor(post_with_head(51), false) / alone, 0.2, 0.02);
  EXPECT_EQ(light_of_floor(post_with_head(0), false), 0.0);
}

// The sides of a small head give about the light of a whole cube, and a cube as a shape the same.
TEST(PathShapes, LightsUpAsCubes) {
  VoxelProperties cube{.name = "cube", .colour = {255, 220, 120, 255}, .emission = 1.0F};
  const double as_cube = light_of_floor(cube, false);
  VoxelProperties box = cube;
  box.shapes = VoxelShape::box({0, 0, 0}, {16, 16, 16});
  EXPECT_NEAR(light_of_floor(box, false) / as_cube, 1.0, 0.05);
  const double torch = light_of_floor(post_with_head(), false);
  EXPECT_GT(torch / as_cube, 0.5);
  EXPECT_LT(torch / as_cube, 2.0);
}

// Returns the light of all sides of shapes from afar, summed over their areas. Sides of `type` that are no lamps count
// too, since paths meet them by chance.
double far_light_of_shapes(const Scene& scene, VoxelType type) {
  const SceneTracer tracer(scene);
  path::PathLampCache cache;
  const auto lamps = cache.lamps(scene, placed_in(tracer), Surfaces(scene.types), 1.0);
  double light = 0.0;
  for (const path::PathLamp& lamp : lamps->lamps()) {
    EXPECT_TRUE(lamp.is_of_shape);
    light += static_cast<double>(lamp.size_u * lamp.size_v * lamp.radiance.x * path::far_light(lamp, 1e6F));
  }
  BlockyMesher mesher;
  QuadBuffer quads;
  ShapeFaceBuffer sides;
  const SceneGrid& grid = *scene.grids().find(scene.instances()[placed_in(tracer)[0].instance].grid);
  mesher.mesh(grid.grid.neighbourhood({0, 0, 0}), scene.types, {.bake_occlusion = false}, quads, sides);
  const VoxelProperties& properties = scene.types[type];
  for (const ShapeFace& side : sides) {
    const ModelFace& face = side.model_face();
    if (side.type != type || is_lamp_side(face, look_of(*side.model, face, properties.faces), properties)) continue;
    const auto& at = face.corners;
    light += static_cast<double>(0.5F * glm::length(glm::cross(at[2] - at[0], at[3] - at[1])) * properties.emission);
  }
  return light;
}

// Two plates that show 4 of 256 texels.
TEST(PathShapes, CutoutSidesLightUpAsCubes) {
  const Texture flame = drawn([](int x, int y) {
    const bool is_visible = x / 2 == 4 && y / 2 == 3;
    return Rgba8{255, 255, 255, is_visible ? std::uint8_t{255} : std::uint8_t{0}};
  });
  std::vector<ShapeElement> elements{{.min = {7, 0, 0}, .max = {9, 16, 16}}};
  for (ElementFace& face : elements[0].faces) face.is_drawn = false;
  for (const Direction side : {Direction::NegX, Direction::PosX}) {
    const VoxelFace look{.texture = flame, .alpha = FaceAlpha::Cutout};
    elements[0].faces[static_cast<std::size_t>(side)] = {.face = look};
  }
  VoxelProperties torch{.name = "torch", .visibility = Visibility::Transparent, .emission = 0.5F};
  torch.shapes = *VoxelShape::from_elements(elements);
  Scene scene;
  const VoxelType type = scene.types.add(torch).value();
  Grid grid;
  grid.set({5, 5, 5}, type);
  place(scene, std::move(grid));
  EXPECT_NEAR(far_light_of_shapes(scene, type), 6.0 * 0.5, 1e-4);
}

// Fluids that only touch at an edge, so that they show all sides: the top is two triangles, and some sides are no
// rectangles.
TEST(PathShapes, InclinedFluidsLightUpAsCubes) {
  Scene scene;
  VoxelProperties lava{.name = "lava", .colour = {255, 255, 255, 255}, .emission = 0.5F, .state_bits = 4};
  lava.shapes = *VoxelShapes::from_rules({.neighbours = ShapeNeighbours::Fluid, .groups = 2});
  const VoxelType type = scene.types.add(lava).value();
  Grid grid;
  grid.set({5, 5, 5}, type, {.state = 5});
  grid.set({6, 5, 6}, type);
  place(scene, std::move(grid));
  const double light = far_light_of_shapes(scene, type);
  EXPECT_GT(light, 0.8 * 2.0 * 6.0 * 0.5);
  EXPECT_LT(light, 1.05 * 2.0 * 6.0 * 0.5);
}

TEST(PathTextures, ShowSharesOfEmission) {
  Scene scene;
  const VoxelType type = scene.types.add(cube_with_front()).value();
  Grid grid;
  grid.set({0, 0, 0}, type);
  place(scene, std::move(grid));
  PathOptions options = under_even_sky(4, 4, 4);
  physical_in(options).sky.brightness = 0.0;
  const auto shown = [&](DVec3 eye) {
    return path_image(scene, towards(eye, {0.5, 0.5, 0.5}, 0.05), options).radiance[5].x;
  };
  EXPECT_NEAR(shown({0.5, 0.5, 9.0}), 0.2F, 1e-4F);
  EXPECT_EQ(shown({9.0, 0.5, 0.5}), 0.0F);
}

}  // namespace
}  // namespace quoin
