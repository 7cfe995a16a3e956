// Compares scenes of many kinds between the device and the CPU.

#include <cmath>
#include <numbers>
#include <random>

#include <glm/gtc/quaternion.hpp>

#include "render/cpu/environment_for_tests.h"
#include "render/vulkan/device/vulkan_for_tests.h"

namespace quoin {
namespace {

using render_test::add_type;
using render_test::from_above;
using render_test::pixel_at;
using render_test::place;
using render_test::sixth_ray_blocked;
using render_test::sized;
using render_test::towards;
using vulkan_test::expect_equal;

class VulkanScene : public vulkan_test::VulkanTest {
 protected:
  void compare(const Scene& scene, const Camera& camera, const RenderOptions& options, const std::string& name) {
    expect_equal(taken(scene, camera, options), render_test::taken(scene, camera, options), name);
  }
};

/// The types of a hut: two opaque types on a floor, a window of glass and a lamp.
struct Types {
  VoxelType wall, roof, glass, water, lamp;
};

Types add_types(Scene& scene) {
  return {add_type(scene, {200, 180, 150}), add_type(scene, {150, 40, 30}),
          add_type(scene, {120, 200, 230, 90}, Visibility::Transparent),
          add_type(scene, {30, 80, 160, 140}, Visibility::Transparent),
          add_type(scene, {255, 220, 120}, Visibility::Opaque, 3.0F)};
}

Grid hut(const Types& types, bool has_glass = true) {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {20, 1, 20}}, types.wall);
  grid.fill_box({{4, 1, 4}, {16, 9, 16}}, types.wall);
  grid.fill_box({{5, 1, 5}, {15, 9, 15}}, kAir);
  for (int i = 0; i < 5; ++i) grid.fill_box({{3 + i, 9 + i, 3 + i}, {17 - i, 10 + i, 17 - i}}, types.roof);
  grid.fill_box({{8, 3, 15}, {12, 7, 16}}, has_glass ? types.glass : kAir);
  grid.fill_box({{15, 3, 8}, {16, 7, 12}}, has_glass ? types.glass : kAir);
  grid.set({10, 1, 17}, types.lamp);
  if (has_glass) grid.fill_box({{0, 1, 17}, {5, 3, 20}}, types.water);
  return grid;
}

InstanceHandle add_instance(Scene& scene, GridHandle grid, DVec3 position, DQuat rotation, double size, bool mirrored) {
  Instance instance;
  instance.grid = grid;
  instance.position = position;
  instance.rotation = glm::normalize(rotation);
  instance.voxel_size = size;
  instance.mirrored = mirrored;
  return scene.add_instance(instance);
}

/// Rotated, mirrored, large and small huts; some touch or overlap others.
Scene village(DVec3 centre, bool has_glass) {
  Scene scene;
  const Types types = add_types(scene);
  SceneGrid placed;
  placed.grid = hut(types, has_glass);
  placed.pivot = {10, 0, 10};
  const GridHandle grid = scene.add_grid(std::move(placed));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 24; ++i) {
    const DVec3 position = centre + DVec3{40 * unit(random), 8 * unit(random), 40 * unit(random)};
    const DQuat rotation{unit(random), unit(random), unit(random), unit(random)};
    add_instance(scene, grid, position, rotation, std::exp(unit(random)), i % 3 == 0);
  }
  SceneGrid ground;
  ground.grid.fill_box({{-60, -13, -60}, {61, -9, 61}}, types.wall);
  place(scene, ground.grid.snapshot(), centre);
  return scene;
}

TEST_F(VulkanScene, TransformedInstancesMatchCpu) {
  const Scene scene = village(DVec3(0.0), false);
  compare(scene, towards({50, 40, 70}, {0, 0, 0}), sized(160, 120), "village");
}

TEST_F(VulkanScene, ManyInstancesMatchCpu) {
  Scene scene;
  const Types types = add_types(scene);
  SceneGrid small;
  small.grid.fill_sphere({0, 0, 0}, 3, types.roof);
  small.grid.fill_box({{-1, 3, -1}, {2, 5, 2}}, types.glass);
  const GridHandle grid = scene.add_grid(std::move(small));
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 900; ++i) {
    const DVec3 position{70 * unit(random), 12 * unit(random), 70 * unit(random)};
    add_instance(scene, grid, position, {unit(random), unit(random), unit(random), unit(random)}, 0.6, i % 2 == 0);
  }
  compare(scene, towards({60, 30, 70}, {0, 0, 0}), sized(96, 72), "many");
  // Along the axes, where direction components are 0.
  compare(scene, from_above(0.3, 60, -0.7, 80), sized(64, 64), "many_from_above");
}

TEST_F(VulkanScene, GlassOfTurnedInstancesMatchesCpu) {
  const Scene scene = village(DVec3(0.0), true);
  compare(scene, towards({-40, 30, 60}, {0, 0, 0}), sized(128, 96), "glass_village");
}

TEST_F(VulkanScene, GlassSurfacesMatchCpu) {
  RenderOptions options = sized(128, 96);
  options.light.glass_surfaces = true;
  environment_in(options).sky.model = SkyModel::Gradient;
  Scene scene = village(DVec3(0.0), true);
  compare(scene, towards({-40, 30, 60}, {0, 0, 0}), options, "surfaces_village");
  const DVec3 far{1e9 + 0.25, -1e9 - 0.5, 1e9};
  compare(village(far, true), towards(far + DVec3(50, 40, 70), far), options, "surfaces_far");
  Camera slanted = towards({300, 260, 400}, {0, 0, 0});
  slanted.projection = Camera::Projection::Orthographic;
  slanted.view_height = 110;
  compare(scene, slanted, options, "surfaces_slanted");
}

// Bodies that touch bodies of another index, in air, on stone of their own grid and of another grid.
TEST_F(VulkanScene, TouchingGlassSurfacesMatchCpu) {
  Scene scene;
  const Types types = add_types(scene);
  VoxelProperties water = scene.types[types.water];
  water.ior = 1.33F;
  scene.types.replace(types.water, water);
  Grid ground;
  ground.fill_box({{-30, -1, -30}, {31, 0, 31}}, types.wall);
  ground.fill_box({{-12, 0, -12}, {13, 3, 13}}, types.water);
  ground.fill_box({{-3, 0, -3}, {4, 7, 4}}, types.glass);
  place(scene, std::move(ground));
  SceneGrid cube;
  cube.grid.fill_box({{0, 0, 0}, {6, 6, 6}}, types.glass);
  const GridHandle grid = scene.add_grid(std::move(cube));
  add_instance(scene, grid, {16.0, 0.0, 4.0}, DQuat(1.0, 0.0, 0.0, 0.0), 1.0, false);
  add_instance(scene, grid, {-20.0, 3.0, 8.0}, DQuat(0.9, 0.1, 0.3, 0.2), 0.8, false);
  add_instance(scene, grid, {3.0, 2.5, 7.0}, DQuat(0.9, 0.0, 0.3, 0.0), 0.7, true);
  RenderOptions options = sized(128, 96);
  options.light.glass_surfaces = true;
  compare(scene, towards({30, 20, 45}, {0, 2, 3}), options, "surfaces_touching");
  compare(scene, towards({1, 1.5, 11}, {-2, 3, -4}, 1.4), options, "surfaces_from_inside");
}

TEST_F(VulkanScene, MatchesCpuFarFromOrigin) {
  const DVec3 far{1e9 + 0.25, -1e9 - 0.5, 1e9};
  const Scene scene = village(far, true);
  compare(scene, towards(far + DVec3(50, 40, 70), far), sized(96, 72), "far_village");
}

TEST_F(VulkanScene, MatchesCpuThroughLongLens) {
  const Scene scene = village(DVec3(0.0), true);
  compare(scene, towards({4e5, 3e5, 6e5}, {0, 0, 0}, 1.3e-4), sized(96, 72), "long_lens");
}

TEST_F(VulkanScene, MatchesCpuInOrthographicImages) {
  const Scene scene = village(DVec3(0.0), true);
  compare(scene, from_above(3.3, 60, -2.7, 90), sized(96, 96), "orthographic");
  Camera slanted = towards({300, 260, 400}, {0, 0, 0});
  slanted.projection = Camera::Projection::Orthographic;
  slanted.view_height = 110;
  compare(scene, slanted, sized(128, 96), "slanted");
  slanted.position *= 100.0;
  compare(scene, slanted, sized(96, 72), "slanted_from_afar");
}

TEST_F(VulkanScene, MatchesCpuForEveryLightOption) {
  Scene scene;
  place(scene, hut(add_types(scene)));
  const Camera camera = towards({34, 26, 46}, {9, 5, 9});
  const auto with = [&](const char* name, const std::function<void(RenderOptions&)>& change) {
    RenderOptions options = sized(96, 72);
    change(options);
    compare(scene, camera, options, name);
  };
  with("vertex", [](RenderOptions& o) { o.light.occlusion_mode = OcclusionMode::Vertex; });
  with("vertex_all", [](RenderOptions& o) {
    o.light.occlusion_mode = OcclusionMode::Vertex;
    o.light.occlusion_affects = OcclusionAffects::All;
  });
  with("no_occlusion", [](RenderOptions& o) { o.light.occlusion_mode = OcclusionMode::Off; });
  with("no_shadows", [](RenderOptions& o) { o.light.shadows = false; });
  with("unlit", [](RenderOptions& o) { o.light.shading = Shading::Unlit; });
  with("all_rays", [](RenderOptions& o) { o.light.occlusion_affects = OcclusionAffects::All; });
  with("six_rays", [](RenderOptions& o) { o.light.occlusion_rays = 6; });
  with("hashed_rays", [](RenderOptions& o) { o.light.occlusion_rays = 13; });
  with("samples", [](RenderOptions& o) { o.samples = 4; });
  with("hashed_samples", [](RenderOptions& o) {
    o.samples = 3;
    o.light.occlusion_rays = 5;
  });
  with("short_shadows", [](RenderOptions& o) { o.light.shadow_distance_voxels = 3.0; });
  with("low_sun", [](RenderOptions& o) { environment_in(o).sun.direction = {1e-30, 0.3e-30, 1e-30}; });
  with("exposed", [](RenderOptions& o) { environment_in(o).exposure = 2.5; });
  with("many_tiles", [](RenderOptions& o) {
    o.width = 530;
    o.height = 20;
    o.light.shading = Shading::Unlit;
  });
  with("colours", [](RenderOptions& o) { o.detail.colours = true; });
}

TEST_F(VulkanScene, TypesThatDoNotOccludeMatchCpu) {
  Scene scene;
  const Types types = add_types(scene);
  place(scene, hut(types));
  const Camera camera = towards({34, 26, 46}, {9, 5, 9});
  RenderOptions options = sized(96, 72);
  options.light.shading = Shading::UnlitWithOcclusion;
  options.light.occlusion_mode = OcclusionMode::Vertex;
  const Image dark = taken(scene, camera, options).colour;
  // The renderer follows the types.
  for (const VoxelType type : {types.wall, types.roof}) {
    VoxelProperties properties = scene.types[type];
    properties.occludes = false;
    scene.types.replace(type, properties);
    compare(scene, camera, options, "unoccluding_" + std::to_string(type));
  }
  EXPECT_NE(taken(scene, camera, options).colour.rgb, dark.rgb);
  options.light.shading = Shading::Lit;
  compare(scene, camera, options, "unoccluding_lit");
}

TEST_F(VulkanScene, MatchesCpuForEveryShading) {
  Scene scene;
  scene.edit(place(scene, hut(add_types(scene)))).rotation = glm::angleAxis(0.4, glm::normalize(DVec3(1, 3, 2)));
  const Camera camera = towards({34, 26, 46}, {9, 5, 9});
  RenderOptions options = sized(96, 72);
  for (const Shading shading : {Shading::UnlitWithOcclusion, Shading::Occlusion, Shading::Normals}) {
    for (const OcclusionMode mode : {OcclusionMode::Rays, OcclusionMode::Vertex, OcclusionMode::Off}) {
      options.light.shading = shading;
      options.light.occlusion_mode = mode;
      options.samples = mode == OcclusionMode::Rays ? 3 : 1;
      compare(scene, camera, options,
              "shading_" + std::to_string(static_cast<int>(shading)) + "_" + std::to_string(static_cast<int>(mode)));
    }
  }
}

TEST_F(VulkanScene, SixthOcclusionRayMatchesReference) {
  for (const Direction face : kDirections) {
    Scene scene;
    const Camera camera = sixth_ray_blocked(scene, face);
    RenderOptions options = sized(1, 1);
    options.light.occlusion_rays = 6;
    options.light.shading = Shading::Occlusion;
    EXPECT_NEAR(pixel_at(taken(scene, camera, options), 0, 0)[0], 255.0 * 5 / 6, 0.51) << static_cast<int>(face);
  }
}

TEST_F(VulkanScene, MatchesCpuFromInsideGlassAndStone) {
  Scene scene;
  const Types types = add_types(scene);
  Grid grid;
  const VoxelType clear = add_type(scene, {60, 140, 220, 9}, Visibility::Transparent);
  grid.fill_box({{0, 0, 0}, {31, 31, 31}}, clear);
  grid.fill_box({{0, 0, 0}, {31, 4, 31}}, types.wall);
  grid.fill_sphere({20, 8, 20}, 5, types.roof);
  grid.fill_box({{8, 4, 24}, {13, 13, 27}}, types.glass);
  place(scene, std::move(grid));
  compare(scene, towards({4.3, 15.2, 5.1}, {20, 8, 20}), sized(96, 72), "under_water");
  compare(scene, towards({10.4, 8.3, 25.6}, {20, 8, 20}), sized(96, 72), "in_glass");
  compare(scene, towards({20.4, 8.3, 20.6}, {2, 8, 2}), sized(32, 24), "in_stone");
}

TEST_F(VulkanScene, ManyPanesMatchCpu) {
  Scene scene;
  const Types types = add_types(scene);
  const VoxelType clear = add_type(scene, {250, 230, 240, 12}, Visibility::Transparent);
  const VoxelType other = add_type(scene, {200, 250, 210, 20}, Visibility::Transparent);
  Grid grid;
  grid.fill_box({{0, 0, 0}, {81, 1, 21}}, types.wall);
  grid.fill_box({{0, 0, 0}, {1, 21, 21}}, types.roof);
  for (int x = 4; x < 78; x += 2) grid.fill_box({{x, 1, 2}, {x + 1, 15, 19}}, x % 4 == 0 ? clear : other);
  place(scene, std::move(grid));
  // A second grid whose panes touch the first grid's panes.
  Grid adjacent;
  for (int x = 4; x < 40; x += 2) adjacent.fill_box({{x + 1, 1, 2}, {x + 2, 8, 19}}, x % 4 == 0 ? clear : other);
  place(scene, std::move(adjacent));
  RenderOptions options = sized(96, 72);
  environment_in(options).sun.direction = {1.0, 0.25, 0.1};
  compare(scene, towards({95, 9, 12}, {0, 7, 10}), options, "panes");
  options.light.glass_surfaces = true;
  compare(scene, towards({95, 9, 12}, {0, 7, 10}), options, "mirroring_panes");
}

TEST_F(VulkanScene, LongRayThroughOneGridMatchesCpu) {
  Scene scene;
  const Types types = add_types(scene);
  Grid grid;
  grid.fill_box({{0, 0, 0}, {16, 1, 16}}, types.wall);
  for (int i = 0; i < 12; ++i) {
    grid.fill_box({{20'000 + i, 0, 2 * i}, {20'000 + i + 1, 2 + i, 2 * i + 4}}, i % 2 != 0 ? types.roof : types.wall);
  }
  place(scene, std::move(grid));
  compare(scene, towards({3.2, 6.1, 7.7}, {20'000, 6, 15}, 2e-3), sized(96, 72), "corridor");
}

TEST_F(VulkanScene, EmptySceneShowsSky) {
  const Scene scene;
  compare(scene, towards({0, 0, 0}, {1, 0.2, 0}, 2.0), sized(64, 48), "sky");
  compare(scene, from_above(0, 10, 0, 20), sized(64, 48), "ground");
}

TEST_F(VulkanScene, RandomScenesMatchCpu) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    Scene scene;
    const Types types = add_types(scene);
    const VoxelType kinds[] = {types.wall, types.roof, types.glass, types.water, types.lamp};
    for (int i = 0; i < 3; ++i) {
      SceneGrid grid;
      for (int j = 0; j < 30; ++j) {
        grid.grid.fill_sphere(DVec3(unit(random), unit(random), unit(random)) * 50.0, 3 + 8 * std::abs(unit(random)),
                              kinds[random() % 5]);
      }
      const GridHandle handle = scene.add_grid(std::move(grid));
      add_instance(scene, handle, DVec3(unit(random), unit(random), unit(random)) * 60.0,
                   {unit(random), unit(random), unit(random), unit(random)}, 1.0 + 0.5 * unit(random), random() % 2);
    }
    const DVec3 eye = DVec3(unit(random), unit(random), unit(random)) * 110.0;
    RenderOptions options = sized(96, 64);
    options.light.occlusion_rays = seed % 2 == 0 ? 9 : 4;
    compare(scene, towards(eye, {0, 0, 0}), options, "random_" + std::to_string(seed));
  }
}

// Returns a hut at night with lamps of every kind.
Scene lit_by_night(DVec3 origin) {
  Scene scene;
  const Types types = add_types(scene);
  const VoxelType torch = add_type(scene, {255, 150, 60, 255}, Visibility::Opaque, 6.0F);
  const VoxelType neon = add_type(scene, {80, 220, 255, 90}, Visibility::Transparent, 3.0F);
  Grid grid = hut(types);
  grid.fill_box({{-30, -1, -30}, {50, 0, 50}}, types.wall);
  for (const IVec3 at : {IVec3{-6, 3, 4}, {22, 5, 9}, {9, 12, 24}, {9, 4, 30}}) grid.set(at, torch);
  grid.fill_box({{-9, 0, 14}, {-8, 6, 17}}, neon);
  const InstanceHandle first = place(scene, std::move(grid), origin);
  scene.edit(first).rotation = glm::angleAxis(0.3, glm::normalize(DVec3(0, 3, 1)));
  Instance other = scene.instances()[first];
  other.position += DVec3(70, 4, 10);
  other.voxel_size = 0.5;
  other.mirrored = true;
  scene.add_instance(other);
  Lamp lamp;
  lamp.position = origin + DVec3(30, 14, 20);
  lamp.colour = {0.4F, 0.5F, 1.0F};
  lamp.intensity = 60.0;
  scene.lamps.push_back(lamp);
  lamp.kind = Lamp::Kind::Spot;
  lamp.position = origin + DVec3(-20, 25, 35);
  lamp.direction = {1.0, -1.0, -0.8};
  lamp.colour = Vec3(1.0F);
  lamp.intensity = 300.0;
  lamp.inner_angle_radians = 0.1;
  lamp.outer_angle_radians = 0.45;
  scene.lamps.push_back(lamp);
  return scene;
}

TEST_F(VulkanScene, LampsOfEveryKindMatchCpu) {
  RenderOptions options = sized(96, 72);
  options.light.max_lamps = 64;
  environment_in(options).sun.brightness = 0.0;
  environment_in(options).sky.brightness = 0.05;
  const Scene scene = lit_by_night({0, 0, 0});
  const Camera camera = towards({50, 36, 76}, {12, 3, 9}, 1.0);
  compare(scene, camera, options, "lamps");
  options.light.max_lamps = 2;
  compare(scene, camera, options, "two_lamps");
  options.light.shadows = false;
  compare(scene, camera, options, "lamps_without_shadows");
  options.light = {};
  options.light.max_lamps = 16;
  options.light.occlusion_affects = OcclusionAffects::All;
  options.samples = 2;
  compare(scene, camera, options, "lamps_by_day");
  const DVec3 far{1e9, -1e9, 1e9};
  environment_in(options).sun.brightness = 0.2;
  compare(lit_by_night(far), towards(far + DVec3(50, 36, 76), far + DVec3(12, 3, 9), 1.0), options, "lamps_far");
}

TEST_F(VulkanScene, SkiesFollowingSunMatchCpu) {
  Scene scene;
  const Types types = add_types(scene);
  place(scene, hut(types));
  const Camera camera = towards({-20, 22, 40}, {10, 5, 10}, 0.9);
  RenderOptions options = sized(96, 72);
  options.samples = 4;
  options.light = natural_light();
  options.environment = Environment::natural();
  int hour = 0;
  for (const double height : {1.0, 0.1, 0.0, -0.08, -0.5}) {
    environment_in(options).sun.direction = {-0.8, height, 0.6};
    compare(scene, camera, options, "hour_" + std::to_string(hour++));
  }
}

// The scene itself may be gone by then.
TEST_F(VulkanScene, DrawsEnvironmentOfUpdatedScene) {
  Scene scene;
  place(scene, hut(add_types(scene)));
  scene.environment = Environment::natural({-0.8, 0.1, 0.6});
  scene.environment->sun.colour = {1.0F, 0.5F, 0.25F};
  scene.environment->exposure = 1.5;
  const Camera camera = towards({-20, 22, 40}, {10, 5, 10}, 0.9);
  const RenderOptions options = sized(96, 72);
  compare(scene, camera, options, "environment_of_scene");
  const RenderedImage wanted = taken_as_is(camera, options);
  {
    const Scene copy = scene.snapshot();
    ASSERT_TRUE(renderer_->update(copy));
  }
  EXPECT_EQ(taken_as_is(camera, options).colour.rgb, wanted.colour.rgb);
  scene.environment.reset();
  ASSERT_TRUE(renderer_->update(scene));
  EXPECT_NE(taken_as_is(camera, options).colour.rgb, wanted.colour.rgb);
}

}  // namespace
}  // namespace quoin
