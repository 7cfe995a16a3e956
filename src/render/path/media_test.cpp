// Compares light in fog and clouds with analytic results; tests the denoiser.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/grid/grid.h>
#include <quoin/render/path_tracer.h>

#include "core/srgb.h"
#include "core/work/nightly_for_tests.h"
#include "render/cpu/environment_for_tests.h"
#include "render/cpu/render_test_support.h"
#include "render/path/path_math.h"
#include "render/path/scatter.h"
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

// Returns options for an even sky with practically unlimited scattering.
PathOptions even_sky(int size, int samples) {
  PathOptions options = under_even_sky(size, size, samples);
  options.max_bounces = 1024;
  options.max_scatterings = 1024;
  return options;
}

// Looks along -z, identically in each pixel.
Camera straight_at_the_front() {
  Camera camera = towards({0.0, 0.0, 12.0}, {0.0, 0.0, 0.0});
  camera.projection = Camera::Projection::Orthographic;
  camera.view_height = 4.0;
  return camera;
}

double mean_red(const PathImage& image) {
  const auto add = [](double sum, Vec3 light) { return sum + static_cast<double>(light.x); };
  return std::accumulate(image.radiance.begin(), image.radiance.end(), 0.0, add) /
         static_cast<double>(image.radiance.size());
}

Scene box_of(VoxelProperties properties, IBox box) {
  Scene scene;
  Grid grid;
  grid.fill_box(box, scene.types.add(std::move(properties)).value_or(kAir));
  place(scene, std::move(grid));
  return scene;
}

VoxelProperties cloud_of(Rgba8 colour, float scattering, float anisotropy = 0.0F) {
  VoxelProperties properties;
  properties.colour = colour;
  properties.colour.a = 128;
  properties.visibility = Visibility::Transparent;
  properties.scattering = scattering;
  properties.anisotropy = anisotropy;
  return properties;
}

TEST(PathMedia, PhaseFunctionSamplesMatchDensityAndMean) {
  for (const float g : {-0.7F, 0.0F, 0.3F, 0.9F}) {
    const path::Scatter scatter(Vec3(0.5F), g);
    double sum = 0.0;
    double inverse = 0.0;
    constexpr std::uint32_t kSamples = 1U << 14U;
    for (std::uint32_t i = 0; i < kSamples; ++i) {
      const path::Scattered sample = scatter.sample(path::Random(7, i).pair(0), 0.5F);
      EXPECT_NEAR(glm::length(sample.direction), 1.0F, 1e-5F);
      EXPECT_NEAR(scatter.density(sample.direction) / sample.density, 1.0F, 2e-3F);
      EXPECT_NEAR(scatter.value(sample.direction).x, 0.5F * sample.density, sample.density * 2e-3F);
      sum += static_cast<double>(sample.direction.z);
      inverse += 1.0 / static_cast<double>(sample.density);
    }
    EXPECT_NEAR(sum / kSamples, static_cast<double>(g), 2e-3);
    // The mean of 1 / density is the area of the whole sphere.
    EXPECT_NEAR(inverse / kSamples / (4.0 * std::acos(-1.0)), 1.0, 0.05) << g;
  }
}

// White furnace: white fog over white ground, and a white cloud, cannot be seen in a white sky.
TEST(PathMedia, WhiteFogAndCloudsVanishInWhiteSky) {
  const Scene cube = box_of(cloud_of({255, 255, 255, 255}, 0.4F, 0.5F), {IVec3(0), IVec3(8)});
  const PathImage cloud = path_image(cube, towards({4.0, 10.0, 24.0}, DVec3(4.0), 0.5), even_sky(16, 64));
  EXPECT_NEAR(mean_red(cloud), 1.0, 0.005);
  Scene scene;
  PathOptions options = even_sky(16, 64);
  physical_in(options).ground.emplace();
  physical_in(options).ground->colour = Vec3(1.0F);
  physical_in(options).fog = Fog{0.2, Vec3(1.0F), 0.3, 8.0};
  const PathImage fog = path_image(scene, towards({0.0, 3.0, 10.0}, {0.0, 0.0, 0.0}, 0.5), options);
  EXPECT_NEAR(mean_red(fog), 1.0, 0.005);
}

// Black fog transmits e^-length, for visible surfaces and for their lighting.
TEST(PathMedia, TransmissionFallsExponentiallyWithLength) {
  VoxelProperties lamp;
  lamp.colour = {255, 255, 255, 255};
  lamp.emission = 1.0F;
  const Scene wall = box_of(lamp, {{-20, -20, -1}, {20, 20, 0}});
  PathOptions options = even_sky(16, 256);
  physical_in(options).sky.brightness = 0.0;
  options.max_bounces = 0;
  physical_in(options).fog = Fog{0.1, Vec3(0.0F), 0.0, 100.0};
  const Camera camera = straight_at_the_front();
  EXPECT_NEAR(mean_red(path_image(wall, camera, options)), std::exp(-1.2), 0.003);

  // The sun is above: its light passes through 10 of fog downwards, and 10 upwards to the camera above.
  const Scene floor = box_of({.name = "", .colour = {255, 255, 255, 255}}, {{-20, -1, -20}, {20, 0, 20}});
  options = even_sky(16, 256);
  physical_in(options).sky.brightness = 0.0;
  physical_in(options).sun.direction = {0.0, 1.0, 0.0};
  physical_in(options).sun.brightness = 1.0;
  physical_in(options).sun.angle_radians = 0.0;
  physical_in(options).fog = Fog{0.05, Vec3(0.0F), 0.0, 10.0};
  EXPECT_NEAR(mean_red(path_image(floor, from_above(0.0, 30.0, 0.0, 4.0), options)), std::exp(-1.0), 0.004);
}

// Black clouds also transmit e^-length. Glass with edges counts as at least one voxel; clouds do not.
TEST(PathMedia, BlackCloudOnlyAbsorbs) {
  for (const int depth : {1, 6}) {
    const Scene scene = box_of(cloud_of({0, 0, 0, 255}, 0.25F), {{-20, -20, -depth}, {20, 20, 0}});
    const Camera camera = straight_at_the_front();
    const PathImage image = path_image(scene, camera, even_sky(16, 256));
    EXPECT_NEAR(mean_red(image), std::exp(-0.25 * depth), 0.004);
    const double alpha = std::accumulate(image.alpha.begin(), image.alpha.end(), 0.0) / 256.0;
    EXPECT_NEAR(alpha, 1.0 - std::exp(-0.25 * depth), 0.004);
  }
}

// Glass in front of and behind a cloud, and a lamp within: no light is lost under a white sky.
TEST(PathMedia, CloudsBetweenGlassLoseNoLight) {
  Scene scene;
  const VoxelType cloud = scene.types.add(cloud_of({255, 255, 255, 255}, 0.3F)).value_or(kAir);
  VoxelProperties clear = cloud_of({255, 255, 255, 255}, 0.0F);
  clear.colour.a = 0;
  const VoxelType glass = scene.types.add(clear).value_or(kAir);
  Grid grid;
  grid.fill_box({{0, 0, 0}, {8, 8, 2}}, glass);
  grid.fill_box({{0, 0, 2}, {8, 8, 5}}, cloud);
  grid.fill_box({{0, 0, 6}, {8, 8, 8}}, glass);
  place(scene, std::move(grid));
  for (const DVec3& from : {DVec3(4.0, 9.0, 30.0), DVec3(3.0, 2.0, -20.0)}) {
    EXPECT_NEAR(mean_red(path_image(scene, towards(from, DVec3(4.0), 0.4), even_sky(16, 128))), 1.0, 0.01);
  }
}

// A lamp in fog lights the air about it, by next-event estimation and by chance alike.
TEST(PathMedia, LampLightsSurroundingFog) {
  VoxelProperties lamp;
  lamp.colour = {255, 255, 255, 255};
  lamp.emission = 20.0F;
  const Scene scene = box_of(lamp, {IVec3(0), IVec3(2)});
  PathOptions options = even_sky(24, cases(24, 64));
  physical_in(options).sky.brightness = 0.0;
  physical_in(options).fog = Fog{0.05, Vec3(1.0F), 0.0, 100.0};
  const PathImage image = path_image(scene, towards({1.0, 1.0, 20.0}, DVec3(1.0), 1.2), options);
  const auto at = [&](std::size_t x, std::size_t y) { return image.radiance[y * 24 + x].x; };
  EXPECT_GT(at(9, 12), 0.02F);
  EXPECT_GT(at(9, 12), 2.0F * at(0, 0));
  EXPECT_GT(at(0, 0), 0.0F);
}

TEST(PathMedia, RejectsInvalidFog) {
  const Scene scene;
  const auto refuses = [&](const Fog& fog) {
    PathOptions options = even_sky(2, 1);
    physical_in(options).fog = fog;
    return !PathTracer(scene).render(of_town(), options).has_value();
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(refuses(Fog{}));
  EXPECT_TRUE(refuses(Fog{-1.0}));
  EXPECT_TRUE(refuses(Fog{nan}));
  EXPECT_TRUE(refuses(Fog{1e7}));
  EXPECT_TRUE(refuses(Fog{0.1, Vec3(2.0F)}));
  EXPECT_TRUE(refuses(Fog{0.1, Vec3(1.0F), 1.0}));
  EXPECT_TRUE(refuses(Fog{0.1, Vec3(1.0F), 0.0, std::numeric_limits<double>::infinity()}));
}

// A lens with blades shows an out-of-focus point as the polygon of the blades.
TEST(PathLens, BladesShapeUnfocusedPoint) {
  VoxelProperties lamp;
  lamp.colour = {255, 255, 255, 255};
  lamp.emission = 1000.0F;
  const Scene scene = box_of(lamp, {IVec3(0), IVec3(1)});
  PathOptions options = even_sky(64, 256);
  physical_in(options).sky.brightness = 0.0;
  options.lens.radius = 4.0;
  options.lens.focus_distance = 30.0;
  options.lens.blades = 4;
  const Camera camera = towards({0.5, 0.5, 60.0}, DVec3(0.5), 0.3);
  const auto lit = [&](const PathOptions& by) {
    const PathImage image = path_image(scene, camera, by);
    return std::ranges::count_if(image.radiance, [](Vec3 light) { return light.x > 0.0F; });
  };
  const auto square = lit(options);
  options.lens.blades = 0;
  const auto disc = lit(options);
  EXPECT_NEAR(static_cast<double>(square) / static_cast<double>(disc), 2.0 / std::acos(-1.0), 0.12);
}

double error_of(const PathImage& image, const PathImage& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < image.radiance.size(); ++i) {
    const DVec3 difference =
        glm::min(DVec3(image.radiance[i]), DVec3(2.0)) - glm::min(DVec3(truth.radiance[i]), DVec3(2.0));
    sum += glm::dot(difference, difference);
  }
  return std::sqrt(sum / static_cast<double>(image.radiance.size()));
}

TEST(PathDenoise, ReducesErrorByFortyPercent) {
  const Scene scene = town();
  PathOptions options;
  options.width = cases(168, 240);
  options.height = cases(112, 160);
  options.samples = 192;
  const PathImage truth = path_image(scene, of_town(), options);
  options.samples = 8;
  const double before = error_of(path_image(scene, of_town(), options), truth);
  options.denoise = true;
  const double after = error_of(path_image(scene, of_town(), options), truth);
  EXPECT_LT(after, 0.6 * before) << before << " " << after;
}

// An image without noise stays unchanged: edges of surfaces, colours and hard shadows.
TEST(PathDenoise, KeepsEdges) {
  Scene scene;
  Grid grid;
  const VoxelType red = add_type(scene, {200, 40, 30, 255});
  const VoxelType white = add_type(scene, {230, 230, 230, 255});
  grid.fill_box({{-20, -1, -20}, {20, 0, 20}}, white);
  grid.fill_box({{-20, -1, -3}, {20, 0, 3}}, red);
  grid.fill_box({{-2, 0, -2}, {2, 8, 2}}, red);
  place(scene, std::move(grid));
  PathOptions options = even_sky(192, 4);
  physical_in(options).sky.brightness = 0.0;
  options.max_bounces = 1;
  physical_in(options).sun.brightness = 1.0;
  physical_in(options).sun.angle_radians = 0.0;
  const Camera camera = towards({15.0, 20.0, 25.0}, DVec3(0.0), 0.8);
  const PathImage plain = path_image(scene, camera, options);
  options.denoise = true;
  const PathImage smooth = path_image(scene, camera, options);
  int different = 0;
  for (std::size_t i = 0; i < plain.radiance.size(); ++i) {
    if (glm::length(plain.radiance[i] - smooth.radiance[i]) > 0.02F) ++different;
  }
  // Pixels on a shadow's edge are noisy themselves.
  EXPECT_LT(different, static_cast<int>(plain.radiance.size()) / 100);
}

TEST(PathDenoise, GivesSameBitsForAnyThreadCount) {
  const Scene scene = town();
  PathOptions options;
  options.width = 70;
  options.height = 40;
  options.samples = 4;
  options.denoise = true;
  const auto one = PathTracer(scene).render(of_town(), options, Threads{1});
  const auto three = PathTracer(scene).render(of_town(), options, Threads{3});
  ASSERT_TRUE(one.has_value() && three.has_value());
  EXPECT_EQ(one->radiance, three->radiance);
}

}  // namespace
}  // namespace quoin
