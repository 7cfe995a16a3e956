// Textures in ray-traced images: each pixel of an unlit image is compared with the texel of its face.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "render/cpu/render_test_support.h"

namespace quoin {
namespace {

using namespace render_test;

// Places a grid that is a box of a new type with this texture, and returns the type.
VoxelType place_box(Scene& scene, const Texture& texture, const IBox& box) {
  VoxelProperties properties;
  properties.faces = texture;
  const VoxelType type = scene.types.add(properties).value();
  Grid grid;
  grid.fill_box(box, type);
  place(scene, std::move(grid));
  return type;
}

// A parallel view of a face direction, `size` voxels wide and high, centred on `at`.
Camera facing(Direction direction, DVec3 at, double size) {
  const FaceFrame& frame = frame_of(direction);
  Camera camera;
  camera.forward = -DVec3(normal_of(direction));
  camera.position = at - camera.forward * 40.0;
  camera.up = DVec3(0.0);
  camera.up[frame.u] = 1.0;
  camera.right = glm::cross(camera.forward, camera.up);
  camera.projection = Camera::Projection::Orthographic;
  camera.view_height = size;
  return camera;
}

Pixel shown(const VoxelFace& face, Direction direction, DVec3 inside, int level) {
  const auto texel = texel_at(face, direction, inside, level);
  return encoded({texel[0], texel[1], texel[2]});
}

TEST(RenderTextures, ShowsNearestTexelsOnAllSides) {
  constexpr int kPixels = 192;
  constexpr double kWidth = 3.0;
  Scene scene;
  VoxelProperties properties;
  properties.faces = random_faces(7);
  const VoxelType type = scene.types.add(properties).value();
  Grid grid;
  grid.fill_box({{-1, -1, -1}, {2, 2, 2}}, type);
  place(scene, std::move(grid));
  for (const Direction direction : kDirections) {
    const Camera camera = facing(direction, DVec3(0.5), kWidth);
    const RenderedImage image = taken(scene, camera, unlit(kPixels, kPixels));
    const VoxelFace& face = scene.types[type].faces[direction];
    int wrong = 0;
    for (int y = 0; y < kPixels; ++y) {
      for (int x = 0; x < kPixels; ++x) {
        DVec3 at = DVec3(0.5) + DVec3(normal_of(direction)) * 1.5 +
                   camera.right * (((x + 0.5) / kPixels - 0.5) * kWidth) -
                   camera.up * (((y + 0.5) / kPixels - 0.5) * kWidth);
        const DVec3 inside = at - glm::floor(at - DVec3(normal_of(direction)) * 0.5);
        wrong += pixel_at(image, x, y) == shown(face, direction, inside, 0) ? 0 : 1;
      }
    }
    EXPECT_EQ(wrong, 0) << name_of(direction);
  }
}

TEST(RenderTextures, FollowsMirroredTurnedAndScaledGrids) {
  Scene scene;
  VoxelProperties properties;
  properties.faces = random_faces(8);
  const VoxelType type = scene.types.add(properties).value();
  Grid grid;
  grid.set({3, 4, 5}, type);
  const InstanceHandle handle = place(scene, std::move(grid), {1e9, 0, 0});
  Instance& moved = scene.edit(handle);
  moved.voxel_size = 0.25;
  moved.mirrored = true;
  moved.rotation = glm::angleAxis(0.7, glm::normalize(DVec3(1, 2, 3)));
  const CpuRenderer renderer(scene);
  for (const Direction direction : kDirections) {
    const VoxelFace& face = scene.types[type].faces[direction];
    const auto world = [&](const DVec3& in_grid) { return world_from_grid(moved, scene.grids()[moved.grid], in_grid); };
    const DVec3 normal(normal_of(direction));
    const FaceFrame& frame = frame_of(direction);
    for (const auto& [u, v] : {std::pair{0.21, 0.34}, {0.77, 0.09}, {0.52, 0.93}}) {
      DVec3 inside = DVec3(0.5) + normal * 0.5;
      inside[frame.u] = u;
      inside[frame.v] = v;
      const DVec3 at = world(DVec3(3, 4, 5) + inside);
      const DVec3 eye = world(DVec3(3, 4, 5) + inside + normal * 3.0);
      const auto image = renderer.render(towards(eye, at, 0.01), unlit(9, 9));
      ASSERT_TRUE(image);
      EXPECT_EQ(pixel_at(*image, 4, 4), shown(face, direction, inside, 0)) << name_of(direction);
    }
  }
}

TEST(RenderTextures, ChoosesMipmapsByDistanceAndSamples) {
  Scene scene;
  const VoxelType type = place_box(scene, random_texture(64, 3), {{-200, 0, -200}, {200, 1, 200}});
  const VoxelFace& face = scene.types[type].faces[Direction::PosY];
  for (int level = 0; level <= 7; ++level) {
    // Each pixel is 2^level texels wide; the middle of the image lies in the middle of a texel of that level.
    const double pixel = std::ldexp(1.0 / 64, level);
    const DVec3 at{0.5 + pixel / 2, 1.0, 0.5 - pixel / 2};
    const DVec3 inside = at - glm::floor(DVec3(at.x, 0.0, at.z));
    const Pixel expected = shown(face, Direction::PosY, inside, level);
    const Camera flat = from_above(at.x, 30, at.z, 5 * pixel);
    EXPECT_EQ(pixel_at(taken(scene, flat, unlit(5, 5)), 2, 2), expected) << level;
    const double height = 5 * pixel / (2.0 * std::tan(0.4));
    Camera perspective = flat;
    perspective.projection = Camera::Projection::Perspective;
    perspective.vertical_fov_radians = 0.8;
    perspective.position.y = 1.0 + height;
    EXPECT_EQ(pixel_at(taken(scene, perspective, unlit(5, 5)), 2, 2), expected) << level;
  }
  // The colour of a pixel with many samples is the mean of its texels.
  RenderOptions many = unlit(3, 3);
  many.samples = 256;
  const Pixel smooth = pixel_at(taken(scene, from_above(0.5, 30, 0.5, 3.0), many), 1, 1);
  const Pixel mean = encoded(face.texture.mean());
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(smooth[c], mean[c], 4);
}

TEST(RenderTextures, TintsLightAndEmission) {
  Scene scene;
  VoxelProperties properties;
  properties.emission = 0.5F;
  properties.faces = VoxelFace{.texture = random_texture(16, 5), .tint = {255, 0, 128, 255}};
  const VoxelType type = scene.types.add(properties).value();
  Grid grid;
  grid.set({0, 0, 0}, type);
  place(scene, std::move(grid));
  RenderOptions options = sized(16, 16);
  options.light.occlusion_mode = OcclusionMode::Off;
  options.light.max_lamps = 0;
  const Camera camera = from_above(0.5, 30, 0.5, 1.0);
  const RenderedImage image = taken(scene, camera, options);
  // A plain voxel shows the light that a colour receives.
  Scene plain;
  Grid block;
  block.set({0, 0, 0}, add_type(plain, {255, 255, 255, 255}));
  place(plain, std::move(block));
  RenderOptions dim = options;
  const Pixel white = pixel_at(taken(plain, camera, dim), 8, 8);
  const Vec3 light{linear_from_srgb(white[0]), linear_from_srgb(white[1]), linear_from_srgb(white[2])};
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 16; ++x) {
      const auto texel =
          texel_at(scene.types[type].faces[Direction::PosY], Direction::PosY, {(x + 0.5) / 16, 1.0, (y + 0.5) / 16}, 0);
      const Vec3 colour(texel[0], texel[1], texel[2]);
      const Pixel expected = encoded(glm::min(colour * (light + 0.5F), Vec3(1.0F)));
      const Pixel found = pixel_at(image, x, y);
      for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(found[c], expected[c], 2) << x << ' ' << y;
    }
  }
}

// A plain top, sides and bottom of several colours: halved grids and impostors show the mean of the face that is seen.
TEST(RenderTextures, ShowsMeansOfFacesFarAway) {
  Scene scene;
  std::array<VoxelFace, 6> faces;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    faces[i].texture = random_texture(i % 2 == 0 ? 16 : 64, static_cast<unsigned>(i));
    faces[i].tint = {static_cast<std::uint8_t>(255 - 40 * i), static_cast<std::uint8_t>(40 * i), 90, 255};
  }
  VoxelProperties properties;
  properties.faces = VoxelFaces(faces);
  const VoxelType type = scene.types.add(properties).value();
  Grid grid;
  grid.fill_box({{-8, -8, -8}, {8, 8, 8}}, type);
  place(scene, std::move(grid));
  RenderOptions halved = unlit(5, 5);
  halved.detail.policy =
      DetailPolicy{.rule = DetailPolicy::Rule::ByPixels, .voxel_pixels = 1e6, .cell_pixels = 1e6, .far_pixels = 0};
  RenderOptions far = unlit(32, 32);
  far.detail.policy = DetailPolicy{.far_pixels = 1000};
  for (const Direction direction : kDirections) {
    const VoxelFace& face = scene.types[type].faces[direction];
    const Pixel expected = shown(face, direction, DVec3(0.5), face.texture.level_count() - 1);
    EXPECT_EQ(pixel_at(taken(scene, facing(direction, DVec3(0.3), 1.0), halved), 2, 2), expected)
        << name_of(direction) << ", halved";
    EXPECT_EQ(pixel_at(taken(scene, facing(direction, DVec3(0.3), 32.0), far), 16, 16), expected)
        << name_of(direction) << ", impostor";
  }
}

// Faces of cubes that their state turns keep their mean far away.
TEST(RenderTextures, ShowsMeansOfTurnedFacesFarAway) {
  Scene scene;
  std::array<VoxelFace, 6> faces;
  for (std::size_t i = 0; i < faces.size(); ++i) faces[i].texture = random_texture(16, static_cast<unsigned>(i));
  VoxelProperties properties{.state_bits = 2, .orientations = StateOrientations::about_y()};
  properties.faces = VoxelFaces(faces);
  const VoxelType type = scene.types.add(properties).value();
  Grid grid;
  grid.fill_box({{-8, -8, -8}, {8, 8, 8}}, type);
  grid.for_each([&](IVec3 voxel, VoxelType) { grid.set_data(voxel, {.state = 1}); });
  place(scene, std::move(grid));
  RenderOptions halved = unlit(5, 5);
  halved.detail.policy =
      DetailPolicy{.rule = DetailPolicy::Rule::ByPixels, .voxel_pixels = 1e6, .cell_pixels = 1e6, .far_pixels = 0};
  RenderOptions far = unlit(32, 32);
  far.detail.policy = DetailPolicy{.far_pixels = 1000};
  const AxisOrientation back = properties.orientations.of(1).inverse();
  for (const Direction direction : kDirections) {
    const Direction unturned = back.apply(direction);
    const VoxelFace& face = scene.types[type].faces[unturned];
    const Pixel expected = shown(face, unturned, DVec3(0.5), face.texture.level_count() - 1);
    EXPECT_EQ(pixel_at(taken(scene, facing(direction, DVec3(0.3), 1.0), halved), 2, 2), expected)
        << name_of(direction) << ", halved";
    EXPECT_EQ(pixel_at(taken(scene, facing(direction, DVec3(0.3), 32.0), far), 16, 16), expected)
        << name_of(direction) << ", impostor";
  }
}

TEST(RenderTextures, ShowsMeansOfCoarseGrids) {
  Scene scene;
  const VoxelType type = place_box(scene, random_texture(16, 5), {{-64, 0, -64}, {64, 2, 64}});
  const Rgba8 mean = scene.types[type].colour;
  RenderOptions options = unlit(3, 3);
  options.detail.policy = DetailPolicy{.rule = DetailPolicy::Rule::ByPixels, .voxel_pixels = 1e6, .cell_pixels = 1e6};
  EXPECT_EQ(pixel_at(taken(scene, from_above(0.3, 30, 0.4, 1.0), options), 1, 1), (Pixel{mean.r, mean.g, mean.b}));
}

Texture plain_texture(Rgba8 colour) {
  AlphaImage image{16, 16, {}};
  for (int i = 0; i < 16 * 16; ++i) image.rgba.insert(image.rgba.end(), {colour.r, colour.g, colour.b, 255});
  return Texture::from_image("plain", image).value();
}

constexpr Rgba8 kGrass{40, 200, 60, 255};
constexpr Rgba8 kRock{120, 110, 100, 255};
constexpr Rgba8 kEarth{90, 60, 30, 255};

// A ball with grass above and rock at its sides, seen along x, in 61x61 pixels of one voxel.
RenderedImage view_of_ball(FieldTextures textures) {
  Scene scene;
  VoxelProperties hill;
  hill.faces = VoxelFaces({plain_texture(kRock)}, {plain_texture(kGrass)}, {plain_texture(kEarth)});
  hill.field_textures = textures;
  DensityGrid field;
  field.add_sphere(DVec3(0.0), 28.0, scene.types.add(hill).value());
  place_field(scene, std::move(field));
  return taken(scene, facing(Direction::PosX, DVec3(0.0), 61.0), unlit(61, 61));
}

TEST(RenderTextures, FieldsShowUpperTexturesOnFlatGroundAndSidesOnSlopes) {
  const RenderedImage image = view_of_ball({.flat_degrees = 30.0F, .steep_degrees = 60.0F});
  // facing() sets `up` to the face's u, which is y for +X.
  const auto at_slope = [&](double degrees) {
    const double radians = degrees * std::numbers::pi / 180.0;
    return pixel_at(image, 30, static_cast<int>(std::lround(30.0 - 28.0 * std::cos(radians))));
  };
  EXPECT_EQ(at_slope(20.0), encoded(linear(kGrass)));
  EXPECT_EQ(at_slope(70.0), encoded(linear(kRock)));
  EXPECT_EQ(at_slope(110.0), encoded(linear(kRock)));
  EXPECT_EQ(at_slope(160.0), encoded(linear(kEarth)));
  const Pixel between = at_slope(45.0);
  EXPECT_GT(between[1], kRock.g + 20);
  EXPECT_LT(between[1], kGrass.g - 20);
}

// 0 and 0.001 degrees have the same cosine.
TEST(RenderTextures, FieldsShowUpperTexturesOnFlatGroundForSlopesThatHardlyDiffer) {
  Scene scene;
  VoxelProperties hill;
  hill.faces = VoxelFaces({plain_texture(kRock)}, {plain_texture(kGrass)}, {plain_texture(kEarth)});
  hill.field_textures = {.flat_degrees = 0.0F, .steep_degrees = 0.001F};
  DensityGrid field;
  field.add_box({-20, -20, -20}, {20, 0, 20}, scene.types.add(hill).value());
  place_field(scene, std::move(field));
  const RenderedImage image = taken(scene, facing(Direction::PosY, DVec3(0.0), 8.0), unlit(9, 9));
  EXPECT_EQ(pixel_at(image, 4, 4), encoded(linear(kGrass)));
}

TEST(RenderTextures, FieldsRepeatTexturesByTheirEdge) {
  for (const float edge : {1.0F, 4.0F}) {
    Scene scene;
    VoxelProperties ground;
    ground.faces = random_texture(16, 21);
    ground.field_textures.voxels = edge;
    const VoxelType type = scene.types.add(ground).value();
    DensityGrid field;
    field.add_box({-20, -20, -20}, {20, 0, 20}, type);
    place_field(scene, std::move(field));
    constexpr int kPixels = 256;
    constexpr double kWidth = 16.0;
    const Camera camera = facing(Direction::PosY, {0.0, 0.0, 0.0}, kWidth);
    const RenderedImage image = taken(scene, camera, unlit(kPixels, kPixels));
    const VoxelFace& face = scene.types[type].faces[Direction::PosY];
    int wrong = 0;
    for (int y = 0; y < kPixels; ++y) {
      for (int x = 0; x < kPixels; ++x) {
        const DVec3 at =
            camera.right * (((x + 0.5) / kPixels - 0.5) * kWidth) - camera.up * (((y + 0.5) / kPixels - 0.5) * kWidth);
        const DVec3 inside = glm::fract(at / double{edge});
        wrong += pixel_at(image, x, y) == shown(face, Direction::PosY, inside, 0) ? 0 : 1;
      }
    }
    EXPECT_EQ(wrong, 0) << "an edge of " << edge;
  }
}

TEST(RenderTextures, RejectsSlopesAndEdgesOfFields) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const FieldTextures& bad : {FieldTextures{.voxels = 0.0F}, FieldTextures{.voxels = nan},
                                   FieldTextures{.flat_degrees = 60.0F}, FieldTextures{.steep_degrees = 91.0F}}) {
    EXPECT_FALSE(validate_type({.name = "hill", .field_textures = bad}));
  }
}

}  // namespace
}  // namespace quoin
