#include <quoin/store/world_meshes.h>

#include <algorithm>
#include <fstream>
#include <vector>

#include <gtest/gtest.h>
#include <quoin/io/mesh_file.h>
#include <quoin/scene/scene_faces.h>
#include <quoin/terrain/terrain.h>

#include "store/scene/world_file.h"
#include "store/world/world_for_tests.h"

namespace quoin {
namespace {

// Returns a landscape with water, with rotated, hidden and repeated parts, and a grid without placements.
Scene landscape() {
  Scene scene;
  const auto materials = add_terrain_types(scene.types);
  TerrainOptions options;
  options.size = IVec3(3, 2, 3);
  SceneGrid land;
  land.name = "land";
  land.grid = std::move(*generate_terrain(options, *materials));
  land.pivot = {10.0, 20.0, 30.0};
  const GridHandle ground = scene.add_grid(std::move(land));
  SceneGrid small;
  small.name = "small";
  small.grid.fill_box({{-70, 3, 5}, {3, 70, 9}}, 2);
  const std::vector<std::byte> note(3, std::byte{1});
  small.grid.set_data({0, 5, 6}, {0, note});
  const GridHandle box = scene.add_grid(std::move(small));
  SceneGrid unused;
  unused.grid.fill_box({{0, 0, 0}, {5, 5, 5}}, 1);
  scene.add_grid(std::move(unused));
  scene.add_instance({.name = "a", .grid = ground});
  Instance turned{.name = "b", .grid = box, .position = {5.0, 100.0, 3.0}};
  turned.rotation = glm::angleAxis(0.5, DVec3(0.0, 1.0, 0.0));
  scene.add_instance(turned);
  turned.visible = false;
  scene.add_instance(turned);
  return scene;
}

Result<WorldMeshes> meshed(const std::filesystem::path& path, const WorldMeshOptions& options) {
  const auto world = WorldStore::open(path, WorldAccess::Read);
  const auto loaded = load_partial_world(*world);
  return mesh_world(*world, *loaded, options);
}

FaceCounts faces_in(const std::filesystem::path& path, InstanceFilter filter) {
  const auto world = WorldStore::open(path, WorldAccess::Read);
  const auto loaded = load_partial_world(*world);
  const auto counts = count_world_faces(*world, *loaded, filter);
  EXPECT_TRUE(counts);
  return counts.value_or(FaceCounts());
}

void expect_equal(const SceneMeshes& a, const SceneMeshes& b) {
  ASSERT_EQ(a.parts.size(), b.parts.size());
  ASSERT_EQ(a.placements.size(), b.placements.size());
  for (std::size_t i = 0; i < a.parts.size(); ++i) {
    EXPECT_EQ(a.parts[i].name, b.parts[i].name);
    EXPECT_EQ(a.parts[i].pivot, b.parts[i].pivot);
    ASSERT_EQ(a.parts[i].thickness.size(), b.parts[i].thickness.size());
    for (std::size_t k = 0; k < a.parts[i].thickness.size(); ++k) {
      EXPECT_EQ(a.parts[i].thickness[k].type, b.parts[i].thickness[k].type);
      EXPECT_EQ(a.parts[i].thickness[k].voxels, b.parts[i].thickness[k].voxels);
    }
    ASSERT_EQ(a.parts[i].surfaces.size(), b.parts[i].surfaces.size());
    for (std::size_t k = 0; k < a.parts[i].surfaces.size(); ++k) {
      const MeshView& x = a.parts[i].surfaces[k];
      const MeshView& y = b.parts[i].surfaces[k];
      EXPECT_EQ(x.surface, y.surface);
      EXPECT_TRUE(std::ranges::equal(x.positions, y.positions));
      EXPECT_TRUE(std::ranges::equal(x.indices, y.indices));
      EXPECT_TRUE(std::ranges::equal(x.directions, y.directions));
      EXPECT_TRUE(std::ranges::equal(x.types, y.types));
      EXPECT_TRUE(std::ranges::equal(x.block_occlusion, y.block_occlusion));
    }
  }
  EXPECT_EQ(a.stats.faces_total, b.stats.faces_total);
  EXPECT_EQ(a.stats.faces_visible, b.stats.faces_visible);
  EXPECT_EQ(a.stats.quads, b.stats.quads);
  EXPECT_EQ(a.stats.triangles, b.stats.triangles);
  EXPECT_EQ(a.stats.vertices, b.stats.vertices);
}

TEST(WorldMeshes, MatchWholeScene) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  const Scene scene = landscape();
  ASSERT_TRUE(write_world(scene, path));
  for (const bool is_plain : {false, true}) {
    WorldMeshOptions options;
    options.folder = folder.path();
    options.cache_bytes = is_plain ? std::size_t{1} << 30 : 1;  // hardly any cache: reads chunks again and again
    options.scene.mesh.watertight = is_plain;
    options.scene.mesh.bake_occlusion = !is_plain;
    options.scene.instances = is_plain ? InstanceFilter::All : InstanceFilter::Visible;
    const auto made = meshed(path, options);
    ASSERT_TRUE(made) << to_string(made.error());
    const auto whole = mesh_scene(scene, options.scene);
    ASSERT_TRUE(whole);
    ASSERT_GT(whole->stats.quads, 1000);
    ASSERT_FALSE(whole->parts[0].thickness.empty());
    expect_equal(made->meshes, *whole);
    EXPECT_EQ(made->voxels, scene.voxel_count());
    EXPECT_EQ(made->voxels_with_data, 1);
    EXPECT_TRUE(made->broken.empty());
  }
}

TEST(WorldFaces, MatchWholeScene) {
  const Scene scene = landscape();
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  ASSERT_TRUE(write_world(scene, path));
  for (const InstanceFilter filter : {InstanceFilter::Visible, InstanceFilter::All}) {
    const FaceCounts whole = count_faces(scene, filter);
    EXPECT_GT(whole.visible, 0);
    EXPECT_EQ(faces_in(path, filter), whole);
  }
}

TEST(WorldMeshes, AreReadAgainAfterRelease) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  ASSERT_TRUE(write_world(landscape(), path));
  WorldMeshOptions options;
  options.folder = folder.path();
  const auto made = meshed(path, options);
  ASSERT_TRUE(made);
  const auto first = write_mesh(made->meshes, folder / "a.glb");
  ASSERT_TRUE(first) << to_string(first.error());
  const auto whole = mesh_scene(landscape(), options.scene);
  ASSERT_TRUE(write_mesh(*whole, folder / "b.glb"));
  const auto bytes = [](const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  EXPECT_TRUE(bytes(folder / "a.glb") == bytes(folder / "b.glb"));
  // No temporary file remains.
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 3);
}

TEST(WorldMeshes, RefuseDensities) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  Scene scene = landscape();
  SceneGrid smooth;
  smooth.field.add_sphere({5.0, 5.0, 5.0}, 20.0, 1);
  Instance placed;
  placed.grid = scene.add_grid(std::move(smooth));
  scene.add_instance(placed);
  ASSERT_TRUE(write_world(scene, path));
  WorldMeshOptions options;
  options.folder = folder.path();
  const auto made = meshed(path, options);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::Unsupported);
}

TEST(WorldMeshes, ReportMissingFolder) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  ASSERT_TRUE(write_world(landscape(), path));
  WorldMeshOptions options;
  options.folder = folder / "none";
  const auto made = meshed(path, options);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::CannotWrite);
  EXPECT_EQ(made.error().path, options.folder.string());
}

TEST(WorldMeshes, CanBeCancelled) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  ASSERT_TRUE(write_world(landscape(), path));
  int steps = 0;
  const auto world = WorldStore::open(path, WorldAccess::Read);
  const auto loaded = load_partial_world(*world);
  const auto made = mesh_world(*world, *loaded, {.folder = folder.path()}, {}, [&](double) { return ++steps < 1; });
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::Cancelled);
}

TEST(WorldMeshes, EstimateMemoryFromSampleOfChunks) {
  const WorldFolder folder;
  const auto path = folder / "w.quoin";
  const Scene scene = landscape();
  ASSERT_TRUE(write_world(scene, path));
  std::size_t bytes = 0;
  scene.grids().for_each([&](GridHandle, const SceneGrid& grid) {
    for (const IVec3 chunk : grid.grid.chunks()) bytes += grid.grid.find_chunk(chunk)->bytes();
  });
  const auto guessed = memory_of_world(*WorldStore::open(path, WorldAccess::Read));
  ASSERT_TRUE(guessed);
  EXPECT_GT(static_cast<double>(*guessed), 0.5 * static_cast<double>(bytes));
  EXPECT_LT(static_cast<double>(*guessed), 2.0 * static_cast<double>(bytes));
}

}  // namespace
}  // namespace quoin
