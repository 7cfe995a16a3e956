// Levels of detail and impostors in rasterised images.

#include <algorithm>
#include <array>
#include <random>
#include <set>

#include "core/work/nightly_for_tests.h"
#include "render/cpu/environment_for_tests.h"
#include "render/impostor/impostor_test_support.h"
#include "render/vulkan/march/vulkan_detail_support.h"
#include "render/vulkan/raster/mesh_for_tests.h"

namespace quoin {
namespace {

using render_test::add_type;
using render_test::sized;
using render_test::towards;
using vulkan_test::add_blobs;
using vulkan_test::add_crowd;
using vulkan_test::blocky_surfaces;
using vulkan_test::bytes_that_differ;
using vulkan_test::in_detail;
using vulkan_test::mesh_options;
using vulkan_test::of_day;
using vulkan_test::with_mesh_light;

class VulkanMeshDetail : public vulkan_test::VulkanMeshTest {
 protected:
  // Makes all types opaque: other tests cover glass.
  void make_opaque() {
    for (std::size_t type = 1; type < scene_.types.size(); ++type) {
      VoxelProperties properties = scene_.types[static_cast<VoxelType>(type)];
      properties.visibility = Visibility::Opaque;
      scene_.types.replace(static_cast<VoxelType>(type), properties);
    }
  }
  // With merged quads, the meshes of these scenes have fewer quads than the impostors have faces.
  void compare_all(const Camera& camera, const RenderOptions& options, const std::string& name, bool merge = false) {
    const RenderOptions lit = with_mesh_light(options);
    meshes_->clear();
    put(scene_, blocky_surfaces(scene_, merge));
    expect_like(drawn(camera, mesh_options(lit)), render_test::taken(scene_, camera, lit), name);
  }
  std::int64_t triangles_of(const Camera& camera, const RenderOptions& options) {
    (void)drawn(camera, mesh_options(options));
    return meshes_->stats().drawn_triangles;
  }

  Scene scene_;
};

RenderOptions always(Detail detail, double cell_pixels) {
  RenderOptions options = sized(256, 192);
  options.detail.policy.emplace().rule = DetailPolicy::Rule::ByRadius;
  options.detail.policy->near_radii = 0.0;
  options.detail.policy->mid_radii = detail == Detail::Mid ? 1e9 : 0.0;
  options.detail.policy->cell_pixels = cell_pixels;
  return options;
}

TEST_F(VulkanMeshDetail, HalvedGridsMatchCpu) {
  add_crowd(scene_, {add_blobs(scene_, 31), add_blobs(scene_, 32)}, cases(3, 4), 260.0);
  make_opaque();
  const Camera camera = towards({-300, 420, -500}, {400, 0, 400}, 0.7);
  std::int64_t last = 0;
  for (const double pixels : {0.4, 2.0, 6.0}) {
    RenderOptions options = of_day(always(Detail::Mid, pixels));
    compare_all(camera, options, "mesh_mid_" + std::to_string(static_cast<int>(10 * pixels)));
    options.light.shadows = false;
    compare_all(camera, options, "mesh_mid_plain_" + std::to_string(static_cast<int>(10 * pixels)));
    const std::int64_t triangles = triangles_of(camera, with_mesh_light(options));
    EXPECT_NE(triangles, last);
    last = triangles;
  }
}

TEST_F(VulkanMeshDetail, ImpostorsMatchCpu) {
  add_crowd(scene_, {add_blobs(scene_, 31), add_blobs(scene_, 32)}, cases(3, 6), 260.0);
  make_opaque();
  const Camera camera = towards({-900, 1420, -1500}, {700, 0, 700}, 0.6);
  const RenderOptions options = of_day(in_detail(320, 240, 128));
  compare_all(camera, options, "mesh_far");
  const std::int64_t with = triangles_of(camera, with_mesh_light(options));
  // With impostor faces as small as pixels, every pixel lies near a face edge.
  const Camera telephoto = towards({-9000, 14200, -15000}, {700, 0, 700}, 0.06);
  const RenderOptions lit = with_mesh_light(options);
  expect_like(drawn(telephoto, mesh_options(lit)), render_test::taken(scene_, telephoto, lit), "mesh_far_telephoto", 2);
  Camera above = render_test::from_above(700, 4000, 700, 2000);
  compare_all(above, options, "mesh_far_above");
  RenderOptions whole = options;
  whole.detail.policy.reset();
  EXPECT_GT(with, 0);
  EXPECT_LT(with, triangles_of(camera, with_mesh_light(whole)));
  // The merged mesh is simpler than its impostor.
  compare_all(camera, options, "mesh_far_merged", true);
  EXPECT_LT(triangles_of(camera, with_mesh_light(options)), with);
}

// A hole is a sky pixel that the traced model covers completely, together with its neighbours.
TEST_F(VulkanMeshDetail, SmallImpostorsHaveNoHoles) {
  using render_test::Model;
  for (const Model model : {Model::Ball, Model::Castle, Model::Terrain, Model::Comb}) {
    render_test::ImpostorWorld world(model);
    for (VoxelType type = 1; type < world.scene.types.size(); ++type) {
      VoxelProperties white;
      white.colour = {255, 255, 255, 255};
      world.scene.types.replace(type, white);
    }
    meshes_->clear();
    put(world.scene, blocky_surfaces(world.scene, false));
    const CpuRenderer traced(world.scene);
    int inside = 0;
    int holes = 0;
    for (const int pixels : {64, 42, 32, 21, 16, 11}) {
      const int size = pixels + 8;
      const Camera camera = render_test::orbiting(world, 0.7 + pixels, 0.4, 0.1 * pixels, pixels, size);
      RenderOptions options = sized(size, size);
      options.light.shading = Shading::Unlit;
      environment_in(options).sky.brightness = 0.0;
      options.samples = 64;
      const auto truth = traced.render(camera, options);
      ASSERT_TRUE(truth.has_value());
      options.detail = always(Detail::Far, 0.4).detail;
      options.samples = 1;
      const Image image = drawn(camera, mesh_options(options));
      for (int i = 0; i < (size - 2) * (size - 2); ++i) {
        const int x = 1 + i % (size - 2);
        const int y = 1 + i / (size - 2);
        float least = 255.0F;
        for (int k = 0; k < 9; ++k) {
          least = std::min(least, vulkan_test::byte_at(truth->colour, x - 1 + k % 3, y - 1 + k / 3).x);
        }
        if (least < 255.0F) continue;
        ++inside;
        holes += vulkan_test::byte_at(image, x, y).x < 128.0F;
      }
    }
    EXPECT_GT(inside, 300);
    EXPECT_LE(holes * 2000, inside) << static_cast<int>(model) << ": " << holes << " of " << inside;
  }
}

TEST_F(VulkanMeshDetail, AllDetailsInOneImageMatchCpu) {
  add_crowd(scene_, {add_blobs(scene_, 31), add_blobs(scene_, 32)}, cases(5, 8), 260.0);
  make_opaque();
  RenderOptions options = in_detail(480, 270, 60);
  options.detail.policy->voxel_pixels = 0.7;
  options = of_day(options);
  const Camera camera = towards({-120, 260, -220}, {900, -100, 900}, 1.0);
  std::vector<SelectedInstance> selected;
  DetailSelector().select(scene_, camera, options.width, options.height, *options.detail.policy, selected);
  std::array<int, 3> count{};
  for (const SelectedInstance& each : selected) ++count.at(static_cast<std::size_t>(each.detail));
  for (const int each : count) EXPECT_GT(each, 0);
  compare_all(camera, options, "mesh_all_details");
  options.detail.colours = true;
  compare_all(camera, options, "mesh_detail_colours");
}

TEST_F(VulkanMeshDetail, EditsShowInEveryDetail) {
  add_crowd(scene_, {add_blobs(scene_, 31)}, 3, 260.0);
  make_opaque();
  const Camera camera = towards({-300, 420, -500}, {260, 0, 260}, 0.7);
  const GridHandle handle = scene_.instances()[scene_.instances().handles().front()].grid;
  std::mt19937 random(5);
  for (int i = 0; i < cases(2, 4); ++i) {
    const IVec3 at = 16 * IVec3(static_cast<int>(random() % 8) - 4, static_cast<int>(random() % 8) - 4,
                                static_cast<int>(random() % 8) - 4);
    scene_.edit(handle).grid.fill_box({at, at + 32}, i % 2 == 0 ? VoxelType{2} : kAir);
    put(scene_, blocky_surfaces(scene_, false));
    for (const Detail detail : {Detail::Mid, Detail::Far}) {
      const RenderOptions options = with_mesh_light(of_day(always(detail, 2.0)));
      expect_like(drawn(camera, mesh_options(options)), render_test::taken(scene_, camera, options), "mesh_edited");
    }
  }
}

// Without waiting, grids without an impostor are drawn halved, and all grids are drawn.
TEST_F(VulkanMeshDetail, DrawsGridsWithoutImpostorHalved) {
  add_crowd(scene_, {add_blobs(scene_, 31), add_blobs(scene_, 32)}, 3, 260.0);
  make_opaque();
  put(scene_, blocky_surfaces(scene_, false));
  const Camera camera = towards({-300, 420, -500}, {260, 0, 260}, 0.7);
  RenderOptions options = with_mesh_light(of_day(always(Detail::Far, 2.0)));
  options.detail.impostor_seconds = 0.0;
  const Image first = drawn(camera, mesh_options(options));
  options.detail.impostor_seconds = std::numeric_limits<double>::infinity();
  expect_like(drawn(camera, mesh_options(options)), render_test::taken(scene_, camera, options), "mesh_waited");
  const Image last = drawn(camera, mesh_options(options));
  const int different = bytes_that_differ(first, last, 60);
  EXPECT_LE(different * 20, static_cast<int>(first.rgb.size()));
}

// Smooth meshes have smooth halved meshes.
TEST_F(VulkanMeshDetail, SmoothMeshesStaySmooth) {
  const VoxelType stone = add_type(scene_, {200, 190, 170});
  SceneGrid ball;
  ball.grid.fill_sphere({0.0, 0.0, 0.0}, 40.0, stone);
  scene_.add_instance({"", scene_.add_grid(std::move(ball))});
  put(scene_, vulkan_test::live_surfaces(scene_, SurfaceStyle::Smooth));
  const Camera camera = towards({0, 60, 200}, {0, 0, 0}, 0.6);
  RenderOptions options = with_mesh_light(always(Detail::Mid, 1.0));
  options.light.shading = Shading::Normals;
  const Image halved = drawn(camera, mesh_options(options));
  const std::int64_t triangles = meshes_->stats().drawn_triangles;
  options.detail.policy.reset();
  const Image whole = drawn(camera, mesh_options(options));
  EXPECT_LT(triangles * 2, meshes_->stats().drawn_triangles);
  const int different = bytes_that_differ(halved, whole, 40);
  EXPECT_LE(different * 50, static_cast<int>(halved.rgb.size()));
}

// Fields are drawn from meshes of their halved samples, together with the halved blocks of the same grid; distant
// fields from their full meshes.
TEST_F(VulkanMeshDetail, HalvesFields) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  const VoxelType stone = add_type(scene_, {200, 190, 170});
  const VoxelType brick = add_type(scene_, {190, 90, 70});
  SceneGrid hill;
  hill.field.add_sphere({0.0, -20.0, 0.0}, 60.0, stone);
  hill.field.remove_sphere({30.0, 30.0, 20.0}, 22.0);
  hill.grid.fill_box({{-16, 30, -16}, {16, 70, 16}}, brick);
  const GridHandle grid = scene_.add_grid(std::move(hill));
  scene_.add_instance({"", grid});
  const Camera camera = towards({0, 120, 300}, {0, 0, 0}, 0.6);
  const auto shown = [&](const RenderOptions& options, std::int64_t& triangles) {
    Image image = drawn(camera, mesh_options(options));
    triangles = meshes_->stats().drawn_triangles;
    return image;
  };
  for (int round = 0; round < 2; ++round) {
    put(scene_, vulkan_test::live_surfaces(scene_, SurfaceStyle::Blocky));
    RenderOptions options = with_mesh_light(of_day(always(Detail::Mid, 1.0)));
    options.light.shading = Shading::Normals;
    std::int64_t halved = 0;
    std::int64_t whole = 0;
    std::int64_t far = 0;
    const Image coarse = shown(options, halved);
    const Image distant = shown(
        [&] {
          RenderOptions of_far = options;
          of_far.detail.policy = of_day(always(Detail::Far, 1.0)).detail.policy;
          return of_far;
        }(),
        far);
    options.detail.policy.reset();
    const Image fine = shown(options, whole);
    EXPECT_LT(halved * 2, whole);
    EXPECT_EQ(far, whole);
    EXPECT_EQ(bytes_that_differ(distant, fine, 8), 0);
    EXPECT_LE(bytes_that_differ(coarse, fine, 40) * 30, static_cast<int>(fine.rgb.size()));
    EXPECT_GT(bytes_that_differ(coarse, fine, 2), 0);
    // Includes the shadows of the halved field.
    RenderOptions lit = with_mesh_light(of_day(always(Detail::Mid, 1.0)));
    std::int64_t triangles = 0;
    const Image shaded = shown(lit, triangles);
    lit.detail.policy.reset();
    EXPECT_LE(bytes_that_differ(shaded, shown(lit, triangles), 60) * 20, static_cast<int>(shaded.rgb.size()));
    // Edits reach the levels.
    scene_.edit(grid).field.add_sphere({-50.0, 30.0, 10.0}, 20.0, brick);
  }
}

// A view's hysteresis prevents flicker near a threshold.
TEST_F(VulkanMeshDetail, ViewIsStableNearThreshold) {
  add_crowd(scene_, {add_blobs(scene_, 31)}, 1, 260.0);
  make_opaque();
  put(scene_, blocky_surfaces(scene_));
  RenderOptions options = with_mesh_light(sized(128, 96));
  options.detail.policy.emplace().rule = DetailPolicy::Rule::ByRadius;
  options.detail.policy->near_radii = 5.0;
  options.detail.policy->mid_radii = 1e9;
  DetailSelector selector;
  options.detail.selector = &selector;
  options.detail.colours = true;
  std::set<std::int64_t> triangles;
  for (int i = 0; i < 6; ++i) {
    std::vector<SelectedInstance> selected;
    DetailSelector without;
    // The switching distance without hysteresis, found by bisection.
    double near = 10.0;
    double far = 10'000.0;
    for (int step = 0; step < 50; ++step) {
      const double middle = 0.5 * (near + far);
      without.select(scene_, towards({middle, 0, 0}, {0, 0, 0}), 128, 96, *options.detail.policy, selected);
      (selected.empty() || selected.front().detail != Detail::Near ? far : near) = middle;
      without = DetailSelector();
    }
    const double at = near * (i % 2 == 0 ? 0.995 : 1.005);
    triangles.insert(triangles_of(towards({at, 0, 0}, {0, 0, 0}), options));
  }
  EXPECT_EQ(triangles.size(), 1U);
}

}  // namespace
}  // namespace quoin
