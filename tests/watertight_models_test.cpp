#include <array>
#include <filesystem>
#include <map>
#include <optional>

#include <gtest/gtest.h>
#include <quoin/io/formats.h>
#include <quoin/mesh/blocky.h>
#include <quoin/mesh/smooth_mesh.h>
#include <quoin/scene/scene_meshes.h>

#include "core/work/nightly_for_tests.h"
#include "mesh/blocky/watertight_for_tests.h"
#include "mesh/smooth/surface_check_for_tests.h"

namespace quoin {
namespace {

// Tests every model of the real files, which lie next to the source tree on some machines.
TEST(WatertightModels, RealModelsAreWatertight) {
  const std::filesystem::path folder = std::filesystem::path(QUOIN_SOURCE_DIR) / ".." / "shared" / "data" / "vox";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "the collection of real files is not here: " << folder;
  BlockyMeshOptions options;
  options.watertight = true;
  int models = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".vox") continue;
    const auto loaded = load_scene(entry.path());
    if (!loaded) continue;  // intentionally bad files; VoxData counts the others
    for (const GridHandle handle : loaded->scene.grids().handles()) {
      const auto mesh = build_blocky_mesh(loaded->scene.grids()[handle].grid, loaded->scene.types, options);
      ASSERT_TRUE(mesh.has_value());
      EXPECT_EQ(oracle::watertight_fault(*mesh), "") << entry.path() << ", grid " << handle.index;
      ++models;
    }
  }
  EXPECT_GT(models, 150);
}

/// After welding vertices by position, each edge lies between two triangles.
void expect_manifold_by_places(const MeshView& view) {
  std::map<std::array<float, 3>, std::uint32_t> places;
  std::vector<std::uint32_t> indices;
  for (const std::uint32_t index : view.indices) {
    const Vec3 p = view.positions[index] + 0.0F;
    indices.push_back(places.try_emplace({p.x, p.y, p.z}, static_cast<std::uint32_t>(places.size())).first->second);
  }
  const oracle::SurfaceCount count = oracle::count_surface(indices, places.size());
  oracle::expect_closed(count);
  EXPECT_EQ(count.crowded_edges, 0) << count;
}

TEST(WatertightModels, RealModelsHaveManifoldSmoothSurfaces) {
  const std::filesystem::path folder = std::filesystem::path(QUOIN_SOURCE_DIR) / ".." / "shared" / "data" / "vox";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "the collection of real files is not here: " << folder;
  int models = 0;
  int files = 0;
  int simplified = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".vox" || files++ % cases(3, 1) != 0) continue;
    const auto loaded = load_scene(entry.path());
    if (!loaded) continue;
    SCOPED_TRACE(entry.path());
    for (const float error : {0.0F, 0.25F}) {
      // Tests every third model, since simplification is slow.
      if (error > 0.0F && (!can_simplify() || ++simplified % 3 != 0)) continue;
      SmoothSceneOptions options;
      options.unite = false;
      if (error > 0.0F) options.simplify_error = error;
      const auto meshes = mesh_scene_smoothly(loaded->scene, options);
      ASSERT_TRUE(meshes);
      EXPECT_LE(meshes->stats.simplify_error, error);
      for (const MeshPart& part : meshes->parts) {
        // Panes of two kinds share positions.
        if (part.surfaces[0].surface == SurfaceClass::Opaque) expect_manifold_by_places(part.surfaces[0]);
        ++models;
      }
    }
  }
  EXPECT_GT(models, cases(60, 200));
}

}  // namespace
}  // namespace quoin
