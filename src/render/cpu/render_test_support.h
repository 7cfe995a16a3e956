#pragma once

// Small scenes, cameras and expected pixels for the renderer's tests.

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <utility>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/core/direction.h>
#include <quoin/render/cpu_renderer.h>

#include "core/srgb.h"

namespace quoin::render_test {

using Pixel = std::array<std::uint8_t, 3>;

inline VoxelType add_type(Scene& scene, Rgba8 colour, Visibility visibility = Visibility::Opaque,
                          float emission = 0.0F) {
  VoxelProperties properties;
  properties.colour = colour;
  properties.visibility = visibility;
  properties.emission = emission;
  const auto type = scene.types.add(properties);
  EXPECT_TRUE(type.has_value());
  return type.value_or(kAir);
}

inline InstanceHandle place(Scene& scene, Grid grid, DVec3 position = DVec3(0.0)) {
  SceneGrid placed;
  placed.grid = std::move(grid);
  return scene.add_instance({"", scene.add_grid(std::move(placed)), position});
}

inline InstanceHandle place_field(Scene& scene, DensityGrid field, DVec3 position = DVec3(0.0)) {
  SceneGrid placed;
  placed.field = std::move(field);
  return scene.add_instance({"", scene.add_grid(std::move(placed)), position});
}

/// Returns an opaque texture of noise.
inline Texture random_texture(int size, unsigned seed) {
  std::mt19937 random(seed);
  AlphaImage image{size, size, {}};
  for (int i = 0; i < 4 * size * size; ++i) {
    image.rgba.push_back(i % 4 == 3 ? 255 : static_cast<std::uint8_t>(random()));
  }
  return Texture::from_image("noise", image).value();
}

/// Returns faces of noise of three sizes, with random turns, mirrors and tints, and different shares of emission.
inline VoxelFaces random_faces(unsigned seed) {
  std::mt19937 random(seed);
  std::array<VoxelFace, 6> faces;
  for (VoxelFace& face : faces) {
    face.texture = random_texture(16 << (random() % 3), seed + random() % 3);
    face.turn = static_cast<std::uint8_t>(random() % 4);
    face.mirrored = random() % 2 == 0;
    if (random() % 2 == 0) face.tint = {255, 100, 30, 255};
  }
  faces[1].emission_share = 0;
  faces[2].emission_share = 170;
  faces[5].emission_share = 51;
  return VoxelFaces(faces);
}

/// Looks straight down from `height` above (x, z), `view_height` wide and high; the image's right is +X, its top -Z.
inline Camera from_above(double x, double height, double z, double view_height) {
  Camera camera;
  camera.position = {x, height, z};
  camera.forward = {0, -1, 0};
  camera.up = {0, 0, -1};
  camera.right = {1, 0, 0};
  camera.projection = Camera::Projection::Orthographic;
  camera.view_height = view_height;
  return camera;
}

inline Camera towards(DVec3 eye, DVec3 target, double vertical_fov_radians = 0.8) {
  Camera camera;
  camera.position = eye;
  camera.forward = glm::normalize(target - eye);
  camera.right = glm::normalize(glm::cross(camera.forward, DVec3(0, 1, 0)));
  camera.up = glm::cross(camera.right, camera.forward);
  camera.vertical_fov_radians = vertical_fov_radians;
  return camera;
}

inline RenderOptions sized(int width, int height) {
  RenderOptions options;
  options.width = width;
  options.height = height;
  options.depth = true;
  return options;
}

inline RenderOptions unlit(int width, int height) {
  RenderOptions options = sized(width, height);
  options.light.shading = Shading::Unlit;
  return options;
}

inline RenderedImage taken(const Scene& scene, const Camera& camera, const RenderOptions& options,
                           Threads threads = {}) {
  auto image = CpuRenderer(scene).render(camera, options, threads);
  EXPECT_TRUE(image.has_value());
  return image ? std::move(*image) : RenderedImage{};
}

inline Pixel pixel_at(const RenderedImage& image, int x, int y) {
  const auto at =
      3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.colour.width) + static_cast<std::size_t>(x));
  return {image.colour.rgb.at(at), image.colour.rgb.at(at + 1), image.colour.rgb.at(at + 2)};
}

inline float depth_at(const RenderedImage& image, int x, int y) {
  return image.depth.values.at(static_cast<std::size_t>(y) * static_cast<std::size_t>(image.depth.width) +
                               static_cast<std::size_t>(x));
}

inline Vec3 linear(Rgba8 colour) {
  return linear_colour(colour);
}

inline Pixel encoded(Vec3 light) {
  const SrgbEncoder& encode = SrgbEncoder::shared();
  return {encode(light.x), encode(light.y), encode(light.z)};
}

/// Makes a plate with a blocker that only the reference's sixth occlusion ray from the face's centre meets, and a
/// camera that sees this centre in one pixel.
inline Camera sixth_ray_blocked(Scene& scene, Direction face) {
  const VoxelType type = add_type(scene, {188, 188, 188, 255});
  const FaceFrame& frame = frame_of(face);
  IVec3 half(12);
  half[frame.axis] = 0;
  Grid grid;
  grid.fill_box({-half, half + 1}, type);
  IVec3 blocker(2);
  blocker[frame.axis] = 3 * frame.sign;
  grid.set(blocker, type);
  place(scene, std::move(grid));
  const DVec3 normal(normal_of(face));
  Camera camera;
  camera.position = DVec3(0.5) + normal * 30.0;
  camera.forward = -normal;
  camera.up = DVec3(0.0);
  camera.up[frame.u] = 1.0;
  camera.right = glm::cross(camera.forward, camera.up);
  camera.projection = Camera::Projection::Orthographic;
  camera.view_height = 0.01;
  return camera;
}

/// Returns the number of pixels in which two images of equal size differ by more than `tolerance` in a channel.
inline int count_different(const RenderedImage& a, const RenderedImage& b, int tolerance) {
  EXPECT_EQ(a.colour.rgb.size(), b.colour.rgb.size());
  int different = 0;
  for (std::size_t i = 0; i + 2 < a.colour.rgb.size() && i + 2 < b.colour.rgb.size(); i += 3) {
    bool differs = false;
    for (std::size_t c = 0; c < 3; ++c) differs |= std::abs(a.colour.rgb[i + c] - b.colour.rgb[i + c]) > tolerance;
    different += differs;
  }
  return different;
}

}  // namespace quoin::render_test
