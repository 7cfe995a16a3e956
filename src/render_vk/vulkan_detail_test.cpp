// Levels of detail, drawn by the device and by the processor.

#include <random>
#include <set>
#include <string>
#include <vector>

#include <glm/gtc/quaternion.hpp>

#include "render/impostor_test_support.h"
#include "render_vk/renderer_impl.h"
#include "render_vk/vulkan_for_tests.h"

namespace quoin {
namespace {

using render_test::add_type;
using render_test::from_above;
using render_test::sized;
using render_test::towards;
using vulkan_test::expect_equal;

class VulkanDetail : public vulkan_test::VulkanTest {
 protected:
  void compare(const Camera& camera, const RenderOptions& options, const std::string& name) {
    const Status updated = renderer_->update(scene_);
    ASSERT_TRUE(updated) << to_string(updated.error());
    auto expected = CpuRenderer(scene_).render(camera, options);
    ASSERT_TRUE(expected) << to_string(expected.error());
    expect_equal(taken_as_is(camera, options), *expected, name);
  }
  // Of the grids that the processor traces.
  [[nodiscard]] std::set<int> halvings_of(const Camera& camera, const RenderOptions& options) const {
    std::vector<SelectedInstance> selected;
    DetailSelector().select(scene_, camera, options.width, options.height, *options.detail, selected);
    const SceneTracer whole(scene_);
    const SceneTracer detailed = whole.with_detail(selected);
    std::set<int> halvings;
    for (const PlacedGrid& placed : detailed.placed()) halvings.insert(placed.halvings);
    return halvings;
  }
  [[nodiscard]] std::uint64_t impostor_bytes() const { return renderer_->impl().detail.impostor_bytes(); }
  [[nodiscard]] std::uint64_t halved_bytes() const { return renderer_->impl().detail.halved_bytes(); }

  Scene scene_;
};

// A house's worth of boxes, all of even edges, so that it may be halved; some of them of glass.
GridHandle add_blobs(Scene& scene, std::uint32_t seed, int count = 30) {
  if (scene.types.size() == 1) {
    add_type(scene, {200, 90, 60});
    add_type(scene, {60, 160, 90});
    add_type(scene, {90, 120, 220, 120}, Visibility::Transparent);
    add_type(scene, {255, 220, 120}, Visibility::Opaque, 2.0F);
  }
  std::mt19937 random(seed);
  SceneGrid grid;
  for (int i = 0; i < count; ++i) {
    const auto coordinate = [&] { return 16 * (static_cast<int>(random() % 10) - 5); };
    const IVec3 at{coordinate(), coordinate(), coordinate()};
    grid.grid.fill_box(at, at + IVec3(15 + 16 * static_cast<int>(random() % 3)),
                       static_cast<VoxelType>(1 + random() % 4));
  }
  grid.pivot = DVec3(1.5, -2.0, 0.25);
  return scene.add_grid(std::move(grid));
}

// Turned, mirrored and scaled ones on a square.
void add_crowd(Scene& scene, const std::vector<GridHandle>& grids, int edge, double spacing) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < edge * edge; ++i) {
    Instance instance;
    instance.grid = grids[static_cast<std::size_t>(i) % grids.size()];
    instance.position = {spacing * (i % edge), 10.0 * unit(random), spacing * (i / edge)};
    instance.rotation = glm::normalize(DQuat(unit(random), unit(random), unit(random), unit(random)));
    instance.voxel_size = 1.0 + 0.5 * unit(random);
    instance.mirrored = i % 3 == 0;
    scene.add_instance(instance);
  }
}

RenderOptions in_detail(int width, int height, int far_pixels) {
  RenderOptions options = sized(width, height);
  options.detail.emplace().far_pixels = far_pixels;
  return options;
}

// All instances Mid, halved as often as their distance and volume allow.
RenderOptions always_mid(double cell_pixels) {
  RenderOptions options = sized(128, 96);
  options.detail.emplace().rule = DetailPolicy::Rule::ByRadius;
  options.detail->near_radii = 0.0;
  options.detail->mid_radii = 1e9;
  options.detail->cell_pixels = cell_pixels;
  return options;
}

TEST_F(VulkanDetail, HalvedGridsAreTheProcessors) {
  add_crowd(scene_, {add_blobs(scene_, 31), add_blobs(scene_, 32)}, 4, 260.0);
  const Camera camera = towards({-300, 420, -500}, {400, 0, 400}, 0.7);
  std::set<int> halvings;
  for (const double pixels : {0.4, 1.0, 2.0, 6.0}) {
    compare(camera, always_mid(pixels), "mid_" + std::to_string(static_cast<int>(10 * pixels)));
    halvings.merge(halvings_of(camera, always_mid(pixels)));
  }
  EXPECT_EQ(halvings, (std::set<int>{1, 2, 3, 4}));
  const RenderOptions plain = sized(128, 96);
  const Picture near = taken_as_is(camera, plain);
  expect_equal(near, render_test::taken(scene_, camera, plain), "near_after_mid");
  EXPECT_NE(near.depth.values, taken_as_is(camera, always_mid(6.0)).depth.values);
}

TEST_F(VulkanDetail, EveryKindOfLightOnHalvedGrids) {
  add_crowd(scene_, {add_blobs(scene_, 31)}, 2, 260.0);
  const Camera camera = towards({-300, 420, -500}, {150, 0, 150}, 0.6);
  const auto with = [&](const std::string& name, auto&& change) {
    RenderOptions options = always_mid(4.0);
    change(options);
    compare(camera, options, "mid_" + name);
  };
  with("vertex", [](RenderOptions& o) { o.light.occlusion = OcclusionMode::Vertex; });
  with("without", [](RenderOptions& o) { o.light.occlusion = OcclusionMode::Off; });
  with("spread", [](RenderOptions& o) { o.light.occlusion_rays = 5; });
  with("short", [](RenderOptions& o) { o.light.shadow_distance = 20.0; });
  with("unlit", [](RenderOptions& o) { o.light.lit = false; });
  with("samples", [](RenderOptions& o) { o.samples = 3; });
}

TEST_F(VulkanDetail, NearIsThePictureWithoutDetailToTheByte) {
  add_crowd(scene_, {add_blobs(scene_, 31)}, 2, 260.0);
  ASSERT_TRUE(renderer_->update(scene_));
  const Camera camera = towards({-100, 220, -200}, {150, 0, 150}, 0.6);
  RenderOptions options = sized(96, 64);
  const Picture plain = taken_as_is(camera, options);
  options.detail.emplace().rule = DetailPolicy::Rule::ByRadius;
  options.detail->near_radii = 1e9;
  const Picture detailed = taken_as_is(camera, options);
  EXPECT_EQ(plain.colour.rgb, detailed.colour.rgb);
  EXPECT_EQ(plain.depth.values, detailed.depth.values);
  EXPECT_EQ(halved_bytes(), 0U);
}

TEST_F(VulkanDetail, EditsReachHalvedGrids) {
  const GridHandle edited = add_blobs(scene_, 31);
  add_crowd(scene_, {edited, add_blobs(scene_, 32)}, 2, 260.0);
  const Camera camera = towards({-300, 420, -500}, {150, 0, 150}, 0.6);
  const RenderOptions options = always_mid(4.0);
  compare(camera, options, "before_edits");
  std::mt19937 random(5);
  for (int round = 0; round < 4; ++round) {
    Grid& grid = scene_.grids()[edited].grid;
    const auto coordinate = [&] { return 16 * (static_cast<int>(random() % 14) - 7); };
    const IVec3 at{coordinate(), coordinate(), coordinate()};
    grid.fill_box(at, at + IVec3(31), round == 2 ? kAir : VoxelType{2});
    compare(camera, options, "after_edit_" + std::to_string(round));
  }
}

TEST_F(VulkanDetail, AnEditSendsWhatItChanged) {
  const GridHandle edited = add_blobs(scene_, 31);
  add_crowd(scene_, {edited}, 1, 1.0);
  const Camera camera = towards({-300, 420, -500}, {0, 0, 0}, 0.6);
  const RenderOptions options = always_mid(4.0);
  compare(camera, options, "before_the_edit");
  vulkan::DeviceMemory& memory = renderer_->impl().memory;
  const std::uint64_t before = memory.written();
  static_cast<void>(taken_as_is(camera, options));
  const std::uint64_t of_a_picture = memory.written() - before;
  Grid& grid = scene_.grids()[edited].grid;
  grid.fill_box({0, 0, 0}, {15, 15, 15}, grid.get({0, 0, 0}) == 1 ? VoxelType{2} : VoxelType{1});
  ASSERT_TRUE(renderer_->update(scene_));
  const std::uint64_t after = memory.written();
  static_cast<void>(taken_as_is(camera, options));
  const std::uint64_t sent = memory.written() - after - of_a_picture;
  EXPECT_GT(sent, 0U);
  EXPECT_LT(sent, halved_bytes()) << "not all levels' chunks";
  compare(camera, options, "after_the_edit");
}

TEST_F(VulkanDetail, GridsThatAreGoneLeaveNothing) {
  const std::vector<GridHandle> grids = {add_blobs(scene_, 31), add_blobs(scene_, 32)};
  add_crowd(scene_, grids, 2, 260.0);
  const Camera camera = towards({-300, 420, -500}, {150, 0, 150}, 0.6);
  const RenderOptions options = always_mid(4.0);
  compare(camera, options, "before_removal");
  const std::uint64_t both = halved_bytes();
  ASSERT_GT(both, 0U);
  for (const InstanceHandle handle : scene_.instances().handles()) {
    if (scene_.instances()[handle].grid == grids[0]) scene_.remove_instance(handle);
  }
  scene_.remove_grid(grids[0]);
  compare(camera, options, "after_removal");
  EXPECT_LT(halved_bytes(), both);
  EXPECT_GT(halved_bytes(), 0U);
  scene_.types.replace(2, [&] {
    VoxelProperties glass = scene_.types[2];
    glass.visibility = Visibility::Transparent;
    glass.colour.a = 100;
    return glass;
  }());
  ASSERT_TRUE(renderer_->update(scene_));
  EXPECT_EQ(halved_bytes(), 0U) << "they were made of other types";
  compare(camera, options, "other_types");
  ASSERT_TRUE(renderer_->update(Scene()));
  EXPECT_EQ(halved_bytes(), 0U);
}

TEST_F(VulkanDetail, WhatPicturesNoLongerUseGivesWay) {
  const std::vector<GridHandle> grids = {add_blobs(scene_, 31), add_blobs(scene_, 32)};
  add_crowd(scene_, grids, 2, 260.0);
  ASSERT_TRUE(renderer_->update(scene_));
  vulkan::DeviceDetail& detail = renderer_->impl().detail;
  const auto place = [&](GridHandle wanted, std::uint64_t most_bytes) {
    std::vector<SelectedInstance> selected;
    for (const InstanceHandle handle : scene_.instances().handles()) {
      if (scene_.instances()[handle].grid == wanted) selected.push_back({handle, Detail::Mid, 1});
    }
    ASSERT_TRUE(detail.place(renderer_->impl().scene, scene_, {selected, {}}, {}, {}, most_bytes));
  };
  place(grids[0], vulkan::DeviceDetail::kMostBytes);
  const std::uint64_t first = detail.halved_bytes();
  place(grids[1], vulkan::DeviceDetail::kMostBytes);
  const std::uint64_t both = detail.halved_bytes();
  EXPECT_GT(first, 0U);
  EXPECT_GT(both, first);
  place(grids[0], both - 1);
  EXPECT_EQ(detail.halved_bytes(), first) << "the other one was not asked for";
  place(grids[0], 0);
  EXPECT_EQ(detail.halved_bytes(), first) << "what a picture needs stays";
  const Camera camera = towards({-300, 420, -500}, {150, 0, 150}, 0.6);
  compare(camera, always_mid(4.0), "after_giving_way");
}

TEST_F(VulkanDetail, SamplesAddUpToTheRenderedPicture) {
  add_crowd(scene_, {add_blobs(scene_, 31)}, 2, 260.0);
  ASSERT_TRUE(renderer_->update(scene_));
  const Camera camera = towards({-300, 420, -500}, {150, 0, 150}, 0.6);
  RenderOptions options = always_mid(4.0);
  VulkanPicture picture(*renderer_);
  for (int sample = 0; sample < 3; ++sample) ASSERT_TRUE(renderer_->draw(picture, camera, options, sample == 0));
  options.samples = 3;
  const Picture whole = taken_as_is(camera, options);
  EXPECT_EQ(picture.read()->rgb, whole.colour.rgb);
  EXPECT_EQ(picture.rays(), whole.rays);
}

TEST_F(VulkanDetail, ColoursTellTheDetail) {
  add_crowd(scene_, {add_blobs(scene_, 31), add_blobs(scene_, 32)}, 7, 300.0);
  const Camera camera = towards({-150, 120, -150}, {500, -60, 500}, 0.7);
  RenderOptions options = in_detail(320, 200, 0);
  options.detail_colours = true;
  compare(camera, options, "detail_colours");
  options.light.lit = false;
  compare(camera, options, "detail_colours_unlit");
}

using render_test::ImpostorWorld;
using render_test::Model;
using render_test::orbiting;

class VulkanImpostors : public VulkanDetail {
 protected:
  // All of one model, on a floor.
  void add_model(Model model) {
    ImpostorWorld world(model);
    scene_ = std::move(world.scene);
    SceneGrid slab;
    slab.grid.fill_box({-300, 0, -300}, {300, 0, 300}, 2);
    Instance ground;
    ground.grid = scene_.add_grid(std::move(slab));
    ground.position = {0, -1.2 * world.radius, 0};
    scene_.add_instance(ground);
  }
  static RenderOptions far_options(int size) { return in_detail(size, size, 128); }
};

TEST_F(VulkanImpostors, AreTheProcessorsFromAllAround) {
  for (const Model model : {Model::Ball, Model::Castle, Model::Ship, Model::Comb, Model::Blobs}) {
    add_model(model);
    const ImpostorWorld world(model);
    const std::string name = "far_" + std::to_string(static_cast<int>(model)) + "_";
    int view = 0;
    // Every level of the snapshots.
    for (const double pixels : {110.0, 60.0, 25.0, 12.0, 5.0}) {
      const Camera camera = orbiting(world, 0.7 + view, 0.6 - 0.2 * view, 0.3 * view, pixels, 128);
      compare(camera, far_options(128), name + std::to_string(view++));
    }
    EXPECT_GT(impostor_bytes(), 0U);
  }
}

TEST_F(VulkanImpostors, EveryKindOfLight) {
  add_model(Model::Castle);
  const ImpostorWorld world(Model::Castle);
  const Camera camera = orbiting(world, 0.7, 0.6, 0.2, 100.0, 148);
  const auto with = [&](const std::string& name, auto&& change) {
    RenderOptions options = far_options(148);
    change(options);
    compare(camera, options, "far_" + name);
  };
  with("vertex", [](RenderOptions& o) { o.light.occlusion = OcclusionMode::Vertex; });
  with("without", [](RenderOptions& o) { o.light.occlusion = OcclusionMode::Off; });
  with("all", [](RenderOptions& o) { o.light.occlusion_affects = OcclusionAffects::All; });
  with("spread", [](RenderOptions& o) { o.light.occlusion_rays = 5; });
  with("unlit", [](RenderOptions& o) { o.light.lit = false; });
  with("no_shadows", [](RenderOptions& o) { o.light.shadows = false; });
  with("samples", [](RenderOptions& o) { o.samples = 5; });
  with("colours", [](RenderOptions& o) { o.detail_colours = true; });
  const Picture far = taken_as_is(camera, far_options(148));
  EXPECT_NE(far.colour.rgb, taken_as_is(camera, sized(148, 148)).colour.rgb) << "occlusion is that of whole faces";
}

TEST_F(VulkanImpostors, AmongOthersOfEveryDetail) {
  add_crowd(scene_, {add_blobs(scene_, 31, 12), add_blobs(scene_, 32, 12)}, 6, 320.0);
  Camera camera = towards({-150, 160, -150}, {900, -60, 900}, 0.7);
  // More than a tile, Near, Mid and Far.
  RenderOptions options = in_detail(320, 200, 128);
  compare(camera, options, "crowd");
  options.detail_colours = true;
  compare(camera, options, "crowd_colours");
  options.samples = 2;
  compare(camera, options, "crowd_samples");
  camera.projection = Camera::Projection::Orthographic;
  camera.view_height = 2000.0;
  compare(camera, options, "crowd_orthographic");
  EXPECT_GT(impostor_bytes(), 0U);
}

// As far as single precision and further.
TEST_F(VulkanImpostors, FarFromTheOriginAndTheCamera) {
  add_crowd(scene_, {add_blobs(scene_, 31), add_blobs(scene_, 32)}, 5, 260.0);
  const DVec3 away{1e9, -3e8, 5e8};
  for (const InstanceHandle handle : scene_.instances().handles()) scene_.instances()[handle].position += away;
  const RenderOptions options = in_detail(256, 192, 128);
  compare(towards(away + DVec3(-300, 420, -500), away + DVec3(500, 0, 500), 0.9), options, "far_away");
  compare(towards(away + DVec3(-3e5, 4e5, -5e5), away + DVec3(500, 0, 500), 0.004), options, "far_telescope");
}

TEST_F(VulkanImpostors, InTheSamePlaceTheFirstInstanceShows) {
  const GridHandle grid = add_blobs(scene_, 31);
  // Without glass: that would begin where the other's opaque voxels do, but for rounding.
  Grid& voxels = scene_.grids()[grid].grid;
  voxels.edit(voxels.bounds(), [](IVec3, VoxelType type) { return type == 3 ? VoxelType{1} : type; });
  SceneGrid other;
  other.pivot = scene_.grids()[grid].pivot;
  other.grid = voxels.clone();
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

TEST_F(VulkanImpostors, EditsAndRemovalsReachThem) {
  const std::vector<GridHandle> grids = {add_blobs(scene_, 31), add_blobs(scene_, 32)};
  add_crowd(scene_, grids, 4, 300.0);
  const Camera camera = towards({-900, 1200, -1500}, {400, 0, 400}, 0.7);
  const RenderOptions options = in_detail(256, 192, 128);
  compare(camera, options, "far_before");
  const std::uint64_t both = impostor_bytes();
  scene_.grids()[grids[0]].grid.fill_box({-40, -40, -40}, {80, 60, 70}, 2);
  compare(camera, options, "far_edited");
  for (const InstanceHandle handle : scene_.instances().handles()) {
    if (scene_.instances()[handle].grid == grids[0]) scene_.remove_instance(handle);
  }
  scene_.remove_grid(grids[0]);
  compare(camera, options, "far_removed");
  EXPECT_LT(impostor_bytes(), both);
  EXPECT_GT(impostor_bytes(), 0U);
  ASSERT_TRUE(renderer_->update(Scene()));
  EXPECT_EQ(impostor_bytes(), 0U);
}

TEST_F(VulkanImpostors, WhatIsNotReadyInTimeIsTraced) {
  add_model(Model::Castle);
  const ImpostorWorld world(Model::Castle);
  const Camera camera = orbiting(world, 0.7, 0.6, 0.0, 100.0, 148);
  RenderOptions options = far_options(148);
  options.impostor_seconds = 0.0;
  compare(camera, options, "far_not_ready");
  EXPECT_EQ(impostor_bytes(), 0U);
}

TEST_F(VulkanImpostors, SamplesAddUpToTheRenderedPicture) {
  add_crowd(scene_, {add_blobs(scene_, 31, 12)}, 3, 300.0);
  ASSERT_TRUE(renderer_->update(scene_));
  const Camera camera = towards({-900, 1200, -1500}, {300, 0, 300}, 0.7);
  // More than a tile.
  RenderOptions options = in_detail(300, 100, 128);
  VulkanPicture picture(*renderer_);
  for (int sample = 0; sample < 3; ++sample) ASSERT_TRUE(renderer_->draw(picture, camera, options, sample == 0));
  options.samples = 3;
  const Picture whole = taken_as_is(camera, options);
  EXPECT_EQ(picture.read()->rgb, whole.colour.rgb);
  EXPECT_EQ(picture.rays(), whole.rays);
  EXPECT_GT(impostor_bytes(), 0U);
}

}  // namespace
}  // namespace quoin
