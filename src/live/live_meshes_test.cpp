#include <quoin/live/live_meshes.h>

#include <atomic>
#include <cstdlib>
#include <limits>

#include <gtest/gtest.h>

#include "live/live_test_support.h"

namespace quoin {
namespace {

class LiveMeshesOf : public testing::TestWithParam<SurfaceStyle> {
 protected:
  LiveMeshOptions options(unsigned threads = 2) const {
    LiveMeshOptions options;
    options.style = GetParam();
    options.workers = {threads};
    return options;
  }
};

std::vector<SurfaceUpdate> all_of(LiveMeshes& meshes, const Scene& scene) {
  meshes.finish(scene, {});
  return meshes.take();
}

TEST_P(LiveMeshesOf, RandomEditsEndAsAFreshStart) {
  const unsigned seeds = kIsSlow && GetParam() == SurfaceStyle::Smooth ? 2 : 40;
  for (unsigned seed = 0; seed < seeds; ++seed) {
    SCOPED_TRACE(seed);
    LiveMeshOptions wanted = options(1 + seed % 3);
    wanted.merge = seed % 2 == 0;
    wanted.instances = seed % 5 == 0 ? InstanceFilter::All : InstanceFilter::Visible;
    if (seed % 4 == 1) wanted.occlusion.method = SmoothOcclusion::None;
    SceneEditor editor(seed);
    LiveMeshes meshes(wanted);
    ShownSurfaces shown;
    const int edits = GetParam() == SurfaceStyle::Blocky ? 60 : kIsSlow ? 4 : 14;
    for (int i = 0; i < edits; ++i) {
      editor.edit();
      if (editor.below(2) == 0) meshes.update(editor.scene, editor.eye());
      if (editor.below(4) == 0) shown.apply(meshes.take());
      if (editor.below(20) == 0) meshes.finish(editor.scene, editor.eye());
    }
    meshes.finish(editor.scene, editor.eye());
    shown.apply(meshes.take());
    EXPECT_EQ(meshes.pending(), 0U);
    expect_surfaces(shown, editor.scene, wanted);
    if (HasFailure()) return;
    if (GetParam() == SurfaceStyle::Smooth && seed % 4 != 0) continue;
    ShownSurfaces fresh;
    LiveMeshes other(wanted);
    fresh.apply(all_of(other, editor.scene));
    expect_surfaces(fresh, editor.scene, wanted);
    EXPECT_EQ(fresh.all().size(), shown.all().size());
  }
}

TEST_P(LiveMeshesOf, EditsGoOnWhileWorkersRun) {
  SceneEditor editor(7);
  std::atomic<int> calls{0};
  LiveMeshOptions wanted = options(3);
  wanted.on_ready = [&] { ++calls; };
  ShownSurfaces shown;
  std::int64_t meshed = 0;
  {
    LiveMeshes meshes(wanted);
    for (int i = 0; i < (GetParam() == SurfaceStyle::Blocky ? 400 : kIsSlow ? 20 : 100); ++i) {
      editor.edit();
      meshes.update(editor.scene, editor.eye());
      shown.apply(meshes.take());
    }
    meshes.finish(editor.scene, {});
    shown.apply(meshes.take());
    expect_surfaces(shown, editor.scene, wanted);
    meshed = meshes.stats().chunks_meshed;
  }
  EXPECT_GT(meshed, 0);
  EXPECT_GE(calls, meshed);
}

TEST_P(LiveMeshesOf, CanEndInTheMiddle) {
  for (int i = 0; i < (kIsSlow ? 2 : 20); ++i) {
    OneGrid one;
    one.grid().fill_box({{0, 0, 0}, {301, 21, 101}}, 1);
    LiveMeshes meshes(options());
    meshes.update(one.scene, {});
    const std::size_t pending = meshes.pending();
    EXPECT_GE(pending, meshes.take().size());
  }
}

TEST_P(LiveMeshesOf, NothingIsMadeWhereNothingChanged) {
  OneGrid one;
  one.grid().fill_sphere({60, 60, 60}, 30.0, 1);
  LiveMeshes meshes(options());
  EXPECT_FALSE(all_of(meshes, one.scene).empty());
  const std::int64_t before = meshes.stats().chunks_meshed;
  one.grid().set({60, 60, 60}, 1);  // what it is
  one.scene.edit(one.placed).position = {5, 5, 5};
  Instance second = one.instance;
  second.position = {500, 0, 0};
  one.scene.add_instance(second);
  EXPECT_TRUE(all_of(meshes, one.scene).empty());
  EXPECT_EQ(meshes.stats().chunks_meshed, before);
}

TEST_P(LiveMeshesOf, WhatIsNotDrawnGoesAndComesBack) {
  OneGrid one;
  one.grid().fill_box({{3, 3, 3}, {10, 10, 10}}, 1);
  LiveMeshes meshes(options());
  EXPECT_EQ(all_of(meshes, one.scene).size(), 1U);
  const auto expect_gone_and_back = [&](const std::function<void(bool shown)>& show) {
    show(false);
    const std::vector<SurfaceUpdate> gone = all_of(meshes, one.scene);
    ASSERT_EQ(gone.size(), 1U);
    EXPECT_EQ(gone[0].surface, nullptr);
    EXPECT_EQ(gone[0].grid, one.handle);
    show(true);
    const std::vector<SurfaceUpdate> back = all_of(meshes, one.scene);
    ASSERT_EQ(back.size(), 1U);
    EXPECT_NE(back[0].surface, nullptr);
  };
  expect_gone_and_back([&](bool shown) { one.scene.edit(one.placed).visible = shown; });
  expect_gone_and_back([&](bool shown) {
    one.scene.edit(one.placed).voxel_size = shown ? 1.0 : std::numeric_limits<double>::quiet_NaN();
  });
  expect_gone_and_back([&](bool shown) {
    if (!shown) one.scene.remove_instance(one.placed);
    if (shown) one.placed = one.scene.add_instance(one.instance);
  });
  expect_gone_and_back([&](bool shown) {
    if (!shown) one.grid().clear();
    if (shown) one.grid().set({1, 1, 1}, 1);
  });
  one.scene.remove_grid(one.handle);
  const std::vector<SurfaceUpdate> gone = all_of(meshes, one.scene);
  ASSERT_EQ(gone.size(), 1U);
  EXPECT_EQ(gone[0].surface, nullptr);
  EXPECT_EQ(gone[0].grid, one.handle);
}

TEST_P(LiveMeshesOf, TheWorldsEdgeIsMeshedAsTheRest) {
  constexpr int kLast = std::numeric_limits<int>::max() - 64;
  constexpr int kFirst = std::numeric_limits<int>::min() + 64;
  for (const int at : {kLast, kFirst}) {
    OneGrid one;
    const int first = at == kLast ? at - 3 : at;
    one.grid().fill_box({IVec3(first), IVec3(first + 4)}, 1);
    ASSERT_GT(one.grid().voxel_count(), 0);
    LiveMeshes meshes(options());
    ShownSurfaces shown;
    shown.apply(all_of(meshes, one.scene));
    expect_surfaces(shown, one.scene, options());
    one.grid().clear();
    shown.apply(all_of(meshes, one.scene));
    EXPECT_TRUE(shown.all().empty());
  }
}

TEST_P(LiveMeshesOf, AnEyeThatIsNowhereHarmsNothing) {
  OneGrid one;
  one.grid().fill_box({{-70, 0, 0}, {71, 4, 4}}, 1);
  LiveMeshes meshes(options());
  for (const double x : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e308}) {
    one.grid().set({0, 9, 0}, one.grid().get({0, 9, 0}) == kAir ? 1 : kAir);
    meshes.finish(one.scene, {x, 0, x});
  }
  ShownSurfaces shown;
  shown.apply(meshes.take());
  expect_surfaces(shown, one.scene, options());
}

INSTANTIATE_TEST_SUITE_P(Styles, LiveMeshesOf, testing::Values(SurfaceStyle::Blocky, SurfaceStyle::Smooth),
                         [](const auto& style) { return style.param == SurfaceStyle::Blocky ? "Blocky" : "Smooth"; });

}  // namespace
}  // namespace quoin
