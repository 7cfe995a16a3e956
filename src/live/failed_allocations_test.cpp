// Consumers of changes stay correct if memory runs out during an update. This file replaces `operator new` of the test
// program, so that a chosen allocation of the calling thread fails. It also counts allocations for other tests.
//
// If QUOIN_TEST_BLOCK_FUNCTIONS is in the environment, the program sets functions for large blocks. A chosen call of
// these fails too, and they check all calls of all tests (block_arena_for_tests.h).

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <new>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/core/memory.h>
#include <quoin/grid/connected.h>
#include <quoin/grid/downsample.h>
#include <quoin/grid/texture.h>
#include <quoin/live/live_light.h>
#include <quoin/live/live_meshes.h>
#include <quoin/live/live_tracer.h>
#include <quoin/render/propagated_light.h>
#include <quoin/scene/level_of_detail.h>
#include <quoin/scene/scene_faces.h>
#include <quoin/scene/scene_query.h>
#include <quoin/scene/scene_tracer.h>
#include <quoin/scene/smooth_scene.h>
#include <quoin/scene/solid_shapes.h>
#include <quoin/store/world_saver.h>

#include "core/coordinates/chunk_order.h"
#include "core/memory/block_arena_for_tests.h"
#include "grid/shapes/shape_types_for_tests.h"
#include "live/allocations_for_tests.h"
#include "live/live_test_support.h"
#include "render/light/emissive_cells.h"
#include "render/light/surface/light_bricks.h"
#include "scene/surfaces.h"
#include "store/world/world_for_tests.h"

namespace {

constinit thread_local std::int64_t allocations_left = -1;  // before one fails; negative: none fails
constinit thread_local std::int64_t allocations_made = 0;
constinit thread_local std::int64_t large_frees = 0;
// The same for all other threads together.
constinit std::atomic<std::int64_t> allocations_left_of_workers = -1;
const std::thread::id kTestThread = std::this_thread::get_id();

// Returns true if the allocation must fail.
bool fails() {
  if (allocations_left >= 0) return allocations_left-- == 0;
  if (allocations_left_of_workers.load() < 0 || std::this_thread::get_id() == kTestThread) return false;
  return allocations_left_of_workers.fetch_sub(1) == 0;
}

bool are_functions_wanted() {
  return std::getenv("QUOIN_TEST_BLOCK_FUNCTIONS") != nullptr;
}

struct Functions {
  Functions() {
    if (!are_functions_wanted()) return;
    static constinit quoin::BlockArena arena;
    arena.fails = [] {
      ++allocations_made;
      return fails();
    };
    are_set = quoin::set_block_functions(arena.functions());
  }
  bool are_set = false;
};
// Initialised before other objects, which may make large blocks.
[[gnu::init_priority(101)]] const Functions functions_of_program;

}  // namespace

// Not inlined: GCC would warn that `free` does not match `new`.
[[gnu::noinline]] void* operator new(std::size_t bytes) {
  if (fails()) throw std::bad_alloc();
  ++allocations_made;
  if (void* const memory = std::malloc(bytes == 0 ? 1 : bytes)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
#ifdef __GLIBC__
  constexpr std::size_t kLarge = 32 * 1024;
  if (memory != nullptr && ::malloc_usable_size(memory) >= kLarge) ++large_frees;
#endif
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  operator delete(memory);
}

namespace quoin {

std::int64_t allocations_of_this_thread() {
  return allocations_made;
}
std::int64_t large_frees_of_this_thread() {
  return large_frees;
}
std::int64_t fail_allocation(std::int64_t n) {
  return std::exchange(allocations_left, n);
}

namespace {

constexpr VoxelType kStone = 1;
constexpr VoxelType kLamp = 2;
constexpr VoxelType kGlass = 3;

/// A scene of a few small grids, and random edits of all parts that consumers follow.
class BusyScene {
 public:
  explicit BusyScene(bool has_shapes = false) {
    for (const auto& [visibility, emission] :
         {std::pair{Visibility::Opaque, 0.0F}, {Visibility::Opaque, 1.0F}, {Visibility::Transparent, 0.0F}}) {
      VoxelProperties properties;
      properties.name = "type " + std::to_string(scene.types.size());
      properties.colour = {200, 150, 90, 120};
      properties.visibility = visibility;
      properties.emission = emission;
      EXPECT_TRUE(scene.types.add(properties));
    }
    if (has_shapes) {
      EXPECT_TRUE(scene.types.add({.name = "fence", .shapes = shapes_for_tests::fence()}));
    }
    for (int i = 0; i < 3; ++i) {
      SceneGrid grid;
      grid.grid.fill_box({{58, 0, 0}, {70, 3, 9}}, kStone);
      grid.grid.set({60, 3, 4}, kLamp);
      if (i == 1) fill_field(grid.field, {20, 1, 4});
      scene.add_instance({.name = "", .grid = scene.add_grid(std::move(grid)), .position = {20.0 * i, 0.0, 1.0 * i}});
    }
  }

  void edit() {
    const std::size_t types = scene.types.size();
    scene.edit(scene.grids().handles().front()).grid.set(voxel(), static_cast<VoxelType>(below(types)));
    for (int i = 0; i < 3 && !edits_voxels_only; ++i) {
      const auto grids = scene.grids().handles();
      const auto instances = scene.instances().handles();
      SceneGrid& grid = scene.edit(grids[below(grids.size())]);
      switch (below(10)) {
        case 0:
        case 1:
        case 2:
          grid.grid.set(voxel(), static_cast<VoxelType>(below(types)));
          break;
        case 3:
          grid.grid.fill_box({{56, 4, 2}, voxel() + IVec3(1, 2, 1)}, kGlass);
          break;
        case 4:
          if (grid.field.chunk_count() != 0) fill_field(grid.field, voxel());
          break;
        case 5:
          scene.add_instance({.name = "", .grid = grids[below(grids.size())], .position = DVec3(voxel())});
          break;
        case 6: {
          Instance& instance = scene.edit(instances[below(instances.size())]);
          instance.visible = below(3) != 0;
          instance.position.y += 1.0;
          break;
        }
        case 7:  // the chunk disappears
          grid.grid.fill_box({{64, 0, 0}, {128, 64, 64}}, kAir);
          break;
        case 8:
          if (instances.size() > 4) scene.remove_instance(instances[below(instances.size())]);
          break;
        default: {
          VoxelProperties properties = scene.types[kGlass];
          properties.visibility = below(2) == 0 ? Visibility::Opaque : Visibility::Transparent;
          properties.collides = below(2) == 0;
          properties.colour.r = static_cast<std::uint8_t>(below(256));
          scene.types.replace(kGlass, properties);
        }
      }
    }
  }
  /// Returns the first grid, which has no field.
  [[nodiscard]] const Grid& grid() const { return scene.grids()[scene.grids().handles().front()].grid; }

  Scene scene;
  bool edits_voxels_only = false;

 private:
  std::size_t below(std::size_t end) { return random_() % end; }
  IVec3 voxel() {
    const auto number = [&](std::size_t end) { return static_cast<int>(below(end)); };
    return {56 + number(16), number(8), number(10)};
  }
  static void fill_field(DensityGrid& field, IVec3 centre) {
    field.edit({centre - 5, centre + 6}, [&](IVec3 sample, DensitySample before) {
      const float distance = glm::length(Vec3(sample - centre)) - 3.0F;
      return distance < before.density ? DensitySample{distance, kStone} : before;
    });
  }

  std::mt19937 random_{11};
};

/// A partial grid whose chunks come and go: solid ones, plates with a hole, lamps, stairs and leaves, and air.
class ComingChunks {
 public:
  ComingChunks() {
    VoxelProperties properties;
    EXPECT_TRUE(types.add(properties));
    properties.emission = 1.0F;
    properties.colour = {250, 200, 150, 255};
    EXPECT_TRUE(types.add(properties));
    constexpr Visibility kClear = Visibility::Transparent;
    EXPECT_TRUE(types.add({.name = "stairs", .colour = {}, .visibility = kClear, .blocks_light = true}));
    EXPECT_TRUE(types.add({.name = "leaves", .colour = {}, .visibility = kClear, .light_cost = 2}));
    grid.make_partial();
  }

  void edit() {
    for (int i = 0; i < 2; ++i) {
      const IVec3 chunk{below(2), below(3), below(2)};
      const int kind = below(5);
      if (kind == 0) {
        grid.unload_chunk(chunk);
        continue;
      }
      Chunk voxels = kind == 1 ? Chunk(kStone) : Chunk();
      if (kind > 2) {
        for (int z = 0; z < kChunkEdge; ++z) {
          for (int x = 0; x < kChunkEdge; ++x) voxels.set({x, 30, z}, x % 31 == 7 && z % 29 == 3 ? kAir : kStone);
        }
        const auto roof = static_cast<VoxelType>(3 + below(2));  // stairs or leaves
        for (int n = 0; n < 1'000; ++n) voxels.set({10 + n % 40, 31, 10 + n / 40}, roof);
        voxels.set({30, 31, 30}, kLamp);
        voxels.set({2, 29, 60}, kLamp);
      }
      grid.load_chunk(chunk, std::move(voxels));
    }
  }
  /// Returns some rows of light of each chunk.
  [[nodiscard]] static std::map<IVec3, std::vector<std::uint16_t>, ByZyx> rows_of(const PropagatedLight& light) {
    std::map<IVec3, std::vector<std::uint16_t>, ByZyx> rows;
    std::array<std::uint16_t, kChunkEdge> row;
    for (int i = 0; i < 4 * 6 * 4; ++i) {
      const IVec3 chunk{i % 4 - 1, i / 4 % 6 - 2, i / 24 - 1};
      for (const int y : {0, 17, 29, 31, 33, 63}) {
        for (const int z : {0, 3, 30, 63}) {
          light.read_row(chunk * kChunkEdge + IVec3(0, y, z), row);
          rows[chunk].insert(rows[chunk].end(), row.begin(), row.end());
        }
      }
    }
    return rows;
  }

  /// Returns true if a chunk or one next to it has voxels, so that its light can reach a surface.
  [[nodiscard]] bool is_near_voxels(IVec3 chunk) const {
    for (int i = 0; i < 27; ++i) {
      if (grid.find_chunk(chunk + IVec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)) != nullptr) return true;
    }
    return false;
  }

  Grid grid;
  VoxelRegistry types;

 private:
  int below(int end) { return static_cast<int>(random_() % static_cast<unsigned>(end)); }

  std::mt19937 random_{5};
};

/// Calls `update` after edits while the n-th allocation fails, for growing n. Calls it again without a failure, and
/// expects `is_current` to return true. `growth`: factor from each n to the next.
template <class Busy>
void expect_recovery(Busy& busy, const std::function<void()>& update, const std::function<bool()>& is_current,
                     double growth = 1.125) {
  update();
  int failures = 0;
  int idle = 0;  // updates without an allocation: the edit was none that the consumer follows
  std::int64_t last_reached = 0;
  std::int64_t n = 0;
  while (n < 100'000 && n < 9 + 3 * last_reached && idle < 200) {
    busy.edit();
    allocations_left = n;
    bool has_failed = false;
    try {
      update();
    } catch (const std::bad_alloc&) {
      has_failed = true;
    }
    const std::int64_t left = fail_allocation(-1);
    idle += left == n ? 1 : 0;
    if (left == n) continue;
    if (left < 0) last_reached = n;
    failures += has_failed ? 1 : 0;
    if (n % 3 == 0) busy.edit();
    update();
    ASSERT_TRUE(is_current()) << "allocation " << n << (has_failed ? " failed" : "");
    n = 1 + static_cast<std::int64_t>(static_cast<double>(n) * growth);
  }
  EXPECT_GT(failures, 0);
}

TEST(FailedAllocations, IncludeBlocksOfTheFunctions) {
  if (!are_functions_wanted()) GTEST_SKIP() << "QUOIN_TEST_BLOCK_FUNCTIONS is not set";
  ASSERT_TRUE(functions_of_program.are_set) << "a large block was made before main";
  BlockVector<std::byte> block(2 * kLargeBlock, std::byte{9});
  fail_allocation(0);
  EXPECT_THROW(block.resize(3 * kLargeBlock), std::bad_alloc);
  fail_allocation(-1);
  EXPECT_EQ(block, BlockVector<std::byte>(2 * kLargeBlock, std::byte{9}));
}

TEST(FailedAllocations, LeaveTextureSetsUnchanged) {
  std::vector<Texture> textures;
  for (const int size : {16, 16, 32, 16, 32, 16}) {
    const auto shade = static_cast<std::uint8_t>(10 * textures.size());
    const auto bytes = static_cast<std::size_t>(4 * size * size);
    textures.push_back(
        Texture::from_image("t", AlphaImage{size, size, std::vector<std::uint8_t>(bytes, shade)}).value());
  }
  TextureSet set(2);
  TextureSet expected(2);
  int failures = 0;
  for (std::size_t i = 0; i < textures.size(); ++i) {
    bool has_failed = true;
    for (std::int64_t n = 0; has_failed; ++n) {
      allocations_left = n;
      try {
        set.add(textures[i]);
        has_failed = false;
      } catch (const std::bad_alloc&) {
        ++failures;
      }
      allocations_left = -1;
      ASSERT_EQ(set.find(textures[i]).has_value(), !has_failed);
      if (has_failed) {
        ASSERT_EQ(set.arrays().size(), expected.arrays().size());
      }
      ASSERT_EQ(set.bytes(), expected.bytes() + (has_failed ? 0 : textures[i].bytes()));
    }
    EXPECT_EQ(set.find(textures[i]), expected.add(textures[i]));
    for (std::size_t j = 0; j <= i; ++j) EXPECT_EQ(set.find(textures[j]), expected.find(textures[j]));
  }
  EXPECT_GT(failures, 6);
}

TEST(FailedAllocations, KeepSurfaces) {
  BusyScene busy;
  Surfaces surfaces(busy.scene.types);
  expect_recovery(
      busy, [&] { surfaces.update(busy.scene.types); },
      [&] {
        const Surfaces expected(busy.scene.types);
        return surfaces[kGlass].colour == expected[kGlass].colour && surfaces[kGlass].ior == expected[kGlass].ior;
      });
}

TEST(FailedAllocations, KeepFaceCounts) {
  BusyScene busy;
  SceneFaces faces;
  expect_recovery(
      busy, [&] { faces.update(busy.scene, {1}); },
      [&] { return faces.counts() == count_faces(busy.scene, InstanceFilter::Visible, {1}); });
}

// The shapes that a game holds after it has replaced the reported chunks.
using HeldShapes = std::map<IVec3, std::vector<IBox>, ByZyx>;

void take_shapes(SolidShapes& shapes, const BusyScene& busy, HeldShapes& held) {
  for (const IVec3 chunk : shapes.update(busy.grid(), busy.scene.types, {1})) {
    held[chunk] = shapes.boxes(chunk);
    if (held[chunk].empty()) held.erase(chunk);
  }
}

TEST(FailedAllocations, KeepSolidShapes) {
  BusyScene busy;
  SolidShapes shapes;
  HeldShapes held;
  expect_recovery(
      busy,
      [&] {
        const std::vector<IVec3> changed = shapes.update(busy.grid(), busy.scene.types, {1});
        const std::int64_t left = fail_allocation(-1);
        for (const IVec3 chunk : changed) {
          held[chunk] = shapes.boxes(chunk);
          if (held[chunk].empty()) held.erase(chunk);
        }
        fail_allocation(left);
      },
      [&] {
        SolidShapes fresh;
        HeldShapes expected;
        take_shapes(fresh, busy, expected);
        return held == expected;
      });
}

using Hit = std::tuple<InstanceHandle, IVec3, double>;

std::vector<std::optional<Hit>> hits_of(const SceneTracer& tracer) {
  std::vector<std::optional<Hit>> hits;
  for (int x = 0; x < 130; x += 3) {
    for (int z = 0; z < 12; z += 2) {
      const auto hit = first_hit(tracer, {{x + 0.4, 50.0, z + 0.3}, {0.01, -1.0, 0.02}});
      hits.push_back(hit ? std::optional<Hit>({hit->instance, hit->voxel, hit->t}) : std::nullopt);
    }
  }
  return hits;
}

std::vector<SelectedInstance> all_halved(const Scene& scene) {
  std::vector<SelectedInstance> selected;
  for (const InstanceHandle handle : scene.instances().handles()) selected.push_back({handle, Detail::Mid, 1, 100.0});
  return selected;
}

TEST(FailedAllocations, KeepTracer) {
  BusyScene busy;
  SceneTracer tracer(busy.scene, InstanceFilter::Visible, {1});
  expect_recovery(
      busy, [&] { tracer.update({1}); },
      [&] { return hits_of(tracer) == hits_of(SceneTracer(busy.scene, InstanceFilter::Visible, {1})); });
}

TEST(FailedAllocations, KeepHalvedGrids) {
  BusyScene busy;
  SceneTracer tracer(busy.scene, InstanceFilter::Visible, {1});
  std::optional<SceneTracer> detailed;
  const auto halved = [&](const SceneTracer& of) { return of.with_detail(all_halved(busy.scene), {1}); };
  expect_recovery(
      busy,
      [&] {
        detailed.reset();
        tracer.update({1});
        detailed.emplace(halved(tracer));
      },
      [&] {
        const SceneTracer fresh(busy.scene, InstanceFilter::Visible, {1});
        return hits_of(*detailed) == hits_of(halved(fresh));
      });
}

TEST(FailedAllocations, KeepSelectedDetail) {
  BusyScene busy;
  Camera camera;
  camera.position = {40.0, 5.0, 200.0};
  const auto select = [&](DetailSelector& selector) {
    std::vector<SelectedInstance> selected;
    selector.select(busy.scene, camera, 320, 200, {}, selected);
    return selected;
  };
  DetailSelector selector;
  std::vector<SelectedInstance> selected;
  expect_recovery(
      busy, [&] { selected = select(selector); },
      [&] {
        DetailSelector fresh;
        const std::vector<SelectedInstance> expected = select(fresh);
        return std::equal(selected.begin(), selected.end(), expected.begin(), expected.end(),
                          [](const SelectedInstance& a, const SelectedInstance& b) {
                            return a.instance == b.instance && a.level == b.level && a.distance == b.distance;
                          });
      });
}

TEST(FailedAllocations, KeepSmoothScene) {
  BusyScene busy;
  SmoothScene smooth;
  const auto hits = [](const Scene& scene) {
    std::vector<double> found;
    for (const std::optional<Hit>& hit : hits_of(SceneTracer(scene, InstanceFilter::Visible, {1}))) {
      found.push_back(hit ? std::get<2>(*hit) : -1.0);
    }
    return found;
  };
  expect_recovery(
      busy, [&] { ASSERT_TRUE(smooth.update(busy.scene, {1})); },
      [&] {
        SmoothScene fresh;
        return fresh.update(busy.scene, {1}) && hits(smooth.scene()) == hits(fresh.scene());
      },
      8.0);
}

std::vector<LightLevels> levels_of(const SceneLight& light, const Scene& scene) {
  std::vector<LightLevels> levels;
  for (const GridHandle grid : scene.grids().handles()) {
    for (int i = 0; i < 1'000; ++i) {
      levels.push_back(light.of(grid).light->at({50 + i % 10 * 3, i / 10 % 10 * 2 - 2, i / 100 * 2 - 4}));
    }
  }
  return levels;
}

TEST(FailedAllocations, KeepLight) {
  BusyScene busy;
  SceneLight light;
  expect_recovery(
      busy, [&] { light.update(busy.scene, {1}); },
      [&] {
        SceneLight fresh;
        fresh.update(busy.scene, {1});
        return levels_of(light, busy.scene) == levels_of(fresh, busy.scene);
      });
}

// After each update, all light is right, and the changes since the one before contain all chunks with other light.
TEST(FailedAllocations, KeepLightOfChunksThatComeAndGo) {
  ComingChunks coming;
  PropagatedLight light;
  ChangeCursor cursor;
  auto shown = ComingChunks::rows_of(light);
  expect_recovery(
      coming, [&] { light.update(coming.grid, coming.types, {1}); },
      [&] {
        PropagatedLight fresh;
        fresh.update(coming.grid, coming.types, {1});
        auto rows = ComingChunks::rows_of(light);
        const GridChanges changes = light.changes_since(cursor);
        for (const auto& [chunk, row] : rows) {
          const auto is_it = [&, at = chunk](const ChunkChange& change) { return change.chunk == at; };
          const bool is_reported =
              std::any_of(changes.items_unless_all().begin(), changes.items_unless_all().end(), is_it);
          if (row != shown[chunk] && !changes.all && !is_reported && coming.is_near_voxels(chunk)) return false;
        }
        shown = std::move(rows);
        return shown == ComingChunks::rows_of(fresh);
      });
}

// A failed update leaves nothing in the solver of its thread that changes the next region.
TEST(FailedAllocations, KeepLightOfNextRegion) {
  const ComingChunks types_only;
  const VoxelRegistry& types = types_only.types;
  constexpr IBox kRoof{{4, 8, 4}, {40, 9, 40}};
  Grid stairs;
  Grid stone;
  for (Grid* const grid : {&stairs, &stone}) grid->fill_box({{0, 0, 0}, {44, 8, 44}}, kStone);
  stairs.fill_box(kRoof, 3);
  stone.fill_box(kRoof, kStone);
  PropagatedLight expected;
  expected.update(stone, types, {1});
  const auto expected_rows = ComingChunks::rows_of(expected);
  bool has_failed = true;
  for (std::int64_t n = 0; has_failed; ++n) {
    bool is_right = false;
    std::thread([&] {
      PropagatedLight light;
      PropagatedLight next;
      allocations_left = n;
      try {
        light.update(stairs, types, {1});
        has_failed = false;
      } catch (const std::bad_alloc&) {
      }
      allocations_left = -1;
      next.update(stone, types, {1});
      is_right = ComingChunks::rows_of(next) == expected_rows && next.at({20, 8, 20}) == expected.at({20, 8, 20});
    }).join();
    ASSERT_TRUE(is_right) << "after " << n << " allocations";
  }
}

TEST(FailedAllocations, KeepLiveLight) {
  BusyScene busy;
  LiveLight light;
  expect_recovery(
      busy, [&] { light.update(busy.scene); },
      [&] {
        light.finish(busy.scene);
        SceneLight fresh;
        fresh.update(busy.scene, {1});
        return levels_of(light.shown(), busy.scene) == levels_of(fresh, busy.scene);
      });
}

TEST(FailedAllocations, KeepLiveTracer) {
  BusyScene busy;
  LiveTracer tracer({InstanceFilter::Visible, {1}});
  expect_recovery(
      busy, [&] { tracer.update(busy.scene); },
      [&] {
        tracer.finish(busy.scene);
        return hits_of(tracer.shown()) == hits_of(SceneTracer(busy.scene, InstanceFilter::Visible, {1}));
      });
}

TEST(FailedAllocations, KeepLiveTracerIfWorkerFails) {
  BusyScene busy;
  LiveTracer tracer({InstanceFilter::Visible, {1}});
  tracer.finish(busy.scene);
  int failures = 0;
  for (std::int64_t n = 0; n < 60; ++n) {
    for (int i = 0; i < 3; ++i) busy.edit();
    const auto shown = hits_of(tracer.shown());
    allocations_left_of_workers = n;
    try {
      tracer.finish(busy.scene);
    } catch (const std::bad_alloc&) {
      ++failures;
      EXPECT_TRUE(tracer.is_late());
      EXPECT_EQ(hits_of(tracer.shown()), shown) << "the tracer shown stays";
    }
    allocations_left_of_workers = -1;
    tracer.finish(busy.scene);
    ASSERT_EQ(hits_of(tracer.shown()), hits_of(SceneTracer(busy.scene, InstanceFilter::Visible, {1}))) << n;
  }
  EXPECT_GT(failures, 10);
}

// The held bricks that let light pass, with their numbers.
std::map<std::tuple<int, int, int, int>, std::vector<std::uint32_t>> contents_of(const LightBricks& bricks) {
  std::map<std::tuple<int, int, int, int>, std::vector<std::uint32_t>> contents;
  for (const LightBricks::Brick& each : bricks.bricks()) {
    if (each.is_held == 0 || each.what == LightBricks::kAllOpaque) continue;
    std::vector<std::uint32_t>& numbers = contents[{each.grid, each.brick.x, each.brick.y, each.brick.z}];
    const auto first = bricks.numbers().begin() + each.what;
    if ((each.what & LightBricks::kIsUniform) != 0) {
      numbers = {each.what};
    } else {
      numbers.assign(first, first + LightBricks::kNumbers);
    }
  }
  return contents;
}

TEST(FailedAllocations, KeepLightBricks) {
  BusyScene busy;
  SceneLight light;
  LightBricks bricks;
  expect_recovery(
      busy,
      [&] {
        const std::int64_t left = std::exchange(allocations_left, -1);
        light.update(busy.scene, {1});
        allocations_left = left;
        bricks.update(busy.scene, light, {1});
      },
      [&] {
        LightBricks fresh;
        fresh.update(busy.scene, light, {1});
        return contents_of(bricks) == contents_of(fresh);
      });
}

TEST(FailedAllocations, KeepEmissiveCells) {
  BusyScene busy;
  EmissiveCells cells;
  const auto boxes = [](const EmissiveCells& of) {
    std::vector<IBox> found;
    of.for_each([&](const EmissiveCell& cell) { found.push_back(cell.box); });
    return found;
  };
  expect_recovery(
      busy, [&] { cells.update(busy.grid(), busy.scene.types); },
      [&] {
        EmissiveCells fresh;
        fresh.update(busy.grid(), busy.scene.types);
        return boxes(cells) == boxes(fresh);
      });
}

TEST(FailedAllocations, KeepConnectedPieces) {
  BusyScene busy;
  ConnectedPieces pieces;
  expect_recovery(
      busy, [&] { pieces.update(busy.grid(), {1}); },
      [&] {
        ConnectedPieces fresh;
        fresh.update(busy.grid(), {1});
        return std::ranges::equal(pieces.pieces(), fresh.pieces(), [](const auto& a, const auto& b) {
          return a.box == b.box && a.voxels == b.voxels && a.first == b.first;
        });
      });
}

TEST(FailedAllocations, KeepPyramid) {
  BusyScene busy;
  GridPyramid pyramid;
  expect_recovery(
      busy, [&] { pyramid.update(busy.grid(), busy.scene.types, 2, {1}); },
      [&] {
        GridPyramid fresh;
        fresh.update(busy.grid(), busy.scene.types, 2, {1});
        if (pyramid.levels() != fresh.levels()) return false;
        for (int level = 1; level <= fresh.levels(); ++level) {
          const Grid& a = pyramid.level(level);
          const Grid& b = fresh.level(level);
          const auto is_same = [&](IVec3 chunk) { return *a.find_chunk(chunk) == *b.find_chunk(chunk); };
          if (a.chunks() != b.chunks() || !std::ranges::all_of(a.chunks(), is_same)) return false;
        }
        return true;
      });
}

bool has_same_surfaces(const ShownSurfaces& a, const ShownSurfaces& b) {
  return std::ranges::equal(a.all(), b.all(), [](const SurfaceUpdate& x, const SurfaceUpdate& y) {
    return x.grid == y.grid && x.chunk == y.chunk && x.content == y.content && x.surface->quads == y.surface->quads &&
           x.surface->shapes == y.surface->shapes &&
           x.surface->smooth.positions.size() == y.surface->smooth.positions.size();
  });
}

TEST(FailedAllocations, KeepLiveMeshes) {
  BusyScene busy(true);
  LiveMeshOptions options;
  options.workers = {1};
  LiveMeshes meshes(options);
  ShownSurfaces shown;
  expect_recovery(
      busy, [&] { meshes.update(busy.scene, {}); },
      [&] {
        meshes.finish(busy.scene, {});
        shown.apply(meshes.take());
        LiveMeshes fresh(options);
        fresh.finish(busy.scene, {});
        ShownSurfaces expected;
        expected.apply(fresh.take());
        return has_same_surfaces(shown, expected);
      });
}

ShownSurfaces surfaces_of(const Scene& scene) {
  LiveMeshOptions options;
  options.workers = {1};
  LiveMeshes fresh(options);
  fresh.finish(scene, {});
  ShownSurfaces expected;
  expected.apply(fresh.take());
  return expected;
}

bool has_same_quads(const ShownSurfaces& lit, const Scene& scene) {
  const ShownSurfaces expected = surfaces_of(scene);
  return std::ranges::equal(lit.all(), expected.all(), [](const SurfaceUpdate& x, const SurfaceUpdate& y) {
    return x.grid == y.grid && x.chunk == y.chunk && x.content == y.content;
  });
}

// Surfaces and light that a failed call would have shown are shown by the next one.
TEST(FailedAllocations, KeepTakenMeshes) {
  for (const bool is_lit : {false, true}) {
    BusyScene busy(true);
    LiveLight light({{}, {1}});
    LiveMeshOptions options;
    options.workers = {1};
    LiveMeshes meshes(options);
    if (is_lit) meshes.use_light(light);
    ShownSurfaces shown;
    int calls = 0;
    expect_recovery(
        busy,
        [&] {
          const std::int64_t left = std::exchange(allocations_left, -1);
          const bool is_complete = ++calls % 3 != 0;
          meshes.update(busy.scene, {});
          if (is_complete) meshes.finish(busy.scene, {});
          if (!is_complete) std::this_thread::sleep_for(std::chrono::milliseconds(2));
          allocations_left = left;
          const std::vector<SurfaceUpdate> taken = meshes.take();
          const std::int64_t left_then = std::exchange(allocations_left, -1);
          shown.apply(taken);
          allocations_left = left_then;
        },
        [&] {
          meshes.finish(busy.scene, {});
          shown.apply(meshes.take());
          if (is_lit) {
            SceneLight fresh;
            fresh.update(busy.scene, {1});
            return levels_of(light.shown(), busy.scene) == levels_of(fresh, busy.scene) &&
                   has_same_quads(shown, busy.scene);
          }
          return has_same_surfaces(shown, surfaces_of(busy.scene));
        });
  }
}

// A game that calls `update` only while surfaces are pending still sees every edit.
TEST(FailedAllocations, KeepLitMeshesPendingIfWorkersFail) {
  BusyScene busy(true);
  LiveLight light({{}, {1}});
  LiveMeshOptions options;
  options.workers = {1};
  LiveMeshes meshes(options);
  meshes.use_light(light);
  ShownSurfaces shown;
  int failures = 0;
  for (std::int64_t n = 0; n < 80; ++n) {
    for (int i = 0; i < 3; ++i) busy.edit();
    allocations_left_of_workers = n;
    std::uint64_t number = meshes.update(busy.scene, {});
    while (meshes.pending() != 0) {
      std::this_thread::sleep_for(std::chrono::microseconds(200));
      shown.apply(meshes.take());
      if (meshes.pending() == 0) break;
      try {
        number = meshes.update(busy.scene, {});
      } catch (const std::bad_alloc&) {
        ++failures;
      }
    }
    allocations_left_of_workers = -1;
    ASSERT_EQ(meshes.shown_update(), number) << n;
    ASSERT_TRUE(has_same_quads(shown, busy.scene)) << n;
    SceneLight fresh;
    fresh.update(busy.scene, {1});
    ASSERT_EQ(levels_of(light.shown(), busy.scene), levels_of(fresh, busy.scene)) << n;
  }
  EXPECT_GT(failures, 5);
}

#ifdef QUOIN_HAVE_STORE
// A failed save stores nothing; the next one stores everything. Destructors of the JSON library allocate memory, so no
// part that is stored as JSON changes.
TEST(FailedAllocations, KeepSavedWorld) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  BusyScene busy;
  busy.edits_voxels_only = true;
  auto world = WorldStore::create(path);
  ASSERT_TRUE(world);
  WorldSaver saver;
  const auto voxels_of = [](const Scene& scene) {
    std::multiset<std::tuple<std::int64_t, std::int64_t>> found;
    for (const GridHandle grid : scene.grids().handles()) {
      found.insert({scene.grids()[grid].grid.voxel_count(), scene.grids()[grid].field.solid_count()});
    }
    return found;
  };
  expect_recovery(
      busy, [&] { ASSERT_TRUE(saver.save(*world, busy.scene)); },
      [&] {
        if (!world->flush()) return false;
        const auto loaded = load_world(*world);
        return loaded && voxels_of(loaded->loaded.scene) == voxels_of(busy.scene) &&
               loaded->loaded.scene.instances().size() == busy.scene.instances().size() &&
               loaded->loaded.scene.types[kGlass] == busy.scene.types[kGlass];
      });
}

// A save that fails leaves no chunk that readers find but no commit writes, and no ticket that a flush waits for.
TEST(FailedAllocations, KeepWorldWithoutPartOfSave) {
  const WorldFolder folder;
  auto world = WorldStore::create(folder / "w.quoin");
  ASSERT_TRUE(world);
  WorldChanges first;
  first.put_types(ComingChunks().types);
  first.put_grid(0, {});
  first.put_chunk({0, 0, IVec3(0)}, {Chunk(kStone)});
  ASSERT_TRUE(world->save(std::move(first)));
  ASSERT_TRUE(world->flush());
  bool has_failed = true;
  for (std::int64_t n = 0; has_failed; ++n) {
    WorldChanges changes;
    for (int x = 0; x < 40; ++x) changes.put_chunk({0, 0, {x, 0, 0}}, {Chunk(kGlass)});
    allocations_left = n;
    try {
      ASSERT_TRUE(world->save(std::move(changes)));
      has_failed = false;
    } catch (const std::bad_alloc&) {
    }
    allocations_left = -1;
    if (has_failed) {
      ASSERT_EQ(world->stats().pending_chunks, 0U) << "after " << n << " allocations";
      ASSERT_EQ(world->stats().pending_bytes, 0U) << "after " << n << " allocations";
    }
    ASSERT_TRUE(world->flush());
    const auto chunk = world->load_chunk({0, 0, IVec3(0)});
    ASSERT_TRUE(chunk && *chunk);
    EXPECT_EQ((*chunk)->voxels, Chunk(has_failed ? kStone : kGlass)) << "after " << n << " allocations";
    EXPECT_EQ(world->chunks(0, 0)->size(), has_failed ? 1U : 40U);
  }
}
#endif

}  // namespace
}  // namespace quoin
