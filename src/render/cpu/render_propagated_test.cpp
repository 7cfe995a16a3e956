// Images in propagated light: first_hit and SurfaceLight give the expected value of each pixel.

#include <algorithm>
#include <cstdlib>
#include <vector>

#include <quoin/render/propagated_light.h>
#include <quoin/render/surface_light.h>
#include <quoin/scene/scene_query.h>

#include "render/cpu/cave_for_tests.h"
#include "render/cpu/environment_for_tests.h"
#include "render/cpu/render_test_support.h"

namespace quoin {
namespace {

using namespace render_test;

int brightest(const RenderedImage& image) {
  return *std::max_element(image.colour.rgb.begin(), image.colour.rgb.end());
}

// Interpolates the light between the corners of a face by the definition.
MeanLevels between(const FaceLight& corners, double u, double v) {
  std::array<double, 4> sum{};
  const std::array<double, 4> shares{(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v};
  for (std::size_t i = 0; i < 4; ++i) {
    const MeanLevels levels = levels_of_corner(corners[i]);
    const std::array<float, 4> each{levels.sky, levels.red, levels.green, levels.blue};
    for (std::size_t c = 0; c < 4; ++c) sum[c] += shares[i] * double{each[c]};
  }
  return {static_cast<float>(sum[0]), static_cast<float>(sum[1]), static_cast<float>(sum[2]),
          static_cast<float>(sum[3])};
}

TEST(RenderPropagated, InterpolatesLightBetweenFaceCorners) {
  Cave cave;
  RenderOptions options = propagated(96, 64);
  environment_in(options).sky.model = SkyModel::Gradient;
  environment_in(options).sun.direction = {0.4, 0.2, 0.1};
  environment_in(options).lamp_brightness = 0.7;
  const CpuRenderer renderer(cave.scene);
  const auto image = renderer.render(Cave::inside(), options);
  ASSERT_TRUE(image);
  SceneLight light;
  light.update(cave.scene);
  const GridLight of = light.of(cave.grid_handle);
  SurfaceLight surface(*of.light, *of.voxels, cave.scene.types);
  const LightLook look = light_look(environment_in(options));
  int compared = 0;
  for (int y = 0; y < options.height; ++y) {
    for (int x = 0; x < options.width; ++x) {
      const ImagePoint point{x + 0.5, y + 0.5, options.width, options.height};
      const Ray ray = ray_through(Cave::inside(), point);
      const auto hit = first_hit(renderer.tracer(), ray);
      ASSERT_TRUE(hit);
      // Glass tints the surface behind it; emission adds to that.
      const VoxelProperties& type = cave.scene.types[hit->type];
      if (hit->position.x > 8.0 || type.emission > 0.0F || cave.scene.types.is_transparent(hit->type)) continue;
      const FaceFrame& frame = frame_of(hit->face);
      const DVec3 inside = hit->position - DVec3(hit->voxel);
      const MeanLevels levels = between(surface.face(hit->voxel, hit->face), inside[frame.u], inside[frame.v]);
      const Pixel wanted = encoded(linear(type.colour) * light_colour(levels, Vec3(normal_of(hit->face)), look));
      const Pixel shown = pixel_at(*image, x, y);
      for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(shown[c], wanted[c], 1) << x << " " << y;
      ++compared;
    }
  }
  EXPECT_GT(compared, 3000);
}

TEST(RenderPropagated, ShowsSharedLightOfLastUpdate) {
  Cave cave;
  const RenderOptions options = propagated(48, 32);
  const auto taken = [&](const CpuRenderer& renderer) {
    return renderer.render(Cave::inside(), options).value().colour.rgb;
  };
  CpuRenderer own(cave.scene);
  CpuRenderer lent(cave.scene);
  SceneLight light;
  lent.use_light(&light);
  const auto open = taken(lent);
  EXPECT_NE(open, taken(own)) << "light that knows no grid is open sky";
  light.update(cave.scene);
  lent.update();
  EXPECT_EQ(taken(lent), taken(own));
  cave.scene.edit(cave.grid_handle).grid.fill_box({{-20, -12, -3}, {-16, -9, -1}}, kAir);  // removes a lamp
  own.update();
  lent.update();
  const auto dark = taken(own);
  EXPECT_NE(taken(lent), dark) << "late";
  light.update(cave.scene);
  lent.update();
  EXPECT_EQ(taken(lent), dark);
  lent.use_light(nullptr);
  EXPECT_EQ(taken(lent), dark);
}

TEST(RenderPropagated, ClosedRoomIsBlackUntilOpened) {
  Cave cave;
  const DVec3 eye = DVec3(Cave::kRoom.min) + 0.9;
  const Camera camera = towards(eye, DVec3(Cave::kRoom.max) - 0.9, 1.4);
  RenderOptions options = propagated(48, 32);
  CpuRenderer renderer(cave.scene);
  EXPECT_EQ(brightest(renderer.render(camera, options).value()), 0);
  options.light.least_light = 0.01;
  EXPECT_GT(brightest(renderer.render(camera, options).value()), 0);
  options.light.least_light = 0.0;
  cave.scene.edit(cave.grid_handle).grid.fill_box({{18, -8, -14}, {19, -7, -9}}, kAir);
  renderer.update();
  EXPECT_GT(brightest(renderer.render(camera, options).value()), 0);
  EXPECT_EQ(count_different(renderer.render(camera, options).value(), taken(cave.scene, camera, options), 0), 0);
}

TEST(RenderPropagated, OcclusionDarkensAllLight) {
  Cave cave;
  RenderOptions options = propagated(64, 48);
  const RenderedImage open = taken(cave.scene, Cave::inside(), options);
  options.light.occlusion_mode = OcclusionMode::Vertex;
  const RenderedImage occluded = taken(cave.scene, Cave::inside(), options);
  int darker = 0;
  for (std::size_t i = 0; i < open.colour.rgb.size(); ++i) {
    ASSERT_LE(occluded.colour.rgb[i], open.colour.rgb[i]);
    darker += occluded.colour.rgb[i] < open.colour.rgb[i];
  }
  EXPECT_GT(darker, 300);
}

TEST(RenderPropagated, GivesSameBytesWithoutLightRays) {
  Cave cave;
  const RenderOptions options = propagated(64, 48);
  const RenderedImage one = taken(cave.scene, Cave::inside(), options, {1});
  const RenderedImage four = taken(cave.scene, Cave::inside(), options, {4});
  EXPECT_EQ(one.colour.rgb, four.colour.rgb);
  EXPECT_EQ(one.rays, 64 * 48);
}

TEST(RenderPropagated, HalvedGridsKeepTheirLight) {
  Cave cave;
  RenderOptions options = propagated(96, 64);
  const Camera camera = towards({60.0, 90.0, 80.0}, {0.0, 10.0, 0.0});
  const RenderedImage whole = taken(cave.scene, camera, options);
  options.detail.policy = DetailPolicy{};
  options.detail.policy->voxel_pixels = 100.0;
  options.detail.policy->cell_pixels = 3.0;
  options.detail.policy->far_pixels = 0;
  const RenderedImage halved = taken(cave.scene, camera, options);
  // The top is in full sky light at any voxel size.
  EXPECT_EQ(pixel_at(halved, 40, 36), pixel_at(whole, 40, 36));
  EXPECT_GT(brightest(halved), 150);
}

// Field samples lie at the corners of voxels: the light comes from in front of the surface.
TEST(RenderPropagated, LightsFieldsOpenToSky) {
  Scene scene;
  SceneGrid made;
  for (const IBox& box : {IBox{{-30, -8, -30}, {31, 1, 31}}, IBox{{-12, 6, -12}, {13, 9, 13}}}) {
    made.field.edit(box, [](IVec3, DensitySample) { return DensitySample{-1.0F, kAir}; });
  }
  scene.add_instance({"", scene.add_grid(std::move(made))});
  const RenderOptions options = propagated(33, 33);
  const RenderedImage image = taken(scene, from_above(0.25, 60, 0.25, 50), options);
  EXPECT_EQ(pixel_at(image, 16, 16), encoded(Vec3(1.0F))) << "the roof";
  EXPECT_EQ(pixel_at(image, 1, 1), encoded(Vec3(1.0F))) << "the ground";
  Camera below = from_above(0.25, 4, 0.25, 20);
  const RenderedImage shade = taken(scene, below, options);
  EXPECT_LT(pixel_at(shade, 16, 16)[0], pixel_at(shade, 0, 16)[0]) << "under the roof, from its middle to its edge";
  EXPECT_GT(pixel_at(shade, 16, 16)[0], 0);
}

TEST(RenderPropagated, LightsFullBoxesLikeCubes) {
  const RenderOptions options = propagated(120, 90);
  const RenderedImage shapes = taken(Hall(false).scene, Hall::inside(), options);
  const RenderedImage cubes = taken(Hall(false, false).scene, Hall::inside(), options);
  EXPECT_EQ(count_different(shapes, cubes, 1), 0);
  EXPECT_GT(count_different(shapes, taken(Hall(true).scene, Hall::inside(), options), 1), 1000);
}

// The light is symmetric about the middle of a voxel, and so are the shapes.
TEST(RenderPropagated, LightsShapesSymmetrically) {
  Scene scene;
  const ShapeTypes types(scene.types);
  const VoxelType lamp = add_type(scene, {255, 200, 120, 255}, Visibility::Opaque, 1.0F);
  Grid grid;
  grid.fill_box({{-16, -1, -16}, {17, 7, 17}}, types.stone);
  grid.fill_box({{-15, 0, -15}, {16, 6, 16}}, kAir);
  grid.fill_box({{-6, 0, -6}, {7, 1, 7}}, types.slab);
  grid.set({0, 4, 0}, lamp);
  place(scene, std::move(grid));
  const RenderedImage image = taken(scene, from_above(0.5, 3.9, 0.5, 12.0), propagated(60, 60));
  int uneven = 0;
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 60; ++x) {
      const Pixel shown = pixel_at(image, x, y);
      for (const Pixel& other : {pixel_at(image, 59 - x, y), pixel_at(image, x, 59 - y)}) {
        for (std::size_t c = 0; c < 3; ++c) uneven += std::abs(shown[c] - other[c]) > 1;
      }
    }
  }
  EXPECT_EQ(uneven, 0);
  EXPECT_GT(pixel_at(image, 30, 30)[0], pixel_at(image, 2, 30)[0] + 20);
}

TEST(RenderPropagated, RejectsInvalidLeastLight) {
  Cave cave;
  RenderOptions options = propagated(8, 8);
  options.light.least_light = -1.0;
  EXPECT_EQ(CpuRenderer(cave.scene).render(Cave::inside(), options).error().code, ErrorCode::InvalidArgument);
}

}  // namespace
}  // namespace quoin
