#include <quoin/render/cpu_renderer.h>

#include <atomic>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

#include "core/death_for_tests.h"
#include "core/instruction_sets_for_tests.h"
#include "render/cpu/environment_for_tests.h"
#include "render/cpu/render_test_support.h"
#include "render/light/light_model.h"
#include "render/shared/image_request.h"

namespace quoin {
namespace {

using namespace render_test;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Returns two instances of scattered opaque, transparent and emissive voxels.
Scene lively_scene() {
  Scene scene;
  const VoxelType stone = add_type(scene, {180, 120, 90, 255});
  const VoxelType glass = add_type(scene, {120, 200, 240, 90}, Visibility::Transparent);
  const VoxelType lamp = add_type(scene, {255, 220, 120, 255}, Visibility::Opaque, 2.0F);
  std::mt19937 random(4);
  Grid grid;
  grid.edit({{-20, -4, -20}, {20, 4, 20}}, [&](IVec3 v, VoxelType) {
    if (v.y < -2) return stone;
    const unsigned dice = random() % 24;
    return dice < 2 ? stone : dice == 2 ? glass : dice == 3 ? lamp : kAir;
  });
  SceneGrid shared;
  shared.grid = std::move(grid);
  const GridHandle handle = scene.add_grid(std::move(shared));
  scene.add_instance({"", handle});
  scene.add_instance({"", handle, {5, 12, -3}, glm::angleAxis(0.7, glm::normalize(DVec3(1, 2, 3))), 0.4});
  return scene;
}

TEST(CpuRenderer, GivesSameBytesForAnyThreadsAndInstructions) {
  const Scene scene = lively_scene();
  const CpuRenderer renderer(scene);
  const Camera camera = towards({25, 18, 30}, {0, 2, 0});
  for (const int occlusion_rays : {9, 5}) {
    RenderOptions options = sized(101, 67);
    options.samples = 2;
    options.light.occlusion_rays = occlusion_rays;
    const auto reference = renderer.render(camera, options, {1});
    ASSERT_TRUE(reference.has_value());
    for (const unsigned threads : {2U, 0U}) {
      for (const InstructionSet set : sets_of_this_machine()) {
        const InstructionSetOverride over(set);
        const auto image = renderer.render(camera, options, {threads});
        ASSERT_TRUE(image.has_value());
        EXPECT_EQ(image->colour.rgb, reference->colour.rgb);
        EXPECT_EQ(image->depth.values, reference->depth.values);
        EXPECT_EQ(image->rays, reference->rays);
        EXPECT_EQ(image->pixels_hit, reference->pixels_hit);
      }
    }
  }
}

TEST(CpuRenderer, ProgressNeverFallsAndReachesOne) {
  const Scene scene = lively_scene();
  double last = 0.0;
  std::atomic<int> inside{0};
  bool is_fine = true;
  const auto image = CpuRenderer(scene).render(towards({25, 18, 30}, {0, 2, 0}), sized(200, 100), {}, [&](double done) {
    is_fine &= ++inside == 1 && done >= last;
    last = done;
    --inside;
    return true;
  });
  ASSERT_TRUE(image.has_value());
  EXPECT_TRUE(is_fine);
  EXPECT_EQ(last, 1.0);
}

TEST(CpuRenderer, StopsWhenCancelled) {
  const Scene scene = lively_scene();
  int calls = 0;
  const auto image = CpuRenderer(scene).render(towards({25, 18, 30}, {0, 2, 0}), sized(300, 300), {},
                                               [&](double) { return ++calls < 3; });
  ASSERT_FALSE(image.has_value());
  EXPECT_EQ(image.error().code, ErrorCode::Cancelled);
  EXPECT_EQ(calls, 3);
}

TEST(CpuRenderer, ReportsAndStopsBetweenSamples) {
  const Scene scene = lively_scene();
  RenderOptions options = sized(16, 16);  // one tile
  options.samples = 50;
  int calls = 0;
  const auto count = [&](double) { return ++calls != 7; };
  const auto stopped = CpuRenderer(scene).render(towards({25, 18, 30}, {0, 2, 0}), options, {}, count);
  ASSERT_FALSE(stopped.has_value());
  EXPECT_EQ(stopped.error().code, ErrorCode::Cancelled);
  EXPECT_EQ(calls, 7);
  ASSERT_TRUE(CpuRenderer(scene).render(towards({25, 18, 30}, {0, 2, 0}), options, {}, count).has_value());
  EXPECT_EQ(calls, 57);
}

TEST(CpuRenderer, RejectsInvalidInput) {
  const Scene scene = lively_scene();
  const CpuRenderer renderer(scene);
  const auto expect_refused = [&](const char* name, const std::function<void(Camera&, RenderOptions&)>& change) {
    Camera camera = towards({25, 18, 30}, {0, 2, 0});
    RenderOptions options = sized(8, 8);
    change(camera, options);
    const auto image = renderer.render(camera, options);
    ASSERT_FALSE(image.has_value()) << name;
    EXPECT_EQ(image.error().code, ErrorCode::InvalidArgument) << name;
    EXPECT_EQ(image.error().message.rfind(name, 0), 0U) << image.error().message;
  };
  expect_refused("size", [](Camera&, RenderOptions& o) { o.width = 0; });
  expect_refused("size", [](Camera&, RenderOptions& o) { o.height = -1; });
  expect_refused("size", [](Camera&, RenderOptions& o) { o.width = o.height = 31'623; });
  expect_refused("size", [](Camera&, RenderOptions& o) { o.width = o.height = std::numeric_limits<int>::max(); });
  expect_refused("samples", [](Camera&, RenderOptions& o) { o.samples = 0; });
  expect_refused("samples", [](Camera&, RenderOptions& o) { o.samples = 4097; });
  expect_refused("sun", [](Camera&, RenderOptions& o) { environment_in(o).sun.direction = DVec3(0.0); });
  expect_refused("camera", [](Camera& c, RenderOptions&) { c.position.y = kNan; });
  expect_refused("camera", [](Camera& c, RenderOptions&) { c.forward = DVec3(0.0); });
  expect_refused("camera", [](Camera& c, RenderOptions&) { c.up.x = kNan; });
  for (const double angle : {0.0, -1.0, std::numbers::pi, 4.0, kNan, kInfinity}) {
    expect_refused("camera", [&](Camera& c, RenderOptions&) { c.vertical_fov_radians = angle; });
    expect_refused("camera", [&](Camera& c, RenderOptions&) {
      c.projection = Camera::Projection::Orthographic;
      c.view_height = angle > 0.0 && angle < 10.0 ? 0.0 : angle;
    });
  }
}

TEST(CpuRenderer, DrawsSkyForEmptyScene) {
  const Scene scene;
  const RenderedImage image = taken(scene, towards({0, 0, 0}, {0, 0, -1}), sized(9, 9));
  EXPECT_EQ(image.pixels_hit, 0);
  EXPECT_EQ(image.rays, 81);
  for (const float depth : image.depth.values) EXPECT_EQ(depth, static_cast<float>(kInfinity));
  EXPECT_EQ(pixel_at(image, 4, 4), encoded(sky_colour(0.0F)));
  const Pixel top = pixel_at(image, 4, 0);
  const Pixel horizon = pixel_at(image, 4, 4);
  EXPECT_LT(top[0], horizon[0]) << "the sky is paler towards the horizon";
}

TEST(CpuRenderer, SkyIsSmooth) {
  for (int i = -10'000; i < 10'000; ++i) {
    const Vec3 step = sky_colour(static_cast<float>(i + 1) * 1e-4F) - sky_colour(static_cast<float>(i) * 1e-4F);
    ASSERT_LT(glm::length(step), 1e-3F) << i;
  }
}

TEST(CpuRenderer, DrawsVoxelUprightAndUnmirrored) {
  Scene scene;
  const Rgba8 red{200, 40, 30, 255};
  const VoxelType type = add_type(scene, red);
  Grid grid;
  grid.set({2, 1, 0}, type);  // to the right of the centre and above it, seen along -Z
  place(scene, std::move(grid));
  RenderOptions options = sized(80, 80);
  options.light.shading = Shading::Unlit;
  const RenderedImage image = taken(scene, towards({0, 0, 10}, {0, 0, 0}, 2.0 * std::atan(0.4)), options);
  // At distance 9 the image extends 3.6 up from the centre: 11.1 pixels per voxel.
  EXPECT_EQ(pixel_at(image, 40 + 27, 40 - 16), encoded(linear(red)));
  EXPECT_FLOAT_EQ(depth_at(image, 40 + 27, 40 - 16),
                  9.0F * static_cast<float>(glm::length(DVec3(27.5 / 100, 15.5 / 100, 1.0))));
  for (const auto& [x, y] : {std::pair(-28, -16), {27, 16}, {-28, 16}}) {
    EXPECT_EQ(depth_at(image, 40 + x, 40 + y), static_cast<float>(kInfinity));
  }
  // The front, and narrow parts of its left and lower sides.
  EXPECT_GT(image.pixels_hit, 123);
  EXPECT_LT(image.pixels_hit, 165);
}

TEST(CpuRenderer, UnlitColoursMatchPalette) {
  Scene scene;
  Grid grid;
  for (int i = 0; i < 256; ++i) {
    grid.set({i % 16, 0, i / 16},
             add_type(scene, {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(255 - i), 77, 255}));
  }
  place(scene, std::move(grid));
  RenderOptions options = sized(16, 16);
  options.light.shading = Shading::Unlit;
  environment_in(options).exposure = 3.0;
  options.samples = 3;
  const RenderedImage image = taken(scene, from_above(8, 5, 8, 16), options);
  for (int i = 0; i < 256; ++i) {
    const Pixel expected{static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(255 - i), 77};
    EXPECT_EQ(pixel_at(image, i % 16, i / 16), expected);
  }
}

TEST(CpuRenderer, SamplesSoftenEdgesOnly) {
  Scene scene;
  Grid grid;
  grid.fill_box({{0, 0, 0}, {4, 4, 4}}, add_type(scene, {255, 255, 255, 255}));
  place(scene, std::move(grid));
  RenderOptions options = sized(64, 64);
  options.light.shading = Shading::Unlit;
  const Camera camera = towards({9, 7, 11}, {2, 2, 2});
  const RenderedImage one = taken(scene, camera, options);
  options.samples = 16;
  const RenderedImage many = taken(scene, camera, options);
  EXPECT_EQ(one.depth.values, many.depth.values) << "depth is that of the centre";
  EXPECT_EQ(one.pixels_hit, many.pixels_hit);
  int between = 0;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) between += pixel_at(many, x, y)[0] > 240 && pixel_at(many, x, y)[0] < 255;
  }
  EXPECT_GT(between, 10);
  EXPECT_LT(count_different(one, many, 2), 64 * 64 / 8);
}

TEST(CpuRenderer, SamplePointsStartAtCentreAndFillPixel) {
  EXPECT_EQ(sample_point(0).x, 0.5);
  EXPECT_EQ(sample_point(0).y, 0.5);
  std::array<int, 16> cells{};
  for (int i = 0; i < 256; ++i) {
    const PixelPoint point = sample_point(i);
    ++cells.at(static_cast<std::size_t>(point.x * 4) + 4 * static_cast<std::size_t>(point.y * 4));
  }
  for (const int count : cells) EXPECT_NEAR(count, 16, 3);
}

TEST(CameraRays, MatchPickingRays) {
  Camera perspective = *look_at({3, 4, 5}, {-20, 1, 9}, 0.7);
  Camera orthographic = perspective;
  orthographic.projection = Camera::Projection::Orthographic;
  orthographic.view_height = 12.5;
  for (const Camera& camera : {perspective, orthographic}) {
    RayPacket rays;
    CameraRays(camera, 37, 21).block(12, 8, {0.25, 0.75}, rays);
    for (int lane = 0; lane < RayPacket::kSize; ++lane) {
      const Ray expected = ray_through(camera, {12 + lane % 4 + 0.25, 8 + lane / 4 + 0.75, 37, 21});
      const Ray in_view = rays.ray(lane);
      EXPECT_NEAR(glm::distance(in_view.origin + camera.position, expected.origin), 0.0, 1e-12);
      EXPECT_NEAR(glm::distance(in_view.direction, expected.direction), 0.0, 1e-12);
    }
  }
}

// An updated renderer, and a second one that is rebuilt for each image.
class UpdatedRenderer {
 public:
  explicit UpdatedRenderer(const Scene& scene) : scene_(scene), renderer_(scene) {}

  void expect_as_new(const char* what) {
    SCOPED_TRACE(what);
    const Camera camera = towards({25, 18, 30}, {0, 2, 0});
    RenderOptions options = sized(90, 60);
    renderer_.update();
    for (const bool detail : {true, false}) {
      options.detail.policy.reset();
      // All instances are far: drawn from impostors.
      if (detail) options.detail.policy.emplace().far_pixels = 1000;
      const auto updated = renderer_.render(camera, options);
      const RenderedImage fresh = taken(scene_, camera, options);
      ASSERT_TRUE(updated.has_value());
      EXPECT_EQ(updated->colour.rgb, fresh.colour.rgb);
      EXPECT_EQ(updated->depth.values, fresh.depth.values);
      EXPECT_NE(updated->colour.rgb, last_.colour.rgb) << "the change does not show";
      last_ = fresh;
    }
  }

 private:
  const Scene& scene_;
  CpuRenderer renderer_;
  RenderedImage last_;
};

// Applies changes of all kinds between images of all kinds.
TEST(CpuRenderer, UpdatedRendererMatchesNewRenderer) {
  Scene scene = lively_scene();
  UpdatedRenderer renderer(scene);
  renderer.expect_as_new("nothing");
  const InstanceHandle first = scene.instances().handles()[0];
  const GridHandle grid = scene.grids().handles()[0];
  scene.edit(first).position += DVec3(3, 1, 0);
  renderer.expect_as_new("moved");
  scene.edit(grid).grid.fill_sphere({4, 3, 4}, 6.0, 1);
  renderer.expect_as_new("edited");
  VoxelProperties stone = scene.types[1];
  stone.colour = {20, 200, 30, 255};
  scene.types.replace(1, stone);
  renderer.expect_as_new("coloured");
  stone.colour.a = 60;
  stone.visibility = Visibility::Transparent;
  scene.types.replace(1, stone);
  renderer.expect_as_new("transparent");
  scene.types.replace(1, {});
  scene.edit(grid).grid = scene.grids()[grid].grid.snapshot();
  place(scene, scene.grids()[grid].grid.snapshot(), {-10, 4, 6});
  renderer.expect_as_new("more");
  scene.remove_instance(first);
  renderer.expect_as_new("fewer");
  scene.edit(grid).grid.clear();
  renderer.expect_as_new("emptied");
}

TEST(CpuRendererDeathTest, RejectsCameraWithoutPerpendicularAxes) {
  const Scene scene = lively_scene();
  const CpuRenderer renderer(scene);
  Camera camera = towards({25, 18, 30}, {0, 2, 0});
  camera.up = camera.right;
  QUOIN_EXPECT_MISTAKE(static_cast<void>(renderer.render(camera, sized(8, 8))), "axes are perpendicular");
}

}  // namespace
}  // namespace quoin
