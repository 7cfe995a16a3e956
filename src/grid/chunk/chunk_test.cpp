#include <quoin/grid/chunk.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/memory.h>

#include "grid/chunk/chunk_storage.h"

namespace quoin {
namespace {

std::size_t dense_index(int x, int y, int z) {
  return static_cast<std::size_t>((z * kChunkEdge + y) * kChunkEdge + x);
}

// Checks the invariants that are too expensive for asserts: each slot belongs to one slab or is free, and all counts
// match the voxels.
void expect_books_agree(const Chunk& chunk) {
  const ChunkStorage* const m = ChunkStorage::of(chunk);
  if (m == nullptr) return;
  std::vector<bool> is_taken(m->slot_count);
  const auto take = [&](std::uint32_t slot) {
    ASSERT_LT(slot, m->slot_count);
    EXPECT_FALSE(is_taken[slot]) << "slot " << slot << " twice";
    is_taken[slot] = true;
  };
  for (const std::uint32_t slab : m->slabs) {
    if ((slab & ChunkStorage::kUniformSlab) == 0) take(slab);
  }
  std::uint32_t free = 0;
  for (std::uint32_t slot = m->first_free; slot != ChunkStorage::kNoSlot && free <= m->free_count; ++free) {
    take(slot);
    slot = static_cast<std::uint32_t>(*m->row(slot, 0));
  }
  EXPECT_EQ(free, m->free_count);
  EXPECT_EQ(std::count(is_taken.begin(), is_taken.end(), false), 0);
  EXPECT_EQ(m->words.size(), std::size_t{m->slot_count} * kSlabRows * static_cast<std::size_t>(m->bits));
  BlockVector<std::uint32_t> counts(m->counts.size());
  std::array<std::array<std::uint16_t, kChunkEdge>, 3> layers{};
  for (std::size_t i = 0; i < kChunkVoxels; ++i) {
    const IVec3 at{static_cast<int>(i % 64), static_cast<int>(i / 64 % 64), static_cast<int>(i / 4096)};
    const VoxelType type = m->type(at.x, at.y, at.z);
    std::size_t place = type % ChunkStorage::kRemainders;
    if (!m->direct()) {
      place = static_cast<std::size_t>(std::find(m->palette.begin(), m->palette.end(), type) - m->palette.begin());
    }
    ++counts[place];
    for (int axis = 0; axis < 3 && type != kAir; ++axis) {
      ++layers.at(static_cast<std::size_t>(axis)).at(static_cast<std::size_t>(at[axis]));
    }
  }
  EXPECT_EQ(m->counts, counts);
  EXPECT_EQ(m->used, counts.size() - static_cast<std::size_t>(std::count(counts.begin(), counts.end(), 0U)));
  EXPECT_EQ(m->layer_counts, layers);
}

void expect_holds(const Chunk& chunk, const std::vector<VoxelType>& dense) {
  expect_books_agree(chunk);
  int non_air = 0;
  IBox box;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      for (int x = 0; x < kChunkEdge; ++x) {
        const VoxelType expected = dense[dense_index(x, y, z)];
        ASSERT_EQ(chunk.get(x, y, z), expected) << x << ' ' << y << ' ' << z;
        if (expected == kAir) continue;
        ++non_air;
        box = unite(box, {{x, y, z}, {x + 1, y + 1, z + 1}});
      }
    }
  }
  EXPECT_EQ(chunk.non_air_count(), non_air);
  EXPECT_EQ(chunk.bounds(), box);
  std::set<VoxelType> types(dense.begin(), dense.end());
  const std::vector<VoxelType> found = chunk.types();
  EXPECT_TRUE(std::equal(types.begin(), types.end(), found.begin(), found.end()));
  int checked = 0;
  for (const VoxelType type : types) {
    if (++checked > 300) break;
    EXPECT_EQ(chunk.count(type), std::count(dense.begin(), dense.end(), type));
  }
}

TEST(Chunk, UniformChunkHoldsNoVoxelData) {
  EXPECT_EQ(Chunk(7).bytes(), sizeof(Chunk));
  EXPECT_EQ(Chunk(7).non_air_count(), 64 * 64 * 64);
  EXPECT_EQ(Chunk().bounds(), IBox{});
}

TEST(Chunk, SetReturnsTrueIfVoxelChanged) {
  Chunk chunk;
  EXPECT_TRUE(chunk.set(1, 2, 3, 5));
  EXPECT_FALSE(chunk.set(1, 2, 3, 5));
  EXPECT_TRUE(chunk.set(1, 2, 3, kAir));
  EXPECT_FALSE(chunk.set(1, 2, 3, kAir));
}

TEST(Chunk, BecomesUniformWhenFilledVoxelByVoxel) {
  Chunk chunk;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      for (int x = 0; x < kChunkEdge; ++x) chunk.set(x, y, z, 9);
    }
  }
  EXPECT_EQ(chunk.uniform(), 9);
}

// Uses enough types to reach each bit width, and compares the chunk with a plain array.
class ChunkOfTypes : public testing::TestWithParam<int> {};

TEST_P(ChunkOfTypes, MatchesPlainArray) {
  std::mt19937 random(static_cast<unsigned>(GetParam()));
  std::vector<VoxelType> dense(kChunkVoxels, kAir);
  Chunk chunk;
  const auto pick = [&] { return static_cast<VoxelType>(random() % static_cast<unsigned>(GetParam())); };
  for (int i = 0; i < 40'000; ++i) {
    const int x = static_cast<int>(random() % 64);
    const int y = static_cast<int>(random() % 64);
    const int z = static_cast<int>(random() % 64);
    const VoxelType type = pick();
    ASSERT_EQ(chunk.set(x, y, z, type), dense[dense_index(x, y, z)] != type);
    dense[dense_index(x, y, z)] = type;
  }
  for (int i = 0; i < 3'000; ++i) {
    const int y = static_cast<int>(random() % 64);
    const int z = static_cast<int>(random() % 64);
    const std::uint64_t mask = (std::uint64_t{random()} << 32 | random()) & (std::uint64_t{random()} << 32 | random());
    const VoxelType type = pick();
    std::uint64_t changed = 0;
    for (int x = 0; x < kChunkEdge; ++x) {
      VoxelType& voxel = dense[dense_index(x, y, z)];
      if ((mask >> x & 1U) == 0 || voxel == type) continue;
      voxel = type;
      changed |= std::uint64_t{1} << x;
    }
    ASSERT_EQ(chunk.fill_row(y, z, mask, type), changed);
  }
  expect_holds(chunk, dense);
  Chunk packed = Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(dense));
  expect_holds(packed, dense);
  chunk.compact();
  expect_holds(chunk, dense);
  const Chunk copy = chunk;
  expect_holds(copy, dense);
}

INSTANTIATE_TEST_SUITE_P(Widths, ChunkOfTypes, testing::Values(2, 3, 4, 5, 16, 17, 200, 256, 257, 65'535));

TEST(Chunk, ReusesUnusedPaletteEntries) {
  Chunk chunk;
  for (int i = 1; i < 60'000; ++i) chunk.set(5, 5, 5, static_cast<VoxelType>(i));
  EXPECT_LE(ChunkStorage::of(chunk)->bits, 2);
}

TEST(Chunk, StoresNoDataForFilledSlabs) {
  Chunk chunk;
  int rows = 0;
  chunk.fill_box({{0, 0, 0}, {64, 32, 64}}, 3, [&](int, int, std::uint64_t changed) {
    EXPECT_EQ(changed, ~std::uint64_t{0});
    ++rows;
  });
  EXPECT_EQ(rows, 32 * 64);
  chunk.fill_box({{10, 40, 10}, {20, 41, 11}}, 4, [](int, int, std::uint64_t) {});
  EXPECT_EQ(chunk.count(3), 64 * 32 * 64);
  EXPECT_EQ(chunk.count(4), 10);
  chunk.compact();
  EXPECT_LT(chunk.bytes(), 8'192U);
}

TEST(Chunk, BecomesUniformWhenFilledAtAnyWidth) {
  for (const int types : {2, 5, 100, 2'000}) {
    Chunk chunk;
    for (int i = 0; i < types; ++i) chunk.set(i % 64, i / 64, 7, static_cast<VoxelType>(i));
    int rows = 0;
    chunk.fill_box({{-5, 0, 0}, {64, 64, 70}}, 1'234, [&](int, int, std::uint64_t) { ++rows; });
    EXPECT_EQ(rows, 64 * 64);
    EXPECT_EQ(chunk.uniform(), 1'234);
  }
}

TEST(Chunk, RenumbersTypesAtAnyWidth) {
  const auto number = [](VoxelType type) { return static_cast<VoxelType>(type == kAir ? kAir : 3'001 - type); };
  for (const int types : {1, 2, 5, 100, 2'000}) {
    for (const bool has_unused : {false, true}) {
      Chunk chunk(types == 1 ? 7 : kAir);
      for (int i = 1; i < types; ++i) chunk.set(i % 64, i / 64, 7, static_cast<VoxelType>(i));
      if (has_unused) chunk.set(1, 0, 7, static_cast<VoxelType>(3'001 - 2));  // type 1 has no voxel now
      if (types > 2) chunk.set_data({2, 0, 7}, {.state = 5});
      Chunk renumbered = chunk.renumbered(number);
      for (int i = 0; i < 64 * 64; ++i) {
        ASSERT_EQ(renumbered.get(i % 64, i / 64, 7), number(chunk.get(i % 64, i / 64, 7))) << types << ", " << i;
      }
      EXPECT_EQ(renumbered.data_count(), chunk.data_count());
      // The palette has one entry per type, so that later writes find it.
      renumbered.set(63, 63, 63, 2'999);
      EXPECT_EQ(renumbered.count(2'999), chunk.count(2) + 1);
    }
  }
}

TEST(Chunk, BoundsMemoryUnderRandomEdits) {
  std::mt19937 random(1);
  Chunk chunk;
  std::size_t largest = 0;
  for (int round = 0; round < 40; ++round) {
    for (int i = 0; i < 200; ++i) {
      const int y = static_cast<int>(random() % 16) * 4;
      const int z = static_cast<int>(random() % 16) * 4;
      chunk.fill_box({{0, y, z}, {64, y + 4, z + 4}}, static_cast<VoxelType>(random() % 3),
                     [](int, int, std::uint64_t) {});
      chunk.set(static_cast<int>(random() % 64), y, z, static_cast<VoxelType>(random() % 3));
    }
    largest = std::max(largest, chunk.bytes());
  }
  EXPECT_LT(largest, 200'000U);
}

}  // namespace
}  // namespace quoin
