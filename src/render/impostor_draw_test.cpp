// Pictures of impostors beside those that are traced.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <glm/gtc/quaternion.hpp>

#include <quoin/render/impostor.h>

#include "bench/workloads.h"
#include "render/render_test_support.h"

namespace quoin {
namespace {

using namespace render_test;

constexpr double kDegree = std::numbers::pi / 180.0;

struct Likeness {
  double overlap = 1.0;     // intersection over union of the silhouettes
  double difference = 0.0;  // mean absolute, over the union
  std::int64_t pixels = 0;
};

Likeness likeness(const Picture& truth, const Picture& picture) {
  std::int64_t both = 0;
  Likeness found;
  for (std::size_t i = 0; i < truth.depth.values.size(); ++i) {
    const bool in_truth = std::isfinite(truth.depth.values[i]);
    const bool in_picture = std::isfinite(picture.depth.values[i]);
    if (!in_truth && !in_picture) continue;
    ++found.pixels;
    both += in_truth && in_picture;
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
      found.difference += std::abs(truth.colour.rgb[c] - picture.colour.rgb[c]) / 3.0;
    }
  }
  if (found.pixels == 0) return found;
  found.overlap = static_cast<double>(both) / static_cast<double>(found.pixels);
  found.difference /= static_cast<double>(found.pixels);
  return found;
}

// A few models in one scene, one grid each, with their pivots at the contents' centres.
enum class Model { Ball, Box, Castle, Blobs, Ship, Terrain, Comb };

Grid voxels_of(Model model) {
  Grid grid;
  if (model == Model::Ball) grid.put_chunk({0, 0, 0}, workloads::blocky_chunk(workloads::Blocky::W4));
  if (model == Model::Box) {
    grid.edit({IVec3(0), IVec3(41)},
              [](IVec3 v, VoxelType) { return static_cast<VoxelType>(1 + (v.x / 5 + v.y / 5 + v.z / 5) % 2); });
  }
  if (model == Model::Castle) {
    grid.fill_box({0, 0, 0}, {44, 0, 44}, 2);
    for (const IVec3 corner : {IVec3{0, 1, 0}, {36, 1, 0}, {0, 1, 36}, {36, 1, 36}}) {
      grid.fill_box(corner, corner + IVec3{8, 27, 8}, 1);
      grid.fill_box(corner + IVec3{2, 20, 2}, corner + IVec3{6, 27, 6}, kAir);
    }
    grid.fill_box({8, 1, 3}, {36, 14, 5}, 3);
    grid.fill_box({8, 1, 39}, {36, 14, 41}, 3);
    grid.fill_box({16, 1, 16}, {28, 22, 28}, 3);
  }
  if (model == Model::Blobs) {
    std::mt19937 random(9);
    for (int i = 0; i < 40; ++i) {
      const auto coordinate = [&] { return static_cast<int>(random() % 41); };
      const IVec3 at{coordinate(), coordinate(), coordinate()};
      grid.fill_box(at, at + IVec3(static_cast<int>(random() % 9)), static_cast<VoxelType>(1 + random() % 3));
    }
  }
  if (model == Model::Ship) {
    for (int z = 0; z < 48; ++z) {
      const int half = std::min({6, z / 2 + 1, (47 - z) / 3 + 2});
      grid.fill_box({-half, 0, z}, {half, 5, z}, 1);
      grid.fill_box({1 - half, 4, z}, {half - 1, 5, z}, kAir);
    }
    for (const int z : {12, 24, 36}) {
      grid.fill_box({0, 5, z}, {0, 34, z}, 2);
      grid.fill_box({-9, 26, z}, {9, 26, z}, 2);
      grid.fill_box({-8, 12, z}, {8, 25, z}, 3);
    }
  }
  if (model == Model::Terrain) {
    grid.edit({IVec3(0), IVec3(200, 60, 200)}, [](IVec3 v, VoxelType) {
      const double height =
          25 + 12 * std::sin(0.11 * v.x) * std::cos(0.07 * v.z) + 5 * std::sin(0.31 * v.x + 0.2 * v.z);
      return v.y <= height ? static_cast<VoxelType>(v.y > height - 1 ? 1 : v.y > height - 4 ? 2 : 3) : kAir;
    });
  }
  if (model == Model::Comb) {
    grid.fill_box({0, 0, 0}, {40, 2, 30}, 2);
    for (int x = 0; x <= 40; x += 2) grid.fill_box({x, 3, 0}, {x, 24, 30}, x % 4 == 0 ? 1 : 3);
  }
  return grid;
}

struct World {
  Scene scene;
  InstanceHandle instance;
  Impostor impostor;
  double radius = 0.0;

  explicit World(Model model) {
    scene.types = workloads::three_types();
    SceneGrid grid;
    grid.grid = voxels_of(model);
    const ContentSphere content = content_sphere(grid.grid);
    radius = content.radius;
    grid.pivot = content.centre;
    impostor = Impostor::build(grid.grid, scene.types);
    instance = scene.add_instance({"", scene.add_grid(std::move(grid))});
  }
  Instance& placed() { return scene.instances()[instance]; }

  [[nodiscard]] Picture drawn(const Camera& camera, const RenderOptions& options) const {
    Picture picture = taken(Scene(), camera, options);
    draw_impostors(SceneTracer(scene), scene.types, std::array{FarInstance{instance, &impostor}}, camera, options,
                   picture);
    return picture;
  }
};

// From a distance at which the sphere spans `pixels` of a square picture a little larger.
Camera orbiting(const World& world, double azimuth, double elevation, double roll, double pixels, int size) {
  const double distance = 12.0 * world.radius;
  const DVec3 eye =
      DVec3{std::cos(elevation) * std::cos(azimuth), std::sin(elevation), std::cos(elevation) * std::sin(azimuth)} *
      distance;
  Camera camera = towards(eye, {0, 0, 0}, 2.0 * std::atan(size / 24.0 / (pixels / 2.0)));
  const DVec3 right = camera.right;
  camera.right = right * std::cos(roll) + camera.up * std::sin(roll);
  camera.up = camera.up * std::cos(roll) - right * std::sin(roll);
  return camera;
}

constexpr std::array kModels = {Model::Ball, Model::Box, Model::Castle, Model::Blobs, Model::Ship, Model::Terrain};

// Of so many pictures from all around, `pixels` wide.
std::vector<Likeness> likenesses(World& world, int pixels, int count) {
  world.placed().rotation = glm::angleAxis(0.5, glm::normalize(DVec3(0.3, 1, 0.2)));
  const int edge = pixels + 20;
  const RenderOptions options = sized(edge, edge);
  std::vector<Likeness> all;
  for (int i = 0; i < count; ++i) {
    const Camera camera =
        orbiting(world, 47.0 * i * kDegree, (i % 7 - 3) * 25.0 * kDegree, 31.0 * i * kDegree, pixels, edge);
    all.push_back(likeness(taken(world.scene, camera, options), world.drawn(camera, options)));
  }
  return all;
}

// The specification asks for 0.97 and 6; measured at worst: 0.997 and 3.8 (the terrain), 0.9986 and 1.2 (all others).
TEST(DrawImpostors, LooksLikeTheTracedPictureAtTheThreshold) {
  for (const Model model : kModels) {
    World world(model);
    for (const int pixels : {128, 64}) {
      for (const Likeness& found : likenesses(world, pixels, 24)) {
        EXPECT_GT(found.pixels, 350);
        EXPECT_GE(found.overlap, 0.995) << static_cast<int>(model) << " " << pixels;
        EXPECT_LE(found.difference, model == Model::Terrain ? 5.0 : 2.0) << static_cast<int>(model) << " " << pixels;
      }
    }
  }
}

// Between its plates no snapshot sees far down.
TEST(DrawImpostors, HasNoHolesInCrevices) {
  World world(Model::Comb);
  for (const int pixels : {128, 90}) {
    for (const Likeness& found : likenesses(world, pixels, 30)) {
      EXPECT_GE(found.overlap, 0.9995);
      EXPECT_LE(found.difference, 6.0);
    }
  }
}

// Voxels are then far smaller than pixels, and what one ray a pixel meets is a matter of chance; measured: 0.9014 at
// least (blobs at 16 pixels).
TEST(DrawImpostors, KeepsItsOutlineWhereItIsSmall) {
  for (const Model model : kModels) {
    World world(model);
    for (const int pixels : {32, 16}) {
      double sum = 0.0;
      for (const Likeness& found : likenesses(world, pixels, 24)) sum += found.overlap;
      EXPECT_GE(sum / 24.0, 0.88) << static_cast<int>(model) << " " << pixels;
    }
  }
}

// By how much a step of one degree changes the picture of an impostor more than the traced one. Measured: 0.06 of 255
// at most (the ship).
TEST(DrawImpostors, DoesNotJumpWhileOrbiting) {
  for (const Model model : {Model::Castle, Model::Ship}) {
    const World world(model);
    const RenderOptions options = sized(148, 148);
    double largest_step = 0.0;
    Picture last;
    Picture last_truth;
    for (int degree = 0; degree < 360; ++degree) {
      const Camera camera = orbiting(world, degree * kDegree, 0.5, 0.0, 128.0, 148);
      Picture truth = taken(world.scene, camera, options);
      Picture picture = world.drawn(camera, options);
      EXPECT_LE(likeness(truth, picture).difference, 6.0) << degree;
      if (degree > 0) {
        const double step = likeness(last, picture).difference - likeness(last_truth, truth).difference;
        largest_step = std::max(largest_step, step);
      }
      last = std::move(picture);
      last_truth = std::move(truth);
    }
    std::printf("model %d: %.3f of 255 beyond the traced step\n", static_cast<int>(model), largest_step);
    EXPECT_LE(largest_step, 0.3) << static_cast<int>(model);
  }
}

TEST(DrawImpostors, TurnsMirrorsAndScalesWithTheInstance) {
  World world(Model::Castle);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 12; ++i) {
    Instance& placed = world.placed();
    placed.rotation = glm::normalize(DQuat(normal(random), normal(random), normal(random), normal(random)));
    placed.mirrored = i % 2 == 1;
    placed.voxel_size = i % 3 == 0 ? 0.25 : 1.0;
    placed.position = DVec3(1e6, -2e6, 3e6);
    Camera camera = orbiting(world, i, 0.3, i, 128.0, 148);
    camera.position = placed.position + camera.position * placed.voxel_size;
    const RenderOptions options = sized(148, 148);
    const Picture truth = taken(world.scene, camera, options);
    const Picture picture = world.drawn(camera, options);
    const Likeness found = likeness(truth, picture);
    EXPECT_GE(found.overlap, 0.97) << i;
    EXPECT_LE(found.difference, 6.0) << i;
    std::int64_t close = 0;
    std::int64_t both = 0;
    for (std::size_t p = 0; p < truth.depth.values.size(); ++p) {
      if (!std::isfinite(truth.depth.values[p]) || !std::isfinite(picture.depth.values[p])) continue;
      ++both;
      close += std::abs(truth.depth.values[p] - picture.depth.values[p]) <= 0.05 * placed.voxel_size;
    }
    EXPECT_GE(static_cast<double>(close), 0.95 * static_cast<double>(both)) << i;
  }
}

TEST(DrawImpostors, OrthographicPicturesToo) {
  const World world(Model::Castle);
  Camera camera = orbiting(world, 0.7, 0.4, 0.2, 128.0, 148);
  camera.projection = Camera::Projection::Orthographic;
  camera.view_height = 2.0 * world.radius * 148.0 / 128.0;
  const Likeness found = likeness(taken(world.scene, camera, sized(148, 148)), world.drawn(camera, sized(148, 148)));
  EXPECT_GE(found.overlap, 0.97);
  EXPECT_LE(found.difference, 6.0);
}

TEST(DrawImpostors, ShowsThePaletteOfTheDay) {
  World world(Model::Box);
  const Camera camera = orbiting(world, 0.7, 0.4, 0.0, 60.0, 70);
  RenderOptions options = sized(70, 70);
  options.light.lit = false;
  for (const VoxelType type : {VoxelType{1}, VoxelType{2}}) {
    VoxelProperties black;
    black.colour = {0, 0, 0, 255};
    world.scene.types.replace(type, black);
  }
  const Picture picture = world.drawn(camera, options);
  EXPECT_TRUE(std::isfinite(depth_at(picture, 35, 35)));
  EXPECT_EQ(pixel_at(picture, 35, 35), (Pixel{0, 0, 0})) << "and black is no hole";
}

TEST(DrawImpostors, EmptyPixelsKeepWhatTheyHad) {
  const World world(Model::Ball);
  const RenderOptions options = sized(80, 80);
  const Camera camera = orbiting(world, 0.7, 0.4, 0.0, 60.0, 80);
  const Picture before = taken(Scene(), camera, options);
  const Picture picture = world.drawn(camera, options);
  int kept = 0;
  for (std::size_t i = 0; i < picture.depth.values.size(); ++i) {
    if (std::isfinite(picture.depth.values[i])) continue;
    ++kept;
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) ASSERT_EQ(picture.colour.rgb[c], before.colour.rgb[c]);
  }
  EXPECT_GT(kept, 80 * 80 / 2);
  Picture nearer = before;
  std::fill(nearer.depth.values.begin(), nearer.depth.values.end(), 1.0F);
  const std::array far{FarInstance{world.instance, &world.impostor}};
  draw_impostors(SceneTracer(world.scene), world.scene.types, far, camera, options, nearer);
  EXPECT_EQ(nearer.colour.rgb, before.colour.rgb) << "what is nearer hides it";
}

TEST(DrawImpostors, OrderDoesNotMatterAndTheLowerHandleWinsAtEqualDepth) {
  World world(Model::Box);
  Instance other = world.placed();
  SceneGrid grid;
  grid.grid = voxels_of(Model::Box);
  grid.grid.edit({IVec3(0), IVec3(41)}, [](IVec3, VoxelType) { return VoxelType{3}; });
  grid.pivot = DVec3(20.5);
  const Impostor grey = Impostor::build(grid.grid, world.scene.types);
  other.grid = world.scene.add_grid(std::move(grid));
  const InstanceHandle twin = world.scene.add_instance(other);
  other.position = {25, 3, 7};
  other.rotation = glm::angleAxis(0.7, DVec3(0, 0, 1));
  const InstanceHandle beside = world.scene.add_instance(other);
  std::vector<FarInstance> far = {{world.instance, &world.impostor}, {twin, &grey}, {beside, &grey}};
  const RenderOptions options = sized(120, 120);
  const Camera camera = orbiting(world, 0.7, 0.4, 0.0, 60.0, 120);
  const SceneTracer tracer(world.scene);
  std::array<Picture, 2> pictures;
  for (Picture& picture : pictures) {
    picture = taken(Scene(), camera, options);
    draw_impostors(tracer, world.scene.types, far, camera, options, picture);
    std::reverse(far.begin(), far.end());
  }
  EXPECT_EQ(pictures[0].colour.rgb, pictures[1].colour.rgb);
  EXPECT_EQ(pictures[0].depth.values, pictures[1].depth.values);
  const Likeness found = likeness(taken(world.scene, camera, options), pictures[0]);
  EXPECT_GE(found.overlap, 0.99);
  EXPECT_LE(found.difference, 2.0) << "the traced picture shows the lower handle's colours";
}

TEST(DrawImpostors, HostilePlacesNeitherHangNorCrash) {
  World world(Model::Ball);
  const RenderOptions options = sized(200, 100);
  const Camera camera = towards({0, 0, 0}, {0, 0, -1}, 1.2);
  const auto pixels_at = [&](DVec3 position, double size = 1.0) {
    world.placed().position = position;
    world.placed().voxel_size = size;
    const Picture picture = world.drawn(camera, options);
    return std::count_if(picture.depth.values.begin(), picture.depth.values.end(),
                         [](float depth) { return std::isfinite(depth); });
  };
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_GT(pixels_at({0, 0, -200}), 100);
  EXPECT_EQ(pixels_at({0, 0, 200}), 0) << "behind";
  EXPECT_EQ(pixels_at({100, 0, 0}), 0) << "beside, at the camera's plane";
  EXPECT_EQ(pixels_at({std::numeric_limits<double>::quiet_NaN(), 0, -200}), 0);
  EXPECT_EQ(pixels_at({0, infinity, -200}), 0);
  EXPECT_EQ(pixels_at({0, 0, -1e7}), 0) << "under a pixel";
  EXPECT_GE(pixels_at({60, 0, -1e-9}), 0);
  EXPECT_GE(pixels_at({0, 0, -1e-300}), 0) << "inside";
  EXPECT_GE(pixels_at({1e300, 0, -1e-300}), 0);
  EXPECT_GE(pixels_at({5, 3, -20}), 0) << "inside";
  EXPECT_GE(pixels_at({0, 0, -1e200}, 1e198), 0);
  EXPECT_GE(pixels_at({0, 0, -1e-200}, 1e-202), 0);
}

TEST(DrawImpostors, ThreadsAndInstructionsChangeNoByte) {
  const World world(Model::Castle);
  const Camera camera = orbiting(world, 0.7, 0.4, 0.2, 128.0, 148);
  RenderOptions options = sized(148, 148);
  options.threads = {1};
  const Picture one = world.drawn(camera, options);
  options.threads = {4};
  options.instructions = InstructionSet::Plain;
  const Picture four = world.drawn(camera, options);
  EXPECT_EQ(one.colour.rgb, four.colour.rgb);
  EXPECT_EQ(one.depth.values, four.depth.values);
}

TEST(RenderFar, WhatIsNotReadyInTimeIsTraced) {
  const World world(Model::Castle);
  RenderOptions options = sized(148, 148);
  const Camera camera = orbiting(world, 0.7, 0.6, 0.0, 100.0, 148);
  const CpuRenderer renderer(world.scene);
  const Picture truth = renderer.render(camera, options).value();
  options.detail = DetailPolicy{};
  options.impostor_seconds = 0.0;
  EXPECT_EQ(renderer.render(camera, options)->colour.rgb, truth.colour.rgb);
  options.impostor_seconds = std::numeric_limits<double>::infinity();
  EXPECT_NE(renderer.render(camera, options)->colour.rgb, truth.colour.rgb) << "occlusion is that of whole faces";
  options.impostor_seconds = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(renderer.render(camera, options).has_value());
}

TEST(RenderFar, TheRendererDrawsFarInstancesFromImpostors) {
  World world(Model::Castle);
  Instance ground = world.placed();
  SceneGrid slab;
  slab.grid.fill_box({-300, 0, -300}, {300, 0, 300}, 2);
  ground.grid = world.scene.add_grid(std::move(slab));
  ground.position = {0, -15, 0};
  world.scene.add_instance(ground);
  RenderOptions options = sized(148, 148);
  const Camera camera = orbiting(world, 0.7, 0.6, 0.0, 100.0, 148);
  const Picture truth = taken(world.scene, camera, options);
  options.detail = DetailPolicy{};
  const Picture picture = taken(world.scene, camera, options);
  EXPECT_NE(truth.colour.rgb, picture.colour.rgb);
  const Likeness found = likeness(truth, picture);
  EXPECT_EQ(found.overlap, 1.0);
  EXPECT_LE(found.difference, 2.0) << "with the castle's shadow on the ground";
  options.detail_colours = true;
  options.light.lit = false;
  const Pixel middle = pixel_at(taken(world.scene, camera, options), 74, 74);
  EXPECT_GT(middle[2], middle[0]) << "far is blue";
}

}  // namespace
}  // namespace quoin
