#include <quoin/grid/grid.h>

#include <array>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace quoin {
namespace {

// Sets voxels to random types, then back. The memory left must be close to that of a grid without the edits.
class GridMemory : public testing::TestWithParam<unsigned> {};

TEST_P(GridMemory, MatchesNewGridAfterUndoneEdits) {
  constexpr int kEdits = 150'000;
  std::mt19937 random(GetParam());
  Grid grid;
  grid.edit({IVec3{-64}, IVec3{64}}, [](IVec3 v, VoxelType) {
    return static_cast<VoxelType>(v.y < (v.x * v.x + v.z) / 64 ? 1 + (v.x & 1) : 0);
  });
  Grid fresh;
  for (const IVec3 at : grid.chunks()) {
    std::vector<VoxelType> types(kChunkVoxels);
    for (std::size_t row = 0; row < kChunkVoxels; row += kChunkEdge) {
      grid.find_chunk(at)->read_row(static_cast<int>(row / kChunkEdge % kChunkEdge), static_cast<int>(row / 4096),
                                    std::span(types).subspan(row).first<kChunkEdge>());
    }
    fresh.put_chunk(at, Chunk::from_dense(std::span(types).first<kChunkVoxels>()));
  }
  std::vector<std::pair<IVec3, VoxelType>> undo;
  for (int round = 0; round < 4; ++round) {
    undo.clear();
    for (int i = 0; i < kEdits; ++i) {
      const auto place = [&] { return static_cast<int>(random() % 128) - 64; };
      const IVec3 at{place(), place(), place()};
      undo.emplace_back(at, grid.get(at));
      grid.set(at, static_cast<VoxelType>(random() % GetParam()));
    }
    for (auto it = undo.rbegin(); it != undo.rend(); ++it) grid.set(it->first, it->second);
    EXPECT_LE(grid.bytes(), fresh.bytes() + fresh.bytes() / 4) << "round " << round;
  }
  ASSERT_EQ(grid.chunks(), fresh.chunks());
  for (const IVec3 at : fresh.chunks()) {
    std::array<VoxelType, kChunkEdge> row{};
    std::array<VoxelType, kChunkEdge> fresh_row{};
    for (int i = 0; i < kChunkEdge * kChunkEdge; ++i) {
      grid.find_chunk(at)->read_row(i % 64, i / 64, row);
      fresh.find_chunk(at)->read_row(i % 64, i / 64, fresh_row);
      ASSERT_EQ(row, fresh_row);
    }
    EXPECT_EQ(grid.find_chunk(at)->bounds(), fresh.find_chunk(at)->bounds());
    EXPECT_EQ(grid.find_chunk(at)->types(), fresh.find_chunk(at)->types());
  }
}

INSTANTIATE_TEST_SUITE_P(Types, GridMemory, testing::Values(2U, 5U, 40U, 300U, 60'000U));

TEST(Grid, FreesTableOfDroppedChunks) {
  Grid grid;
  for (int i = 0; i < 20'000; ++i) grid.set({i % 100 * 64, i / 100 * 64, 0}, 1);
  for (int i = 0; i < 20'000; ++i) grid.set({i % 100 * 64, i / 100 * 64, 0}, kAir);
  for (int i = 0; i < 3; ++i) grid.set({i * 64, 0, 0}, 1);
  EXPECT_LT(grid.bytes(), 16'384U);
}

}  // namespace
}  // namespace quoin
