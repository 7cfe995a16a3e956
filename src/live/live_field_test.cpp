#include <quoin/live/live_meshes.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <thread>
#include <tuple>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <quoin/live/live_light.h>

#include "core/work/nightly_for_tests.h"
#include "live/live_test_support.h"

namespace quoin {
namespace {

using Point = std::tuple<double, double, double>;

// Counts the edges with an odd number of triangles; 0 if the surfaces are closed.
std::size_t open_edges(const ShownSurfaces& shown, GridHandle handle) {
  std::map<std::pair<Point, Point>, int> edges;
  for (const SurfaceUpdate& each : shown.all()) {
    if (each.grid != handle || each.content != SurfaceContent::Field) continue;
    const SmoothChunkMesh& mesh = each.surface->smooth;
    const auto point = [&](std::size_t i) {
      const DVec3 p = DVec3(mesh.positions[mesh.indices[i]]) + DVec3(each.chunk) * 64.0;
      return Point{p.x, p.y, p.z};
    };
    for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
      for (std::size_t i = 0; i < 3; ++i) {
        Point a = point(t + i);
        Point b = point(t + (i + 1) % 3);
        if (b < a) std::swap(a, b);
        ++edges[{a, b}];
      }
    }
  }
  std::size_t odd = 0;
  for (const auto& [edge, triangles] : edges) odd += static_cast<std::size_t>(triangles & 1);
  return odd;
}

// Checks that all chunks have the level for the distance, in samples, of the nearest eye.
void expect_levels(const ShownSurfaces& shown, const std::vector<DVec3>& eyes, double detail_distance) {
  const auto level_at = [&](double distance) {
    return std::clamp(static_cast<int>(std::ceil(std::log2(std::max(distance, 1e-3) / detail_distance))), 0, 3);
  };
  std::array<int, 4> seen{};
  for (const SurfaceUpdate& each : shown.all()) {
    double distance = std::numeric_limits<double>::infinity();
    for (const DVec3 eye : eyes) {
      const DVec3 low = DVec3(each.chunk) * 64.0;
      distance = std::min(distance, glm::length(eye - glm::clamp(eye, low, low + 64.0)));
    }
    const int level = each.surface->level;
    EXPECT_GE(level, level_at(distance / 1.1001));
    EXPECT_LE(level, level_at(distance * 1.1001));
    ++seen[static_cast<std::size_t>(level)];
  }
  EXPECT_GT(seen[0], 0);
  EXPECT_GT(seen[1] + seen[2] + seen[3], 0);
}

void expect_field(const ShownSurfaces& shown, const Scene& scene, GridHandle handle, const LiveMeshOptions& options) {
  SmoothMeshOptions wanted;
  wanted.occlusion = options.occlusion;
  const DensityGrid& field = scene.grids()[handle].field;
  SmoothTriangles expected;
  for (const std::uint32_t body : smooth::bodies_of(scene.types, field)) {
    const auto mesh = build_smooth_mesh(smooth::field_of_body(field, scene.types, body, {}), scene.types, wanted);
    ASSERT_TRUE(mesh.has_value());
    const SmoothTriangles part = triangles_of(*mesh);
    expected.insert(expected.end(), part.begin(), part.end());
  }
  SmoothTriangles found;
  for (const SurfaceUpdate& each : shown.all()) {
    if (each.grid != handle || each.content != SurfaceContent::Field) continue;
    ASSERT_EQ(each.surface->style, SurfaceStyle::Smooth);
    expect_glass_last(*each.surface, scene.types);
    const SmoothTriangles part = triangles_of(*each.surface, each.chunk);
    found.insert(found.end(), part.begin(), part.end());
  }
  sort_triangles(expected);
  sort_triangles(found);
  ASSERT_EQ(found.size(), expected.size());
  ASSERT_TRUE(found == expected);
}

// Returns hills of a few chunks.
DensityGrid hills(int chunks, unsigned seed = 3) {
  DensityGrid field;
  std::mt19937 random(seed);
  const double size = 64.0 * chunks;
  field.add_box({2.0, 2.0, 2.0}, {size - 3.0, 20.0, size - 3.0}, 1);
  for (int i = 0; i < 6 * chunks * chunks; ++i) {
    const auto below = [&](double end) { return std::uniform_real_distribution<double>(0.0, end)(random); };
    const double x = below(size - 40.0);
    const double z = below(size - 40.0);
    field.add_sphere({20.0 + x, 12.0 + below(20.0), 20.0 + z}, 4.0 + below(14.0),
                     static_cast<VoxelType>(1 + random() % 3), 4.0);
  }
  return field;
}

// Makes a random edit, often near chunk borders.
void dig(DensityGrid& field, std::mt19937& random, int chunks) {
  const auto below = [&](double end) { return std::uniform_real_distribution<double>(0.0, end)(random); };
  const auto border = [&] { return 64.0 * static_cast<double>(random() % static_cast<unsigned>(chunks)) - 3.0; };
  const DVec3 at{random() % 3 == 0 ? below(64.0 * chunks) : border() + below(6.0), 10.0 + below(25.0),
                 random() % 3 == 0 ? below(64.0 * chunks) : border() + below(6.0)};
  switch (random() % 4) {
    case 0:
      field.add_sphere(at, 2.0 + below(8.0), static_cast<VoxelType>(1 + random() % 3), 2.0);
      return;
    case 1:
      field.smooth(at, 8.0, 0.7);
      return;
    case 2:
      field.add_box(at, at + DVec3(below(20.0), below(60.0), below(20.0)), 2);
      return;
    default:
      field.remove_sphere(at, 2.0 + below(9.0), 1.0);
  }
}

LiveMeshOptions options_of(unsigned threads) {
  LiveMeshOptions options;
  options.workers = {threads};
  return options;
}

TEST(LiveField, MatchesWholeFieldMesh) {
  OneGrid one;
  one.field() = hills(2);
  LiveMeshes meshes(options_of(2));
  ShownSurfaces shown;
  meshes.finish(one.scene, DVec3(0.0));
  shown.apply(meshes.take());
  ASSERT_NO_FATAL_FAILURE(expect_field(shown, one.scene, one.handle, options_of(2)));
  EXPECT_EQ(open_edges(shown, one.handle), 0U);
  one.field().clear();
  meshes.finish(one.scene, DVec3(0.0));
  shown.apply(meshes.take());
  EXPECT_TRUE(shown.all().empty());
}

TEST(LiveField, MeshesVoxelsSeparatelyFromField) {
  OneGrid one;
  one.field().add_sphere({32, 32, 32}, 10, 1);
  one.scene.edit(one.handle).grid.fill_box({{40, 40, 40}, {50, 50, 50}}, 3);
  LiveMeshes meshes(options_of(1));
  ShownSurfaces shown;
  meshes.finish(one.scene, DVec3(0.0));
  shown.apply(meshes.take());
  ASSERT_EQ(shown.all().size(), 2U);
  EXPECT_EQ(shown.find(one.handle, IVec3(0))->style, SurfaceStyle::Blocky);
  EXPECT_EQ(shown.find(one.handle, IVec3(0), SurfaceContent::Field)->style, SurfaceStyle::Smooth);
  one.scene.edit(one.placed).visible = false;
  meshes.finish(one.scene, DVec3(0.0));
  shown.apply(meshes.take());
  EXPECT_TRUE(shown.all().empty()) << "nothing draws the grid any more";
}

TEST(LiveField, SurfacesStayClosedWhileEdited) {
  for (unsigned seed = 1; seed <= (kIsSlow ? 1U : 3U); ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    OneGrid one;
    one.field() = hills(2, seed);
    const LiveMeshOptions options = options_of(1 + seed % 3);
    LiveMeshes meshes(options);
    ShownSurfaces shown;
    meshes.finish(one.scene, DVec3(0.0));
    shown.apply(meshes.take());
    std::size_t taken = 0;
    const int edits = kIsSlow ? 10 : cases(20, 60);
    // On a busy machine workers may need longer than all edits together.
    for (int i = 0; i < edits || taken == 0; ++i) {
      if (i >= edits) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (i < edits && random() % 3 != 0) dig(one.field(), random, 2);
      meshes.update(one.scene, DVec3(64.0, 40.0, 64.0));
      const std::vector<SurfaceUpdate> updates = meshes.take();
      shown.apply(updates);
      taken += updates.size();
      if (!updates.empty()) {
        ASSERT_EQ(open_edges(shown, one.handle), 0U) << "edit " << i;
      }
      if (random() % 30 == 0) meshes.finish(one.scene, DVec3(0.0));
    }
    meshes.finish(one.scene, DVec3(0.0));
    shown.apply(meshes.take());
    EXPECT_EQ(meshes.pending(), 0U);
    ASSERT_NO_FATAL_FAILURE(expect_field(shown, one.scene, one.handle, options));
  }
}

TEST(LiveField, LevelsFollowEyeWithoutSeams) {
  for (unsigned seed = 1; seed <= (kIsSlow ? 1U : static_cast<unsigned>(cases(1, 2))); ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    OneGrid one;
    one.field() = hills(4, seed);
    LiveMeshOptions options = options_of(1 + seed % 3);
    options.detail_distance = 40.0;
    LiveMeshes meshes(options);
    ShownSurfaces shown;
    DVec3 eye(0.0, 40.0, 0.0);
    meshes.finish(one.scene, eye);
    shown.apply(meshes.take());
    ASSERT_EQ(open_edges(shown, one.handle), 0U);
    expect_levels(shown, {eye}, 40.0);
    for (int i = 0; i < (kIsSlow ? 10 : 40); ++i) {
      eye += DVec3(5.0, 0.0, 3.0 + 2.0 * std::sin(i));
      if (i % 4 == 0) dig(one.field(), random, 4);
      meshes.update(one.scene, eye);
      const std::vector<SurfaceUpdate> updates = meshes.take();
      shown.apply(updates);
      if (!updates.empty()) {
        ASSERT_EQ(open_edges(shown, one.handle), 0U) << "step " << i;
      }
    }
    meshes.finish(one.scene, eye);
    shown.apply(meshes.take());
    ASSERT_EQ(open_edges(shown, one.handle), 0U);
    expect_levels(shown, {eye}, 40.0);
  }
}

TEST(LiveField, ChoosesLevelsByNearestEyeAndInstance) {
  OneGrid one;
  one.field() = hills(4);
  LiveMeshOptions options = options_of(2);
  options.detail_distance = 40.0;
  LiveMeshes meshes(options);
  ShownSurfaces shown;
  const std::array others{DVec3(250.0, 40.0, 250.0)};
  meshes.finish(one.scene, DVec3(0.0, 40.0, 0.0), others);
  shown.apply(meshes.take());
  expect_levels(shown, {DVec3(0.0, 40.0, 0.0), others[0]}, 40.0);
  // Only the finite eye counts.
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::array nowhere{DVec3(nan, 0.0, 0.0), DVec3(0.0, 40.0, 0.0)};
  meshes.finish(one.scene, DVec3(std::numeric_limits<double>::infinity(), 0.0, nan), nowhere);
  shown.apply(meshes.take());
  expect_levels(shown, {DVec3(0.0, 40.0, 0.0)}, 40.0);
  // At half the size an eye is twice as many samples away; after moving, the other end is near.
  one.scene.edit(one.placed).voxel_size = 0.5;
  one.scene.edit(one.placed).position = {-125.0, 0.0, -125.0};
  meshes.finish(one.scene, DVec3(0.0, 40.0, 0.0));
  shown.apply(meshes.take());
  EXPECT_EQ(open_edges(shown, one.handle), 0U);
  expect_levels(shown, {DVec3(250.0, 80.0, 250.0)}, 40.0);
  one.scene.edit(one.placed).voxel_size = std::numeric_limits<double>::quiet_NaN();
  meshes.finish(one.scene, DVec3(0.0, 40.0, 0.0));
  shown.apply(meshes.take());
  EXPECT_TRUE(shown.all().empty());
}

// A moved instance needs no new light, so the snapshot with the light does not have its position.
TEST(LiveField, LevelsFollowInstancesThatMoveWithLiveLight) {
  OneGrid one;
  one.field() = hills(4);
  LiveMeshOptions options = options_of(2);
  options.detail_distance = 40.0;
  LiveLight light;
  LiveMeshes meshes(options);
  meshes.use_light(light);
  ShownSurfaces shown;
  const DVec3 eye(0.0, 40.0, 0.0);
  meshes.finish(one.scene, eye);
  shown.apply(meshes.take());
  expect_levels(shown, {eye}, 40.0);
  for (const double moved : {250.0, 0.0, 120.0}) {
    one.scene.edit(one.placed).position = {-moved, 0.0, -moved};
    // Once also while light is computed for an earlier state.
    if (moved == 120.0) {
      one.field().remove_sphere({60.0, 20.0, 60.0}, 4.0);
      meshes.update(one.scene, eye);
      one.scene.edit(one.placed).position = {-200.0, 0.0, -200.0};
    }
    meshes.finish(one.scene, eye);
    shown.apply(meshes.take());
    EXPECT_EQ(open_edges(shown, one.handle), 0U);
    const double at = moved == 120.0 ? 200.0 : moved;
    expect_levels(shown, {{at, 40.0, at}}, 40.0);
  }
}

TEST(LiveField, FollowsTypeColours) {
  OneGrid one;
  one.field().add_sphere({60, 60, 60}, 10, 1);
  LiveMeshes meshes(options_of(1));
  ShownSurfaces shown;
  meshes.finish(one.scene, DVec3(0.0));
  shown.apply(meshes.take());
  VoxelProperties properties = one.scene.types[1];
  properties.colour = {1, 2, 250, 255};
  one.scene.types.replace(1, properties);
  meshes.finish(one.scene, DVec3(0.0));
  const std::vector<SurfaceUpdate> updates = meshes.take();
  EXPECT_FALSE(updates.empty());
  shown.apply(updates);
  ASSERT_NO_FATAL_FAILURE(expect_field(shown, one.scene, one.handle, options_of(1)));
}

// Returns a lake that contains a glass ball and crosses chunk borders; `bed` is the material around it.
DensityGrid lake(VoxelType water, VoxelType glass, VoxelType bed) {
  DensityGrid field;
  field.add_box({2.0, 2.0, 2.0}, {126.0, 70.0, 126.0}, bed);
  field.add_sphere({64.0, 74.0, 64.0}, 9.0, glass);
  field.edit({{30, 50, 30}, {100, 70, 100}}, [&](IVec3, DensitySample now) {
    if (now.density < 0.0F && now.material == bed) now.material = water;
    return now;
  });
  return field;
}

void expect_shown(LiveMeshes& meshes, OneGrid& one, ShownSurfaces& shown) {
  meshes.finish(one.scene, DVec3(0.0));
  shown.apply(meshes.take());
  ASSERT_NO_FATAL_FAILURE(expect_field(shown, one.scene, one.handle, options_of(2)));
  EXPECT_EQ(open_edges(shown, one.handle), 0U);
}

std::size_t glass_indices(const ShownSurfaces& shown) {
  std::size_t all = 0;
  for (const SurfaceUpdate& each : shown.all()) all += each.surface->glass_indices;
  return all;
}

TEST(LiveField, MeshesTransparentMaterialsAsClosedBodies) {
  OneGrid one;
  VoxelProperties glass = one.scene.types[2];
  glass.colour = {220, 240, 250, 30};
  const VoxelType clear = one.scene.types.add(glass).value();
  one.field() = lake(2, clear, 1);
  LiveMeshes meshes(options_of(2));
  ShownSurfaces shown;
  ASSERT_NO_FATAL_FAILURE(expect_shown(meshes, one, shown));
  const std::size_t before = glass_indices(shown);
  EXPECT_GT(before, 0U);
  // Deep in the bed: no sign changes.
  one.field().edit({{60, 20, 60}, {70, 30, 70}}, [](IVec3, DensitySample now) {
    now.material = 2;
    return now;
  });
  ASSERT_NO_FATAL_FAILURE(expect_shown(meshes, one, shown));
  EXPECT_GT(glass_indices(shown), before);
  one.field().remove_sphere({64.0, 60.0, 40.0}, 14.0);
  ASSERT_NO_FATAL_FAILURE(expect_shown(meshes, one, shown));
}

TEST(LiveField, FollowsTypesThatBecomeTransparent) {
  OneGrid one;
  one.field() = lake(3, 3, 1);
  LiveMeshes meshes(options_of(2));
  ShownSurfaces shown;
  ASSERT_NO_FATAL_FAILURE(expect_shown(meshes, one, shown));
  EXPECT_EQ(glass_indices(shown), 0U);
  VoxelProperties properties = one.scene.types[3];
  for (const Visibility visibility : {Visibility::Transparent, Visibility::Opaque, Visibility::Transparent}) {
    properties.visibility = visibility;
    one.scene.types.replace(3, properties);
    // Edits at the same time, so that jobs serve both changes.
    one.field().remove_sphere({64.0, 70.0, 64.0}, visibility == Visibility::Opaque ? 4.0 : 7.0);
    ASSERT_NO_FATAL_FAILURE(expect_shown(meshes, one, shown));
    EXPECT_EQ(glass_indices(shown) > 0, visibility == Visibility::Transparent);
  }
}

TEST(LiveField, ReplacesFieldAtOnce) {
  OneGrid one;
  one.field() = hills(2, 1);
  LiveMeshes meshes(options_of(2));
  ShownSurfaces shown;
  meshes.finish(one.scene, DVec3(0.0));
  shown.apply(meshes.take());
  one.field() = hills(2, 2);
  for (int i = 0; i < 1000 && meshes.pending() == 0; ++i) meshes.update(one.scene, DVec3(0.0));
  while (meshes.pending() != 0) {
    meshes.update(one.scene, DVec3(0.0));
    const std::vector<SurfaceUpdate> updates = meshes.take();
    shown.apply(updates);
    if (!updates.empty()) {
      ASSERT_EQ(open_edges(shown, one.handle), 0U);
    }
  }
  ASSERT_NO_FATAL_FAILURE(expect_field(shown, one.scene, one.handle, options_of(2)));
}

}  // namespace
}  // namespace quoin
