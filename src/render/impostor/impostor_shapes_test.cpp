// Compares impostors of shapes with traced images.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include <quoin/render/impostor_cache.h>

#include "grid/shapes/shape_types_for_tests.h"
#include "render/impostor/impostor_test_support.h"
#include "render/impostor/raster/impostor_faces.h"

namespace quoin {
namespace {

using namespace render_test;

// Returns a texture with visible texels only in a disc, of one colour.
Texture disc_texture() {
  AlphaImage image{16, 16, std::vector<std::uint8_t>(std::size_t{4} * 16 * 16)};
  for (int i = 0; i < 256; ++i) {
    const double x = i % 16 - 7.5;
    const double y = i / 16 - 7.5;
    if (x * x + y * y > 30.0) continue;
    const auto at = static_cast<std::size_t>(4 * i);
    image.rgba[at] = 220, image.rgba[at + 1] = 40, image.rgba[at + 2] = 60, image.rgba[at + 3] = 255;
  }
  return Texture::from_image("disc", image).value();
}

struct ShapeWorld {
  Scene scene;
  std::optional<ShapeTypes> types;
  VoxelType plant = kAir;  // crossed plates with a cutout texture
  InstanceHandle instance;
  double radius = 0.0;

  ShapeWorld() {
    types.emplace(scene.types);
    VoxelProperties of_plant{.name = "plant", .visibility = Visibility::Transparent};
    of_plant.faces = VoxelFace{.texture = disc_texture(), .alpha = FaceAlpha::Cutout};
    of_plant.shapes = VoxelShape::crossed_plates();
    plant = scene.types.add(of_plant).value();
  }
  // Places a grid, with the content's centre at the origin.
  void place_centred(Grid grid) {
    SceneGrid placed;
    placed.grid = std::move(grid);
    const ContentSphere content = Impostor::build(placed.grid, scene.types).content();
    radius = content.radius;
    placed.pivot = content.centre;
    instance = scene.add_instance({"", scene.add_grid(std::move(placed))});
  }
  [[nodiscard]] const Grid& grid() const { return scene.grids()[scene.instances()[instance].grid].grid; }

  // A yard with every kind of shape, in `copies` rows and columns.
  [[nodiscard]] Grid yard(int copies) const {
    const ShapeTypes& t = *types;
    Grid grid;
    for (int i = 0; i < copies * copies; ++i) {
      const IVec3 at{i % copies * 10, 0, i / copies * 10};
      grid.fill_box({at, at + IVec3(10, 1, 10)}, t.stone);
      grid.fill_box({at + IVec3(1, 1, 1), at + IVec3(5, 4, 3)}, t.stone);
      grid.fill_box({at + IVec3(1, 4, 1), at + IVec3(5, 5, 3)}, t.slab);
      for (int k = 0; k < 3; ++k) grid.set(at + IVec3(5 + k, 1, 1), t.stairs, {.state = static_cast<std::uint32_t>(k)});
      for (int k = 0; k < 9; ++k) grid.set(at + IVec3(k, 1, 8), t.fence);
      for (int k = 1; k < 4; ++k) grid.set(at + IVec3(k, 2, 3), t.torch, {.state = 4});
      for (int k = 0; k < 4; ++k) grid.set(at + IVec3(2 * k + 1, 1, 6), k % 2 == 0 ? t.flower : plant);
      grid.set(at + IVec3(8, 1, 4), t.door, {.state = 1});
      grid.set(at + IVec3(8, 2, 4), t.door, {.state = 1});
    }
    return grid;
  }

  [[nodiscard]] Camera orbiting(double azimuth, double elevation, double pixels, int size) const {
    const double distance = 12.0 * radius;
    const DVec3 eye =
        DVec3{std::cos(elevation) * std::cos(azimuth), std::sin(elevation), std::cos(elevation) * std::sin(azimuth)} *
        distance;
    return towards(eye, {0, 0, 0}, 2.0 * std::atan(size / 24.0 / (pixels / 2.0)));
  }
  [[nodiscard]] RenderedImage drawn(const Impostor& impostor, const Camera& camera,
                                    const RenderOptions& options) const {
    RenderedImage image = taken(Scene(), camera, options);
    draw_impostors(SceneTracer(scene), std::array{FarInstance{instance, &impostor}}, camera, options, image);
    return image;
  }
};

struct Compared {
  Likeness likeness;
  double off_mean = 0.0;   // the largest difference of a channel's mean in linear light, of 255
  double off_depth = 0.0;  // mean, in voxels
};

Compared compared(const RenderedImage& truth, const RenderedImage& image) {
  Compared found{.likeness = likeness(truth, image)};
  std::array<double, 3> sums{};
  double depth = 0.0;
  std::int64_t both = 0;
  for (std::size_t i = 0; i < truth.depth.values.size(); ++i) {
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
      sums.at(c % 3) += linear_from_srgb(image.colour.rgb[c]) - linear_from_srgb(truth.colour.rgb[c]);
    }
    if (!std::isfinite(truth.depth.values[i]) || !std::isfinite(image.depth.values[i])) continue;
    depth += std::abs(truth.depth.values[i] - image.depth.values[i]);
    ++both;
  }
  const double pixels = static_cast<double>(std::max<std::int64_t>(found.likeness.pixels, 1));
  for (const double sum : sums) found.off_mean = std::max(found.off_mean, 255.0 * std::abs(sum) / pixels);
  found.off_depth = depth / static_cast<double>(std::max<std::int64_t>(both, 1));
  return found;
}

// Compares the images of a scene without and with impostors.
Compared compared_far(const Scene& scene, const Scene& drawn, const Camera& camera, RenderOptions options,
                      int impostor_edge = 128) {
  options.samples = 16;
  const RenderedImage truth = taken(scene, camera, options);
  options.detail.policy = DetailPolicy{.far_pixels = 1'000};
  options.detail.impostor_edge = impostor_edge;
  return compared(truth, taken(drawn, camera, options));
}

RenderOptions vertex_occlusion(int size) {
  RenderOptions options = sized(size, size);
  options.light.occlusion_mode = OcclusionMode::Vertex;
  return options;
}

// Near impostors show the faces themselves: images are the same except for rounding at edges.
TEST(ImpostorShapes, MatchTracedShapesNear) {
  ShapeWorld world;
  world.place_centred(world.yard(1));
  const Impostor impostor = Impostor::build(world.grid(), world.scene.types);
  for (const double azimuth : {0.7, 2.6, 4.4}) {
    const Camera camera = world.orbiting(azimuth, 0.5, 120.0, 128);
    const RenderOptions options = vertex_occlusion(128);
    const RenderedImage truth = taken(world.scene, camera, options);
    const RenderedImage image = world.drawn(impostor, camera, options);
    const Compared found = compared(truth, image);
    EXPECT_GE(found.likeness.overlap, 0.995) << azimuth;
    EXPECT_LE(found.off_depth, 0.02) << azimuth;
    EXPECT_LE(count_different(truth, image, 8), 128 * 128 / 100) << azimuth;
  }
}

// Steps across all cell sizes. Measured: 0.14, 0.13 and 0.23 with faces, 9.2 and 7.3 with cells, in which thin shapes
// grow to eighths of voxels (10.7 to 22.5 without shapes).
TEST(ImpostorShapes, LookLikeTracedShapesAtEveryDistance) {
  ShapeWorld world;
  Grid bare = world.yard(6);
  world.place_centred(world.yard(6));
  const VoxelType stone = world.types->stone;
  bare.edit(bare.bounds(), [&](IVec3, VoxelType type) { return type == stone ? type : kAir; });
  ShapeWorld without;
  without.place_centred(std::move(bare));
  without.scene.edit(without.scene.instances()[without.instance].grid).pivot =
      world.scene.grids()[world.scene.instances()[world.instance].grid].pivot;
  for (const int pixels : {96, 48, 24, 12, 8}) {
    const Camera camera = world.orbiting(0.9, 0.35, pixels, pixels + 8);
    const RenderOptions options = sized(pixels + 8, pixels + 8);
    const Compared found = compared_far(world.scene, world.scene, camera, options);
    const Compared other = compared_far(world.scene, without.scene, camera, options);
    std::printf("%d pixels: overlap %.3f, difference %.2f, mean off by %.2f (without shapes %.3f, %.2f, %.2f)\n",
                pixels, found.likeness.overlap, found.likeness.difference, found.off_mean, other.likeness.overlap,
                other.likeness.difference, other.off_mean);
    EXPECT_GE(found.likeness.overlap, 0.97) << pixels;
    EXPECT_LE(found.off_mean, pixels > 16 ? 1.0 : 10.0) << pixels;
    EXPECT_GT(other.off_mean, 4.0) << pixels << ", without shapes";
  }
}

TEST(ImpostorShapes, LeaveOutHiddenTexelsAndGlass) {
  ShapeWorld world;
  Grid grid;
  grid.set({0, 0, 0}, world.plant);
  grid.set({4, 0, 0}, world.types->pane);
  world.place_centred(std::move(grid));
  const Impostor impostor = Impostor::build(world.grid(), world.scene.types);
  for (const ImpostorFaces::Face& face : impostor.faces().faces) EXPECT_EQ(face.type, world.plant);
  const Camera camera = world.orbiting(0.4, 0.2, 120.0, 128);
  world.scene.types.replace(world.types->pane,
                            {.visibility = Visibility::Transparent, .shapes = VoxelShape::box({0, 0, 0}, {1, 1, 1})});
  const RenderedImage truth = taken(world.scene, camera, sized(128, 128));
  const Likeness found = likeness(truth, world.drawn(impostor, camera, sized(128, 128)));
  EXPECT_GE(found.overlap, 0.97) << "the disc, not the whole plate";
  EXPECT_GT(found.pixels, 100);
}

TEST(ImpostorShapes, BoundElementsOutsideTheirVoxel) {
  ShapeWorld world;
  Grid grid;
  grid.set({0, 0, 0}, world.types->beam);
  world.place_centred(std::move(grid));
  const Impostor impostor = Impostor::build(world.grid(), world.scene.types);
  EXPECT_EQ(impostor.bounds().min.y, -1);
  EXPECT_EQ(impostor.bounds().max.y, 2);
  EXPECT_GE(impostor.content().radius, 1.5);
  const Camera camera = world.orbiting(0.3, 0.3, 60.0, 72);
  const RenderedImage truth = taken(world.scene, camera, sized(72, 72));
  EXPECT_GE(likeness(truth, world.drawn(impostor, camera, sized(72, 72))).overlap, 0.97);
}

// Grids with more faces than texels are seen by rays.
TEST(ImpostorShapes, AreFoundByRaysInLargeGrids) {
  ShapeWorld world;
  world.place_centred(world.yard(14));
  const Impostor impostor = Impostor::build(world.grid(), world.scene.types, {16});
  EXPECT_GT(impostor.faces().first_width, 0);
  EXPECT_FALSE(impostor.faces().shapes.empty());
  const Camera camera = world.orbiting(0.9, 0.4, 32.0, 40);
  const Compared found = compared_far(world.scene, world.scene, camera, sized(40, 40), 16);
  std::printf("by rays: overlap %.3f, difference %.2f, mean off by %.2f\n", found.likeness.overlap,
              found.likeness.difference, found.off_mean);
  // Measured: 0.955 and 17.8, with texels of 9 voxels.
  EXPECT_GE(found.likeness.overlap, 0.94);
  EXPECT_LE(found.off_mean, 20.0);
}

// The middle of the ground's face lies inside the post.
TEST(ImpostorShapes, LeaveLightToFacesBehindThem) {
  ShapeWorld world;
  Grid grid;
  grid.set({0, 0, 0}, world.types->stone);
  grid.set({0, 1, 0}, world.types->fence);
  const Impostor impostor = Impostor::build(grid, world.scene.types);
  int found = 0;
  for (const ImpostorFaces::Face& face : impostor.faces().faces) {
    if (face.type != world.types->stone || face.direction != Direction::PosY) continue;
    ++found;
    EXPECT_GE(face.open_rays, 5);
  }
  EXPECT_EQ(found, 1);
}

TEST(ImpostorShapes, AreInImages) {
  ShapeWorld world;
  Grid grid;
  grid.set({0, 0, 0}, world.types->slab);
  const std::vector<ImpostorImage> images = impostor_images(grid, world.scene.types, {32});
  const ImpostorImage& above = images.at(2);  // from +Y
  const auto middle = static_cast<std::size_t>(16 * 32 + 16);
  EXPECT_EQ(above.coverage.at(middle), 255);
  EXPECT_NEAR(above.depth.values.at(middle), 8.0, 0.02) << "the upper side is at the content's centre";
  EXPECT_EQ(above.colour.rgb.at(3 * middle), 200);
}

TEST(ImpostorShapes, FollowStatesAndTypes) {
  ShapeWorld world;
  Grid grid;
  grid.set({0, 0, 0}, world.types->door);
  grid.set({3, 0, 0}, world.types->stone);
  world.place_centred(std::move(grid));
  const GridHandle handle = world.scene.instances()[world.instance].grid;
  ImpostorCache cache;
  const auto ready = [&] {
    static_cast<void>(cache.find(world.scene, handle));
    EXPECT_EQ(cache.wait(world.scene), 0U);
    return cache.find(world.scene, handle);
  };
  const auto first = ready();
  EXPECT_EQ(ready(), first) << "nothing has changed";
  world.scene.edit(handle).grid.set_data({3, 0, 0}, {.state = 1});
  EXPECT_EQ(ready(), first) << "cubes do not follow their data";
  world.scene.edit(handle).grid.set_data({0, 0, 0}, {.state = 1});
  const auto turned = ready();
  EXPECT_NE(turned, first);
  const Impostor fresh = Impostor::build(world.grid(), world.scene.types);
  ASSERT_EQ(turned->faces().surfels.size(), fresh.faces().surfels.size());
  for (std::size_t i = 0; i < fresh.faces().surfels.size(); ++i) {
    EXPECT_EQ(turned->faces().surfels[i].offset, fresh.faces().surfels[i].offset);
  }
  VoxelProperties wider = world.scene.types[world.types->door];
  wider.shapes = VoxelShape::box({0, 0, 0}, {5, 16, 16});
  world.scene.types.replace(world.types->door, wider);
  const auto replaced = ready();
  EXPECT_NE(replaced, turned);
  world.scene.edit(handle).grid.set({0, 0, 2}, world.types->slab);
  EXPECT_GT(ready()->faces().surfels.size(), replaced->faces().surfels.size());
}

}  // namespace
}  // namespace quoin
