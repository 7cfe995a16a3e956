// Tests which chunks are meshed again after an edit.

#include <quoin/live/live_meshes.h>

#include <set>

#include <gtest/gtest.h>

#include "core/work/nightly_for_tests.h"
#include "live/live_test_support.h"
#include "render/chunks/voxel_densities.h"

namespace quoin {
namespace {

using Places = std::set<std::array<int, 3>>;

std::array<int, 3> key(IVec3 chunk) {
  return {chunk.x, chunk.y, chunk.z};
}

class FollowedGrid {
 public:
  explicit FollowedGrid(SurfaceStyle style) : meshes(options_of(style)) {}

  static LiveMeshOptions options_of(SurfaceStyle style) {
    LiveMeshOptions options;
    options.style = style;
    options.workers = {2};
    return options;
  }
  // Returns the number of chunks meshed since the last call, and sets `given` to the chunks delivered.
  std::int64_t meshed(Places& given) {
    const std::int64_t before = meshes.stats().chunks_meshed;
    meshes.finish(one.scene, {});
    given.clear();
    const std::vector<SurfaceUpdate> updates = meshes.take();
    for (const SurfaceUpdate& update : updates) given.insert(key(update.chunk));
    shown.apply(updates);
    return meshes.stats().chunks_meshed - before;
  }

  OneGrid one;
  LiveMeshes meshes;
  ShownSurfaces shown;
};

TEST(LiveReach, BlockyEditsReachNeighbourChunks) {
  FollowedGrid followed(SurfaceStyle::Blocky);
  Grid& grid = followed.one.grid();
  for (int i = 0; i < 27; ++i) grid.set(Neighbourhood::offset(i) * 64 + 30, 1);
  Places given;
  EXPECT_EQ(followed.meshed(given), 27);
  std::mt19937 random(5);
  for (int i = 0; i < 60; ++i) {
    const auto place = [&] { return std::array{0, 1, 31, 62, 63}[random() % 5]; };
    const IVec3 at{place(), place(), place()};
    Places reached;
    for (int n = 0; n < 27; ++n) reached.insert(key(chunk_of(at + Neighbourhood::offset(n))));
    ASSERT_TRUE(grid.set(at, grid.get(at) == kAir ? 1 : kAir));
    EXPECT_EQ(followed.meshed(given), static_cast<std::int64_t>(reached.size()));
    EXPECT_EQ(given, reached);
  }
}

// Returns the chunks within reach of a changed sample, according to a density field.
Places chunks_near_changes(const DensityGrid& before, const DensityGrid& after, int reach) {
  DensityGrid edited = before.snapshot();
  ChangeCursor cursor;
  (void)edited.changes_since(cursor);
  for (const IVec3 chunk : before.chunks()) {
    if (after.find_chunk(chunk) == nullptr) edited.put_chunk(chunk, DensityChunk(DensityNeighbourhood{}.outside));
  }
  for (const IVec3 chunk : after.chunks()) edited.put_chunk(chunk, *after.find_chunk(chunk));
  Places all;
  for (const IVec3 chunk : chunks_to_mesh(edited, edited.changes_since(cursor), reach)) all.insert(key(chunk));
  return all;
}

// Returns the chunks that can own quads and read a changed density, or a changed type of a solid sample.
Places chunks_that_read_changes(const DensityGrid& before, const DensityGrid& after, const Places& asked) {
  const int reach = reach_of({});
  Places changed;
  const Places near = chunks_near_changes(before, after, reach);
  for (const auto& each : asked) {
    if (!near.contains(each)) continue;
    const IVec3 chunk{each[0], each[1], each[2]};
    const DensityNeighbourhood a = before.neighbourhood(chunk);
    const DensityNeighbourhood b = after.neighbourhood(chunk);
    bool differs = false;
    for (int z = -reach; z < kChunkEdge + reach && !differs; ++z) {
      for (int y = -reach; y < kChunkEdge + reach && !differs; ++y) {
        for (int x = -reach; x < kChunkEdge + reach && !differs; ++x) {
          differs = a.get({x, y, z}) != b.get({x, y, z});
          const IVec3 p{x, y, z};
          const bool has_material = glm::clamp(p, IVec3(-1), IVec3(64)) == p;
          const IVec3 sample = chunk * 64 + p;
          differs = differs || (has_material && before.material(sample) != after.material(sample));
        }
      }
    }
    if (differs) changed.insert(each);
  }
  return changed;
}

TEST(LiveReach, SmoothEditsReachChunksWithChangedDensity) {
  FollowedGrid followed(SurfaceStyle::Smooth);
  Grid& grid = followed.one.grid();
  grid.fill_box({{-40, 0, -40}, {91, 21, 91}}, 1);
  grid.fill_sphere({60, 30, 60}, 24.0, 3);
  Places given;
  followed.meshed(given);
  std::mt19937 random(5);
  for (int i = 0; i < (kIsSlow ? 1 : cases(3, 12)); ++i) {
    SCOPED_TRACE(i);
    const DensityGrid before = *field_from_grid(grid);
    const auto place = [&] { return std::array{2, 9, 13, 16, 30, 46, 49, 52, 59, 63}[random() % 10]; };
    const IVec3 at{place(), 10 + static_cast<int>(random() % 20), place()};
    ASSERT_TRUE(grid.set(at, grid.get(at) == kAir ? 1 : i % 3 == 0 ? 5 : kAir));
    const DensityGrid after = *field_from_grid(grid);
    Places asked;
    for (const IVec3 chunk : grid.chunks()) asked.insert(key(chunk));
    for (const IVec3 chunk : grid.chunks()) asked.insert(key(chunk - IVec3{1, 0, 0}));
    for (const IVec3 chunk : grid.chunks()) asked.insert(key(chunk - IVec3{0, 1, 0}));
    for (const IVec3 chunk : grid.chunks()) asked.insert(key(chunk - IVec3{0, 0, 1}));
    const Places reached = chunks_that_read_changes(before, after, asked);
    const std::int64_t meshed = followed.meshed(given);
    // Not all affected chunks can own a quad.
    EXPECT_LE(meshed, static_cast<std::int64_t>(reached.size()));
    EXPECT_GT(meshed, 0);
    for (const auto& each : given) EXPECT_TRUE(reached.contains(each));
    expect_smooth(followed.shown, followed.one.scene, FollowedGrid::options_of(SurfaceStyle::Smooth));
  }
}

TEST(LiveReach, SkipsSmoothEditsDeepInside) {
  FollowedGrid followed(SurfaceStyle::Smooth);
  Grid& grid = followed.one.grid();
  grid.fill_box({{-40, -40, -40}, {101, 101, 101}}, 1);
  Places given;
  EXPECT_GT(followed.meshed(given), 0);
  // Painted far from every face: the chunk's densities stay the same, and no vertex uses its type.
  grid.set({30, 30, 30}, 3);
  EXPECT_LE(followed.meshed(given), 1);
  // A type below the face changes only the colours of that chunk.
  grid.set({30, 100, 30}, 3);
  EXPECT_EQ(followed.meshed(given), 1);
  EXPECT_EQ(given, (Places{{0, 1, 0}}));
  expect_smooth(followed.shown, followed.one.scene, FollowedGrid::options_of(SurfaceStyle::Smooth));
}

TEST(LiveReach, RemeshesOnlyChunksWithChangedType) {
  for (const SurfaceStyle style : {SurfaceStyle::Blocky, SurfaceStyle::Smooth}) {
    FollowedGrid followed(style);
    followed.one.grid().fill_box({{10, 10, 10}, {21, 21, 21}}, 1);
    followed.one.grid().fill_box({{330, 10, 10}, {341, 21, 21}}, 2);
    Places given;
    EXPECT_EQ(followed.meshed(given), 2);
    VoxelRegistry& types = followed.one.scene.types;
    VoxelProperties properties = types[2];
    properties.name = "glowing";
    properties.emission = 3.0F;
    types.replace(2, properties);
    EXPECT_EQ(followed.meshed(given), 0);
    properties.visibility = Visibility::Opaque;
    properties.colour.r = 77;
    types.replace(2, properties);
    EXPECT_EQ(followed.meshed(given), 1);
    EXPECT_EQ(given, (Places{{5, 0, 0}}));
    expect_surfaces(followed.shown, followed.one.scene, FollowedGrid::options_of(style));
    // No voxel has this type.
    EXPECT_TRUE(types.add(properties).has_value());
    EXPECT_EQ(followed.meshed(given), 0);
  }
}

}  // namespace
}  // namespace quoin
