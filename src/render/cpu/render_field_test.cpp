// Images of density fields, lit in the same way as blocks.

#include <algorithm>
#include <array>
#include <cmath>

#include <glm/gtc/quaternion.hpp>

#include <quoin/mesh/smooth_mesh.h>
#include <quoin/mesh/smooth_occlusion.h>

#include "render/cpu/environment_for_tests.h"
#include "render/cpu/render_test_support.h"
#include "render/light/occlusion_directions.h"
#include "render/path/town_for_tests.h"

namespace quoin {
namespace {

using namespace render_test;

constexpr DVec3 kSun{0.48, 0.6, 0.64};  // unit

RenderOptions lit_by_the_sun(int edge) {
  RenderOptions options = sized(edge, edge);
  environment_in(options).sun.direction = kSun;
  options.light.occlusion_mode = OcclusionMode::Off;
  return options;
}

TEST(RenderField, LightsBallByNormals) {
  Scene scene;
  const Rgba8 colour{200, 120, 60, 255};
  DensityGrid field;
  constexpr double kRadius = 24.0;
  field.add_sphere(DVec3(32.0), kRadius, add_type(scene, colour));
  place_field(scene, std::move(field), DVec3(-32.0));
  const RenderedImage image = taken(scene, from_above(0, 100, 0, 60), lit_by_the_sun(61));
  int compared = 0;
  for (int y = 0; y < 61; ++y) {
    for (int x = 0; x < 61; ++x) {
      const double px = (x - 30) * 60.0 / 61.0;
      const double pz = (y - 30) * 60.0 / 61.0;
      const double square = kRadius * kRadius - px * px - pz * pz;
      // Near the outline the cell surface differs from the ball.
      if (square < 60.0) continue;
      const DVec3 normal = DVec3{px, std::sqrt(square), pz} / kRadius;
      const double cosine = std::max(glm::dot(normal, kSun), 0.0);
      // At grazing light the own cells of the ball may or may not block it.
      if (std::abs(glm::dot(normal, kSun)) < 0.1) continue;
      const Pixel expected = encoded(linear(colour) * static_cast<float>(0.1 + cosine));
      const Pixel found = pixel_at(image, x, y);
      for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 5) << x << ' ' << y;
      EXPECT_NEAR(depth_at(image, x, y), 100.0 - std::sqrt(square), 0.05);
      ++compared;
    }
  }
  EXPECT_GT(compared, 1200);
}

TEST(RenderField, FieldsAndBlocksShadeEachOther) {
  Scene scene;
  const VoxelType grey = add_type(scene, {188, 188, 188, 255});
  Grid floor;
  floor.fill_box({{-40, -1, -40}, {40, 0, 40}}, grey);
  place(scene, std::move(floor));
  DensityGrid ball;
  ball.add_sphere(DVec3(16.0), 8.0, grey);
  place_field(scene, std::move(ball), {-16, 0, -16});
  RenderOptions options = lit_by_the_sun(81);
  environment_in(options).sun.direction = {0, 1, 0};
  const RenderedImage image = taken(scene, from_above(0, 100, 0, 81), options);
  // No pixel below the ball's outline is visible; next to it the floor is lit.
  EXPECT_EQ(pixel_at(image, 40 + 10, 40), encoded(linear({188, 188, 188, 255}) * 1.1F));
  // With a slanted sun the ball's shadow lies at the projection of its centre onto the floor.
  environment_in(options).sun.direction = {1, 1, 0};
  const RenderedImage aslant = taken(scene, from_above(0, 100, 0, 81), options);
  const Pixel in_shadow = encoded(linear({188, 188, 188, 255}) * 0.1F);
  EXPECT_EQ(pixel_at(aslant, 40 - 16, 40), in_shadow);
  EXPECT_EQ(pixel_at(aslant, 40 - 22, 40), in_shadow);
  EXPECT_NE(pixel_at(aslant, 40 - 30, 40), in_shadow);
  EXPECT_NE(pixel_at(aslant, 40 + 16, 40), in_shadow);
  // A block over the ball blocks its light.
  Grid roof;
  roof.fill_box({{-3, 30, -3}, {4, 31, 4}}, grey);
  place(scene, std::move(roof));
  environment_in(options).sun.direction = {0, 1, 0};
  const RenderedImage under = taken(scene, from_above(0, 28, 0, 81), options);
  EXPECT_EQ(pixel_at(under, 40, 40), in_shadow);
  EXPECT_NE(pixel_at(under, 40 + 6, 40), in_shadow);
}

TEST(RenderField, LightsFlatFloorLikeBlocks) {
  const auto floor = [](bool of_blocks) {
    Scene scene;
    const VoxelType grey = add_type(scene, {188, 188, 188, 255});
    if (of_blocks) {
      Grid grid;
      grid.fill_box({{0, 0, 0}, {40, 10, 40}}, grey);
      grid.fill_box({{20, 10, 0}, {40, 20, 40}}, grey);
      place(scene, std::move(grid));
    } else {
      DensityGrid field;
      field.edit({{-4, -4, -4}, {45, 25, 45}}, [&](IVec3 p, DensitySample) {
        const auto beyond = [](double at, double low, double high) { return std::max(low - at, at - high); };
        const double sides = std::max(beyond(p.x, 0, 40), beyond(p.z, 0, 40));
        const double low = std::max(sides, beyond(p.y, 0, 10));
        const double high = std::max({beyond(p.x, 20, 40), beyond(p.z, 0, 40), beyond(p.y, 0, 20)});
        return DensitySample{static_cast<float>(std::min(low, high)), grey};
      });
      place_field(scene, std::move(field));
    }
    return scene;
  };
  for (const int rays : {6, 9, 25}) {
    RenderOptions options = sized(40, 40);
    options.samples = 4;
    options.light.occlusion_rays = rays;
    const RenderedImage blocks = taken(floor(true), from_above(20, 60, 20, 40), options);
    const RenderedImage field = taken(floor(false), from_above(20, 60, 20, 40), options);
    // Away from the edges, which a trilinear field rounds off.
    for (int y = 4; y < 36; ++y) {
      for (const int x : {4, 8, 12, 15, 24, 30, 35}) {
        const Pixel a = pixel_at(blocks, x, y);
        const Pixel b = pixel_at(field, x, y);
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(a[c], b[c], rays == 25 ? 6 : 3) << rays << ' ' << x << ' ' << y;
      }
    }
  }
}

TEST(RenderField, SmoothOcclusionMatchesMesh) {
  Scene scene;
  DensityGrid field;
  field.add_box({0, 0, 0}, {40, 10, 40}, kAir);
  field.add_sphere({20, 14, 20}, 8.0, kAir);
  const DensityGrid same = field.snapshot();
  place_field(scene, std::move(field));
  RenderOptions options = sized(40, 40);
  options.light.shading = Shading::Occlusion;
  options.light.occlusion_mode = OcclusionMode::Smooth;
  options.light.smooth_occlusion.method = SmoothOcclusion::Weighted;
  options.depth = true;
  const Camera camera = from_above(20, 60, 20, 40);
  const RenderedImage image = taken(scene, camera, options);
  int darker = 0;
  for (int y = 4; y < 36; ++y) {
    for (int x = 4; x < 36; ++x) {
      const float depth = image.depth.values[static_cast<std::size_t>(40 * y + x)];
      const DVec3 point(x + 0.5, 60.0 - static_cast<double>(depth), y + 0.5);
      const DVec3 up = glm::normalize(same.gradient_at(point));
      const float open = 1.0F - smooth_occlusion(same, point, Vec3(up), options.light.smooth_occlusion);
      darker += open < 0.9F ? 1 : 0;
      // The image uses the lighting normals, which are smoother than the exact ones.
      EXPECT_NEAR(pixel_at(image, x, y)[0], 255.0 * open, 30.0) << x << ' ' << y;
    }
  }
  EXPECT_GT(darker, 30);
  EXPECT_EQ(pixel_at(image, 6, 6), (Pixel{255, 255, 255})) << "flat";
  EXPECT_EQ(pixel_at(image, 20, 20), (Pixel{255, 255, 255})) << "convex";
}

TEST(RenderField, ShowsMaterialColours) {
  Scene scene;
  const VoxelType red = add_type(scene, {200, 30, 30, 255});
  const VoxelType glow = add_type(scene, {30, 200, 30, 255}, Visibility::Opaque, 2.0F);
  DensityGrid field;
  field.add_box({0, 0, 0}, {10, 10, 10}, red);
  field.add_box({20, 0, 0}, {30, 10, 10}, glow);
  field.add_box({40, 0, 0}, {50, 10, 10}, kAir);
  place_field(scene, std::move(field));
  RenderOptions options = sized(60, 20);
  options.light.shading = Shading::Unlit;
  const RenderedImage unlit = taken(scene, from_above(25, 50, 5, 20), options);
  EXPECT_EQ(pixel_at(unlit, 10, 10), (Pixel{200, 30, 30}));
  EXPECT_EQ(pixel_at(unlit, 30, 10), (Pixel{30, 200, 30}));
  EXPECT_EQ(pixel_at(unlit, 50, 10), (Pixel{255, 255, 255}));
  options.light.shading = Shading::Normals;
  EXPECT_EQ(pixel_at(taken(scene, from_above(25, 50, 5, 20), options), 10, 10), (Pixel{128, 255, 128}));
  options.light.shading = Shading::Lit;
  environment_in(options).sun.brightness = environment_in(options).sky.brightness = 0.0;
  const RenderedImage night = taken(scene, from_above(25, 50, 5, 20), options);
  EXPECT_EQ(pixel_at(night, 10, 10), (Pixel{0, 0, 0}));
  EXPECT_GT(pixel_at(night, 30, 10)[1], 200);
}

// A flat floor at y = 10 in patches of three materials.
DensityGrid patchwork(Scene& scene) {
  const std::array<VoxelType, 3> types{add_type(scene, {220, 40, 30, 255}), add_type(scene, {40, 200, 60, 255}),
                                       add_type(scene, {30, 60, 240, 255})};
  DensityGrid field;
  field.edit({{-4, 0, -4}, {76, 16, 76}}, [&](IVec3 p, DensitySample) {
    const int patch = (p.x * p.x + 5 * p.z * p.z + p.x * p.z) / 7 % 3;
    return DensitySample{static_cast<float>(p.y) - 10.0F, types[static_cast<std::size_t>(patch)]};
  });
  return field;
}

// Seen from above, the floor has the colours of the mesh's vertices, interpolated between them.
TEST(RenderField, BlendsMaterialsLikeMesh) {
  Scene scene;
  DensityGrid field = patchwork(scene);
  const SmoothMesh mesh = build_smooth_mesh(field, scene.types, {}).value();
  constexpr int kFirst = 8;  // first visible cell, on both axes
  constexpr int kCells = 64;
  std::array<std::array<Vec3, kCells + 1>, kCells + 1> colours{};
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const IVec3 cell(glm::floor(mesh.positions[i]));
    const IVec3 from = cell - kFirst;
    if (cell.y < 9 || std::min(from.x, from.z) < 0 || std::max(from.x, from.z) > kCells) continue;
    const LinearRgba16 albedo = mesh.albedo[i];
    colours[static_cast<std::size_t>(from.z)][static_cast<std::size_t>(from.x)] =
        Vec3(albedo[0], albedo[1], albedo[2]) / 65'535.0F;
  }
  place_field(scene, std::move(field));
  RenderOptions options = sized(4 * kCells, 4 * kCells);
  options.light.shading = Shading::Unlit;
  constexpr double kMiddle = kFirst + 0.5 + 0.5 * kCells;
  const RenderedImage image = taken(scene, from_above(kMiddle, 50, kMiddle, kCells), options);
  int blended = 0;
  for (int y = 0; y < 4 * kCells; ++y) {
    for (int x = 0; x < 4 * kCells; ++x) {
      const Vec3 at((static_cast<float>(x) + 0.5F) / 4.0F, 0.0F, (static_cast<float>(y) + 0.5F) / 4.0F);
      const auto column = static_cast<std::size_t>(at.x);
      const auto row = static_cast<std::size_t>(at.z);
      const Vec3 part = glm::fract(at);
      const Vec3 above = glm::mix(colours[row][column], colours[row][column + 1], part.x);
      const Vec3 below = glm::mix(colours[row + 1][column], colours[row + 1][column + 1], part.x);
      const Pixel expected = encoded(glm::mix(above, below, part.z));
      const Pixel found = pixel_at(image, x, y);
      for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(found[c], expected[c], 1) << x << ' ' << y;
      blended += std::abs(above.x - below.x) > 0.01F ? 1 : 0;
    }
  }
  EXPECT_GT(blended, 10'000);
}

// Emission and path-traced materials blend by the same shares.
TEST(RenderField, BlendsEmission) {
  Scene scene;
  const VoxelType dark = add_type(scene, {0, 0, 0, 255});
  const VoxelType glow = add_type(scene, {255, 255, 255, 255}, Visibility::Opaque, 0.5F);
  DensityGrid field;
  field.edit({{0, 0, 0}, {40, 16, 40}}, [&](IVec3 p, DensitySample) {
    return DensitySample{static_cast<float>(p.y) - 10.0F, p.x < 20 ? dark : glow};
  });
  place_field(scene, std::move(field));
  RenderOptions options = sized(40, 40);
  environment_in(options).sun.brightness = environment_in(options).sky.brightness = 0.0;
  const Camera camera = from_above(19.5, 50, 20, 4);
  const RenderedImage image = taken(scene, camera, options);
  PathOptions paths = under_even_sky(40, 40, 16);
  physical_in(paths).sky.brightness = 0.0;
  paths.max_bounces = 0;
  const PathImage traced = path_image(scene, camera, paths);
  for (int x = 0; x < 40; ++x) {
    // 0 from 1 before the middle between both materials, 1 from 1 beyond it.
    const float share = std::clamp(0.5F * (1.0F + (static_cast<float>(x) + 0.5F - 20.0F) / 10.0F), 0.0F, 1.0F);
    EXPECT_NEAR(pixel_at(image, x, 20)[0], encoded(Vec3(0.5F * share))[0], 1) << x;
    EXPECT_NEAR(traced.radiance[static_cast<std::size_t>(20 * 40 + x)].x, 0.5F * share, 0.01F) << x;
  }
}

TEST(RenderField, TurnsDirectionsWithNormal) {
  for (const DVec3 normal : {DVec3{0, 1, 0}, DVec3{0, -1, 0}, DVec3{1, 0, 0}, glm::normalize(DVec3{-1, -9, 0.2}),
                             glm::normalize(DVec3{0.3, 0.2, -0.7})}) {
    EXPECT_LT(glm::distance(turned_from_up({0, 1, 0}, normal), normal), 1e-9);
    const DVec3 a = turned_from_up({1, 0, 0}, normal);
    const DVec3 b = turned_from_up({0, 0, 1}, normal);
    EXPECT_NEAR(glm::length(a), 1.0, 1e-9);
    EXPECT_NEAR(glm::dot(a, b), 0.0, 1e-9);
    EXPECT_NEAR(glm::dot(a, normal), 0.0, 1e-9);
    EXPECT_LT(glm::distance(glm::cross(b, a), normal), 1e-9);
  }
}

}  // namespace
}  // namespace quoin
