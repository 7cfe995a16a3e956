// Transparent fields look the same as transparent voxels.

#include <cmath>
#include <utility>

#include <glm/gtc/quaternion.hpp>

#include "core/instruction_sets_for_tests.h"
#include "render/cpu/environment_for_tests.h"
#include "render/cpu/glass_for_tests.h"
#include "render/cpu/render_test_support.h"
#include "render/light/light_model.h"

namespace quoin {
namespace {

using namespace render_test;

// Returns the transmittance of a length of glass.
Vec3 through(float length) {
  return power((1.0F - kAlpha) * (Vec3(1.0F) - kAlpha * (Vec3(1.0F) - linear(kGlass))), length);
}
Vec3 own(float length) {
  return linear(kGlass) * (1.0F - std::pow(1.0F - kAlpha, length));
}

// Adds a box with faces between samples, or on them: its sides are exact.
void add_plate(DensityGrid& field, DVec3 low, DVec3 high, VoxelType type) {
  field.edit({IVec3(glm::floor(low)) - 2, IVec3(glm::ceil(high)) + 3}, [&](IVec3 p, DensitySample before) {
    const DVec3 beyond = glm::max(low - DVec3(p), DVec3(p) - high);
    const double density = std::max({beyond.x, beyond.y, beyond.z});
    if (density >= 0.0 || before.density < 0.0F) {
      before.density = std::min(before.density, static_cast<float>(density));
      return before;
    }
    return DensitySample{static_cast<float>(density), type};
  });
}

TEST(RenderFieldGlass, SlabTintsByThicknessAndShowsOwnColour) {
  for (const float thickness : {0.5F, 1.0F, 2.25F, 7.0F}) {
    for (const bool is_glass : {true, false}) {
      GlassScene s;
      Grid wall;
      wall.fill_box({{-9, -1, -9}, {10, 0, 10}}, s.red);
      place(s.scene, std::move(wall));
      DensityGrid slab;
      const double low = thickness > 1.0F ? 3.0 : 3.0 - 0.5 * static_cast<double>(thickness);  // around a sample
      add_plate(slab, {-8, low, -8}, {8, low + static_cast<double>(thickness), 8}, is_glass ? s.glass : s.stone);
      place_field(s.scene, std::move(slab));
      RenderOptions options = sized(4, 4);
      options.light.shading = Shading::Unlit;
      const RenderedImage image = taken(s.scene, from_above(0, 20, 0, 4), options);
      const Vec3 expected = is_glass ? linear(kRed) * through(thickness) + own(thickness) : linear(kWhite);
      expect_near(pixel_at(image, 1, 2), encoded(expected), 1);
      EXPECT_NEAR(depth_at(image, 1, 2), 20.0 - low - static_cast<double>(thickness), 1e-5) << "it counts as hit";
    }
  }
}

TEST(RenderFieldGlass, MeasuresLengthInVoxels) {
  GlassScene s;
  Grid wall;
  wall.fill_box({{-9, -1, -9}, {10, 0, 10}}, s.red);
  place(s.scene, std::move(wall));
  DensityGrid slab;
  add_plate(slab, {-8, 4, -8}, {8, 8, 8}, s.glass);
  s.scene.edit(place_field(s.scene, std::move(slab))).voxel_size = 0.5;
  RenderOptions options = sized(4, 4);
  options.light.shading = Shading::Unlit;
  const RenderedImage image = taken(s.scene, from_above(0, 20, 0, 2), options);
  expect_near(pixel_at(image, 1, 2), encoded(linear(kRed) * through(4.0F) + own(4.0F)), 1);
}

// The floor of a lake in the same field: at the same position below water and below air.
TEST(RenderFieldGlass, LakeFloorLiesAtItsSamples) {
  GlassScene s;
  DensityGrid lake;
  lake.edit({{-12, -12, -12}, {13, 12, 13}}, [&](IVec3 p, DensitySample) {
    const double floor = p.y + 0.5;
    const double depth = std::min(std::abs(floor), std::abs(p.y - 6.25));
    if (floor < 0.0) return DensitySample{static_cast<float>(-depth), s.red};
    return DensitySample{static_cast<float>(p.y < 6.25 ? -depth : depth), s.glass};
  });
  place_field(s.scene, std::move(lake));
  RenderOptions options = sized(4, 4);
  environment_in(options).sun.direction = {0, 1, 0};
  options.light.occlusion_mode = OcclusionMode::Off;
  const RenderedImage image = taken(s.scene, from_above(0, 20, 0, 4), options);
  // The sun's light passes the water, and the view does too; the surface itself blocks no light.
  const Vec3 behind = linear(kRed) * (0.1F + through(6.74F));
  expect_near(pixel_at(image, 1, 1), encoded(behind * through(6.75F) + own(6.75F) * 1.1F), 1);
}

TEST(RenderFieldGlass, TintsTheSunAndDoesNotOcclude) {
  GlassScene s;
  Grid floor;
  floor.fill_box({{-12, -1, -12}, {13, 0, 13}}, s.stone);
  place(s.scene, std::move(floor));
  DensityGrid slab;
  add_plate(slab, {-11, 3, -11}, {11, 5, 11}, s.glass);
  const InstanceHandle roof = place_field(s.scene, std::move(slab));
  RenderOptions options = sized(3, 3);
  environment_in(options).sun.direction = {0, 1, 0};
  const auto floor_below = [&] { return pixel_at(taken(s.scene, from_above(0, 2, 0, 4), options), 1, 1); };
  expect_near(floor_below(), encoded(linear(kWhite) * (0.15F + through(2.0F))), 1);
  options.light.shadow_distance_voxels = 4.49;
  expect_near(floor_below(), encoded(linear(kWhite) * (0.15F + through(1.5F))), 1);
  options.light.shadow_distance_voxels = 2.5;
  expect_near(floor_below(), encoded(linear(kWhite) * 1.15F), 1);
  options.light.shadow_distance_voxels = 100.0;
  // Painted with stone it blocks the light; painted with glass again it passes the light.
  const GridHandle handle = s.scene.instances()[roof].grid;
  const auto paint = [&](VoxelType type) {
    s.scene.edit(handle).field.edit({{-20, 0, -20}, {20, 10, 20}}, [&](IVec3, DensitySample now) {
      now.material = type;
      return now;
    });
  };
  paint(s.stone);
  EXPECT_LT(floor_below()[0], encoded(linear(kWhite) * 0.1F)[0]);
  paint(s.glass);
  expect_near(floor_below(), encoded(linear(kWhite) * (0.15F + through(2.0F))), 1);
}

// Blocks and a field of the same glass next to each other, seen from above and along both.
TEST(RenderFieldGlass, MatchesAdjacentGlassOfBlocks) {
  GlassScene s;
  Grid blocks;
  blocks.fill_box({{-12, -1, -12}, {13, 0, 13}}, s.stone);
  blocks.fill_box({{-8, 2, -8}, {0, 5, 8}}, s.glass);
  place(s.scene, std::move(blocks));
  DensityGrid plate;
  add_plate(plate, {0, 2, -8}, {8, 5, 8}, s.glass);
  place_field(s.scene, std::move(plate));
  RenderOptions options = sized(16, 16);
  environment_in(options).sun.direction = {0, 1, 0};
  options.light.glass_surfaces = true;
  const RenderedImage above = taken(s.scene, from_above(0, 30, 0, 12), options);
  for (int y = 2; y < 14; ++y) expect_near(pixel_at(above, 2, y), pixel_at(above, 13, y), 1);
  // Along both, as one body of 16 voxels.
  options.light.shading = Shading::Unlit;
  Camera along = towards({-40, 3.5, 0.5}, {0, 3.5, 0.5});
  along.projection = Camera::Projection::Orthographic;
  along.view_height = 1.0;
  const float all_own = 1.0F - std::pow(1.0F - kAlpha, 16.0F);
  const Vec3 sky = sky_colour(0.0F);
  expect_near(pixel_at(taken(s.scene, along, options), 8, 8), encoded(sky * through(16.0F) + linear(kGlass) * all_own),
              1);
}

TEST(RenderFieldGlass, ShowsOverlappingBlocks) {
  GlassScene s;
  SceneGrid both;
  add_plate(both.field, {-10, -10, -10}, {10, 4, 10}, s.glass);
  both.grid.fill_box({{-2, -4, -2}, {2, 1, 2}}, s.red);
  s.scene.add_instance({"", s.scene.add_grid(std::move(both)), DVec3(0.0)});
  RenderOptions options = sized(8, 8);
  options.light.shading = Shading::Unlit;
  const RenderedImage image = taken(s.scene, from_above(0, 20, 0, 8), options);
  expect_near(pixel_at(image, 4, 4), encoded(linear(kRed) * through(3.0F) + own(3.0F)), 1);
  EXPECT_GT(std::abs(pixel_at(image, 0, 0)[2] - pixel_at(image, 4, 4)[2]), 20) << "it is deeper next to them";
}

// A ball of clear glass in front of the sky: its two surfaces reflect by the field's normals.
TEST(RenderFieldGlass, SurfacesReflectByGradient) {
  Scene scene;
  VoxelProperties clear;
  clear.colour = {255, 255, 255, 0};
  clear.visibility = Visibility::Transparent;
  DensityGrid ball;
  constexpr double kRadius = 30.0;
  ball.add_sphere(DVec3(40.0), kRadius, scene.types.add(clear).value());
  place_field(scene, std::move(ball), DVec3(-40.0));
  RenderOptions options = sized(61, 61);
  options.light.glass_surfaces = true;
  Camera camera = towards({0, 0, 100}, {0, 0, 0});
  camera.projection = Camera::Projection::Orthographic;
  camera.view_height = 61.0;
  const RenderedImage image = taken(scene, camera, options);
  const auto fresnel = [](double cosine) {
    const double inside = std::sqrt(1.0 - (1.0 - cosine * cosine) / 2.25);
    const double across = (cosine - 1.5 * inside) / (cosine + 1.5 * inside);
    const double in_plane = (1.5 * cosine - inside) / (1.5 * cosine + inside);
    return 0.5 * (across * across + in_plane * in_plane);
  };
  // Straight through: the sky in the camera's own ray directions.
  const RenderedImage empty = taken(Scene(), camera, options);
  int compared = 0;
  for (int y = 4; y < 57; y += 4) {
    for (int x = 4; x < 57; x += 4) {
      const double px = x - 30.0;
      const double py = 30.0 - y;
      const double square = kRadius * kRadius - px * px - py * py;
      if (square < 200.0) continue;
      const DVec3 normal = DVec3{px, py, std::sqrt(square)} / kRadius;
      const auto share = static_cast<float>(fresnel(normal.z));
      const auto up = static_cast<float>(2.0 * normal.z * normal.y);  // (0, 0, -1), mirrored
      const Vec3 mirrored = share * (sky_colour(up) + (1.0F - share) * sky_colour(up));
      const Pixel plain = pixel_at(empty, x, y);
      const Vec3 behind = linear({plain[0], plain[1], plain[2], 255});
      expect_near(pixel_at(image, x, y), encoded(mirrored + (1.0F - share) * (1.0F - share) * behind), 5);
      ++compared;
    }
  }
  EXPECT_GT(compared, 60);
  options.light.glass_surfaces = false;
  EXPECT_EQ(taken(scene, camera, options).colour.rgb, empty.colour.rgb);
}

struct PondScene : GlassScene {
  GridHandle grid;

  // Hills and a pond in one field, with a house of blocks and a pane.
  PondScene() {
    SceneGrid land;
    land.field.edit({{-70, -40, -70}, {70, 30, 70}}, [&](IVec3 p, DensitySample) {
      const double hill = 10.0 * std::sin(0.07 * p.x) * std::cos(0.06 * p.z);
      const double ground = 0.8 * (p.y - hill);
      const double water = p.y + 1.3;
      const double depth = std::min(std::abs(ground), std::abs(water));
      if (ground < 0.0) return DensitySample{static_cast<float>(water < 0.0 ? -depth : ground), stone};
      return DensitySample{static_cast<float>(water < 0.0 ? -depth : std::min(ground, water)), glass};
    });
    land.field.add_sphere({10, 3, 10}, 6.0, green);
    land.grid.fill_box({{-20, -6, -20}, {-8, 12, -8}}, red);
    land.grid.fill_box({{-4, -6, -20}, {-3, 12, -4}}, glass);
    grid = scene.add_grid(std::move(land));
    scene.add_instance({"", grid, DVec3(0.0)});
  }
};

TEST(RenderFieldGlass, GivesSameBytesForAnyThreadsAndInstructions) {
  PondScene s;
  RenderOptions options = sized(80, 60);
  options.light.glass_surfaces = true;
  const Camera camera = towards({70, 40, 80}, {0, 0, 0});
  const RenderedImage one = taken(s.scene, camera, options, {1});
  EXPECT_EQ(taken(s.scene, camera, options, {3}).colour.rgb, one.colour.rgb);
  for (const InstructionSet set : sets_of_this_machine()) {
    const InstructionSetOverride over(set);
    EXPECT_EQ(taken(s.scene, camera, options).colour.rgb, one.colour.rgb) << name_of(set);
  }
  // The image without glass differs.
  for (const VoxelType type : {s.glass, s.green}) {
    VoxelProperties opaque = s.scene.types[type];
    opaque.visibility = Visibility::Opaque;
    s.scene.types.replace(type, opaque);
  }
  EXPECT_GT(count_different(one, taken(s.scene, camera, options), 4), 500);
}

TEST(RenderFieldGlass, FollowsEditsAndTypes) {
  PondScene s;
  RenderOptions options = sized(64, 48);
  options.light.glass_surfaces = true;
  const Camera camera = towards({50, 60, 60}, {0, 0, 0});
  CpuRenderer kept(s.scene);
  RenderedImage last = taken(s.scene, camera, options);
  const auto expect_followed = [&](const char* what) {
    kept.update();
    const auto followed = kept.render(camera, options);
    ASSERT_TRUE(followed.has_value());
    const RenderedImage anew = taken(s.scene, camera, options);
    EXPECT_EQ(followed->colour.rgb, anew.colour.rgb) << what;
    EXPECT_GT(count_different(anew, last, 3), 20) << what;
    last = anew;
  };
  const auto repaint = [&](VoxelType from, VoxelType to) {
    s.scene.edit(s.grid).field.edit({{-70, -40, -70}, {70, 30, 70}}, [&](IVec3, DensitySample now) {
      if (now.material == from) now.material = to;
      return now;
    });
  };
  const auto replace = [&](VoxelType type, Visibility visibility) {
    VoxelProperties properties = s.scene.types[type];
    properties.visibility = visibility;
    s.scene.types.replace(type, properties);
  };
  s.scene.edit(s.grid).field.add_sphere({20, 4, -10}, 7.0, s.green);
  expect_followed("more glass");
  s.scene.edit(s.grid).field.remove_sphere({0, -2, 20}, 9.0);
  expect_followed("dug");
  repaint(s.glass, s.red);
  repaint(s.green, s.red);
  expect_followed("no glass in the field");
  repaint(s.red, s.green);
  expect_followed("painted transparent");
  replace(s.green, Visibility::Opaque);
  expect_followed("a type made opaque");
  replace(s.stone, Visibility::Transparent);
  expect_followed("the ground made transparent");
}

// Seen from inside a body of the field: tinted, without a visible surface.
TEST(RenderFieldGlass, SeenFromInsideTintsOnly) {
  GlassScene s;
  Grid floor;
  floor.fill_box({{-9, -1, -9}, {10, 0, 10}}, s.stone);
  place(s.scene, std::move(floor));
  DensityGrid sea;
  add_plate(sea, {-9, -2, -9}, {9, 10, 9}, s.glass);
  place_field(s.scene, std::move(sea));
  RenderOptions options = sized(3, 3);
  options.light.shading = Shading::Unlit;
  const RenderedImage image = taken(s.scene, from_above(0, 2.5, 0, 2), options);
  expect_near(pixel_at(image, 1, 1), encoded(linear(kWhite) * through(2.5F)), 1);
  EXPECT_EQ(depth_at(image, 1, 1), 0.0F);
}

// The opaque part comes from an impostor, the glass from rays; neither is halved.
TEST(RenderFieldGlass, StaysTransparentFromAfar) {
  PondScene s;
  RenderOptions options = sized(96, 72);
  const Camera camera = towards({170, 120, 190}, {0, 0, 0});
  const RenderedImage whole = taken(s.scene, camera, options);
  options.detail.policy.emplace().far_pixels = 0;
  options.detail.policy->cell_pixels = 3.0;
  EXPECT_EQ(taken(s.scene, camera, options).colour.rgb, whole.colour.rgb);
  options.detail.policy->far_pixels = 1000;
  const RenderedImage far = taken(s.scene, camera, options);
  EXPECT_NE(far.colour.rgb, whole.colour.rgb);
  EXPECT_LT(count_different(whole, far, 24), 250) << "edges";
  for (const VoxelType type : {s.glass, s.green}) {
    VoxelProperties opaque = s.scene.types[type];
    opaque.visibility = Visibility::Opaque;
    s.scene.types.replace(type, opaque);
  }
  EXPECT_GT(count_different(far, taken(s.scene, camera, options), 6), 60);
  options.detail.policy->far_pixels = 0;
  EXPECT_NE(taken(s.scene, camera, options).colour.rgb, whole.colour.rgb) << "without glass it is halved";
}

}  // namespace
}  // namespace quoin
