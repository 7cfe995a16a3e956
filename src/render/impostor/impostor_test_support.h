#pragma once

// Models, their impostors, and the similarity of their images to traced images.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include <glm/geometric.hpp>

#include <quoin/render/impostor.h>

#include "bench/workloads.h"
#include "render/cpu/render_test_support.h"
#include "render/impostor/impostor_pass.h"

namespace quoin::render_test {

inline constexpr double kDegree = std::numbers::pi / 180.0;

struct Likeness {
  double overlap = 1.0;     // intersection over union of the silhouettes
  double difference = 0.0;  // mean absolute, over the union
  std::int64_t pixels = 0;
};

inline Likeness likeness(const RenderedImage& truth, const RenderedImage& image) {
  std::int64_t both = 0;
  Likeness found;
  for (std::size_t i = 0; i < truth.depth.values.size(); ++i) {
    const bool in_truth = std::isfinite(truth.depth.values[i]);
    const bool in_image = std::isfinite(image.depth.values[i]);
    if (!in_truth && !in_image) continue;
    ++found.pixels;
    both += in_truth && in_image;
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
      found.difference += std::abs(truth.colour.rgb[c] - image.colour.rgb[c]) / 3.0;
    }
  }
  if (found.pixels == 0) return found;
  found.overlap = static_cast<double>(both) / static_cast<double>(found.pixels);
  found.difference /= static_cast<double>(found.pixels);
  return found;
}

// A few models in one scene, one grid each, with their pivots at the contents' centres.
enum class Model { Ball, Box, Castle, Blobs, Ship, Terrain, Comb, SmoothBall, SmoothHills, SmoothRods, Village };

inline Grid castle() {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {45, 1, 45}}, 2);
  for (const IVec3 corner : {IVec3{0, 1, 0}, {36, 1, 0}, {0, 1, 36}, {36, 1, 36}}) {
    grid.fill_box({corner, corner + IVec3{9, 28, 9}}, 1);
    grid.fill_box({corner + IVec3{2, 20, 2}, corner + IVec3{7, 28, 7}}, kAir);
  }
  grid.fill_box({{8, 1, 3}, {37, 15, 6}}, 3);
  grid.fill_box({{8, 1, 39}, {37, 15, 42}}, 3);
  grid.fill_box({{16, 1, 16}, {29, 23, 29}}, 3);
  return grid;
}

inline Grid ship() {
  Grid grid;
  for (int z = 0; z < 48; ++z) {
    const int half = std::min({6, z / 2 + 1, (47 - z) / 3 + 2});
    grid.fill_box({{-half, 0, z}, {half + 1, 6, z + 1}}, 1);
    grid.fill_box({{1 - half, 4, z}, {half, 6, z + 1}}, kAir);
  }
  for (const int z : {12, 24, 36}) {
    grid.fill_box({{0, 5, z}, {1, 35, z + 1}}, 2);
    grid.fill_box({{-9, 26, z}, {10, 27, z + 1}}, 2);
    grid.fill_box({{-8, 12, z}, {9, 26, z + 1}}, 3);
  }
  return grid;
}

inline VoxelType terrain_at(IVec3 v) {
  const double height = 25 + 12 * std::sin(0.11 * v.x) * std::cos(0.07 * v.z) + 5 * std::sin(0.31 * v.x + 0.2 * v.z);
  return v.y <= height ? static_cast<VoxelType>(v.y > height - 1 ? 1 : v.y > height - 4 ? 2 : 3) : kAir;
}

inline Grid voxels_of(Model model) {
  if (model == Model::Castle) return castle();
  if (model == Model::Ship) return ship();
  if (model == Model::Village) {
    Grid house;
    house.fill_box({{-8, 4, -10}, {6, 20, 4}}, 2);
    house.fill_box({{-10, 20, -12}, {8, 23, 6}}, 3);
    return house;
  }
  Grid grid;
  if (model == Model::Ball) grid.put_chunk({0, 0, 0}, workloads::blocky_chunk(workloads::Blocky::W4));
  if (model == Model::Box) {
    grid.edit({IVec3(0), IVec3(41)},
              [](IVec3 v, VoxelType) { return static_cast<VoxelType>(1 + (v.x / 5 + v.y / 5 + v.z / 5) % 2); });
  }
  if (model == Model::Blobs) {
    std::mt19937 random(9);
    for (int i = 0; i < 40; ++i) {
      const auto coordinate = [&] { return static_cast<int>(random() % 41); };
      const IVec3 at{coordinate(), coordinate(), coordinate()};
      grid.fill_box({at, at + IVec3(static_cast<int>(random() % 9)) + 1}, static_cast<VoxelType>(1 + random() % 3));
    }
  }
  if (model == Model::Terrain) {
    grid.edit({IVec3(0), IVec3(200, 60, 200)}, [](IVec3 v, VoxelType) { return terrain_at(v); });
  }
  if (model == Model::Comb) {
    grid.fill_box({{0, 0, 0}, {41, 3, 31}}, 2);
    for (int x = 0; x <= 40; x += 2) grid.fill_box({{x, 3, 0}, {x + 1, 25, 31}}, x % 4 == 0 ? 1 : 3);
  }
  return grid;
}

inline DensityGrid field_of(Model model) {
  DensityGrid field;
  if (model == Model::SmoothBall) field.add_sphere({20.3, 21.1, 19.7}, 20.0, 2);
  if (model == Model::SmoothHills || model == Model::Village) {
    const int edge = model == Model::Village ? 24 : 60;
    field.edit({{-edge, -12, -edge}, {edge, 30, edge}}, [&](IVec3 p, DensitySample) {
      const double height = 8.0 * std::sin(0.09 * p.x) * std::cos(0.07 * p.z) + 2.0 * std::sin(0.31 * p.x + 0.23 * p.z);
      const double side = std::max({std::abs(p.x), std::abs(p.z), 2 * std::abs(p.y) - 4}) - (edge - 2.5);
      const auto type = static_cast<VoxelType>(p.y > height - 1.5 ? 1 : 2 + (p.x / 8 + p.z / 8) % 2);
      return DensitySample{static_cast<float>(std::max(0.8 * (p.y - height), side)), type};
    });
    field.remove_sphere({6.0, 4.0, 10.0}, 9.0, 2.0);
    field.add_sphere({-14.0, 12.0, -8.0}, 7.0, 3, 3.0);
  }
  if (model == Model::SmoothRods) {
    for (int i = 0; i < 5; ++i) {
      field.add_box({8.0 * i, 0.3, 3.1 * i}, {8.0 * i + 2.6, 40.0, 3.1 * i + 2.4}, 1, 1.0);
      field.add_box({-4.0, 8.2 * i, 2.0}, {40.0, 8.2 * i + 1.9, 14.0}, 3);
    }
  }
  return field;
}

struct ImpostorWorld {
  Scene scene;
  InstanceHandle instance;
  Impostor impostor;
  double radius = 0.0;

  explicit ImpostorWorld(Model model) {
    scene.types = workloads::three_types();
    SceneGrid grid;
    grid.grid = voxels_of(model);
    grid.field = field_of(model);
    const ContentSphere content = content_sphere(grid);
    radius = content.radius;
    grid.pivot = content.centre;
    impostor = Impostor::build(grid, scene.types);
    instance = scene.add_instance({"", scene.add_grid(std::move(grid))});
  }
  Instance& placed() { return scene.edit(instance); }

  [[nodiscard]] RenderedImage drawn(const Camera& camera, const RenderOptions& options, Threads threads = {}) const {
    RenderedImage image = taken(Scene(), camera, options);
    draw_impostors(SceneTracer(scene), std::array{FarInstance{instance, &impostor}}, camera, options, image, threads);
    return image;
  }
};

// Places the camera where the sphere spans `pixels` of a slightly larger square image.
inline Camera orbiting(const ImpostorWorld& world, double azimuth, double elevation, double roll, double pixels,
                       int size) {
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

}  // namespace quoin::render_test
