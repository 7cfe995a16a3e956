#include <filesystem>

#include <gtest/gtest.h>
#include <quoin/io/formats.h>
#include <quoin/mesh/blocky_mesh.h>

#include "mesh/blocky/watertight_for_tests.h"

namespace quoin {
namespace {

// Every model of the real files, which lie beside the source tree on machines that have them.
TEST(WatertightModels, EveryRealModelIsWatertight) {
  const std::filesystem::path folder = std::filesystem::path(QUOIN_SOURCE_DIR) / ".." / "shared" / "data" / "vox";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "the collection of real files is not here: " << folder;
  BlockyMeshOptions options;
  options.watertight = true;
  int models = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".vox") continue;
    const auto loaded = load_scene(entry.path());
    if (!loaded) continue;  // those that are meant to be bad; VoxData counts the others
    for (const GridHandle handle : loaded->scene.grids().handles()) {
      const auto mesh = build_blocky_mesh(loaded->scene.grids()[handle].grid, loaded->scene.types, options);
      ASSERT_TRUE(mesh.has_value());
      EXPECT_EQ(oracle::watertight_fault(*mesh), "") << entry.path() << ", grid " << handle.index;
      ++models;
    }
  }
  EXPECT_GT(models, 150);
}

}  // namespace
}  // namespace quoin
