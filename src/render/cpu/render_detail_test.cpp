// Images of coarser cells look like images of the voxels.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <set>
#include <span>
#include <string>
#include <vector>

#include <glm/gtc/quaternion.hpp>

#include <quoin/grid/downsample.h>
#include <quoin/scene/scene_tracer.h>
#include <quoin/terrain/terrain.h>

#include "core/work/nightly_for_tests.h"
#include "grid/shapes/shape_types_for_tests.h"
#include "render/cpu/environment_for_tests.h"
#include "render/cpu/render_test_support.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {
namespace {

using namespace render_test;

constexpr double kFov = std::numbers::pi / 6;
constexpr int kEdge = 320;

// A scene of one slightly rotated instance, so that no edges align with the image's rows.
struct Model {
  Scene scene;
  InstanceHandle instance;

  void place_turned(Grid grid) { place_turned(std::move(grid), DensityGrid()); }
  void place_turned(Grid grid, DensityGrid field) {
    instance = place(scene, std::move(grid));
    SceneGrid& placed = scene.edit(scene.instances()[instance].grid);
    placed.field = std::move(field);
    placed.pivot = content_sphere(placed).centre;
    scene.edit(instance).rotation = glm::angleAxis(0.7, glm::normalize(DVec3(0.3, 1.0, 0.1)));
  }
  [[nodiscard]] double radius() const { return content_sphere(scene.grids()[scene.instances()[instance].grid]).radius; }
};

Model ship() {
  Model model;
  const VoxelType wood = add_type(model.scene, {120, 80, 45, 255});
  const VoxelType plank = add_type(model.scene, {165, 120, 70, 255});
  const VoxelType sail = add_type(model.scene, {230, 225, 205, 255});
  Grid grid;
  for (int z = 0; z < 180; ++z) {
    const double taper = z < 60 ? std::sqrt(z / 60.0) : 1.0;
    for (int y = 0; y < 32; ++y) {
      const int half = std::max(0, static_cast<int>(std::lround(27.0 * taper)) - std::max(0, 15 - y));
      grid.fill_box({{-half, y, z}, {half + 1, y + 1, z + 1}}, y % 7 == 5 ? plank : wood);
      const int inside = std::abs(half - 3);
      if (y > 24) grid.fill_box({{-inside, y, z}, {inside + 1, y + 1, z + 1}}, kAir);
    }
  }
  for (const int z : {60, 123}) {
    grid.fill_box({{-1, 20, z}, {2, 151, z + 3}}, wood);
    for (int y = 50; y <= 140; ++y) {
      const int bulge = static_cast<int>(std::lround(13.0 * std::sin((y - 50) / 90.0 * std::numbers::pi)));
      grid.fill_box({{-37, y, z - 4 - bulge}, {38, y + 1, z - 2 - bulge}}, sail);
    }
  }
  model.place_turned(std::move(grid));
  return model;
}

Model terrain() {
  Model model;
  const auto types = add_terrain_types(model.scene.types);
  const TerrainOptions options{.seed = 42, .size = {6, 2, 6}};
  model.place_turned(generate_terrain(options, types.value()).value());
  return model;
}

// Returns a deck one voxel thick on piers, below cables of single voxels.
Model bridge() {
  Model model;
  const VoxelType stone = add_type(model.scene, {150, 145, 135, 255});
  const VoxelType steel = add_type(model.scene, {190, 60, 45, 255});
  Grid grid;
  grid.fill_box({{-110, 41, -12}, {111, 42, 14}}, stone);
  for (const int x : {-81, 0, 83}) {
    grid.fill_box({{x, 0, -11}, {x + 8, 79, -4}}, stone);
    grid.fill_box({{x, 0, 5}, {x + 8, 79, 12}}, stone);
  }
  for (const int z : {-9, 9}) {
    grid.fill_box({{-110, 47, z}, {111, 48, z + 1}}, steel);
    for (int x = -105; x <= 105; x += 15) grid.fill_box({{x, 41, z}, {x + 1, 48, z + 1}}, steel);
  }
  model.place_turned(std::move(grid));
  return model;
}

Model smooth_terrain() {
  Model model;
  const auto types = add_terrain_types(model.scene.types);
  const SmoothTerrainOptions options{.seed = 42, .size = {6, 2, 6}};
  model.place_turned({}, generate_smooth_terrain(options, types.value()).value());
  return model;
}

// Returns a hill with a house of blocks, and walls two samples thick.
Model village(bool has_thin_walls) {
  Model model;
  const VoxelType stone = add_type(model.scene, {150, 145, 135, 255});
  const VoxelType grass = add_type(model.scene, {90, 160, 70, 255});
  DensityGrid field;
  field.add_sphere({0, -100, 0}, 130.0, grass);
  field.add_sphere({40, 20, 30}, 25.0, stone, 6.0);
  field.remove_sphere({-40, 20, 20}, 30.0, 3.0);
  if (has_thin_walls) {
    for (int x = -150; x < 150; x += 12) field.add_box({x + 0.4, 30, -120}, {x + 2.1, 120, 120}, stone);
  }
  Grid grid;
  grid.fill_box({{-20, 20, -40}, {20, 60, 0}}, stone);
  grid.fill_box({{-26, 60, -46}, {26, 64, 6}}, grass);
  model.place_turned(std::move(grid), std::move(field));
  return model;
}

struct Closeness {
  double colour = 0.0;   // mean absolute difference of the channels, over the pixels of either image
  double overlap = 0.0;  // intersection over union of the silhouettes
};

Closeness closeness(const RenderedImage& a, const RenderedImage& b) {
  double sum = 0.0;
  int both = 0;
  int either = 0;
  for (std::size_t i = 0; i < a.depth.values.size(); ++i) {
    const bool in_a = std::isfinite(a.depth.values[i]);
    const bool in_b = std::isfinite(b.depth.values[i]);
    both += static_cast<int>(in_a && in_b);
    if (!in_a && !in_b) continue;
    ++either;
    for (std::size_t c = 0; c < 3; ++c) sum += std::abs(a.colour.rgb[3 * i + c] - b.colour.rgb[3 * i + c]);
  }
  return {sum / (3.0 * either), static_cast<double>(both) / either};
}

// Returns a camera where a voxel at the content's nearest point spans that many pixels.
Camera camera_for(const Model& model, double voxel_pixels, DVec3 direction) {
  const double scale = 0.5 * kEdge / std::tan(kFov / 2.0);
  return towards(glm::normalize(direction) * (model.radius() + scale / voxel_pixels), {0, 0, 0}, kFov);
}

DetailPolicy without_impostors() {
  DetailPolicy policy;
  policy.far_pixels = 0;
  return policy;
}

// Returns the number of halvings of the model's one traced instance.
int halvings_traced(const Model& model, const Camera& camera, const DetailPolicy& policy) {
  std::vector<SelectedInstance> selected;
  DetailSelector().select(model.scene, camera, kEdge, kEdge, policy, selected);
  const SceneTracer tracer(model.scene);
  return placed_in(tracer.with_detail(selected)).at(0).level;
}

// Compares the images without and with levels of detail.
Closeness closeness_at(const Model& model, const Camera& camera, const DetailPolicy& policy) {
  RenderOptions options = sized(kEdge, kEdge);
  options.samples = 64;
  const CpuRenderer renderer(model.scene);
  const RenderedImage near = renderer.render(camera, options).value();
  options.detail.policy = policy;
  return closeness(near, renderer.render(camera, options).value());
}

// Compares just beyond the thresholds for Mid and for halving.
void expect_close(const Model& model, int halvings) {
  const DetailPolicy policy = without_impostors();
  const std::array directions{DVec3(1, 0.6, 1.4), DVec3(-1.2, 0.3, 0.4)};
  for (const DVec3& direction : std::span(directions).first(static_cast<std::size_t>(cases(1, 2)))) {
    for (const double voxel_pixels : {0.999 * policy.voxel_pixels, 0.4999 * policy.cell_pixels}) {
      const bool is_halved = voxel_pixels < 0.5 * policy.cell_pixels;
      const Camera camera = camera_for(model, voxel_pixels, direction);
      EXPECT_EQ(halvings_traced(model, camera, policy), is_halved ? halvings : 0);
      const Closeness found = closeness_at(model, camera, policy);
      EXPECT_LE(found.colour, 6.0) << "where a voxel spans " << voxel_pixels << " pixels";
      EXPECT_GE(found.overlap, 0.97) << "where a voxel spans " << voxel_pixels << " pixels";
      ::testing::Test::RecordProperty("difference", std::to_string(found.colour));
      ::testing::Test::RecordProperty("overlap", std::to_string(found.overlap));
    }
  }
}

TEST(RenderDetail, ShipLooksAlikeInCoarserCells) {
  expect_close(ship(), 1);
}

TEST(RenderDetail, TerrainLooksAlikeInCoarserCells) {
  expect_close(terrain(), 1);
}

TEST(RenderDetail, ThinBridgeIsNotHalved) {
  expect_close(bridge(), 0);
}

// Ground with a part of each: carpets, fences, plants and slabs. As cubes: with a cube for each shape.
Model garden(bool as_cubes) {
  Model model;
  const ShapeTypes types(model.scene.types);
  const auto add = [&](VoxelProperties properties) { return model.scene.types.add(std::move(properties)).value(); };
  const VoxelType carpet =
      add({.name = "carpet", .colour = {200, 40, 40}, .shapes = VoxelShape::box({0, 0, 0}, {16, 1, 16})});
  Grid grid;
  // Both parities of heights.
  grid.fill_box({{0, 0, 0}, {48, 6, 96}}, types.stone);
  grid.fill_box({{48, 0, 0}, {96, 9, 96}}, types.stone);
  std::mt19937 random(4);
  for (int i = 0; i < 96 * 96; ++i) {
    const IVec3 at{i % 96, i % 96 < 48 ? 6 : 9, i / 96};
    if (at.z < 24) {
      grid.set(at, carpet);
    } else if (at.z < 48) {
      if (at.z % 6 == 0) grid.set(at, types.fence);
    } else if (at.z < 72) {
      if (random() % 8 == 0) grid.set(at, types.flower);
    } else {
      grid.set(at, types.slab);
    }
  }
  if (as_cubes) {
    VoxelRegistry plain;
    for (std::size_t i = 1; i < model.scene.types.size(); ++i) {
      const VoxelProperties& from = model.scene.types[static_cast<VoxelType>(i)];
      EXPECT_TRUE(plain.add({.name = from.name, .colour = from.colour}));
    }
    model.scene.types = plain;
  }
  model.place_turned(std::move(grid));
  return model;
}

// Returns the largest difference of a channel's mean in linear light over the pixels of either image, of 255.
double mean_difference(const RenderedImage& a, const RenderedImage& b) {
  std::array<double, 3> sums{};
  double pixels = 0.0;
  for (std::size_t i = 0; i < a.depth.values.size(); ++i) {
    pixels += std::isfinite(a.depth.values[i]) || std::isfinite(b.depth.values[i]) ? 1.0 : 0.0;
    for (std::size_t c = 0; c < 3; ++c) {
      sums.at(c) += linear_from_srgb(a.colour.rgb[3 * i + c]) - linear_from_srgb(b.colour.rgb[3 * i + c]);
    }
  }
  const auto [least, most] = std::ranges::minmax(sums);
  return 255.0 * std::max(-least, most) / pixels;
}

// Measured: overlap 0.995, mean 2.9 (with cubes 0.975 and 8.2).
TEST(RenderDetail, ShapesLookAlikeInCoarserCells) {
  const Model model = garden(false);
  const Model cubes = garden(true);
  DetailPolicy policy = without_impostors();
  const Camera camera = camera_for(model, 0.4999 * policy.cell_pixels, DVec3(1, 0.6, 1.4));
  ASSERT_EQ(halvings_traced(model, camera, policy), 1);
  RenderOptions options = sized(kEdge, kEdge);
  options.samples = 16;
  const RenderedImage near = taken(model.scene, camera, options);
  options.detail.policy = policy;
  const RenderedImage far = taken(model.scene, camera, options);
  const RenderedImage far_cubes = taken(cubes.scene, camera, options);
  const Closeness found = closeness(near, far);
  const Closeness of_cubes = closeness(near, far_cubes);
  std::printf("shapes: overlap %.4f, difference %.2f, mean %.2f; cubes: %.4f, %.2f, %.2f\n", found.overlap,
              found.colour, mean_difference(near, far), of_cubes.overlap, of_cubes.colour,
              mean_difference(near, far_cubes));
  EXPECT_GE(found.overlap, 0.97);
  EXPECT_LE(mean_difference(near, far), 3.0);
  EXPECT_GT(mean_difference(near, far_cubes), 3.0) << "with cubes";
}

// Compares at the largest distance for this number of halvings.
void expect_close_at(const Model& model, int level, int halvings, double difference) {
  const DetailPolicy policy = without_impostors();
  const double voxel_pixels = 0.999 * std::ldexp(policy.cell_pixels, -level);
  const Camera camera = camera_for(model, voxel_pixels, DVec3(1, 0.6, 1.4));
  EXPECT_EQ(halvings_traced(model, camera, policy), halvings);
  const Closeness found = closeness_at(model, camera, policy);
  EXPECT_LE(found.colour, difference) << "halved " << halvings << " times";
  EXPECT_GE(found.overlap, 0.97) << "halved " << halvings << " times";
  ::testing::Test::RecordProperty("difference" + std::to_string(level), std::to_string(found.colour));
  ::testing::Test::RecordProperty("overlap" + std::to_string(level), std::to_string(found.overlap));
}

TEST(RenderDetail, SmoothTerrainLooksAlikeInCoarserSamples) {
  const Model model = smooth_terrain();
  expect_close_at(model, 1, 1, 6.0);
  expect_close_at(model, 2, 2, 7.5);
  // Roofs of its caves would be one sample thin.
  expect_close_at(model, 3, 2, 7.5);
}

TEST(RenderDetail, HalvesFieldTogetherWithBlocks) {
  const Model model = village(false);
  for (int level = 1; level <= 2; ++level) expect_close_at(model, level, level, 6.0);
  // The eaves of the house would be twice as thick.
  expect_close_at(model, 3, 2, 6.0);
}

TEST(RenderDetail, ThinFieldAndItsBlocksAreNotHalved) {
  expect_close_at(village(true), 1, 0, 0.0);
}

TEST(RenderDetail, ClosenessDetectsDifferences) {
  const Model model = terrain();
  DetailPolicy coarse = without_impostors();
  coarse.cell_pixels = 4.0;
  const Closeness found = closeness_at(model, camera_for(model, 0.999, DVec3(1, 0.6, 1.4)), coarse);
  EXPECT_GT(found.colour, 6.0);
  EXPECT_LT(found.overlap, 0.999);
}

Model balls(VoxelType* glass = nullptr) {
  Model model;
  std::array<VoxelType, 3> types = {add_type(model.scene, {200, 90, 60, 255}),
                                    add_type(model.scene, {60, 160, 90, 255}),
                                    add_type(model.scene, {90, 120, 220, 120}, Visibility::Transparent)};
  if (glass != nullptr) *glass = types[2];
  std::mt19937 random(31);
  Grid grid;
  for (int i = 0; i < 30; ++i) {
    const auto coordinate = [&] { return 2 * (static_cast<int>(random() % 12) - 6); };
    const IVec3 at{coordinate(), coordinate(), coordinate()};
    grid.fill_box({at, at + IVec3(1 + 2 * static_cast<int>(random() % 4)) + 1}, types.at(random() % 3));
    const IVec3 speck{coordinate(), coordinate(), coordinate()};
    if (grid.get(speck) == kAir) grid.set(speck, types[0]);
  }
  model.place_turned(std::move(grid));
  return model;
}

RenderOptions always_mid() {
  RenderOptions options = sized(64, 64);
  options.detail.policy.emplace().rule = DetailPolicy::Rule::ByRadius;
  options.detail.policy->near_radii = 0.0;
  options.detail.policy->mid_radii = 1e9;
  return options;
}

TEST(RenderDetail, MidMatchesHalvedGridInFullLight) {
  const Model model = balls();
  const Camera camera = towards({30, 25, 40}, {0, 0, 0}, 0.9);
  Scene coarse;
  for (VoxelType type = 1; type < model.scene.types.size(); ++type) {
    ASSERT_TRUE(coarse.types.add(model.scene.types[type]));
  }
  const Instance& full = model.scene.instances()[model.instance];
  const SceneGrid& full_grid = model.scene.grids()[full.grid];
  SceneGrid grid;
  grid.grid = *downsample(full_grid.grid, coarse.types);
  grid.pivot = full_grid.pivot / 2.0;
  Instance instance = full;
  instance.grid = coarse.add_grid(std::move(grid));
  instance.voxel_size = 2.0;
  coarse.add_instance(instance);
  RenderOptions options = always_mid();
  options.light.shadow_distance_voxels = 8.0;
  const RenderedImage mid = taken(model.scene, camera, options);
  RenderOptions expected = sized(64, 64);
  expected.light.occlusion_distance_voxels /= 2.0;
  expected.light.shadow_distance_voxels = 4.0;
  const RenderedImage other = taken(coarse, camera, expected);
  EXPECT_EQ(mid.depth.values, other.depth.values);
  EXPECT_GT(mid.pixels_hit, 300);
  const RenderedImage near = taken(model.scene, camera, sized(64, 64));
  EXPECT_NE(mid.depth.values, near.depth.values);
}

TEST(RenderDetail, MidMatchesHalvedFieldInFullLight) {
  const Model model = village(false);
  const Camera camera = towards({160, 150, 200}, {0, 0, 0}, 0.9);
  Scene coarse;
  for (VoxelType type = 1; type < model.scene.types.size(); ++type) {
    ASSERT_TRUE(coarse.types.add(model.scene.types[type]));
  }
  Instance instance = model.scene.instances()[model.instance];
  const SceneGrid& full = model.scene.grids()[instance.grid];
  SceneGrid grid;
  grid.grid = *downsample(full.grid, coarse.types);
  grid.field = *downsample(full.field);
  grid.pivot = full.pivot / 2.0;
  instance.grid = coarse.add_grid(std::move(grid));
  instance.voxel_size = 2.0;
  coarse.add_instance(instance);
  for (const OcclusionMode mode : {OcclusionMode::Rays, OcclusionMode::Smooth}) {
    RenderOptions options = always_mid();
    options.light.occlusion_mode = mode;
    RenderOptions expected = sized(64, 64);
    expected.light = options.light;
    expected.light.occlusion_distance_voxels /= 2.0;
    expected.light.smooth_occlusion.spread /= 2.0F;
    const RenderedImage mid = taken(model.scene, camera, options);
    const RenderedImage other = taken(coarse, camera, expected);
    EXPECT_EQ(mid.depth.values, other.depth.values);
    // Rays start a lift of the full samples, not of the halved ones, before the surface.
    EXPECT_LE(count_different(mid, other, 8), 64);
    EXPECT_GT(mid.pixels_hit, 1000);
    EXPECT_NE(mid.depth.values, taken(model.scene, camera, sized(64, 64)).depth.values);
  }
}

TEST(RenderDetail, LevelsFollowFieldEdits) {
  Model model = village(false);
  CpuRenderer renderer(model.scene);
  const Camera camera = towards({160, 150, 200}, {0, 0, 0}, 0.9);
  const RenderedImage before = renderer.render(camera, always_mid()).value();
  DensityGrid& field = model.scene.edit(model.scene.instances()[model.instance].grid).field;
  for (int step = 0; step < 4; ++step) {
    if (step == 3) {
      field.clear();
    } else {
      field.remove_sphere({40.0 - 20.0 * step, 30.0, 30.0}, 20.0);
      field.add_box({-63.0, 20.0, 60.0}, {1.0, 40.0 + step, 66.0}, 1);
    }
    renderer.update();
    const RenderedImage after = renderer.render(camera, always_mid()).value();
    EXPECT_NE(before.colour.rgb, after.colour.rgb);
    EXPECT_EQ(taken(model.scene, camera, always_mid()).colour.rgb, after.colour.rgb) << step;
  }
}

TEST(RenderDetail, OpaqueMidMatchesHalvedGrid) {
  VoxelType glass = kAir;
  Model model = balls(&glass);
  Grid& voxels = model.scene.edit(model.scene.instances()[model.instance].grid).grid;
  voxels.edit(voxels.bounds(), [&](IVec3, VoxelType type) { return type == glass ? VoxelType{1} : type; });
  Scene coarse;
  for (VoxelType type = 1; type < model.scene.types.size(); ++type) {
    ASSERT_TRUE(coarse.types.add(model.scene.types[type]));
  }
  Instance instance = model.scene.instances()[model.instance];
  SceneGrid grid;
  grid.pivot = model.scene.grids()[instance.grid].pivot / 2.0;
  grid.grid = *downsample(voxels, coarse.types);
  instance.grid = coarse.add_grid(std::move(grid));
  instance.voxel_size = 2.0;
  coarse.add_instance(instance);
  RenderOptions expected = sized(64, 64);
  expected.light.occlusion_distance_voxels /= 2.0;
  const Camera camera = towards({30, 25, 40}, {0, 0, 0}, 0.9);
  EXPECT_LE(count_different(taken(model.scene, camera, always_mid()), taken(coarse, camera, expected), 2), 8);
}

TEST(RenderDetail, NearMatchesImageWithoutDetailExactly) {
  const Model model = balls();
  const Camera camera = towards({30, 25, 40}, {0, 0, 0}, 0.9);
  RenderOptions options = sized(64, 64);
  const RenderedImage plain = taken(model.scene, camera, options);
  options.detail.policy.emplace().far_pixels = 0;
  const RenderedImage detailed = taken(model.scene, camera, options);
  EXPECT_EQ(plain.colour.rgb, detailed.colour.rgb);
  EXPECT_EQ(plain.depth.values, detailed.depth.values);
}

TEST(RenderDetail, GivesSameBytesForAnyThreadCount) {
  const Model model = balls();
  const CpuRenderer renderer(model.scene);
  const Camera camera = towards({300, 250, 400}, {0, 0, 0}, 0.2);
  RenderOptions options = sized(64, 64);
  options.detail.policy.emplace();
  const RenderedImage one = renderer.render(camera, options, {1}).value();
  EXPECT_EQ(renderer.render(camera, options, {4}).value().colour.rgb, one.colour.rgb);
  EXPECT_EQ(CpuRenderer(model.scene).render(camera, options).value().colour.rgb, one.colour.rgb);
}

TEST(RenderDetail, OffscreenInstancesStillCastShadows) {
  Scene scene;
  const VoxelType type = add_type(scene, {200, 200, 200, 255});
  Grid floor;
  floor.fill_box({{-40, -1, -40}, {41, 0, 41}}, type);
  place(scene, std::move(floor));
  Grid roof;
  roof.fill_box({{-20, 0, -20}, {21, 1, 21}}, type);
  const InstanceHandle handle = place(scene, std::move(roof), {0, 90, 0});
  RenderOptions options = sized(4, 4);
  environment_in(options).sun.direction = {0, 1, 0};
  options.detail.policy.emplace().far_pixels = 0;
  const Camera camera = from_above(0, 30, 0, 4);
  const Pixel shadowed = pixel_at(taken(scene, camera, options), 1, 1);
  scene.remove_instance(handle);
  EXPECT_LT(shadowed[0], pixel_at(taken(scene, camera, options), 1, 1)[0] / 2);
}

TEST(RenderDetail, ColoursShowDetail) {
  Scene scene;
  const VoxelType type = add_type(scene, {200, 200, 200, 255});
  Grid slab;
  slab.fill_box({{-208, -16, -208}, {208, 0, 208}}, type);
  place(scene, std::move(slab));
  RenderOptions options = sized(4, 4);
  options.detail.colours = true;
  options.light.shading = Shading::Unlit;
  const auto colour_with = [&](const DetailPolicy& policy, double view_height) {
    options.detail.policy = policy;
    return pixel_at(taken(scene, from_above(0.5, 10, 0.5, view_height), options), 1, 1);
  };
  DetailPolicy policy;
  policy.far_pixels = 0;
  const Pixel near = colour_with(policy, 2.0);
  const Pixel once = colour_with(policy, 24.0);
  const Pixel often = colour_with(policy, 300.0);
  policy.far_pixels = 1'000'000;
  const Pixel far = colour_with(policy, 100.0);
  EXPECT_TRUE(near[1] > near[0] && near[1] > near[2]) << "green";
  EXPECT_TRUE(once[0] > once[2] && once[1] > once[2]) << "yellow";
  EXPECT_TRUE(often[0] > often[1] && often[1] < once[1]) << "orange";
  EXPECT_TRUE(far[2] > far[0] && far[2] > far[1]) << "blue";
}

// Returns the distances from a model where its chosen detail changes, nearest first.
std::vector<double> thresholds_of(const Model& model, const DetailPolicy& policy) {
  std::vector<double> found;
  std::vector<SelectedInstance> selected;
  int last = -1;
  for (double distance = 0.5 * model.radius(); distance < 400.0 * model.radius(); distance *= 1.001) {
    DetailSelector().select(model.scene, towards({0, 0, distance}, {0, 0, 0}, kFov), 64, 64, policy, selected);
    const int now = static_cast<int>(selected.at(0).detail) * 10 + selected[0].level;
    if (last >= 0 && now != last) found.push_back(distance);
    last = now;
  }
  return found;
}

TEST(RenderDetail, ViewsAreStableAtThresholds) {
  const Model model = balls();
  const CpuRenderer renderer(model.scene);
  RenderOptions options = sized(64, 64);
  options.detail.colours = true;
  options.light.shading = Shading::Unlit;
  for (const auto rule : {DetailPolicy::Rule::ByPixels, DetailPolicy::Rule::ByRadius}) {
    options.detail.policy.emplace().rule = rule;
    options.detail.policy->far_pixels = 12;
    const std::vector<double> thresholds = thresholds_of(model, *options.detail.policy);
    EXPECT_GE(thresholds.size(), 3U);
    int changes_without = 0;
    for (const double threshold : thresholds) {
      DetailSelector view;
      std::set<Pixel> with_memory;
      std::set<Pixel> without;
      for (int frame = 0; frame < 12; ++frame) {
        const Camera camera = towards({0, 0, threshold * (1.0 + (frame % 2 == 0 ? 0.005 : -0.005))}, {0, 0, 0}, kFov);
        options.detail.selector = &view;
        with_memory.insert(pixel_at(renderer.render(camera, options).value(), 32, 32));
        options.detail.selector = nullptr;
        without.insert(pixel_at(renderer.render(camera, options).value(), 32, 32));
      }
      EXPECT_EQ(with_memory.size(), 1U) << threshold;
      changes_without += static_cast<int>(without.size()) - 1;
    }
    EXPECT_GE(changes_without, 2) << "each image by itself has no memory";
  }
}

}  // namespace
}  // namespace quoin
