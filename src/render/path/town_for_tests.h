#pragma once

#include <utility>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/grid/grid.h>
#include <quoin/render/path_tracer.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/scene.h>

#include "render/cpu/environment_for_tests.h"
#include "render/cpu/render_test_support.h"

namespace quoin::render_test {

/// A gilded tower, a block of glass, lamps, a spot and a ship that hangs askew above a meadow.
inline Scene town() {
  Scene scene;
  const VoxelType ground = add_type(scene, {120, 150, 90, 255});
  VoxelProperties metal;
  metal.colour = {220, 180, 90, 255};
  metal.roughness = 0.3F;
  metal.metalness = 1.0F;
  const VoxelType gold = scene.types.add(metal).value_or(kAir);
  const VoxelType lamp = add_type(scene, {255, 180, 90, 255}, Visibility::Opaque, 6.0F);
  const VoxelType glass = add_type(scene, {120, 190, 255, 60}, Visibility::Transparent);
  Grid grid;
  grid.fill_box({{-30, -2, -30}, {30, 0, 30}}, ground);
  grid.fill_box({{-8, 0, -8}, {-2, 12, -2}}, gold);
  grid.fill_box({{4, 0, -10}, {10, 8, 2}}, glass);
  grid.fill_box({{-12, 3, 6}, {-10, 5, 8}}, lamp);
  place(scene, std::move(grid));
  Grid ship;
  ship.fill_box({{0, 0, 0}, {6, 3, 4}}, gold);
  ship.set({3, 3, 2}, lamp);
  const InstanceHandle handle = place(scene, std::move(ship), {2.0, 14.0, 3.0});
  Instance& turned = scene.edit(handle);
  turned.rotation = glm::angleAxis(0.7, glm::normalize(DVec3(1, 2, 3)));
  Lamp spot;
  spot.kind = Lamp::Kind::Spot;
  spot.position = {12.0, 20.0, 12.0};
  spot.direction = {-1.0, -1.5, -1.0};
  spot.intensity = 200.0;
  scene.lamps.push_back(spot);
  return scene;
}

/// Options for an image without a sun, under a sky of radiance 1.
inline PathOptions under_even_sky(int width, int height, int samples) {
  PathOptions options;
  options.width = width;
  options.height = height;
  options.samples = samples;
  physical_in(options).sky.model = SkyModel::Uniform;
  physical_in(options).sun.brightness = 0.0;
  return options;
}

/// Renders an image; fails the test on an error.
inline PathImage path_image(const Scene& scene, const Camera& camera, const PathOptions& options,
                            Threads threads = {}) {
  auto image = PathTracer(scene).render(camera, options, threads);
  EXPECT_TRUE(image.has_value()) << (image ? "" : image.error().message);
  return image ? std::move(*image) : PathImage{};
}

inline Camera of_town() {
  return towards({18.0, 22.0, 40.0}, {0.0, 4.0, 0.0}, 0.8);
}

}  // namespace quoin::render_test
