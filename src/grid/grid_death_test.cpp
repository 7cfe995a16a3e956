// What functions of grids require.

#include <array>

#include <gtest/gtest.h>

#include <quoin/core/ref.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/downsample.h>
#include <quoin/grid/grid.h>

#include "core/death_for_tests.h"

namespace quoin {
namespace {

TEST(ChunkDeathTest, AVoxelOutsideIsAMistake) {
  Chunk chunk;
  QUOIN_EXPECT_MISTAKE((void)chunk.get(0, 64, 0), "0 <= x, y, z < 64");
  QUOIN_EXPECT_MISTAKE(chunk.set(-1, 0, 0, 1), "0 <= x, y, z < 64");
}

TEST(ChunkDeathTest, ARowOutsideIsAMistake) {
  Chunk chunk;
  std::array<VoxelType, kChunkEdge> row{};
  QUOIN_EXPECT_MISTAKE(chunk.read_row(0, 64, row), "0 <= y, z < 64");
  QUOIN_EXPECT_MISTAKE(chunk.fill_row(-1, 0, 1, 1), "0 <= y, z < 64");
  QUOIN_EXPECT_MISTAKE(chunk.write_row(64, 0, row), "0 <= y, z < 64");
  QUOIN_EXPECT_MISTAKE((void)chunk.row_mask(0, -1, 1), "0 <= y, z < 64");
}

TEST(RefDeathTest, AskingNobodyIsAMistake) {
  struct Object : RefCounted {};
  QUOIN_EXPECT_MISTAKE((void)Ref<Object>().is_shared(), "there is an object");
}

TEST(DensityDeathTest, ASampleOutsideIsAMistake) {
  const DensityChunk chunk(0);
  QUOIN_EXPECT_MISTAKE((void)chunk.get(64, 0, 0), "0 <= x, y, z < 64");
}

TEST(DensityDeathTest, ABandThatIsNotPositiveIsAMistake) {
  QUOIN_EXPECT_MISTAKE(DensityGrid(0.0F), "0 < band <= 65,504");
  QUOIN_EXPECT_MISTAKE((void)stored_density(1.0F, -1.0F), "a positive band");
}

TEST(DensityDeathTest, AReachBeyondTheNextChunksIsAMistake) {
  const DensityGrid grid;
  QUOIN_EXPECT_MISTAKE((void)chunks_to_mesh(grid, {}, 65), "0 <= reach <= 64");
}

TEST(PyramidDeathTest, ALevelThatIsNotThereIsAMistake) {
  const GridPyramid pyramid;
  QUOIN_EXPECT_MISTAKE((void)pyramid.level(1), "1 <= level <= levels");
}

TEST(RegistryDeathTest, ATypeThatIsNotRegisteredIsAMistake) {
  VoxelRegistry types;
  QUOIN_EXPECT_MISTAKE((void)types[1], "a registered type");
  QUOIN_EXPECT_MISTAKE(types.replace(0, {}), "a registered type, not air");
  QUOIN_EXPECT_MISTAKE(types.replace(3, {}), "a registered type, not air");
}

}  // namespace
}  // namespace quoin
