// Skies that follow the sun.

#include <quoin/render/cpu_renderer.h>
#include <quoin/render/path_tracer.h>

#include "render/cpu/environment_for_tests.h"
#include "render/cpu/render_test_support.h"
#include "render/light/light_model.h"

namespace quoin {
namespace {

using render_test::add_type;
using render_test::encoded;
using render_test::from_above;
using render_test::linear;
using render_test::Pixel;
using render_test::pixel_at;
using render_test::place;
using render_test::sized;
using render_test::taken;
using render_test::towards;

constexpr Rgba8 kGround{180, 180, 180, 255};

Scene floor_scene() {
  Scene scene;
  Grid grid;
  grid.fill_box({{-20, -1, -20}, {20, 0, 20}}, add_type(scene, kGround));
  place(scene, std::move(grid));
  return scene;
}

RenderOptions follows(DVec3 sun) {
  RenderOptions options = sized(9, 9);
  environment_in(options).sun.direction = sun;
  environment_in(options).sky.model = SkyModel::Gradient;
  return options;
}

TEST(RenderSky, SurfacesAndSkyFollowSunHeight) {
  const Scene scene = floor_scene();
  for (const DVec3 sun : {DVec3(1, 3, 0), DVec3(1, 0.1, 0), DVec3(1, -0.05, 0), DVec3(0, -1, 0)}) {
    const RenderOptions options = follows(sun);
    const Daylight light = daylight_of(*options.environment);
    const float diffuse = static_cast<float>(std::max(glm::normalize(sun).y, 0.0));
    const Vec3 expected = linear(kGround) * (0.15F * light.ambient + diffuse * light.sun);
    const Pixel seen = pixel_at(taken(scene, from_above(0, 5, 0, 2), options), 4, 4);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(seen.at(i), encoded(expected).at(i), 1);
    const RenderedImage sky = taken(Scene{}, towards({0, 0, 0}, {0, 0, -1}), options);
    EXPECT_EQ(pixel_at(sky, 4, 4), encoded(light.sky.horizon));
  }
}

TEST(RenderSky, SunBelowHorizonGivesNoLightFromBelow) {
  const Scene scene = floor_scene();
  Camera camera = from_above(0, -9, 0, 2);
  camera.forward = {0, 1, 0};
  camera.right = {-1, 0, 0};
  RenderOptions options = follows({0.2, -1, 0});
  const RenderedImage night = taken(scene, camera, options);
  const Vec3 ambient = 0.15F * linear(kGround) * daylight_of(*options.environment).ambient;
  EXPECT_EQ(pixel_at(night, 4, 4), encoded(ambient));
  environment_in(options).sky.model = SkyModel::Fixed;
  EXPECT_GT(pixel_at(taken(scene, camera, options), 4, 4)[0], 150) << "it does where the sky is fixed";
}

TEST(RenderSky, ZeroBrightnessIsBlack) {
  const Scene scene = floor_scene();
  RenderOptions options = follows({1, 0.3, 0});
  environment_in(options).sky.brightness = 0.0;
  environment_in(options).sun.brightness = 0.0;
  EXPECT_EQ(pixel_at(taken(scene, from_above(0, 5, 0, 2), options), 4, 4), (Pixel{0, 0, 0}));
}

TEST(RenderSky, DrawsTheEnvironmentOfTheScene) {
  Scene scene = floor_scene();
  const Environment dusk = *follows({1, 0.05, 0}).environment;
  const Camera camera = towards({0, 4, 9}, {0, 0, -4});
  RenderOptions options = sized(16, 12);
  PathOptions paths{.width = 16, .height = 12, .samples = 2};
  CpuRenderer renderer(scene);
  PathTracer tracer(scene);
  const auto before = renderer.render(camera, options).value().colour.rgb;
  const auto traced_before = tracer.render(camera, paths).value().radiance;
  options.environment = paths.environment = dusk;
  const auto wanted = renderer.render(camera, options).value().colour.rgb;
  const auto traced_wanted = tracer.render(camera, paths).value().radiance;
  EXPECT_NE(wanted, before);
  EXPECT_NE(traced_wanted, traced_before);
  options.environment.reset();
  paths.environment.reset();
  scene.environment = dusk;
  EXPECT_EQ(renderer.render(camera, options).value().colour.rgb, before) << "until the update";
  renderer.update();
  tracer.update();
  EXPECT_EQ(renderer.render(camera, options).value().colour.rgb, wanted);
  EXPECT_EQ(tracer.render(camera, paths).value().radiance, traced_wanted);
  EXPECT_EQ(CpuRenderer(scene).render(camera, options).value().colour.rgb, wanted);
  options.environment = paths.environment = Environment::reference();
  EXPECT_EQ(renderer.render(camera, options).value().colour.rgb, before) << "options replace it";
}

}  // namespace
}  // namespace quoin
