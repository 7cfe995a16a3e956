// Images lit by lamps: points, spots and emissive voxels.

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/gtc/quaternion.hpp>

#include "render/cpu/environment_for_tests.h"
#include "render/cpu/render_test_support.h"
#include "render/light/emissive_cells.h"

namespace quoin {
namespace {

using namespace render_test;

constexpr Rgba8 kBrightest{255, 255, 255, 255};

RenderOptions by_night(int width, int height) {
  RenderOptions options = sized(width, height);
  options.light.occlusion_mode = OcclusionMode::Off;
  environment_in(options).sun.brightness = 0.0;
  environment_in(options).sky.brightness = 0.0;
  options.light.max_lamps = 64;
  return options;
}

// The y = 0 plane is the top of a white floor from -40 to 40.
Scene floor_by_night() {
  Scene scene;
  const VoxelType white = add_type(scene, kBrightest);
  Grid grid;
  grid.fill_box({{-40, -1, -40}, {40, 0, 40}}, white);
  place(scene, std::move(grid));
  return scene;
}

double fading(double distance, double reach) {
  return 1.0 - std::pow(distance / reach, 4.0);
}

void expect_grey(const RenderedImage& image, int x, int y, double light) {
  const Pixel found = pixel_at(image, x, y);
  const Pixel expected = encoded(Vec3(static_cast<float>(light)));
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 1) << x << ", " << y;
}

// Returns the world position of a pixel's centre in an image from above that is `height` high.
DVec3 floor_at(int x, int y, int size, double height) {
  return {((x + 0.5) / size - 0.5) * height, 0.0, ((y + 0.5) / size - 0.5) * height};
}

TEST(RenderLamps, PointLampFallsOffWithSquaredDistance) {
  Scene scene = floor_by_night();
  Lamp lamp;
  lamp.position = {3.0, 5.0, -2.0};
  lamp.intensity = 20.0;
  lamp.range = 30.0;
  scene.lamps.push_back(lamp);
  const RenderedImage image = taken(scene, from_above(0, 20, 0, 40), by_night(40, 40));
  for (int y = 1; y < 40; y += 6) {
    for (int x = 1; x < 40; x += 6) {
      const DVec3 to = lamp.position - floor_at(x, y, 40, 40) - DVec3(0.0, 0.01, 0.0);
      const double d = glm::length(to);
      expect_grey(image, x, y, d < 30.0 ? 20.0 * (to.y / d) / (d * d) * fading(d, 30.0) : 0.0);
    }
  }
  EXPECT_EQ(image.pixels_hit, 1600);
  EXPECT_EQ(pixel_at(image, 0, 39), (Pixel{0, 0, 0})) << "beyond its range";
}

TEST(RenderLamps, SpotLampLightsItsCone) {
  Scene scene = floor_by_night();
  Lamp lamp;
  lamp.kind = Lamp::Kind::Spot;
  lamp.position = {0.0, 10.0, 0.0};
  lamp.direction = {0.0, -7.0, 0.0};
  lamp.intensity = 50.0;
  lamp.inner_angle_radians = 0.2;
  lamp.outer_angle_radians = 0.5;
  scene.lamps.push_back(lamp);
  const RenderedImage image = taken(scene, from_above(0, 20, 0, 40), by_night(80, 80));
  for (int x = 0; x < 80; ++x) {
    const DVec3 to = lamp.position - floor_at(x, 40, 80, 40) - DVec3(0.0, 0.01, 0.0);
    const double d = glm::length(to);
    const double cone = std::clamp((to.y / d - std::cos(0.5)) / (std::cos(0.2) - std::cos(0.5)), 0.0, 1.0);
    expect_grey(image, x, 40, cone * cone * 50.0 * (to.y / d) / (d * d));
  }
}

TEST(RenderLamps, CastShadowsUnlessDisabled) {
  Scene scene = floor_by_night();
  Grid& grid = scene.edit(scene.grids().handles()[0]).grid;
  grid.fill_box({{4, 0, -10}, {5, 4, 10}}, 1);
  Lamp lamp;
  lamp.position = {0.0, 2.0, 0.0};
  lamp.intensity = 10.0;
  scene.lamps.push_back(lamp);
  RenderOptions options = by_night(40, 40);
  const Camera camera = from_above(0, 20, 0, 40);
  EXPECT_EQ(pixel_at(taken(scene, camera, options), 27, 20), (Pixel{0, 0, 0})) << "behind the wall";
  EXPECT_GT(pixel_at(taken(scene, camera, options), 13, 20)[0], 30) << "on the other side";
  options.light.shadows = false;
  EXPECT_GT(pixel_at(taken(scene, camera, options), 27, 20)[0], 30);
}

// One voxel as a lamp of six faces: its light is close to the light of the faces.
TEST(RenderLamps, EmissiveVoxelMatchesItsFaces) {
  Scene scene = floor_by_night();
  const VoxelType torch = add_type(scene, kBrightest, Visibility::Opaque, 6.0F);
  Grid& grid = scene.edit(scene.grids().handles()[0]).grid;
  grid.set({0, 6, 0}, torch);
  const RenderedImage image = taken(scene, from_above(0.5, 4, 0.5, 40), by_night(80, 80));
  const double reach = std::sqrt(4096.0 * std::sqrt(3.0) * 6.0 / std::numbers::pi);
  for (int x = 2; x < 80; x += 7) {
    const DVec3 at = floor_at(x, 30, 80, 40) + DVec3(0.5, 0.0, 0.5);
    // 16 x 16 patches per face.
    double sum = 0.0;
    for (const Direction face : kDirections) {
      const FaceFrame& frame = frame_of(face);
      for (int i = 0; i < 256; ++i) {
        DVec3 patch(0.0, 6.0, 0.0);
        patch[frame.axis] += frame.sign > 0 ? 1.0 : 0.0;
        patch[frame.u] += (i % 16 + 0.5) / 16;
        const int row = i / 16;
        patch[frame.v] += (row + 0.5) / 16;
        const DVec3 to = patch - at;
        const double d = glm::length(to);
        const double shining = -frame.sign * to[frame.axis] / d;
        if (shining > 0.0) sum += 6.0 / std::numbers::pi / 256 * shining * (to.y / d) / (d * d);
      }
    }
    const double d = glm::length(DVec3(0.5, 6.5, 0.5) - at);
    const Pixel found = pixel_at(image, x, 30);
    const Pixel expected = encoded(Vec3(static_cast<float>(sum * fading(d, reach))));
    EXPECT_NEAR(found[0], expected[0], 3) << x;
  }
}

// Analytic check of a ball of constant radiance: its light falls off with the squared distance from its centre.
TEST(RenderLamps, EmissiveFieldMatchesItsSurface) {
  Scene scene = floor_by_night();
  const VoxelType glow = add_type(scene, kBrightest, Visibility::Opaque, 1.5F);
  constexpr double kRadius = 4.0;
  const DVec3 middle{0.3, 12.2, -0.4};
  SceneGrid ball;
  ball.field.add_sphere(middle, kRadius, glow);
  EmissiveCells cells;
  cells.update(ball.field, scene.types);
  double area = 0.0;
  cells.for_each([&](const EmissiveCell& cell) {
    for (const Vec3& power : cell.power) area += double{power.x} / 1.5;
  });
  EXPECT_NEAR(area, 4.0 * std::numbers::pi * kRadius * kRadius, 6.0);
  scene.add_instance({"", scene.add_grid(std::move(ball)), DVec3(0.0)});
  Camera camera = from_above(0.0, 5, 0.0, 60);
  const RenderedImage image = taken(scene, camera, by_night(60, 60));
  double sum = 0.0;
  int count = 0;
  for (int x = 2; x < 60; x += 3) {
    for (int y = 2; y < 60; y += 3) {
      const DVec3 to = middle - floor_at(x, y, 60, 60);
      const double d = glm::length(to);
      const double expected = 1.5 * kRadius * kRadius / (d * d) * (to.y / d);
      const double found = linear({pixel_at(image, x, y)[0], 0, 0, 255}).x;
      EXPECT_NEAR(found / expected, 1.0, 0.4) << x << ' ' << y;
      sum += found / expected;
      ++count;
    }
  }
  EXPECT_NEAR(sum / count, 1.0, 0.12);
}

TEST(RenderLamps, FieldsAreLitAndCastShadows) {
  Scene scene = floor_by_night();
  SceneGrid hill;
  hill.field.add_sphere({0, -6, 0}, 10.0, 1);
  scene.add_instance({"", scene.add_grid(std::move(hill)), DVec3(0.0)});
  Lamp lamp;
  lamp.position = {20.0, 6.0, 0.0};
  lamp.intensity = 60.0;
  scene.lamps.push_back(lamp);
  const RenderedImage image = taken(scene, from_above(0, 30, 0, 60), by_night(60, 60));
  EXPECT_GT(pixel_at(image, 34, 30)[0], 40) << "the hill's side that looks at the lamp";
  EXPECT_EQ(pixel_at(image, 24, 30), (Pixel{0, 0, 0})) << "its other side";
  EXPECT_EQ(pixel_at(image, 16, 30), (Pixel{0, 0, 0})) << "its shadow";
  EXPECT_GT(pixel_at(image, 30, 8)[0], 10) << "beside it";
}

TEST(RenderLamps, ClosedLanternLightsNothing) {
  Scene scene = floor_by_night();
  const VoxelType torch = add_type(scene, kBrightest, Visibility::Opaque, 50.0F);
  Grid& grid = scene.edit(scene.grids().handles()[0]).grid;
  grid.fill_box({{-2, 3, -2}, {3, 8, 3}}, 1);
  grid.fill_box({{-1, 4, -1}, {2, 7, 2}}, kAir);
  grid.set({0, 5, 0}, torch);
  const RenderOptions options = by_night(40, 40);
  const RenderedImage image = taken(scene, towards({0, 2, 30}, {0, 0, 0}, 1.0), options);
  EXPECT_TRUE(std::all_of(image.colour.rgb.begin(), image.colour.rgb.end(), [](auto byte) { return byte == 0; }));
  scene.edit(scene.grids().handles()[0]).grid.fill_box({{-2, 5, -1}, {-1, 6, 2}}, kAir);
  const RenderedImage open = taken(scene, towards({-30, 12, 0}, {0, 0, 0}, 1.0), options);
  EXPECT_GT(*std::max_element(open.colour.rgb.begin(), open.colour.rgb.end()), 100);
}

TEST(RenderLamps, LightFollowsEditsAndTypes) {
  Scene scene = floor_by_night();
  const VoxelType torch = add_type(scene, kBrightest, Visibility::Opaque, 9.0F);
  const GridHandle grid = scene.grids().handles()[0];
  CpuRenderer renderer(scene);
  const RenderOptions options = by_night(8, 8);
  const auto light = [&] {
    renderer.update();
    return pixel_at(renderer.render(from_above(3, 2, 0, 1), options).value(), 4, 4)[0];
  };
  EXPECT_EQ(light(), 0);
  scene.edit(grid).grid.set({0, 3, 0}, torch);
  const int lit = light();
  EXPECT_GT(lit, 20);
  VoxelProperties brighter = scene.types[torch];
  brighter.emission = 30.0F;
  scene.types.replace(torch, brighter);
  EXPECT_GT(light(), lit);
  scene.lamps.push_back({"", Lamp::Kind::Point, {3, 4, 0}});
  const int both = light();
  scene.edit(grid).grid.set({0, 3, 0}, kAir);
  EXPECT_LT(light(), both);
  scene.lamps.clear();
  EXPECT_EQ(light(), 0);
}

TEST(RenderLamps, GlassTintsLampLight) {
  Scene scene = floor_by_night();
  const VoxelType glass = add_type(scene, {255, 40, 40, 200}, Visibility::Transparent);
  scene.edit(scene.grids().handles()[0]).grid.fill_box({{-20, 3, -20}, {20, 4, 20}}, glass);
  Lamp lamp;
  lamp.position = {0.0, 8.0, 0.0};
  lamp.intensity = 60.0;
  scene.lamps.push_back(lamp);
  const Pixel tinted = pixel_at(taken(scene, from_above(2, 2, 2, 1), by_night(2, 2)), 0, 0);
  EXPECT_GT(tinted[0], 20);
  EXPECT_LT(tinted[1], tinted[0] / 2) << "red";
}

// Holds with any other content in the image.
TEST(RenderLamps, LampChoiceDependsOnlyOnPosition) {
  Scene scene = floor_by_night();
  for (int i = 0; i < 200; ++i) {
    Lamp lamp;
    const int row = i / 20;
    lamp.position = {-35.0 + i % 20 * 3.7, 1.5 + i % 3, -35.0 + row * 7.1};
    lamp.colour = {0.2F + static_cast<float>(i % 3) * 0.4F, 0.5F, 0.2F + static_cast<float>(i % 5) * 0.2F};
    lamp.intensity = 0.3 + i % 7;
    scene.lamps.push_back(lamp);
  }
  RenderOptions options = by_night(96, 96);
  options.light.max_lamps = 6;
  const RenderedImage whole = taken(scene, from_above(0, 50, 0, 48), options);
  options.width = options.height = 32;
  const RenderedImage part = taken(scene, from_above(8, 50, -8, 16), options);
  int different = 0;
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) different += pixel_at(part, x, y) != pixel_at(whole, x + 48, y + 16);
  }
  EXPECT_EQ(different, 0);
  EXPECT_EQ(taken(scene, from_above(8, 50, -8, 16), options, {1}).colour.rgb, part.colour.rgb);
  options.light.max_lamps = 200;
  EXPECT_GT(count_different(taken(scene, from_above(8, 50, -8, 16), options), part, 1), 500) << "more add more";
}

TEST(RenderLamps, AreOffByDefault) {
  Scene scene = floor_by_night();
  const Camera camera = towards({0, 20, 30}, {0, 0, 0}, 0.8);
  RenderOptions options = sized(32, 32);
  environment_in(options).exposure = 0.3;
  const RenderedImage before = taken(scene, camera, options);
  scene.lamps.push_back({"", Lamp::Kind::Point, {0, 4, 0}});
  EXPECT_EQ(taken(scene, camera, options).colour.rgb, before.colour.rgb);
  options.light.max_lamps = 64;
  EXPECT_NE(taken(scene, camera, options).colour.rgb, before.colour.rgb);
  options.light.max_lamps = -1;
  EXPECT_FALSE(CpuRenderer(scene).render(camera, options).has_value());
}

TEST(RenderLamps, InvalidLampsGiveNoLight) {
  Scene scene = floor_by_night();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 8; ++i) {
    Lamp lamp;
    lamp.position = {0, 4, 0};
    lamp.kind = Lamp::Kind::Spot;
    if (i == 0) lamp.position.x = nan;
    if (i == 1) lamp.intensity = infinity;
    if (i == 2) lamp.intensity = -1.0;
    if (i == 3) lamp.range = nan;
    if (i == 4) lamp.direction = DVec3(0.0);
    if (i == 5) lamp.colour.x = std::numeric_limits<float>::quiet_NaN();
    if (i == 6) lamp.inner_angle_radians = nan;
    if (i == 7) lamp.outer_angle_radians = nan;
    scene.lamps.push_back(lamp);
  }
  const RenderedImage image = taken(scene, from_above(0, 20, 0, 40), by_night(16, 16));
  EXPECT_TRUE(std::all_of(image.colour.rgb.begin(), image.colour.rgb.end(), [](auto byte) { return byte == 0; }));
}

// Returns the same numbers on every machine, each below a limit.
class Below {
 public:
  int operator()(std::uint32_t limit) {
    state_ = state_ * 1'664'525U + 1'013'904'223U;
    return static_cast<int>((state_ >> 8) % limit);
  }

 private:
  std::uint32_t state_ = 7;
};

std::vector<EmissiveCell> cells_of(const EmissiveCells& cells) {
  std::vector<EmissiveCell> all;
  cells.for_each([&](const EmissiveCell& cell) { all.push_back(cell); });
  return all;
}

void expect_same(const EmissiveCells& kept, const EmissiveCells& fresh) {
  const std::vector<EmissiveCell> a = cells_of(kept);
  const std::vector<EmissiveCell> b = cells_of(fresh);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].centre, b[i].centre);
    ASSERT_EQ(a[i].power, b[i].power);
    ASSERT_EQ(a[i].box.min, b[i].box.min);
  }
}

TEST(EmissiveCells, MatchRebuildAfterFieldEdits) {
  Scene scene;
  const VoxelType stone = add_type(scene, kBrightest);
  const VoxelType torch = add_type(scene, {255, 120, 30, 255}, Visibility::Opaque, 3.0F);
  DensityGrid field;
  EmissiveCells kept;
  Below below;
  std::size_t most = 0;
  for (int round = 0; round < 40; ++round) {
    const DVec3 at(below(90) - 20, below(90) - 20, below(90) - 20);
    if (round % 3 == 2) {
      field.remove_sphere(at, 2.0 + below(12));
    } else {
      field.add_sphere(at, 2.0 + below(8), round % 2 == 0 ? torch : stone);
    }
    kept.update(field, scene.types);
    EmissiveCells fresh;
    fresh.update(field, scene.types);
    most = std::max(most, cells_of(kept).size());
    ASSERT_NO_FATAL_FAILURE(expect_same(kept, fresh));
  }
  EXPECT_GT(most, 100U);
}

// A glowing ball in a lake of the same field shines as in air; in stone it does not.
TEST(EmissiveCells, EmissiveFieldsShineIntoSurroundingGlass) {
  Scene scene;
  const VoxelType stone = add_type(scene, kBrightest);
  const VoxelType torch = add_type(scene, {255, 120, 30, 255}, Visibility::Opaque, 3.0F);
  const VoxelType water = add_type(scene, {60, 120, 160, 40}, Visibility::Transparent);
  const auto power_in = [&](VoxelType around) {
    DensityGrid field;
    field.edit({{0, 0, 0}, {40, 40, 40}}, [&](IVec3 p, DensitySample) {
      const double ball = glm::distance(DVec3(p), DVec3(20.3)) - 7.0;
      const double sides = std::min({p.x, p.y, p.z, 39 - p.x, 39 - p.y, 39 - p.z}) - 0.5;
      if (ball < 0.0) return DensitySample{static_cast<float>(ball), torch};
      if (around == kAir || sides < 0.0) return DensitySample{static_cast<float>(ball), kAir};
      return DensitySample{static_cast<float>(-std::max(std::min(ball, sides), 0.01)), around};
    });
    EmissiveCells cells;
    cells.update(field, scene.types);
    double sum = 0.0;
    cells.for_each([&](const EmissiveCell& cell) {
      for (const Vec3& power : cell.power) sum += static_cast<double>(power.x);
    });
    return sum;
  };
  const double in_air = power_in(kAir);
  EXPECT_GT(in_air, 0.0);
  EXPECT_NEAR(power_in(water), in_air, 0.08 * in_air);
  EXPECT_EQ(power_in(stone), 0.0);
}

TEST(EmissiveCells, MatchRebuildAfterEdits) {
  Scene scene;
  const VoxelType stone = add_type(scene, kBrightest);
  const VoxelType torch = add_type(scene, {255, 120, 30, 255}, Visibility::Opaque, 3.0F);
  const VoxelType glow = add_type(scene, {60, 220, 90, 120}, Visibility::Transparent, 2.0F);
  Grid grid;
  EmissiveCells kept;
  Below below;
  for (int round = 0; round < 60; ++round) {
    const IVec3 at{below(90) - 20, below(90) - 20, below(90) - 20};
    const std::array<VoxelType, 4> types = {kAir, stone, torch, glow};
    grid.fill_box({at, at + 1 + below(6)}, types.at(static_cast<std::size_t>(below(4))));
    kept.update(grid, scene.types);
    EmissiveCells fresh;
    fresh.update(grid, scene.types);
    ASSERT_NO_FATAL_FAILURE(expect_same(kept, fresh));
  }
}

// If all data may have changed, removed chunks are still examined, since their lamps are known.
TEST(EmissiveCells, ExamineRemovedChunksIfAllDataChanged) {
  VoxelRegistry types;
  VoxelProperties turned{.name = "turned", .emission = 1.0F, .state_bits = 2};
  turned.orientations = StateOrientations::about_y();
  const VoxelType type = *types.add(turned);
  Grid grid;
  grid.set({5, 5, 5}, type);
  grid.set({200, 5, 5}, type);
  ChangeCursor cursor;
  (void)grid.changes_since(cursor);
  grid.set({5, 5, 5}, kAir);
  const GridChanges changes = grid.changes_since(cursor);
  const std::vector<IVec3> both{{0, 0, 0}, {3, 0, 0}};
  DataChanges data;
  data.all = true;
  std::vector<IVec3> chunks = chunks_to_mesh(grid, changes);
  EXPECT_EQ(chunks, (std::vector<IVec3>{{0, 0, 0}}));
  add_turned(grid, types, data, chunks);
  EXPECT_EQ(chunks, both);
  chunks = chunks_to_mesh(grid, changes);
  add_near_shapes(grid, changes, data, chunks);
  EXPECT_EQ(chunks, both);
  chunks = {};
  add_near_shapes(grid, changes, {}, chunks);
  EXPECT_EQ(chunks, (std::vector<IVec3>{{0, 0, 0}})) << "a change far from other chunks";
}

TEST(RenderLamps, AllowsAlternatingLampLimits) {
  Scene scene = floor_by_night();
  for (int i = 0; i < 6; ++i) {
    Lamp lamp;
    lamp.position = {5.0 * i - 12.0, 4.0, 2.0 * i - 5.0};
    lamp.intensity = 10.0 + i;
    lamp.range = 25.0;
    scene.lamps.push_back(lamp);
  }
  CpuRenderer renderer(scene);
  RenderOptions options = by_night(40, 40);
  const auto check = [&](int lamps) {
    SCOPED_TRACE(lamps);
    options.light.max_lamps = lamps;
    const RenderedImage image = renderer.render(from_above(0, 20, 0, 40), options).value();
    EXPECT_EQ(image.colour.rgb, taken(scene, from_above(0, 20, 0, 40), options).colour.rgb);
  };
  // Three kinds are one more than the cache holds.
  for (const int lamps : {64, 2, 64, 2, 1, 2, 64}) check(lamps);
  scene.lamps[2].intensity = 40.0;
  renderer.update();
  for (const int lamps : {2, 64, 2}) check(lamps);
}

}  // namespace
}  // namespace quoin
