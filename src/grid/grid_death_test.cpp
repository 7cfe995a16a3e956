// Tests the requirements of grid functions.

#include <array>
#include <utility>

#include <gtest/gtest.h>

#include <quoin/core/ref.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/downsample.h>
#include <quoin/grid/grid.h>
#include <quoin/grid/voxel_registry.h>

#include "core/death_for_tests.h"
#include "grid/change_records.h"
#include "grid/chunk/chunk_storage.h"

namespace quoin {
namespace {

TEST(ChunkDeathTest, AssertsOnVoxelOutsideChunk) {
  Chunk chunk;
  QUOIN_EXPECT_MISTAKE((void)chunk.get(0, 64, 0), "0 <= x, y, z < 64");
  QUOIN_EXPECT_MISTAKE(chunk.set(-1, 0, 0, 1), "0 <= x, y, z < 64");
}

TEST(ChunkDeathTest, AssertsOnRowOutsideChunk) {
  Chunk chunk;
  std::array<VoxelType, kChunkEdge> row{};
  QUOIN_EXPECT_MISTAKE(chunk.read_row(0, 64, row), "0 <= y, z < 64");
  QUOIN_EXPECT_MISTAKE(chunk.fill_row(-1, 0, 1, 1), "0 <= y, z < 64");
  QUOIN_EXPECT_MISTAKE(chunk.write_row(64, 0, row), "0 <= y, z < 64");
  QUOIN_EXPECT_MISTAKE(chunk.write_row(0, 64, 1, row), "0 <= y, z < 64");
  QUOIN_EXPECT_MISTAKE((void)chunk.row_mask(0, -1, 1), "0 <= y, z < 64");
}

TEST(RefDeathTest, AssertsOnNullRef) {
  struct Object : RefCounted {};
  QUOIN_EXPECT_MISTAKE((void)Ref<Object>().is_shared(), "there is an object");
}

TEST(DensityDeathTest, AssertsOnSampleOutsideChunk) {
  const DensityChunk chunk(0);
  QUOIN_EXPECT_MISTAKE((void)chunk.get(64, 0, 0), "0 <= x, y, z < 64");
}

TEST(DensityDeathTest, AssertsOnRowOutsideChunk) {
  DensityChunk chunk(0);
  std::array<Half, kChunkEdge> row{};
  QUOIN_EXPECT_MISTAKE((void)chunk.solid_row(64, 0), "0 <= y, z < 64");
  QUOIN_EXPECT_MISTAKE((void)chunk.row(0, -1), "0 <= y, z < 64");
  QUOIN_EXPECT_MISTAKE(chunk.read_row(-1, 0, row), "0 <= y, z < 64");
  QUOIN_EXPECT_MISTAKE(chunk.write_row(0, 64, row), "0 <= y, z < 64");
}

TEST(DensityDeathTest, AssertsOnInvalidHalf) {
  constexpr Half kMinusZero = 0x8000;
  constexpr Half kInfinity = 0x7C00;
  constexpr Half kNaN = 0x7E00;
  DensityChunk chunk(0);
  std::array<Half, kChunkEdge> row{};
  for (const Half half : {kMinusZero, kInfinity, kNaN}) {
    row[63] = half;
    QUOIN_EXPECT_MISTAKE(chunk.write_row(0, 0, row), "every density is a stored_density");
    QUOIN_EXPECT_MISTAKE(chunk.fill(half), "a stored_density");
    QUOIN_EXPECT_MISTAKE(DensityChunk{half}, "a stored_density");
  }
}

TEST(DensityDeathTest, AssertsOnChunkOfOtherBand) {
  DensityGrid grid(8.0F);
  DensityChunk chunk(stored_density(16.0F, 16.0F));
  QUOIN_EXPECT_MISTAKE(grid.put_chunk(IVec3(0), chunk), "densities are stored_density of the band");
  std::array<Half, kChunkEdge> row{};
  row[5] = 1;  // 2^-24, which becomes 2^-14
  chunk.fill(0);
  chunk.write_row(9, 9, row);
  QUOIN_EXPECT_MISTAKE(grid.put_chunk(IVec3(0), chunk), "densities are stored_density of the band");
}

TEST(NeighbourhoodDeathTest, AssertsOnOffsetBeyondNeighbours) {
  const Neighbourhood voxels;
  QUOIN_EXPECT_MISTAKE((void)Neighbourhood::index(0, 2, 0), "-1 <= dx, dy, dz <= 1");
  QUOIN_EXPECT_MISTAKE((void)Neighbourhood::offset(27), "0 <= index < 27");
  QUOIN_EXPECT_MISTAKE((void)voxels.at(0, 0, -2), "-1 <= dx, dy, dz <= 1");
  QUOIN_EXPECT_MISTAKE((void)voxels.get(IVec3(128, 0, 0)), "-1 <= dx, dy, dz <= 1");
  const DensityNeighbourhood samples;
  QUOIN_EXPECT_MISTAKE((void)samples.at(2, 0, 0), "-1 <= dx, dy, dz <= 1");
  QUOIN_EXPECT_MISTAKE((void)samples.get(IVec3(0, -65, 0)), "-1 <= dx, dy, dz <= 1");
}

TEST(ChangesDeathTest, AssertsOnChunkBeyondNeighbours) {
  QUOIN_EXPECT_MISTAKE((void)ChunkChange().affects(IVec3(2, 0, 0)), "-1 <= dx, dy, dz <= 1");
  QUOIN_EXPECT_MISTAKE((void)DensityChange().affects(IVec3(0, 0, -2), 0), "-1 <= dx, dy, dz <= 1");
  QUOIN_EXPECT_MISTAKE((void)DensityChange().affects(IVec3(0), 65), "0 <= reach <= 64");
}

TEST(ChangesDeathTest, AssertsOnSlabOutsideChunk) {
  ChunkSlabs slabs;
  QUOIN_EXPECT_MISTAKE(slabs.add(64, 0), "0 <= y, z < 64");
  QUOIN_EXPECT_MISTAKE((void)slabs.has(0, -1), "0 <= y, z < 64");
  QUOIN_EXPECT_MISTAKE((void)slabs.along_y(64), "0 <= z < 64");
  QUOIN_EXPECT_MISTAKE((void)slabs.block(8, 0), "0, 16, 32 or 48");
}

TEST(DensityDeathTest, AssertsOnNonPositiveBand) {
  QUOIN_EXPECT_MISTAKE(DensityGrid(0.0F), "0 < band <= 65,504");
  QUOIN_EXPECT_MISTAKE((void)stored_density(1.0F, -1.0F), "a positive band");
}

TEST(DensityDeathTest, AssertsOnReachBeyondNeighbours) {
  const DensityGrid grid;
  QUOIN_EXPECT_MISTAKE((void)chunks_to_mesh(grid, {}, 65), "0 <= reach <= 64");
}

TEST(PyramidDeathTest, AssertsOnMissingLevel) {
  const GridPyramid pyramid;
  QUOIN_EXPECT_MISTAKE((void)pyramid.level(1), "1 <= level <= levels");
  const DensityPyramid densities;
  QUOIN_EXPECT_MISTAKE((void)densities.level(1), "1 <= level <= levels");
  QUOIN_EXPECT_MISTAKE((void)densities.counts(0), "1 <= level <= levels");
}

TEST(RegistryDeathTest, AssertsOnUnregisteredType) {
  VoxelRegistry types;
  QUOIN_EXPECT_MISTAKE((void)types[1], "a registered type");
  QUOIN_EXPECT_MISTAKE(types.replace(0, {}), "a registered type, not air");
  QUOIN_EXPECT_MISTAKE(types.replace(3, {}), "a registered type, not air");
}

TEST(RegistryDeathTest, AssertsOnSecondAirType) {
  VoxelRegistry types;
  const VoxelType type = types.add({}).value();
  VoxelProperties air;
  air.visibility = Visibility::Air;
  QUOIN_EXPECT_MISTAKE(types.replace(type, air), "type 0 is the only air");
}

// NOLINTBEGIN(bugprone-use-after-move): tested here
TEST(RegistryDeathTest, RejectsUseAfterMove) {
  VoxelRegistry types;
  const VoxelRegistry moved = std::move(types);
  const ChangeCursor cursor = moved.cursor();
  ChangeCursor read = cursor;
  QUOIN_EXPECT_MISTAKE((void)types.size(), "a registry that was not moved from");
  QUOIN_EXPECT_MISTAKE((void)types[0], "a registry that was not moved from");
  QUOIN_EXPECT_MISTAKE((void)types.cursor(), "a registry that was not moved from");
  QUOIN_EXPECT_MISTAKE((void)types.has_changed_since(cursor), "a registry that was not moved from");
  QUOIN_EXPECT_MISTAKE((void)types.changes_since(read), "a registry that was not moved from");
  QUOIN_EXPECT_MISTAKE((void)types.add({}), "a registry that was not moved from");
  QUOIN_EXPECT_MISTAKE((void)VoxelRegistry(types), "a registry that was not moved from");
}

TEST(GridDeathTest, RejectsUseAfterMove) {
  Grid grid;
  const Grid moved = std::move(grid);
  ChangeCursor cursor;
  QUOIN_EXPECT_MISTAKE((void)grid.snapshot(), "a grid that was not moved from");
  QUOIN_EXPECT_MISTAKE(grid.fill_box(kWholeChunk, 1), "a grid that was not moved from");
  QUOIN_EXPECT_MISTAKE(grid.put_chunk(IVec3(0), Chunk(1)), "a grid that was not moved from");
  QUOIN_EXPECT_MISTAKE(grid.clear(), "a grid that was not moved from");
  QUOIN_EXPECT_MISTAKE((void)grid.chunks(), "a grid that was not moved from");
  QUOIN_EXPECT_MISTAKE((void)grid.bounds(), "a grid that was not moved from");
  QUOIN_EXPECT_MISTAKE((void)grid.cursor(), "a grid that was not moved from");
  QUOIN_EXPECT_MISTAKE((void)grid.changes_since(cursor), "a grid that was not moved from");
}

TEST(DensityDeathTest, RejectsUseAfterMove) {
  DensityGrid field;
  const DensityGrid moved = std::move(field);
  ChangeCursor cursor;
  QUOIN_EXPECT_MISTAKE((void)field.snapshot(), "a field that was not moved from");
  QUOIN_EXPECT_MISTAKE((void)field.band(), "a field that was not moved from");
  QUOIN_EXPECT_MISTAKE(field.add_sphere(DVec3(0.0), 1.0, 1), "a field that was not moved from");
  QUOIN_EXPECT_MISTAKE(field.smooth(DVec3(0.0), 1.0, 1.0), "a field that was not moved from");
  QUOIN_EXPECT_MISTAKE(field.put_chunk(IVec3(0), DensityChunk(0)), "a field that was not moved from");
  QUOIN_EXPECT_MISTAKE((void)field.bounds(), "a field that was not moved from");
  QUOIN_EXPECT_MISTAKE((void)field.changes_since(cursor), "a field that was not moved from");
}
// NOLINTEND(bugprone-use-after-move)

TEST(RefDeathTest, RejectsAccessToNullObject) {
  struct Object : RefCounted {
    int value = 1;
  };
  const Ref<Object> none;
  QUOIN_EXPECT_MISTAKE((void)none->value, "there is an object");
  QUOIN_EXPECT_MISTAKE((void)*none, "there is an object");
}

TEST(ChangesDeathTest, RejectsPackedBoxBeyondChunk) {
  QUOIN_EXPECT_MISTAKE((void)PackedBox::of(0, 64, 0), "0 <= x, y, z < 64");
  QUOIN_EXPECT_MISTAKE((void)PackedBox::of_row(0, 0, 0), "voxels of the row");
}

TEST(ChunkDeathTest, RejectsSlabBeyondChunk) {
  QUOIN_EXPECT_MISTAKE((void)ChunkStorage::slab_index(64, 0), "0 <= y, z < 64");
  QUOIN_EXPECT_MISTAKE((void)bits_for((std::size_t{1} << 16) + 1), "types of 16 bits");
}

}  // namespace
}  // namespace quoin
