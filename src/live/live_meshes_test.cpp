#include <quoin/live/live_meshes.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <limits>
#include <map>
#include <mutex>
#include <random>
#include <set>
#include <span>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/terrain/noise.h>

#include "core/death_for_tests.h"
#include "core/work/nightly_for_tests.h"
#include "live/live_test_support.h"

namespace quoin {
namespace {

class LiveMeshesTest : public testing::TestWithParam<SurfaceStyle> {
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

TEST_P(LiveMeshesTest, MatchesFreshMeshesAfterRandomEdits) {
  const unsigned smooth = kIsSlow ? 2 : static_cast<unsigned>(cases(16, 40));
  const unsigned seeds = GetParam() == SurfaceStyle::Smooth ? smooth : 40;
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

TEST_P(LiveMeshesTest, AllowsEditsWhileWorkersRun) {
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

TEST_P(LiveMeshesTest, StopsDuringMeshing) {
  for (int i = 0; i < (kIsSlow ? 2 : 20); ++i) {
    OneGrid one;
    one.grid().fill_box({{0, 0, 0}, {301, 21, 101}}, 1);
    LiveMeshes meshes(options());
    meshes.update(one.scene, {});
    const std::size_t pending = meshes.pending();
    EXPECT_GE(pending, meshes.take().size());
  }
}

TEST_P(LiveMeshesTest, RemeshesNothingWithoutChanges) {
  OneGrid one;
  one.grid().fill_sphere({60, 60, 60}, 30.0, 1);
  LiveMeshes meshes(options());
  EXPECT_FALSE(all_of(meshes, one.scene).empty());
  const std::int64_t before = meshes.stats().chunks_meshed;
  one.grid().set({60, 60, 60}, 1);  // same type as before
  one.scene.edit(one.placed).position = {5, 5, 5};
  Instance second = one.instance;
  second.position = {500, 0, 0};
  one.scene.add_instance(second);
  EXPECT_TRUE(all_of(meshes, one.scene).empty());
  EXPECT_EQ(meshes.stats().chunks_meshed, before);
}

TEST_P(LiveMeshesTest, RemovesHiddenSurfacesUntilShown) {
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

TEST_P(LiveMeshesTest, MeshesVoxelsAtWorldEdge) {
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

TEST_P(LiveMeshesTest, IgnoresNonFiniteEye) {
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

INSTANTIATE_TEST_SUITE_P(Styles, LiveMeshesTest, testing::Values(SurfaceStyle::Blocky, SurfaceStyle::Smooth),
                         [](const auto& style) { return style.param == SurfaceStyle::Blocky ? "Blocky" : "Smooth"; });

// Returns the unit faces of quads with all their attributes.
std::multiset<std::uint64_t> faces_of(std::span<const Quad> quads) {
  std::multiset<std::uint64_t> faces;
  constexpr std::uint64_t kSizes = std::uint64_t{63} << Quad::kSizeUShift | std::uint64_t{63} << Quad::kSizeVShift;
  for (const Quad quad : quads) {
    const FaceFrame& frame = frame_of(quad.direction());
    for (int u = 0; u < quad.size_u(); ++u) {
      for (int v = 0; v < quad.size_v(); ++v) {
        const std::uint64_t moved = static_cast<std::uint64_t>(u) << (6 * frame.u) | static_cast<std::uint64_t>(v)
                                                                                         << (6 * frame.v);
        faces.insert((quad.bits & ~kSizes) + moved);
      }
    }
  }
  return faces;
}

std::vector<Quad> quads_of(const ChunkSurface& surface, IVec3 region) {
  std::vector<Quad> quads;
  for (const SurfaceRegion& each : surface.regions) {
    if (each.region != region) continue;
    for (const auto& range : {each.opaque, each.transparent}) {
      quads.insert(quads.end(), surface.quads.begin() + range[0], surface.quads.begin() + range[6]);
    }
  }
  return quads;
}

void expect_regions(const ChunkSurface& surface, const ChunkSurface& whole, int edge, const VoxelRegistry& types) {
  ASSERT_EQ(faces_of(surface.quads), faces_of(whole.quads));
  std::size_t listed = 0;
  for (const SurfaceRegion& region : surface.regions) {
    for (std::size_t d = 0; d < 6; ++d) {
      for (const bool transparent : {false, true}) {
        const auto& range = transparent ? region.transparent : region.opaque;
        for (std::uint32_t i = range[d]; i < range[d + 1]; ++i, ++listed) {
          const Quad quad = surface.quads[i];
          ASSERT_EQ(static_cast<std::size_t>(quad.direction()), d);
          ASSERT_EQ(types.is_transparent(quad.type()), transparent);
          ASSERT_EQ(i < surface.opaque_quads, !transparent);
          const FaceFrame& frame = frame_of(quad.direction());
          IVec3 last = quad.voxel();
          last[frame.u] += quad.size_u() - 1;
          last[frame.v] += quad.size_v() - 1;
          ASSERT_EQ(quad.voxel() / edge, region.region);
          ASSERT_EQ(last / edge, region.region);
        }
      }
    }
  }
  EXPECT_EQ(listed, surface.quads.size()) << "each once";
}

TEST(LiveRegions, HoldSameFacesAndReportChanges) {
  for (const int edge : {16, 32, 64}) {
    SceneEditor editor(static_cast<std::uint32_t>(edge));
    LiveMeshOptions wanted;
    wanted.region_edge = kChunkEdge;
    LiveMeshes whole(wanted);
    if (edge == 16) wanted = {};  // the default
    if (edge != 16) wanted.region_edge = edge;
    LiveMeshes meshes(wanted);
    ShownSurfaces shown;
    ShownSurfaces shown_whole;
    const int across = 64 / edge;
    int kept = 0;
    for (int step = 0; step < 60; ++step) {
      editor.edit();
      meshes.finish(editor.scene, {});
      whole.finish(editor.scene, {});
      const std::vector<SurfaceUpdate> updates = meshes.take();
      for (const SurfaceUpdate& update : updates) {
        const ChunkSurface* before = shown.find(update.grid, update.chunk);
        for (int i = 0; i < across * across * across; ++i) {
          const IVec3 region{i % across, i / across % across, i / across / across};
          const bool is_same = before != nullptr && update.surface != nullptr && across > 1 &&
                               quads_of(*before, region) == quads_of(*update.surface, region);
          ASSERT_EQ((update.changed_regions >> i & 1U) == 0, is_same);
          kept += static_cast<int>(is_same);
        }
      }
      shown.apply(updates);
      shown_whole.apply(whole.take());
      for (const SurfaceUpdate& each : shown.all()) {
        const ChunkSurface* other = shown_whole.find(each.grid, each.chunk);
        ASSERT_NE(other, nullptr);
        expect_regions(*each.surface, *other, edge, editor.scene.types);
        ASSERT_TRUE(edge != 64 || each.surface->quads == other->quads);
        if (HasFatalFailure()) return;
      }
    }
    EXPECT_EQ(kept > 0, edge < 64);
  }
}

// A game digs single blocks of a landscape and uploads 64 bytes of vertices and 24 of indices per changed quad.
TEST(LiveRegions, UploadLessThan50KilobytesPerDugBlock) {
  Scene scene;
  for (const char* const name : {"grass", "dirt", "stone"}) ASSERT_TRUE(scene.types.add({.name = name}));
  const auto height = [](int x, int z) { return static_cast<int>(66.0 + 26.0 * fractal2(7, x / 220.0, z / 220.0, 5)); };
  const GridHandle handle = scene.add_grid({});
  scene.add_instance({.grid = handle});
  for (int z = 0; z < 256; ++z) {
    for (int x = 0; x < 256; ++x) {
      Grid& grid = scene.edit(handle).grid;
      const int top = height(x, z);
      grid.fill_box({{x, 0, z}, {x + 1, top - 4, z + 1}}, 3);
      grid.fill_box({{x, top - 4, z}, {x + 1, top, z + 1}}, 2);
      grid.set({x, top, z}, 1);
    }
  }
  LiveMeshes meshes;
  meshes.finish(scene, {});
  (void)meshes.take();
  std::mt19937 random(5);
  std::size_t bytes = 0;
  std::size_t bytes_of_chunks = 0;
  constexpr int kDigs = 60;
  for (int i = 0; i < kDigs; ++i) {
    Grid& grid = scene.edit(handle).grid;
    IVec3 top{static_cast<int>(random() % 256), 128, static_cast<int>(random() % 256)};
    while (grid.get(top) == kAir) --top.y;
    EXPECT_TRUE(grid.set(top, kAir)) << i;
    meshes.finish(scene, {});
    for (const SurfaceUpdate& update : meshes.take()) {
      if (update.surface == nullptr) continue;
      bytes_of_chunks += update.surface->quads.size() * 88;
      for (const SurfaceRegion& region : update.surface->regions) {
        const int bit = region.region.x + 4 * (region.region.y + 4 * region.region.z);
        if ((update.changed_regions >> bit & 1U) == 0) continue;
        bytes += static_cast<std::size_t>(region.opaque[6] - region.opaque[0]) * 88;
        bytes += static_cast<std::size_t>(region.transparent[6] - region.transparent[0]) * 88;
      }
    }
  }
  EXPECT_GT(bytes, 0U);
  EXPECT_LT(bytes / kDigs, 50'000U);
  EXPECT_LT(2 * bytes, bytes_of_chunks);
}

TEST(LiveCallbacks, ConvertAndTakeSurfacesOnWorkers) {
  SceneEditor editor(5);
  LiveMeshOptions wanted;
  wanted.region_edge = kChunkEdge;  // as the quads that it is compared with
  wanted.workers = {3};
  wanted.convert = [](const SurfaceUpdate& update) {
    return std::make_shared<const std::size_t>(update.surface->quads.size());
  };
  LiveMeshes* meshes = nullptr;
  std::mutex mutex;
  std::map<std::pair<GridHandle, std::array<int, 3>>, std::size_t> taken;
  const auto take = [&] {
    const std::lock_guard lock(mutex);  // keeps the order of `take` calls
    for (const SurfaceUpdate& update : meshes->take()) {
      const std::pair key{update.grid, std::array{update.chunk.x, update.chunk.y, update.chunk.z}};
      if (update.surface == nullptr) {
        taken.erase(key);
        continue;
      }
      const auto& converted = update.surface->converted;
      taken[key] = converted == nullptr ? 0 : *static_cast<const std::size_t*>(converted.get());
      EXPECT_EQ(taken[key], update.surface->quads.size());
    }
  };
  wanted.on_ready = [&] {
    EXPECT_LT(meshes->pending(), 1'000'000U);
    take();
  };
  LiveMeshes live(wanted);
  meshes = &live;
  for (int i = 0; i < 100; ++i) {
    editor.edit();
    live.update(editor.scene, editor.eye());
  }
  live.finish(editor.scene, {});
  take();
  EXPECT_EQ(live.pending(), 0U);
  std::size_t with_quads = 0;
  for (const GridHandle handle : grids_of_drawn(editor.scene, InstanceFilter::Visible)) {
    const Grid& grid = editor.scene.grids()[handle].grid;
    for (const IVec3 chunk : grid.chunks()) {
      QuadBuffer quads;
      BlockyMesher().mesh(grid.neighbourhood(chunk), editor.scene.types, {}, quads);
      if (quads.empty()) continue;
      ++with_quads;
      EXPECT_EQ((taken[{handle, {chunk.x, chunk.y, chunk.z}}]), quads.size());
    }
  }
  EXPECT_EQ(taken.size(), with_quads);
}

TEST(LiveCallbacks, PassExceptionsToFinish) {
  OneGrid one;
  one.grid().fill_box({{0, 0, 0}, {200, 10, 10}}, 1);
  for (const bool from_convert : {false, true}) {
    LiveMeshOptions wanted;
    std::atomic<int> calls{0};
    const auto fail = [&] {
      if (calls++ == 0) throw std::runtime_error("the disk is full");
    };
    if (from_convert) {
      wanted.convert = [&](const SurfaceUpdate&) {
        fail();
        return std::make_shared<const int>(1);
      };
    } else {
      wanted.on_ready = fail;
    }
    LiveMeshes meshes(wanted);
    try {
      meshes.finish(one.scene, {});
      ADD_FAILURE() << "nothing arrived";
    } catch (const std::runtime_error& why) {
      EXPECT_STREQ(why.what(), "the disk is full");
    }
    meshes.finish(one.scene, {});
    const std::vector<SurfaceUpdate> updates = meshes.take();
    EXPECT_EQ(updates.size(), one.grid().chunk_count());
    int without = 0;
    for (const SurfaceUpdate& update : updates) without += update.surface->converted == nullptr ? 1 : 0;
    EXPECT_EQ(without, from_convert ? 1 : static_cast<int>(updates.size()));
    EXPECT_EQ(meshes.pending(), 0U);
  }
}

// All workers are in a callback for 60 frames: `update` and `take` return, with the surfaces that are ready.
TEST(LiveCallbacks, BlockNoFrame) {
  for (const bool in_convert : {true, false}) {
    OneGrid one;
    one.grid().fill_box({{0, 0, 0}, {300, 10, 10}}, 1);
    std::atomic<int> blocked{0};
    std::atomic<bool> is_open{false};
    const auto wait = [&] {
      ++blocked;
      is_open.wait(false);
      --blocked;
    };
    LiveMeshOptions wanted;
    wanted.workers = {2};
    if (in_convert) {
      wanted.convert = [&](const SurfaceUpdate&) {
        wait();
        return std::make_shared<const int>(1);
      };
    } else {
      wanted.on_ready = wait;
    }
    LiveMeshes meshes(wanted);
    std::map<int, const ChunkSurface*> taken;
    std::vector<SurfaceUpdate> held;
    const auto take = [&] {
      for (SurfaceUpdate& update : meshes.take()) {
        taken[update.chunk.x] = update.surface.get();
        held.push_back(std::move(update));
      }
    };
    meshes.update(one.scene, {});
    while (blocked != 2) std::this_thread::yield();
    for (int frame = 0; frame < 60; ++frame) {
      one.grid().set(frame % 300, 9, 3, kAir);
      meshes.update(one.scene, {});
      take();
    }
    EXPECT_EQ(blocked, 2);
    EXPECT_LE(taken.size(), in_convert ? 0U : 2U);
    EXPECT_GT(meshes.pending(), 0U);
    is_open = true;
    is_open.notify_all();
    meshes.finish(one.scene, {});
    take();
    ASSERT_EQ(taken.size(), one.grid().chunk_count());
    for (const auto& [x, surface] : taken) EXPECT_EQ(surface->converted != nullptr, in_convert) << x;
  }
}

TEST(LiveCallbacks, AllowTakingDuringDestruction) {
  OneGrid one;
  one.grid().fill_box({{0, 0, 0}, {600, 21, 301}}, 1);
  for (int i = 0; i < 20; ++i) {
    std::atomic<LiveMeshes*> meshes{nullptr};
    LiveMeshOptions wanted;
    wanted.workers = {2};
    wanted.on_ready = [&] { static_cast<void>(meshes.load()->take()); };
    LiveMeshes live(wanted);
    meshes = &live;
    live.update(one.scene, {});
  }
}

TEST(LiveBudget, LeavesRestForNextCall) {
  OneGrid one;
  one.grid().fill_box({{0, 0, 0}, {640, 10, 10}}, 1);
  LiveMeshes meshes;
  meshes.finish(one.scene, {});
  ShownSurfaces shown;
  for (std::size_t left = 10; left > 0; --left) {
    EXPECT_EQ(meshes.pending(), left);
    const std::vector<SurfaceUpdate> one_more = meshes.take(1);
    ASSERT_EQ(one_more.size(), 1U);
    shown.apply(one_more);
    if (left != 5) continue;
    // A waiting surface is replaced and delivered once.
    one.grid().fill_box({{0, 10, 0}, {640, 12, 10}}, 1);
    meshes.finish(one.scene, {});
    shown.apply(meshes.take());
    break;
  }
  EXPECT_EQ(meshes.pending(), 0U);
  expect_surfaces(shown, one.scene, {});
  EXPECT_TRUE(meshes.take(0).empty());
}

TEST(LiveBudget, CountsConvertedData) {
  OneGrid one;
  one.grid().fill_box({{0, 0, 0}, {640, 10, 10}}, 1);
  for (const bool is_size_known : {true, false}) {
    LiveMeshOptions wanted;
    wanted.convert = [&](const SurfaceUpdate&) {
      return ConvertedSurface(std::make_shared<const int>(1), is_size_known ? 1000 : 0);
    };
    LiveMeshes meshes(wanted);
    meshes.finish(one.scene, {});
    const std::vector<SurfaceUpdate> three = meshes.take(is_size_known ? 2500 : 1);
    ASSERT_EQ(three.size(), is_size_known ? 3U : 1U);
    const ChunkSurface& surface = *three.front().surface;
    EXPECT_EQ(surface.converted_bytes, is_size_known ? 1000U : 0U);
    EXPECT_EQ(surface.upload_bytes(), is_size_known ? 1000U : surface.bytes());
  }
}

// The game drops old surfaces, and keeps only their converted data.
TEST(LiveMeshesMemory, IsReleasedByWorkers) {
  struct Vertices {
    explicit Vertices(std::atomic<int>& count, std::thread::id caller) : on_caller(count), calling(caller) {}
    Vertices(const Vertices&) = delete;
    Vertices& operator=(const Vertices&) = delete;
    ~Vertices() { on_caller += std::this_thread::get_id() == calling ? 1 : 0; }
    std::atomic<int>& on_caller;
    std::thread::id calling;
  };
  OneGrid one;
  one.grid().fill_box({{0, 0, 0}, {256, 10, 10}}, 1);
  std::atomic<int> on_caller{0};
  std::map<int, std::shared_ptr<const void>> converted;
  std::map<int, std::shared_ptr<const ChunkSurface>> surfaces;
  for (const unsigned workers : {1U, 3U}) {
    LiveMeshOptions wanted;
    wanted.workers = {workers};
    wanted.convert = [&, calling = std::this_thread::get_id()](const SurfaceUpdate&) {
      return std::make_shared<const Vertices>(on_caller, calling);
    };
    auto meshes = std::make_unique<LiveMeshes>(wanted);
    for (int i = 0; i < 40; ++i) {
      one.grid().fill_box({{0, 10, i % 10}, {256, 11, i % 10 + 1}}, static_cast<VoxelType>(i % 3));
      meshes->finish(one.scene, {});
      for (const SurfaceUpdate& update : meshes->take()) {
        if (i % 2 == 0) converted[update.chunk.x] = update.surface->converted;
        surfaces[update.chunk.x] = update.surface;
      }
    }
    EXPECT_EQ(on_caller, 0);
    meshes.reset();
    converted.clear();
    surfaces.clear();
    EXPECT_EQ(on_caller.exchange(0), 8) << "of each chunk, the last vertices and those before";
  }
}

TEST(LiveMeshesDeathTest, RejectsUnknownRegionEdge) {
  LiveMeshOptions wanted;
  wanted.region_edge = 24;
  QUOIN_EXPECT_MISTAKE(LiveMeshes{wanted}, "16, 32 or 64");
}

}  // namespace
}  // namespace quoin
