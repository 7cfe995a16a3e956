#ifdef QUOIN_HAVE_VULKAN

// Compares distant halved grids between the device and the CPU.

#include <set>

#include "render/vulkan/march/vulkan_detail_support.h"
#include "scene/tracer/placed_grid.h"

namespace quoin {
namespace {

using render_test::sized;
using render_test::towards;
using vulkan_test::add_blobs;
using vulkan_test::add_crowd;
using vulkan_test::expect_equal;
using vulkan_test::in_detail;
using vulkan_test::of_day;

class VulkanDetail : public vulkan_test::VulkanDetailTest {
 protected:
  // Returns the halvings of the grids that the CPU traces.
  [[nodiscard]] std::set<int> halvings_of(const Camera& camera, const RenderOptions& options) const {
    std::vector<SelectedInstance> selected;
    DetailSelector().select(scene_, camera, options.width, options.height, *options.detail.policy, selected);
    const SceneTracer whole(scene_);
    const SceneTracer detailed = whole.with_detail(selected);
    std::set<int> halvings;
    for (const PlacedGrid& placed : placed_in(detailed)) halvings.insert(placed.level);
    return halvings;
  }
};

// All instances are Mid and halved as often as their distance and volume allow.
RenderOptions always_mid(double cell_pixels) {
  RenderOptions options = sized(128, 96);
  options.detail.policy.emplace().rule = DetailPolicy::Rule::ByRadius;
  options.detail.policy->near_radii = 0.0;
  options.detail.policy->mid_radii = 1e9;
  options.detail.policy->cell_pixels = cell_pixels;
  return options;
}

TEST_F(VulkanDetail, HalvedGridsMatchCpu) {
  add_crowd(scene_, {add_blobs(scene_, 31), add_blobs(scene_, 32)}, 4, 260.0);
  const Camera camera = towards({-300, 420, -500}, {400, 0, 400}, 0.7);
  std::set<int> halvings;
  for (const double pixels : {0.4, 1.0, 2.0, 6.0}) {
    compare(camera, always_mid(pixels), "mid_" + std::to_string(static_cast<int>(10 * pixels)));
    halvings.merge(halvings_of(camera, of_day(always_mid(pixels))));
  }
  EXPECT_EQ(halvings, (std::set<int>{1, 2, 3, 4}));
  const RenderOptions plain = sized(128, 96);
  const RenderedImage near = taken_as_is(camera, plain);
  expect_equal(near, render_test::taken(scene_, camera, plain), "near_after_mid");
  EXPECT_NE(near.depth.values, taken_as_is(camera, always_mid(6.0)).depth.values);
}

TEST_F(VulkanDetail, HalvedGridsMatchCpuInAllLight) {
  add_crowd(scene_, {add_blobs(scene_, 31)}, 2, 260.0);
  const Camera camera = towards({-300, 420, -500}, {150, 0, 150}, 0.6);
  const auto with = [&](const std::string& name, auto&& change) {
    RenderOptions options = always_mid(4.0);
    change(options);
    compare(camera, options, "mid_" + name);
  };
  with("vertex", [](RenderOptions& o) { o.light.occlusion_mode = OcclusionMode::Vertex; });
  with("without", [](RenderOptions& o) { o.light.occlusion_mode = OcclusionMode::Off; });
  with("spread", [](RenderOptions& o) { o.light.occlusion_rays = 5; });
  with("short", [](RenderOptions& o) { o.light.shadow_distance_voxels = 20.0; });
  with("unlit", [](RenderOptions& o) { o.light.shading = Shading::Unlit; });
  with("samples", [](RenderOptions& o) { o.samples = 3; });
}

TEST_F(VulkanDetail, NearMatchesImageWithoutDetailExactly) {
  add_crowd(scene_, {add_blobs(scene_, 31)}, 2, 260.0);
  ASSERT_TRUE(renderer_->update(scene_));
  const Camera camera = towards({-100, 220, -200}, {150, 0, 150}, 0.6);
  RenderOptions options = sized(96, 64);
  const RenderedImage plain = taken_as_is(camera, options);
  options.detail.policy.emplace().rule = DetailPolicy::Rule::ByRadius;
  options.detail.policy->near_radii = 1e9;
  const RenderedImage detailed = taken_as_is(camera, options);
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
    Grid& grid = scene_.edit(edited).grid;
    const auto coordinate = [&] { return 16 * (static_cast<int>(random() % 14) - 7); };
    const IVec3 at{coordinate(), coordinate(), coordinate()};
    grid.fill_box({at, at + 32}, round == 2 ? kAir : VoxelType{2});
    compare(camera, options, "after_edit_" + std::to_string(round));
  }
}

TEST_F(VulkanDetail, UploadsOnlyChangesOfLevels) {
  const GridHandle edited = add_blobs(scene_, 31);
  add_crowd(scene_, {edited}, 1, 1.0);
  const Camera camera = towards({-300, 420, -500}, {0, 0, 0}, 0.6);
  const RenderOptions options = always_mid(4.0);
  compare(camera, options, "before_the_edit");
  vulkan::DeviceMemory& memory = renderer_->impl().memory;
  const std::uint64_t before = memory.written();
  static_cast<void>(taken_as_is(camera, options));
  const std::uint64_t of_an_image = memory.written() - before;
  Grid& grid = scene_.edit(edited).grid;
  grid.fill_box({{0, 0, 0}, {16, 16, 16}}, grid.get({0, 0, 0}) == 1 ? VoxelType{2} : VoxelType{1});
  ASSERT_TRUE(renderer_->update(scene_));
  const std::uint64_t after = memory.written();
  static_cast<void>(taken_as_is(camera, options));
  const std::uint64_t sent = memory.written() - after - of_an_image;
  EXPECT_GT(sent, 0U);
  EXPECT_LT(sent, halved_bytes()) << "not all levels' chunks";
  compare(camera, options, "after_the_edit");
}

// Adds hills with caves, and a house on them.
GridHandle add_hills(Scene& scene, bool has_house) {
  const GridHandle handle = add_blobs(scene, 31, has_house ? 30 : 0);
  DensityGrid& field = scene.edit(handle).field;
  field.add_box({-150, -100, -150}, {150, -30, 150}, 2, 20.0);
  field.add_sphere({60, -30, 40}, 50.0, 1, 6.0);
  field.remove_sphere({-60, -20, -30}, 40.0);
  field.add_sphere({-20, 60, 90}, 22.0, 4);
  return handle;
}

TEST_F(VulkanDetail, HalvedFieldsMatchCpu) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  add_crowd(scene_, {add_hills(scene_, true), add_blobs(scene_, 32), add_hills(scene_, false)}, 3, 360.0);
  const Camera camera = towards({-300, 420, -500}, {400, 0, 400}, 0.7);
  std::set<int> halvings;
  for (const double pixels : {0.4, 1.0, 2.0, 6.0}) {
    compare(camera, always_mid(pixels), "mid_field_" + std::to_string(static_cast<int>(10 * pixels)));
    halvings.merge(halvings_of(camera, of_day(always_mid(pixels))));
  }
  EXPECT_EQ(halvings, (std::set<int>{1, 2, 3, 4}));
  EXPECT_NE(taken_as_is(camera, sized(128, 96)).depth.values, taken_as_is(camera, always_mid(6.0)).depth.values);
}

TEST_F(VulkanDetail, EditsReachHalvedFields) {
  if (!is_nightly()) GTEST_SKIP() << "nightly only";
  const GridHandle edited = add_hills(scene_, true);
  add_crowd(scene_, {edited, add_hills(scene_, false)}, 2, 360.0);
  const Camera camera = towards({-300, 420, -500}, {150, 0, 150}, 0.6);
  const RenderOptions options = always_mid(4.0);
  compare(camera, options, "field_before_edits");
  std::mt19937 random(5);
  for (int round = 0; round < 4; ++round) {
    DensityGrid& field = scene_.edit(edited).field;
    const auto coordinate = [&] { return static_cast<double>(random() % 200) - 100.0; };
    field.remove_sphere({coordinate(), -30.0, coordinate()}, 30.0);
    field.add_sphere({coordinate(), 10.0, coordinate()}, 24.0, 4);
    if (round == 2) field.clear();
    if (round == 3) scene_.edit(edited).grid.clear();
    compare(camera, options, "field_after_edit_" + std::to_string(round));
  }
}

TEST_F(VulkanDetail, FreesLevelsOfRemovedGrids) {
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

TEST_F(VulkanDetail, EvictsUnusedLevels) {
  const std::vector<GridHandle> grids = {add_blobs(scene_, 31), add_blobs(scene_, 32)};
  add_crowd(scene_, grids, 2, 260.0);
  ASSERT_TRUE(renderer_->update(scene_));
  vulkan::DeviceDetail& detail = renderer_->impl().detail;
  const auto place = [&](GridHandle wanted, std::uint64_t max_bytes) {
    std::vector<SelectedInstance> selected;
    for (const InstanceHandle handle : scene_.instances().handles()) {
      if (scene_.instances()[handle].grid == wanted) selected.push_back({handle, Detail::Mid, 1});
    }
    ASSERT_TRUE(detail.place(renderer_->impl().scene, scene_, {selected, {}}, {}, {}, {}, max_bytes));
  };
  place(grids[0], vulkan::DeviceDetail::kMaxBytes);
  const std::uint64_t first = detail.halved_bytes();
  place(grids[1], vulkan::DeviceDetail::kMaxBytes);
  const std::uint64_t both = detail.halved_bytes();
  EXPECT_GT(first, 0U);
  EXPECT_GT(both, first);
  place(grids[0], both - 1);
  EXPECT_EQ(detail.halved_bytes(), first) << "the other one was not asked for";
  place(grids[0], 0);
  EXPECT_EQ(detail.halved_bytes(), first) << "levels that the image needs are kept";
  place(grids[1], both);
  EXPECT_EQ(detail.halved_bytes(), both) << "the evicted level is made again";
  place(grids[1], both - 1);
  EXPECT_EQ(detail.halved_bytes(), both - first) << "the level that was used longer ago is evicted";
  const Camera camera = towards({-300, 420, -500}, {150, 0, 150}, 0.6);
  compare(camera, always_mid(4.0), "after_giving_way");
}

TEST_F(VulkanDetail, SamplesAddUpToRenderedImage) {
  add_crowd(scene_, {add_blobs(scene_, 31)}, 2, 260.0);
  ASSERT_TRUE(renderer_->update(scene_));
  const Camera camera = towards({-300, 420, -500}, {150, 0, 150}, 0.6);
  RenderOptions options = always_mid(4.0);
  VulkanImage image(*renderer_);
  for (int sample = 0; sample < 3; ++sample)
    ASSERT_TRUE(renderer_->draw(image, camera, options, sample == 0 ? Accumulation::Restart : Accumulation::Continue));
  options.samples = 3;
  const RenderedImage whole = taken_as_is(camera, options);
  EXPECT_EQ(image.read()->rgb, whole.colour.rgb);
  EXPECT_EQ(image.rays(), whole.rays);
}

TEST_F(VulkanDetail, DetailColoursMatchCpu) {
  add_crowd(scene_, {add_blobs(scene_, 31), add_blobs(scene_, 32)}, 7, 300.0);
  const Camera camera = towards({-150, 120, -150}, {500, -60, 500}, 0.7);
  RenderOptions options = in_detail(320, 200, 0);
  options.detail.colours = true;
  compare(camera, options, "detail_colours");
  options.light.shading = Shading::Unlit;
  compare(camera, options, "detail_colours_unlit");
}

}  // namespace
}  // namespace quoin

#endif
