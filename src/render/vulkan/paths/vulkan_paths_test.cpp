// Compares path-traced images of a device with the CPU's: the same random numbers give the same paths.

#include <cstdlib>

#include <cmath>
#include <string>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/io/image_files.h>
#include <quoin/render/path_tracer.h>

#include "core/work/nightly_for_tests.h"
#include "grid/shapes/shape_types_for_tests.h"
#include "render/cpu/environment_for_tests.h"
#include "render/path/town_for_tests.h"
#include "render/vulkan/device/vulkan_for_tests.h"
#include "render/vulkan/lakeside_for_tests.h"
#include "render/vulkan/march/renderer_impl.h"

namespace quoin::vulkan_test {
namespace {

using render_test::add_type;
using render_test::of_town;
using render_test::place;
using render_test::towards;
using render_test::town;

PathOptions small(int samples = 4) {
  PathOptions options;
  options.width = cases(48, 64);
  options.height = cases(36, 48);
  options.samples = samples;
  options.layers = true;
  options.environment = physical_day();
  return options;
}

// The differences of two images with the same paths.
struct PathDifferences {
  int pixels = 0;      ///< pixels whose light differs by more than 1/100
  int depths = 0;      ///< by more than 1e-4 of the distance
  double light = 1.0;  /// ratio of the total light to the other image
  int total = 0;
};

bool is_near(float a, float b, float relative, float absolute) {
  return a == b || std::abs(a - b) <= relative * std::max(std::abs(a), std::abs(b)) + absolute;
}

PathDifferences path_differences(const PathImage& a, const PathImage& b) {
  PathDifferences found;
  EXPECT_EQ(a.radiance.size(), b.radiance.size());
  if (a.radiance.size() != b.radiance.size()) return found;
  found.total = static_cast<int>(a.radiance.size());
  DVec3 of_a(0.0);
  DVec3 of_b(0.0);
  for (std::size_t i = 0; i < a.radiance.size(); ++i) {
    bool differs = !is_near(a.alpha[i], b.alpha[i], 0.01F, 1e-4F);
    for (int c = 0; c < 3; ++c) {
      differs = differs || !is_near(a.radiance[i][c], b.radiance[i][c], 0.01F, 1e-3F) ||
                !is_near(a.scene[i][c], b.scene[i][c], 0.01F, 1e-3F);
    }
    found.pixels += static_cast<int>(differs);
    of_a += DVec3(a.radiance[i]);
    of_b += DVec3(b.radiance[i]);
    if (a.depth.values.empty() || b.depth.values.empty()) continue;
    found.depths += static_cast<int>(!is_near(a.depth.values[i], b.depth.values[i], 1e-4F, 0.0F));
  }
  const DVec3 ones(1.0);
  found.light = of_b == DVec3(0.0) ? (of_a == DVec3(0.0) ? 1.0 : 2.0) : glm::dot(of_a, ones) / glm::dot(of_b, ones);
  return found;
}

class VulkanPaths : public VulkanTest {
 protected:
  PathImage drawn(const Scene& scene, const Camera& camera, const PathOptions& options) {
    const Status updated = renderer_->update(scene);
    EXPECT_TRUE(updated) << to_string(updated.error());
    auto image = renderer_->render_paths(camera, options);
    EXPECT_TRUE(image) << to_string(image.error());
    return image ? std::move(*image) : PathImage{};
  }

  // `share`: the share of pixels in which single precision may change paths.
  void expect_same_light(const Scene& scene, const Camera& camera, const PathOptions& options, const std::string& name,
                         double share = 0.002) {
    const PathImage device = drawn(scene, camera, options);
    auto cpu = PathTracer(scene).render(camera, options);
    ASSERT_TRUE(cpu);
    const PathDifferences found = path_differences(device, *cpu);
    EXPECT_LE(found.pixels, share * found.total) << name;
    EXPECT_LE(found.depths, 0.005 * found.total + 1.0) << name;
    EXPECT_NEAR(found.light, 1.0, 0.01) << name;
    EXPECT_NEAR(static_cast<double>(device.rays), static_cast<double>(cpu->rays), 0.02 * static_cast<double>(cpu->rays))
        << name;
    EXPECT_NEAR(static_cast<double>(device.pixels_hit), static_cast<double>(cpu->pixels_hit),
                0.002 * found.total + 1.0);
    if (std::getenv("QUOIN_WRITE_VULKAN") == nullptr) return;
    std::printf("%s: %d pixels, %d depths of %d; light %.5f; rays %lld, %lld\n", name.c_str(), found.pixels,
                found.depths, found.total, found.light, static_cast<long long>(device.rays),
                static_cast<long long>(cpu->rays));
    const std::string base = std::string(QUOIN_BINARY_DIR "/paths_") + name;
    EXPECT_TRUE(write_png(*develop(device), base + ".vulkan.png"));
    EXPECT_TRUE(write_png(*develop(*cpu), base + ".cpu.png"));
  }
};

TEST_F(VulkanPaths, MatchCpu) {
  PathOptions options = small();
  expect_same_light(town(), of_town(), options, "physical");
  physical_in(options).sky.model = SkyModel::Gradient;
  expect_same_light(town(), of_town(), options, "gradient");
  physical_in(options).sky.model = SkyModel::Uniform;
  physical_in(options).sun.angle_radians = 0.0;
  options.max_bounces = 1;
  expect_same_light(town(), of_town(), options, "uniform");
}

TEST_F(VulkanPaths, SampleEnvironmentLikeCpu) {
  PathOptions options = small();
  RadianceImage image{16, 8, std::vector<float>(std::size_t{16} * 8 * 3, 0.2F)};
  image.rgb[3 * (2 * 16 + 5)] = 40.0F;
  physical_in(options).sky.image = std::make_shared<const RadianceImage>(image);
  physical_in(options).sky.model = SkyModel::Image;
  physical_in(options).sky.image_turn_radians = 1.0;
  physical_in(options).sun.brightness = 0.0;
  expect_same_light(town(), of_town(), options, "environment");
}

TEST_F(VulkanPaths, MatchCpuWithGroundFogAndLens) {
  PathOptions options = small();
  physical_in(options).ground = GroundPlane{.height = -3.0, .colour = Vec3(0.4F), .only_shadows = false, .fade = 0.1};
  expect_same_light(town(), of_town(), options, "ground");
  physical_in(options).ground->only_shadows = true;
  expect_same_light(town(), of_town(), options, "caught");
  physical_in(options).fog = Fog{.density = 0.02, .colour = {0.9F, 0.95F, 1.0F}, .anisotropy = 0.4, .top = 6.0};
  expect_same_light(town(), of_town(), options, "fog");
  options.lens.radius = 0.7;
  options.lens.blades = 5;
  options.lens.focus_distance = 40.0;
  expect_same_light(town(), of_town(), options, "lens");
}

TEST_F(VulkanPaths, MatchCpuInOrthographicImages) {
  Camera camera = of_town();
  camera.projection = Camera::Projection::Orthographic;
  camera.view_height = 40.0;
  expect_same_light(town(), camera, small(), "orthographic");
}

TEST_F(VulkanPaths, MatchCpuInClouds) {
  Scene scene = town();
  VoxelProperties cloud;
  cloud.colour = {230, 230, 240, 60};
  cloud.visibility = Visibility::Transparent;
  cloud.scattering = 0.2F;
  cloud.anisotropy = 0.5F;
  const VoxelType type = scene.types.add(cloud).value_or(kAir);
  Grid grid;
  grid.fill_box({IVec3(0), {12, 6, 12}}, type);
  place(scene, std::move(grid), {6.0, 10.0, 6.0});
  expect_same_light(scene, of_town(), small(), "clouds");
}

TEST_F(VulkanPaths, DenoiseLikeCpu) {
  PathOptions options = small();
  options.denoise = true;
  physical_in(options).fog = Fog{.density = 0.01, .colour = Vec3(1.0F), .anisotropy = 0.0, .top = 4.0};
  expect_same_light(town(), of_town(), options, "denoised");
}

// From the fifth sample on, paths on the CPU use the learned shares of lamps.
TEST_F(VulkanPaths, ConvergeToCpuImage) {
  PathOptions options = small(48);
  options.height = cases(32, 48);  // whole blocks
  const Scene scene = town();
  const PathImage device = drawn(scene, of_town(), options);
  const auto cpu = PathTracer(scene).render(of_town(), options);
  ASSERT_TRUE(cpu);
  EXPECT_NEAR(path_differences(device, *cpu).light, 1.0, 0.005);
  constexpr int kBlock = 8;
  double sum = 0.0;
  int blocks = 0;
  for (int y = 0; y < options.height; y += kBlock) {
    for (int x = 0; x < options.width; x += kBlock) {
      DVec3 of_device(0.0);
      DVec3 of_cpu(0.0);
      for (int i = 0; i < kBlock * kBlock; ++i) {
        const auto at = static_cast<std::size_t>((y + i / kBlock) * options.width + x + i % kBlock);
        of_device += DVec3(device.radiance[at]);
        of_cpu += DVec3(cpu->radiance[at]);
      }
      const double difference = glm::length(of_device - of_cpu) / glm::length(of_cpu);
      EXPECT_LT(difference, 0.15) << x << ' ' << y;
      sum += difference * difference;
      ++blocks;
    }
  }
  EXPECT_LT(std::sqrt(sum / blocks), 0.03);
}

// Removes the textures of all types, which keep their mean colours.
void remove_textures(Scene& scene) {
  for (std::size_t i = 0; i < scene.types.size(); ++i) {
    VoxelProperties plain = scene.types[static_cast<VoxelType>(i)];
    if (plain.faces.empty()) continue;
    plain.faces = {};
    scene.types.replace(static_cast<VoxelType>(i), plain);
  }
}

// Adds cubes of a type with textures in all orientations, of one that no state turns, and of one that emits light.
void add_textured_cubes(Scene& scene) {
  const auto add = [&](unsigned seed, float emission) {
    VoxelProperties properties{.emission = emission, .state_bits = 6};
    properties.faces = render_test::random_faces(seed);
    for (int i = 0; i < AxisOrientation::kCount; ++i)
      properties.orientations.by_value.push_back(AxisOrientation::at(i));
    return *scene.types.add(properties);
  };
  const VoxelType turned = add(5, 0.0F);
  const VoxelType lamp = add(11, 4.0F);
  VoxelProperties unturned;
  unturned.faces = render_test::random_faces(7);
  Grid grid;
  grid.fill_box({{-8, -1, -6}, {8, 0, 7}}, *scene.types.add(unturned));
  for (int i = 0; i < AxisOrientation::kCount; ++i) {
    grid.set({i % 8 - 4, 0, i / 8 - 3}, turned, {.state = static_cast<std::uint32_t>(i)});
  }
  grid.fill_box({{-7, 0, 3}, {-4, 2, 5}}, lamp);
  for (int i = 0; i < 3; ++i) grid.set({6, i, 2}, lamp, {.state = static_cast<std::uint32_t>(10 + 7 * i)});
  const InstanceHandle handle = place(scene, std::move(grid), {8.0, -4.0, 22.0});
  scene.edit(handle).rotation = glm::angleAxis(0.4, glm::normalize(DVec3(1, 3, 0)));
}

// Cubes and fields with textures; one field has no materials and is white. Nightly runs add glass of fields and of
// voxels, since their shader takes a minute to compile.
TEST_F(VulkanPaths, MatchCpuOnTexturesAndFields) {
  Scene scene = is_nightly() ? town() : Scene();
  const FieldTypes types = add_field_types(scene);
  VoxelProperties rock;
  rock.faces = render_test::random_faces(40);
  rock.field_textures = {.voxels = 3.0F, .flat_degrees = 20.0F, .steep_degrees = 60.0F};
  rock.roughness = 0.4F;
  const VoxelType textured = *scene.types.add(rock);
  SceneGrid hill;
  hill.field.add_sphere({0.0, 0.0, 0.0}, 6.0, types.stone);
  hill.field.add_sphere({9.0, 2.0, 3.0}, 4.0, is_nightly() ? types.glass : types.glow);
  hill.field.add_sphere({3.0, 4.0, 1.0}, 5.0, textured);
  scene.add_instance({"", scene.add_grid(std::move(hill)), DVec3(12.0, 4.0, 12.0)});
  SceneGrid plain;
  plain.field.edit({IVec3(-6), IVec3(7)}, [](IVec3 p, DensitySample) {
    return DensitySample{glm::length(Vec3(p)) - 4.0F, kAir};
  });
  scene.add_instance({"", scene.add_grid(std::move(plain)), DVec3(-8.0, 3.0, 14.0)});
  add_textured_cubes(scene);
  PathOptions options = small();
  options.width = 64;
  options.height = 48;
  expect_same_light(scene, of_town(), options, "textures");
  const PathImage device = drawn(scene, of_town(), options);
  remove_textures(scene);
  const auto plain_colours = PathTracer(scene).render(of_town(), options);
  ASSERT_TRUE(plain_colours);
  EXPECT_GT(path_differences(device, *plain_colours).pixels, 200);
}

// Nightly only: its shader takes a minute to compile. Leaves, stained glass, and cells with faces of all kinds.
TEST_F(VulkanPaths, MatchCpuThroughTexturedGlassAndCells) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Scene scene;
  const auto add = [&](VoxelFaces faces, float ior = 1.5F, float emission = 0.0F) {
    VoxelProperties type{.visibility = Visibility::Transparent};
    type.emission = emission;
    type.ior = ior;
    type.faces = std::move(faces);
    return *scene.types.add(type);
  };
  const VoxelFace cutout{.texture = noise_with_alpha(1, 0), .turn = 1, .alpha = FaceAlpha::Cutout};
  const VoxelFace translucent{
      .texture = noise_with_alpha(2, 60), .tint = {255, 180, 90}, .alpha = FaceAlpha::Translucent};
  const VoxelType leaves = add(VoxelFaces(cutout));
  const VoxelType stained = add(VoxelFaces(translucent));
  const VoxelType thin = add(VoxelFaces(translucent), 1.0F);
  const VoxelType mixed =
      add(VoxelFaces(cutout, VoxelFace{render_test::random_texture(16, 3)}, translucent), 1.0F, 0.5F);
  const VoxelType glass = add_type(scene, {120, 200, 230, 90}, Visibility::Transparent);
  VoxelProperties fog{.colour = {230, 230, 240, 60}, .visibility = Visibility::Transparent};
  fog.scattering = 0.1F;
  fog.faces = VoxelFaces(translucent);
  const VoxelType cloud = *scene.types.add(fog);
  VoxelProperties ground;
  ground.faces = render_test::random_faces(5);
  Grid grid;
  grid.fill_box({{-8, -1, -8}, {9, 0, 9}}, *scene.types.add(ground));
  grid.fill_box({{-4, 0, -4}, {-1, 3, -1}}, leaves);
  grid.fill_box({{1, 0, -3}, {5, 2, -1}}, stained);
  grid.fill_box({{1, 2, -3}, {5, 3, -1}}, thin);
  grid.fill_box({{-3, 0, 2}, {0, 2, 4}}, mixed);
  grid.fill_box({{2, 0, 1}, {4, 2, 4}}, glass);
  grid.set({2, 1, 2}, leaves);
  grid.set({-1, 0, 0}, leaves);
  grid.set({0, 0, 2}, stained);
  grid.fill_box({{-8, 0, 5}, {-4, 2, 8}}, cloud);
  place(scene, std::move(grid));
  PathOptions options = small();
  expect_same_light(scene, towards({6, 5, 9}, {0, 0, 0}), options, "cells");
  expect_same_light(scene, towards({-1.5, 0.6, 3.2}, {4, 0.6, 1}, 1.2), options, "cells_inside");
  const PathImage device = drawn(scene, towards({6, 5, 9}, {0, 0, 0}), options);
  remove_textures(scene);
  const auto plain_colours = PathTracer(scene).render(towards({6, 5, 9}, {0, 0, 0}), options);
  ASSERT_TRUE(plain_colours);
  EXPECT_GT(path_differences(device, *plain_colours).pixels, 200);
}

// More glass bodies along a ray than a pixel's list holds.
TEST_F(VulkanPaths, MatchCpuThroughManyPanes) {
  Scene scene;
  const VoxelType ground = add_type(scene, {200, 200, 200, 255});
  VoxelProperties pane;
  pane.visibility = Visibility::Transparent;
  pane.ior = 1.0F;
  Grid grid;
  grid.fill_box({{-20, -20, -1}, {20, 20, 0}}, ground);
  VoxelProperties cloud;
  cloud.visibility = Visibility::Transparent;
  cloud.scattering = 0.01F;
  for (int i = 0; i < 40; ++i) {
    VoxelProperties& next = i % 2 == 0 ? pane : cloud;
    next.colour = {static_cast<std::uint8_t>(200 + i), 240, 250, 10};
    const VoxelType type = scene.types.add(next).value_or(kAir);
    grid.fill_box({{-20, -20, 2 + 2 * i}, {20, 20, 3 + 2 * i}}, type);
  }
  place(scene, std::move(grid));
  PathOptions options = small(4);
  options.width = options.height = 24;
  physical_in(options).sky.model = SkyModel::Uniform;
  expect_same_light(scene, towards({0.0, 0.0, 100.0}, {0.0, 0.0, 0.0}), options, "panes");
}

// Nightly only: its shader takes half a minute to compile.
TEST_F(VulkanPaths, MatchCpuOnShapes) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  Scene scene;
  const ShapeTypes types(scene.types);
  VoxelProperties textured{.name = "textured", .emission = 3.0F};
  textured.faces = render_test::random_faces(5);
  textured.shapes = VoxelShape::box({2, 0, 2}, {14, 12, 14});
  const VoxelType box = *scene.types.add(textured);
  Grid grid;
  grid.fill_box({{-8, -1, -8}, {9, 0, 9}}, types.stone);
  for (int i = -4; i < 5; ++i) grid.set({i, 0, -3}, types.fence);
  for (std::uint32_t i = 0; i < 8; ++i) grid.set({static_cast<int>(i) - 4, 0, -1}, types.stairs, {.state = i});
  grid.fill_box({{-3, 0, 1}, {0, 1, 3}}, types.water);
  grid.fill_box({{1, 0, 2}, {4, 2, 3}}, types.pane);
  grid.fill_box({{1, 0, 1}, {3, 1, 2}}, box);
  grid.set({-4, 0, 2}, types.torch);
  grid.set({4, 1, 1}, types.beam);
  place(scene, std::move(grid));
  expect_same_light(scene, towards({4.0, 4.0, 7.0}, {0.0, 0.0, 0.0}), small(), "shapes");
}

// A distant camera, whose view space begins in front of the scene; also far from the world's origin.
TEST_F(VulkanPaths, MatchCpuFromFarAway) {
  Scene scene = town();
  const DVec3 far(3.0e6, -2.0e5, 1.0e6);
  for (const InstanceHandle handle : scene.instances().handles()) scene.edit(handle).position += far;
  scene.lamps.front().position += far;
  Camera camera = towards(far + DVec3(9.0e3, 5.0e3, 2.0e4), far, 0.003);
  PathOptions options = small();
  physical_in(options).ground =
      GroundPlane{.height = far.y - 2.0, .colour = Vec3(0.3F), .only_shadows = false, .fade = 0.0};
  expect_same_light(scene, camera, options, "far", 0.01);
}

// Nightly only: its shader takes half a minute to compile.
TEST_F(VulkanPaths, EmptySceneShowsSky) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  expect_same_light(Scene(), of_town(), small(), "nothing", 0.0);
}

TEST_F(VulkanPaths, AddSamplesToImage) {
  const Scene scene = town();
  ASSERT_TRUE(renderer_->update(scene));
  VulkanPathImage image(*renderer_);
  EXPECT_EQ(image.samples(), 0);
  EXPECT_EQ(image.read().error().code, ErrorCode::InvalidArgument);
  const int edge = cases(24, 64);
  const auto wanted = [&](int samples) {
    PathOptions made = small(samples);
    made.width = edge;
    return made;
  };
  PathOptions options = wanted(3);
  ASSERT_TRUE(renderer_->draw_paths(image, of_town(), options, Accumulation::Restart));
  options.samples = 5;
  ASSERT_TRUE(renderer_->draw_paths(image, of_town(), options, Accumulation::Continue));
  EXPECT_EQ(image.samples(), 8);
  EXPECT_EQ(image.width(), edge);
  EXPECT_GE(image.bytes(), static_cast<std::size_t>(edge * options.height) * 112);
  const auto in_parts = image.read();
  const auto at_once = renderer_->render_paths(of_town(), wanted(8));
  ASSERT_TRUE(in_parts && at_once);
  EXPECT_EQ(in_parts->radiance, at_once->radiance);
  EXPECT_EQ(in_parts->rays, at_once->rays);
  ASSERT_TRUE(renderer_->draw_paths(image, of_town(), wanted(1), Accumulation::Restart));
  EXPECT_EQ(image.samples(), 1);
}

TEST_F(VulkanPaths, FollowEdits) {
  Scene scene = town();
  ASSERT_TRUE(renderer_->update(scene));
  ASSERT_TRUE(renderer_->render_paths(of_town(), small(1)));
  VoxelProperties glowing;
  glowing.colour = {90, 255, 90, 255};
  glowing.emission = 9.0F;
  const VoxelType type = scene.types.add(glowing).value_or(kAir);
  const GridHandle grid = scene.instances()[scene.instances().handles().front()].grid;
  scene.edit(grid).grid.fill_box({{-4, 0, 10}, {2, 6, 12}}, type);
  scene.lamps.clear();
  expect_same_light(scene, of_town(), small(), "edited");
}

TEST_F(VulkanPaths, UploadEmissiveFacesOnlyOnChange) {
  Scene scene = town();
  const vulkan::DeviceMemory& memory = renderer_->impl().memory;
  const auto sent = [&] {
    EXPECT_TRUE(renderer_->update(scene));
    const std::uint64_t before = memory.written();
    EXPECT_TRUE(renderer_->render_paths(of_town(), small(1)));
    return memory.written() - before;
  };
  const std::uint64_t first = sent();
  const std::uint64_t again = sent();
  EXPECT_LT(again, first);
  const GridHandle grid = scene.instances()[scene.instances().handles().front()].grid;
  scene.edit(grid).grid.fill_box({{-4, 0, 10}, {2, 6, 12}}, 1);
  EXPECT_EQ(sent(), again) << "what glows is where it was";
  VoxelProperties glowing;
  glowing.colour = {90, 255, 90, 255};
  glowing.emission = 9.0F;
  const VoxelType type = scene.types.add(glowing).value_or(kAir);
  const std::uint64_t with_a_type = sent();
  EXPECT_GT(with_a_type, again);
  scene.edit(grid).grid.fill_box({{-4, 0, 10}, {2, 6, 12}}, type);
  // More than a hundred unit faces, which take 20 bytes each, and as many free slots.
  EXPECT_GT(sent(), again + 4'000);
  expect_same_light(scene, of_town(), small(), "glowing");
}

TEST_F(VulkanPaths, RejectSameInputAsCpu) {
  const Scene scene = town();
  ASSERT_TRUE(renderer_->update(scene));
  PathOptions options = small();
  options.samples = 0;
  EXPECT_EQ(renderer_->render_paths(of_town(), options).error().code, ErrorCode::InvalidArgument);
  options = small();
  physical_in(options).sky.model = SkyModel::Image;
  EXPECT_EQ(renderer_->render_paths(of_town(), options).error().code, ErrorCode::InvalidArgument);
  options = small();
  physical_in(options).sun.direction = DVec3(NAN);
  EXPECT_EQ(renderer_->render_paths(of_town(), options).error().code, ErrorCode::InvalidArgument);
  VulkanPathImage image(*renderer_);
  ASSERT_TRUE(renderer_->draw_paths(image, of_town(), small(1), Accumulation::Restart));
  options = small(65'536);
  EXPECT_EQ(renderer_->draw_paths(image, of_town(), options, Accumulation::Continue).error().code,
            ErrorCode::LimitExceeded);
  const auto stop = [](double) { return false; };
  EXPECT_EQ(renderer_->draw_paths(image, of_town(), small(1), Accumulation::Continue, stop).error().code,
            ErrorCode::Cancelled);
  EXPECT_EQ(image.samples(), 0);
}

}  // namespace
}  // namespace quoin::vulkan_test
