// Lit blocky surfaces follow changes of light, even without changed voxels nearby.

#include <quoin/core/memory.h>
#include <quoin/live/live_meshes.h>

#include <algorithm>
#include <map>
#include <memory>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/live/live_light.h>
#include <quoin/mesh/blocky.h>

#include "live/placed_light_world_for_tests.h"
#include "render/light/surface/light_world_for_tests.h"

namespace quoin {
namespace {

using Key = std::tuple<int, int, int>;
using Surfaces = std::map<Key, std::shared_ptr<const ChunkSurface>>;

struct DarkeningScene : PlacedLightWorld {
  using PlacedLightWorld::PlacedLightWorld;
  [[nodiscard]] const Grid& grid() const { return scene.grids()[handle].grid; }
  void edit(std::mt19937& random) {
    Grid& edited = scene.edit(handle).grid;
    for (int i = 0; i < 5; ++i) edited.set(LightWorld::somewhere(random), static_cast<VoxelType>(random() % 5));
  }
};

void take(LiveMeshes& meshes, Surfaces& surfaces, int* count = nullptr) {
  for (SurfaceUpdate& update : meshes.take()) {
    if (count != nullptr) ++*count;
    const IVec3 at = update.chunk;
    surfaces[{at.x, at.y, at.z}] = std::move(update.surface);
  }
}

using LitQuads = std::vector<std::pair<std::uint64_t, FaceLight>>;

LitQuads sorted(const QuadBuffer& quads, const BlockVector<FaceLight>& light) {
  EXPECT_EQ(quads.size(), light.size());
  LitQuads all;
  for (std::size_t i = 0; i < std::min(quads.size(), light.size()); ++i) all.emplace_back(quads[i].bits, light[i]);
  std::ranges::sort(all);
  return all;
}

// Compares with surfaces built from scratch.
void expect_right(const DarkeningScene& world, const SceneLight& light, const Surfaces& surfaces,
                  LightMerging merging) {
  const GridLight lit = light.of(world.handle);
  SurfaceLight surface_light(*lit.light, *lit.voxels, world.scene.types);
  BlockyMesher mesher;
  QuadBuffer quads;
  QuadBuffer split;
  BlockVector<FaceLight> corners;
  std::size_t lit_quads = 0;
  for (const IVec3 chunk : world.grid().chunks()) {
    SCOPED_TRACE(testing::Message() << chunk.x << " " << chunk.y << " " << chunk.z);
    mesher.mesh(world.grid().neighbourhood(chunk), world.scene.types, {}, quads);
    surface_light.split(quads, chunk, merging, split, corners);
    const auto found = surfaces.find({chunk.x, chunk.y, chunk.z});
    if (found == surfaces.end() || found->second == nullptr) {
      ASSERT_TRUE(quads.empty());
      continue;
    }
    ASSERT_EQ(sorted(found->second->quads, found->second->light), sorted(split, corners));
    lit_quads += split.size();
  }
  ASSERT_GT(lit_quads, 100U);
}

class LitMeshes : public testing::TestWithParam<LightMerging> {};

TEST_P(LitMeshes, MatchLightAfterEdits) {
  DarkeningScene world(3);
  SceneLight light;
  LiveMeshOptions options;
  options.light_merging = GetParam();
  options.region_edge = kChunkEdge;  // as the surfaces that it is compared with
  LiveMeshes meshes(options);
  meshes.use_light(&light);
  Surfaces surfaces;
  std::mt19937 random(4);
  for (int i = 0; i < 12; ++i) {
    light.update(world.scene);
    meshes.finish(world.scene, DVec3(0.0));
    take(meshes, surfaces);
    expect_right(world, light, surfaces, GetParam());
    world.edit(random);
  }
}

INSTANTIATE_TEST_SUITE_P(All, LitMeshes, testing::Values(LightMerging::Constant, LightMerging::Linear),
                         [](const auto& tested) {
                           return tested.param == LightMerging::Constant ? "Constant" : "Linear";
                         });

// A floor across several chunks in a closed room with a lamp.
struct Room {
  Room() {
    EXPECT_TRUE(scene.types.add({.name = "stone", .colour = {}}));
    EXPECT_TRUE(scene.types.add({.name = "lamp", .colour = {255, 255, 255, 255}, .emission = 1.0F}));
    SceneGrid room;
    room.grid.fill_box({{0, 0, 0}, {192, 40, 64}}, 1);
    room.grid.fill_box({{1, 1, 1}, {191, 39, 63}}, kAir);
    handle = scene.add_grid(std::move(room));
    scene.add_instance({"room", handle});
  }
  Scene scene;
  GridHandle handle;
};

TEST(LiveLitMeshes, RemeshesChunkReachedOnlyByLight) {
  Room room;
  SceneLight light;
  LiveMeshOptions options;
  options.region_edge = 16;
  LiveMeshes meshes(options);
  meshes.use_light(&light);
  Surfaces surfaces;
  light.update(room.scene);
  meshes.finish(room.scene, DVec3(0.0));
  take(meshes, surfaces);
  EXPECT_EQ(surfaces.size(), 3U);

  // Six voxels from the next chunk: no voxel of that chunk is a neighbour.
  room.scene.edit(room.handle).grid.set({57, 1, 30}, 2);
  light.update(room.scene);
  meshes.finish(room.scene, DVec3(0.0));
  const std::vector<SurfaceUpdate> updates = meshes.take();
  ASSERT_EQ(updates.size(), 2U);
  for (const SurfaceUpdate& update : updates) {
    ASSERT_LT(update.chunk.x, 2);
    // Only the neighbouring chunk's regions within the light's range change: the light ends 8 voxels inside.
    constexpr std::uint64_t kFirstAlongX = 0x1111'1111'1111'1111U;
    if (update.chunk.x == 1) {
      EXPECT_EQ(update.changed_regions & ~kFirstAlongX, 0U);
      EXPECT_NE(update.changed_regions & kFirstAlongX, 0U);
    }
    std::uint32_t brightest = 0;
    for (const FaceLight& corners : update.surface->light) {
      for (const std::uint32_t corner : corners) brightest = std::max(brightest, corner >> 8 & 255U);
    }
    EXPECT_GT(brightest, 12U * 5);
  }

  // Changes the light of a type, and no voxel.
  VoxelProperties dark = room.scene.types[2];
  dark.emission = 0.0F;
  room.scene.types.replace(2, dark);
  light.update(room.scene);
  meshes.finish(room.scene, DVec3(0.0));
  int count = 0;
  take(meshes, surfaces, &count);
  EXPECT_GE(count, 2);
  for (const auto& [at, surface] : surfaces) {
    for (const FaceLight& corners : surface->light) {
      for (const std::uint32_t corner : corners) ASSERT_EQ(corner >> 8, 0U) << "the sky's alone, outside";
    }
  }
}

TEST(LiveLitMeshes, RemeshesNothingWithoutChanges) {
  Room room;
  SceneLight light;
  light.update(room.scene);
  LiveMeshes meshes;
  meshes.use_light(&light);
  meshes.finish(room.scene, DVec3(0.0));
  const auto meshed = meshes.stats().chunks_meshed;
  light.update(room.scene);
  meshes.finish(room.scene, DVec3(0.0));
  EXPECT_EQ(meshes.stats().chunks_meshed, meshed);
}

TEST(LiveLitMeshes, RestoresPlainMeshesWithoutLight) {
  Room room;
  SceneLight light;
  light.update(room.scene);
  LiveMeshes meshes;
  meshes.finish(room.scene, DVec3(0.0));
  Surfaces plain;
  take(meshes, plain);
  meshes.use_light(&light);
  meshes.finish(room.scene, DVec3(0.0));
  Surfaces lit;
  take(meshes, lit);
  EXPECT_EQ(lit.size(), plain.size());
  for (const auto& [at, surface] : lit) EXPECT_EQ(surface->light.size(), surface->quads.size());
  meshes.use_light(nullptr);
  meshes.finish(room.scene, DVec3(0.0));
  Surfaces again;
  take(meshes, again);
  ASSERT_EQ(again.size(), plain.size());
  for (const auto& [at, surface] : again) {
    EXPECT_TRUE(surface->light.empty());
    EXPECT_TRUE(std::ranges::equal(surface->quads, plain[at]->quads, [](Quad a, Quad b) { return a.bits == b.bits; }));
  }
}

TEST(LiveLitMeshes, FollowLiveLight) {
  DarkeningScene world(8);
  LiveLight light;
  LiveMeshOptions options;
  options.region_edge = kChunkEdge;  // as the surfaces that it is compared with
  LiveMeshes meshes(options);
  meshes.use_light(light);
  Surfaces surfaces;
  std::mt19937 random(9);
  for (int i = 0; i < 40; ++i) {
    world.edit(random);
    meshes.update(world.scene, DVec3(0.0));
    take(meshes, surfaces);
  }
  meshes.finish(world.scene, DVec3(0.0));
  take(meshes, surfaces);
  expect_right(world, light.shown(), surfaces, LightMerging::Linear);
}

}  // namespace
}  // namespace quoin
