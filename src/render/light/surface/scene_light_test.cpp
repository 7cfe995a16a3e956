#include <quoin/render/propagated_light.h>

#include <random>
#include <span>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/render/surface_light.h>

#include "core/death_for_tests.h"
#include "render/light/surface/light_bricks.h"
#include "render/light/surface/light_world_for_tests.h"
#include "render/light/voxel_light.h"

namespace quoin {
namespace {

Scene scene_of(LightWorld world, GridHandle& handle) {
  Scene scene;
  scene.types = world.types;
  SceneGrid grid;
  grid.grid = std::move(world.grid);
  handle = scene.add_grid(std::move(grid));
  scene.add_instance({"", handle});
  return scene;
}

// Digs, builds, and places lamps, in voxels and in the field.
void edit(SceneGrid& grid, std::mt19937& random) {
  const IVec3 at = LightWorld::somewhere(random);
  switch (random() % 4) {
    case 0:
      grid.grid.fill_sphere(DVec3(at), 4.0, kAir);
      break;
    case 1:
      grid.grid.set(at, LightWorld::kLamp);
      break;
    case 2:
      grid.field.add_sphere(DVec3(at) + DVec3(0.0, 30.0, 0.0), 5.0, random() % 2 == 0 ? LightWorld::kStone : kAir);
      break;
    default:
      grid.field.remove_sphere(DVec3(at) + DVec3(0.0, 30.0, 0.0), 6.0);
  }
}

TEST(SceneLight, MatchesFreshLightAfterEdits) {
  GridHandle handle;
  Scene scene = scene_of(LightWorld(11), handle);
  std::mt19937 random(3);
  SceneLight light;
  light.update(scene);
  for (int step = 0; step < 6; ++step) {
    for (int i = 0; i < 3; ++i) edit(scene.edit(handle), random);
    light.update(scene);
    SceneLight fresh;
    fresh.update(scene);
    const SceneGrid& grid = scene.grids()[handle];
    for (int i = 0; i < 20'000; ++i) {
      const IVec3 at = LightWorld::somewhere(random) + IVec3(0, random() % 2 == 0 ? 0 : 30, 0);
      ASSERT_EQ(light.of(handle).light->at(at), fresh.of(handle).light->at(at));
      ASSERT_EQ(light.of(handle).voxels->get(at), fresh.of(handle).voxels->get(at));
      const bool is_held = grid.grid.get(at) != kAir || grid.field.density(at) < 0.0F;
      ASSERT_EQ(light.of(handle).voxels->get(at) != kAir, is_held);
    }
  }
}

// Bricks contain the same light as the grid, for every voxel near a surface.
TEST(LightBricks, HoldLightAroundSurfaces) {
  GridHandle handle;
  Scene scene = scene_of(LightWorld(12), handle);
  LightCache cache;
  std::mt19937 random(5);
  for (int step = 0; step < 8; ++step) {
    const LightBricks& bricks = cache.bricks(scene, {});
    const GridLight of = cache.light(scene, {}).of(handle);
    LightRows rows(*of.light, *of.voxels, scene.types);
    const auto found = [&](IVec3 brick) -> const LightBricks::Brick* {
      const std::size_t mask = bricks.bricks().size() - 1;
      for (std::size_t slot = LightBricks::slot_of(brick, 0) & mask;; slot = (slot + 1) & mask) {
        const LightBricks::Brick& each = bricks.bricks()[slot];
        if (each.is_held == 0) return nullptr;
        if (each.brick == brick && each.grid == 0) return &each;
      }
    };
    int lit = 0;
    for (int i = 0; i < 20'000; ++i) {
      const IVec3 near = LightWorld::somewhere(random);
      if (of.voxels->get(near) == kAir) continue;
      const IVec3 at =
          near + IVec3(static_cast<int>(random() % 5), static_cast<int>(random() % 5), static_cast<int>(random() % 5)) -
          2;
      const LightBricks::Brick* brick = found({at.x >> 3, at.y >> 3, at.z >> 3});
      bool passes = brick != nullptr;
      std::uint32_t word = 0;
      if (passes && (brick->what & LightBricks::kIsUniform) != 0) {
        word = brick->what & 0xFFFFU;
      } else if (passes) {
        const auto index = static_cast<std::uint32_t>((at.x & 7) + 8 * (at.y & 7) + 64 * (at.z & 7));
        passes = (bricks.numbers()[brick->what + 256 + index / 32] >> (index % 32) & 1U) != 0;
        word = bricks.numbers()[brick->what + index / 2] >> (16 * (index % 2)) & 0xFFFFU;
      }
      ASSERT_EQ(passes, rows.passes(at));
      if (!passes) continue;
      ASSERT_EQ(word, rows.word(at));
      lit += word != 0;
    }
    EXPECT_GT(lit, 500);
    edit(scene.edit(handle), random);
    cache.update();
  }
}

TEST(SceneLight, UnknownGridIsOpenSky) {
  GridHandle handle;
  const Scene scene = scene_of(LightWorld(1), handle);
  SceneLight light;
  EXPECT_EQ(light.of(handle).light->at({0, -20, 0}), (LightLevels{15, 0, 0, 0}));
  EXPECT_EQ(light.of(handle).voxels->chunk_count(), 0U);
  light.update(scene);
  EXPECT_EQ(light.of(handle).voxels, &scene.grids()[handle].grid);
  EXPECT_EQ(light.of({}).light->at({0, -20, 0}).sky, 15);
  EXPECT_GE(light.bytes(), light.of(handle).light->bytes());
}

TEST(SceneLight, SnapshotsKeepLight) {
  GridHandle handle;
  Scene scene = scene_of(LightWorld(1), handle);
  scene.edit(handle).field.add_sphere({60.0, 0.0, 0.0}, 6.0, LightWorld::kStone);
  SceneLight light;
  light.update(scene);
  const SceneLight kept = light.snapshot();
  EXPECT_NE(kept.of(handle).voxels, light.of(handle).voxels) << "its own, where there is a field";
  const IVec3 voxel{0, 40, 0};
  scene.edit(handle).grid.fill_box({{-30, 50, -30}, {30, 51, 30}}, LightWorld::kStone);
  light.update(scene);
  EXPECT_EQ(kept.of(handle).light->at(voxel).sky, 15);
  EXPECT_EQ(light.of(handle).light->at(voxel).sky, 0);
  EXPECT_EQ(kept.of(handle).voxels->get(0, 50, 0), kAir);
  EXPECT_EQ(light.of(handle).voxels->get(0, 50, 0), LightWorld::kStone);
}

TEST(SceneLightDeathTest, AssertsOnMissingNormals) {
  GridHandle handle;
  const Scene scene = scene_of(LightWorld(1), handle);
  SceneLight light;
  light.update(scene);
  SurfaceLight surface(*light.of(handle).light, *light.of(handle).voxels, scene.types);
  const std::vector<Vec3> places(3);
  std::vector<MeanLevels> levels(3);
  QUOIN_EXPECT_MISTAKE(surface.read({places, std::span(places).first(2)}, levels), "a normal for every position");
}

}  // namespace
}  // namespace quoin
