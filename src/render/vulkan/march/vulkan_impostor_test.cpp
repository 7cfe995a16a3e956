#ifdef QUOIN_HAVE_VULKAN

// Compares impostors between the device and the CPU.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "core/work/nightly_for_tests.h"
#include "render/impostor/impostor_test_support.h"
#include "render/vulkan/march/vulkan_detail_support.h"

namespace quoin {
namespace {

using render_test::from_above;
using render_test::ImpostorWorld;
using render_test::Model;
using render_test::orbiting;
using render_test::sized;
using render_test::towards;
using vulkan_test::add_blobs;
using vulkan_test::add_crowd;
using vulkan_test::expect_equal;
using vulkan_test::in_detail;

class VulkanImpostors : public vulkan_test::VulkanDetailTest {
 protected:
  // Adds instances of one model on a floor.
  void add_model(Model model) {
    ImpostorWorld world(model);
    scene_ = std::move(world.scene);
    SceneGrid slab;
    slab.grid.fill_box({{-300, 0, -300}, {301, 1, 301}}, 2);
    Instance ground;
    ground.grid = scene_.add_grid(std::move(slab));
    ground.position = {0, -1.2 * world.radius, 0};
    scene_.add_instance(ground);
  }
  static RenderOptions far_options(int size) { return in_detail(size, size, 128); }
};

TEST_F(VulkanImpostors, MatchCpuFromAllSides) {
  std::vector<Model> models = {Model::Castle, Model::Comb, Model::SmoothHills, Model::Village};
  if (is_nightly()) models.insert(models.end(), {Model::Ball, Model::Ship, Model::Blobs, Model::SmoothBall});
  for (std::size_t i = 0; i < models.size(); ++i) {
    const Model model = models[i];
    add_model(model);
    const ImpostorWorld world(model);
    const std::string name = "far_" + std::to_string(static_cast<int>(model)) + "_";
    // The views cover every level of the snapshots. By day, a model shows every other level, in images that are not
    // much larger than the model.
    const std::array sizes{110, 60, 25, 12, 5};
    for (std::size_t view = is_nightly() ? 0 : i % 2; view < sizes.size(); view += is_nightly() ? 1 : 2) {
      const auto step = static_cast<double>(view);
      const int edge = cases(std::max(sizes.at(view) + 18, 64), 128);
      const Camera camera = orbiting(world, 0.7 + step, 0.6 - 0.2 * step, 0.3 * step, sizes.at(view), edge);
      const RenderOptions options = far_options(edge);
      expect_equal(taken(scene_, camera, options), render_test::taken(scene_, camera, options),
                   name + std::to_string(view));
    }
    EXPECT_GT(impostor_bytes(), 0U);
  }
}

TEST_F(VulkanImpostors, MatchCpuInAllLight) {
  for (const Model model : {Model::Castle, Model::Village}) {
    add_model(model);
    const ImpostorWorld world(model);
    const Camera camera = orbiting(world, 0.7, 0.6, 0.2, 100.0, 148);
    const auto with = [&](const std::string& name, auto&& change) {
      RenderOptions options = far_options(148);
      change(options);
      compare(camera, options, "far_" + name);
    };
    with("vertex", [](RenderOptions& o) { o.light.occlusion_mode = OcclusionMode::Vertex; });
    with("without", [](RenderOptions& o) { o.light.occlusion_mode = OcclusionMode::Off; });
    with("all", [](RenderOptions& o) { o.light.occlusion_affects = OcclusionAffects::All; });
    with("spread", [](RenderOptions& o) { o.light.occlusion_rays = 5; });
    with("unlit", [](RenderOptions& o) { o.light.shading = Shading::Unlit; });
    with("no_shadows", [](RenderOptions& o) { o.light.shadows = false; });
    with("samples", [](RenderOptions& o) { o.samples = 5; });
    with("colours", [](RenderOptions& o) { o.detail.colours = true; });
    const RenderedImage far = taken_as_is(camera, far_options(148));
    EXPECT_NE(far.colour.rgb, taken_as_is(camera, sized(148, 148)).colour.rgb) << "occlusion is that of whole faces";
  }
}

TEST_F(VulkanImpostors, MatchCpuAmongAllDetails) {
  add_crowd(scene_, {add_blobs(scene_, 31, 12), add_blobs(scene_, 32, 12)}, 6, 320.0);
  Camera camera = towards({-150, 160, -150}, {900, -60, 900}, 0.7);
  // More than one tile, with Near, Mid and Far instances.
  RenderOptions options = in_detail(320, 200, 128);
  compare(camera, options, "crowd");
  options.detail.colours = true;
  compare(camera, options, "crowd_colours");
  options.samples = 2;
  compare(camera, options, "crowd_samples");
  camera.projection = Camera::Projection::Orthographic;
  camera.view_height = 2000.0;
  compare(camera, options, "crowd_orthographic");
  EXPECT_GT(impostor_bytes(), 0U);
}

// Frames wait neither for the build of an impostor nor for its whole upload.
TEST_F(VulkanImpostors, FramesUploadInParts) {
  SceneGrid large;
  large.grid.edit({IVec3(0), IVec3(150)}, [](IVec3 v, VoxelType) {
    return static_cast<VoxelType>((v.x / 2 + v.y / 3 + v.z / 2) % 3 == 0 ? 1 : 0);
  });
  ImpostorWorld world(Model::Ball);
  scene_ = std::move(world.scene);
  large.pivot = content_sphere(large.grid).centre;
  Instance instance;
  instance.grid = scene_.add_grid(std::move(large));
  instance.position = {0, 0, -20};
  scene_.add_instance(instance);
  const Camera camera = towards({700, 500, 1300}, {0, 0, 0}, 0.3);
  RenderOptions frames = in_detail(96, 96, 200);
  frames.detail.impostor_seconds = 0.0;
  RenderOptions waiting = frames;
  waiting.detail.impostor_seconds = std::numeric_limits<double>::infinity();
  const auto frames_until = [&](const RenderedImage& wanted) {
    for (int frame = 1; frame < 2000; ++frame) {
      if (taken_as_is(camera, frames).colour.rgb == wanted.colour.rgb) return frame;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return -1;
  };
  const RenderedImage wanted = render_test::taken(scene_, camera, waiting);
  ASSERT_TRUE(renderer_->update(scene_));
  const RenderedImage traced = taken_as_is(camera, sized(96, 96));
  EXPECT_EQ(taken_as_is(camera, frames).colour.rgb, traced.colour.rgb) << "nothing is there yet";
  EXPECT_GT(frames_until(taken(scene_, camera, waiting)), 0);
  // After an edit, the old impostor is drawn until the whole new one is uploaded.
  scene_.edit(instance.grid).grid.fill_box({{60, 100, 100}, {90, 150, 150}}, kAir);
  ASSERT_TRUE(renderer_->update(scene_));
  const RenderedImage first = taken_as_is(camera, frames);
  EXPECT_LT(render_test::count_different(first, wanted, 40), 800);
  const RenderedImage edited = render_test::taken(scene_, camera, waiting);
  int frame = 0;
  while (frame < 2000 && render_test::count_different(taken_as_is(camera, frames), edited, 2) > 40) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    ++frame;
  }
  EXPECT_GT(frame, 2);
  EXPECT_LT(frame, 2000);
  EXPECT_EQ(taken_as_is(camera, frames).colour.rgb, taken_as_is(camera, waiting).colour.rgb);
}

// Up to the range of single precision and beyond.
TEST_F(VulkanImpostors, MatchCpuFarFromOriginAndCamera) {
  add_crowd(scene_, {add_blobs(scene_, 31), add_blobs(scene_, 32)}, 5, 260.0);
  const DVec3 away{1e9, -3e8, 5e8};
  for (const InstanceHandle handle : scene_.instances().handles()) scene_.edit(handle).position += away;
  const RenderOptions options = in_detail(256, 192, 128);
  compare(towards(away + DVec3(-300, 420, -500), away + DVec3(500, 0, 500), 0.9), options, "far_away");
  compare(towards(away + DVec3(-3e5, 4e5, -5e5), away + DVec3(500, 0, 500), 0.004), options, "far_telescope");
}

// The fields too are turned and mirrored.
TEST_F(VulkanImpostors, FieldsMatchCpuFarFromOriginAndCamera) {
  ImpostorWorld world(Model::Village);
  scene_ = std::move(world.scene);
  const GridHandle village = scene_.instances()[world.instance].grid;
  scene_.remove_instance(world.instance);
  add_crowd(scene_, {village}, 4, 90.0);
  const DVec3 away{1e9, -3e8, 5e8};
  for (const InstanceHandle handle : scene_.instances().handles()) scene_.edit(handle).position += away;
  const RenderOptions options = in_detail(256, 192, 128);
  compare(towards(away + DVec3(-100, 220, -200), away + DVec3(150, 0, 150), 0.7), options, "far_fields_away");
  compare(towards(away + DVec3(-1e5, 2e5, -2e5), away + DVec3(150, 0, 150), 0.002), options, "far_fields_telescope");
  scene_.edit(village).field.remove_sphere({0, 0, 0}, 14.0);
  compare(towards(away + DVec3(-100, 220, -200), away + DVec3(150, 0, 150), 0.7), options, "far_fields_edited");
}

TEST_F(VulkanImpostors, ShowFirstOfCoincidingInstances) {
  const GridHandle grid = add_blobs(scene_, 31);
  // Without glass, whose start would coincide with the other grid's opaque voxels up to rounding.
  Grid& voxels = scene_.edit(grid).grid;
  voxels.edit(voxels.bounds(), [](IVec3, VoxelType type) { return type == 3 ? VoxelType{1} : type; });
  SceneGrid other;
  other.pivot = scene_.grids()[grid].pivot;
  other.grid = voxels.snapshot();
  other.grid.edit(voxels.bounds(), [](IVec3, VoxelType type) { return type == kAir ? kAir : VoxelType{4}; });
  add_crowd(scene_, {grid}, 3, 400.0);
  const GridHandle glowing = scene_.add_grid(std::move(other));
  for (const InstanceHandle handle : scene_.instances().handles()) {
    Instance same = scene_.instances()[handle];
    same.grid = glowing;
    scene_.add_instance(same);
  }
  compare(towards({-900, 1200, -1500}, {400, 0, 400}, 0.7), in_detail(256, 192, 128), "same_place");
}

TEST_F(VulkanImpostors, FollowEditsAndRemovals) {
  const std::vector<GridHandle> grids = {add_blobs(scene_, 31), add_blobs(scene_, 32)};
  add_crowd(scene_, grids, 4, 300.0);
  const Camera camera = towards({-900, 1200, -1500}, {400, 0, 400}, 0.7);
  const RenderOptions options = in_detail(256, 192, 128);
  compare(camera, options, "far_before");
  const std::uint64_t both = impostor_bytes();
  scene_.edit(grids[0]).grid.fill_box({{-40, -40, -40}, {81, 61, 71}}, 2);
  compare(camera, options, "far_edited");
  for (const InstanceHandle handle : scene_.instances().handles()) {
    if (scene_.instances()[handle].grid == grids[0]) scene_.remove_instance(handle);
  }
  scene_.remove_grid(grids[0]);
  compare(camera, options, "far_removed");
  EXPECT_LT(impostor_bytes(), both);
  EXPECT_GT(impostor_bytes(), 0U);
  VoxelProperties glass = scene_.types[2];
  glass.visibility = Visibility::Transparent;
  glass.colour.a = 100;
  scene_.types.replace(2, glass);
  compare(camera, options, "far_other_types");
  ASSERT_TRUE(renderer_->update(Scene()));
  EXPECT_EQ(impostor_bytes(), 0U);
}

TEST_F(VulkanImpostors, ShowHiddenInstancesOnRequest) {
  add_crowd(scene_, {add_blobs(scene_, 31, 12)}, 3, 300.0);
  const std::vector<InstanceHandle> handles = scene_.instances().handles();
  for (std::size_t i = 0; i < handles.size(); i += 2) scene_.edit(handles[i]).visible = false;
  const Camera camera = towards({-900, 1200, -1500}, {300, 0, 300}, 0.7);
  const RenderOptions options = in_detail(128, 96, 128);
  compare(camera, options, "far_without_hidden");
  ASSERT_TRUE(renderer_->update(scene_, InstanceFilter::All));
  const auto all = CpuRenderer(scene_, InstanceFilter::All).render(camera, options);
  expect_equal(taken_as_is(camera, options), *all, "far_with_hidden");
  EXPECT_GT(all->pixels_hit, render_test::taken(scene_, camera, options).pixels_hit);
}

// Voxels smaller than texels grow to texel size.
TEST_F(VulkanImpostors, LargeGridMatchesCpu) {
  add_model(Model::Terrain);
  const ImpostorWorld world(Model::Terrain);
  for (const int view : {0, 1, 2}) {
    const Camera camera = orbiting(world, 0.4 + view, 0.9 - 0.3 * view, 0.0, 120.0 / (1 + 2 * view), 128);
    compare(camera, far_options(128), "far_large_" + std::to_string(view));
  }
}

TEST_F(VulkanImpostors, MatchCpuAroundCamera) {
  add_crowd(scene_, {add_blobs(scene_, 31, 12)}, 2, 120.0);
  RenderOptions options = in_detail(128, 96, 1'000'000);
  int view = 0;
  for (const DVec3 eye : {DVec3(60, 20, -130), DVec3(60, 30, 60), DVec3(-20, 10, 5)}) {
    compare(towards(eye, {60, 0, 55}, 1.2), options, "far_around_" + std::to_string(view++));
  }
  Camera above = from_above(60, 300, 60, 200);
  above.right = glm::normalize(DVec3(1, 0, 0.3));
  above.up = glm::cross(above.right, above.forward);
  compare(above, options, "far_above");
}

TEST_F(VulkanImpostors, MatchCpuOnRandomScenesAndPolicies) {
  for (std::uint32_t seed = 1; seed <= static_cast<std::uint32_t>(cases(3, 12)); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    scene_ = Scene();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    add_crowd(scene_, {add_blobs(scene_, seed, 8), add_blobs(scene_, seed + 100, 5)}, 4, 150.0 + 100.0 * unit(random));
    RenderOptions options = in_detail(96 + static_cast<int>(random() % 200), 64, static_cast<int>(random() % 400));
    options.detail.policy->cell_pixels = 1.0 + unit(random);
    options.detail.policy->voxel_pixels = 1.5 + unit(random);
    options.samples = 1 + static_cast<int>(random() % 2);
    options.light.occlusion_mode = random() % 2 == 0 ? OcclusionMode::Rays : OcclusionMode::Vertex;
    options.detail.colours = random() % 3 == 0;
    const double distance = std::exp(7.0 + 2.0 * unit(random));
    const DVec3 eye = DVec3(unit(random), 0.2 + std::abs(unit(random)), unit(random)) * distance;
    Camera camera = towards(eye, {200, 0, 200}, 0.6 + 0.3 * unit(random));
    if (random() % 3 == 0) {
      camera.projection = Camera::Projection::Orthographic;
      camera.view_height = 800.0;
    }
    compare(camera, options, "random_detail_" + std::to_string(seed));
  }
}

TEST_F(VulkanImpostors, TracesImpostorsThatAreNotReadyInTime) {
  add_model(Model::Castle);
  const ImpostorWorld world(Model::Castle);
  const Camera camera = orbiting(world, 0.7, 0.6, 0.0, 100.0, 148);
  RenderOptions options = far_options(148);
  options.detail.impostor_seconds = 0.0;
  compare(camera, options, "far_not_ready");
  EXPECT_EQ(impostor_bytes(), 0U);
}

TEST_F(VulkanImpostors, NeverShowImpostorsOfAnotherScene) {
  const Camera camera = towards({-900, 1200, -1500}, {300, 0, 300}, 0.7);
  RenderOptions options = in_detail(128, 96, 128);
  add_crowd(scene_, {add_blobs(scene_, 31, 12)}, 3, 300.0);
  compare(camera, options, "far_of_the_first");
  EXPECT_GT(impostor_bytes(), 0U);
  scene_ = Scene();
  add_crowd(scene_, {add_blobs(scene_, 77, 9)}, 3, 300.0);
  // Each frame shows the second scene, traced until its impostors are completely uploaded.
  const RenderedImage far = render_test::taken(scene_, camera, options);
  const RenderedImage near = render_test::taken(scene_, camera, render_test::sized(128, 96));
  options.detail.impostor_seconds = 0.0;
  ASSERT_TRUE(renderer_->update(scene_));
  const auto like = [](const RenderedImage& a, const RenderedImage& b) {
    return vulkan_test::differences(a, b).pixels * 1000 <= 128 * 96;
  };
  ASSERT_FALSE(like(near, far)) << "else this tests nothing";
  for (int frame = 0; frame < 20; ++frame) {
    const RenderedImage shown = taken_as_is(camera, options);
    EXPECT_TRUE(like(shown, near) || like(shown, far)) << frame;
  }
}

TEST_F(VulkanImpostors, SamplesAddUpToRenderedImage) {
  add_crowd(scene_, {add_blobs(scene_, 31, 12)}, 3, 300.0);
  ASSERT_TRUE(renderer_->update(scene_));
  const Camera camera = towards({-900, 1200, -1500}, {300, 0, 300}, 0.7);
  // More than one tile.
  RenderOptions options = in_detail(300, 100, 128);
  VulkanImage image(*renderer_);
  for (int sample = 0; sample < 3; ++sample)
    ASSERT_TRUE(renderer_->draw(image, camera, options, sample == 0 ? Accumulation::Restart : Accumulation::Continue));
  options.samples = 3;
  const RenderedImage whole = taken_as_is(camera, options);
  EXPECT_EQ(image.read()->rgb, whole.colour.rgb);
  EXPECT_EQ(image.rays(), whole.rays);
  EXPECT_GT(impostor_bytes(), 0U);
}

}  // namespace
}  // namespace quoin

#endif
