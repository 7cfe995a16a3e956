#include "grid/chunk_table.h"

#include <algorithm>
#include <map>
#include <random>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

namespace quoin {
namespace {

using Key = std::tuple<int, int, int>;

Key place_key(IVec3 at) {
  return {at.x, at.y, at.z};
}

ChunkEntry& add(ChunkTable& table, IVec3 at, VoxelType type) {
  const ChunkTable::Slot slot = table.find_or_create(at);
  slot.entry->chunk.set(1, 2, 3, type);
  table.voxels_changed(slot);
  return *slot.entry;
}

// Positions of a crowd that moves away step by step, and a few strays far from it and from each other.
IVec3 random_place(std::mt19937& random, int round, bool strays) {
  const auto below = [&](int limit) { return static_cast<int>(random() % static_cast<unsigned>(limit)); };
  if (strays && random() % 8 == 0) return {below(40'000) - 20'000, below(40'000) - 20'000, below(40'000) - 20'000};
  return IVec3{below(9) - 4, below(3) - 1, below(9) - 4} + IVec3(round / 400, 0, -round / 300);
}

TEST(ChunkTable, MatchesMapUnderRandomChanges) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    ChunkTable table;
    std::map<Key, const ChunkEntry*> plain;
    std::vector<IVec3> places;
    for (int round = 0; round < 12'000; ++round) {
      const IVec3 at = random_place(random, round, seed % 2 == 0);
      const bool grows = (round / 3'000) % 2 == 0;
      if (random() % 8 < (grows ? 6U : 1U)) {
        plain[place_key(at)] = &add(table, at, 7);
        places.push_back(at);
      } else if (!places.empty()) {
        const std::size_t i = random() % places.size();
        table.erase(places[i]);
        plain.erase(place_key(places[i]));
        places[i] = places.back();
        places.pop_back();
      }
      if (round % 5'000 == 4'999) {
        table.clear();
        plain.clear();
      }
      ASSERT_EQ(table.size(), plain.size());
      ASSERT_LE(table.outside(), table.size());
      ASSERT_LE(table.window_cells(), std::max<std::size_t>(256, 32 * plain.size()));
      for (const IVec3 asked : {at, random_place(random, round, seed % 2 == 0), places.empty() ? at : places[0]}) {
        const auto found = plain.find(place_key(asked));
        ASSERT_EQ(table.find(asked), found == plain.end() ? nullptr : found->second);
        const VoxelType expected = found == plain.end() ? kAir : VoxelType{7};
        ASSERT_EQ(table.voxel(asked.x * 64 + 1, asked.y * 64 + 2, asked.z * 64 + 3), expected);
        ASSERT_EQ(table.voxel(asked.x * 64, asked.y * 64, asked.z * 64), kAir);
      }
    }
  }
}

TEST(ChunkTable, KeepsAdjacentChunksInWindowInAnyOrder) {
  std::mt19937 random(3);
  std::vector<IVec3> places;
  places.reserve(12 * 3 * 12);
  for (int i = 0; i < 12 * 3 * 12; ++i) places.push_back(IVec3{i % 12, i / 12 % 3, i / 36} - IVec3{5, 1, 700});
  for (int order = 0; order < 4; ++order) {
    ChunkTable table;
    for (const IVec3 at : places) add(table, at, 1);
    EXPECT_EQ(table.outside(), 0U) << order;
    EXPECT_LE(table.window_cells(), 8 * places.size());
    std::shuffle(places.begin(), places.end(), random);
  }
}

TEST(ChunkTable, WindowFollowsMovingChunks) {
  ChunkTable table;
  for (int x = 0; x < 3'000; ++x) {
    for (int z = 0; z < 16; ++z) add(table, {x, 0, z}, 1);
    for (int z = 0; x >= 16 && z < 16; ++z) table.erase({x - 16, 0, z});
    ASSERT_LE(table.outside(), table.size() / 3);
    ASSERT_LE(table.window_cells(), 32 * table.size());
  }
}

// Simulates a moving viewer: small numbers of chunks appear ahead and disappear behind, and the window is never
// rebuilt.
TEST(ChunkTable, WindowSlidesWithoutGrowing) {
  for (const IVec3 way : {IVec3{1, 0, 0}, IVec3{-1, 0, 0}, IVec3{0, 1, 0}, IVec3{0, 0, -1}, IVec3{1, -1, 1}}) {
    ChunkTable table;
    const auto each = [](auto&& visit) {
      for (int i = 0; i < 9 * 9 * 9; ++i) visit(IVec3{i % 9, i / 9 % 9, i / 81});
    };
    const IVec3 start = way * 1000 - 4;
    each([&](IVec3 at) { add(table, start + at, 3); });
    const std::size_t cells = table.window_cells();
    for (int step = 0; step < 60; ++step) {
      const IVec3 here = start + way * step;
      const IBox behind{here, here + 9};
      const IBox ahead{here + way, here + way + 9};
      each([&](IVec3 at) {
        if (!behind.contains(here + way + at)) add(table, here + way + at, 3);
      });
      each([&](IVec3 at) {
        if (!ahead.contains(here + at)) table.erase(here + at);
      });
      ASSERT_EQ(table.size(), 9U * 9U * 9U);
      ASSERT_EQ(table.outside(), 0U);
      ASSERT_EQ(table.window_cells(), cells);
      each([&](IVec3 at) {
        const IVec3 chunk = here + way + at;
        ASSERT_NE(table.find(chunk), nullptr);
        ASSERT_EQ(table.voxel(chunk.x * 64 + 1, chunk.y * 64 + 2, chunk.z * 64 + 3), 3);
      });
      ASSERT_EQ(table.find(here + way + 9), nullptr);
      ASSERT_EQ(table.find(here + way - 1), nullptr);
    }
  }
}

TEST(ChunkTable, KeepsWindowDespiteDistantChunks) {
  for (const bool far_first : {true, false}) {
    ChunkTable table;
    const auto add_far = [&table] {
      for (int i = 0; i < 8; ++i) add(table, IVec3{i % 2, i / 2 % 2, i / 4} * 40'000 - 20'000, 1);
    };
    if (far_first) add_far();
    for (int i = 0; i < 4'096; ++i) add(table, {i % 16, i / 16 % 16, i / 256}, 1);
    if (!far_first) add_far();
    EXPECT_LE(table.outside(), 8U + 1'024U) << "only the chunks added last are outside";
    EXPECT_GE(table.window_cells(), 2'048U);
    EXPECT_EQ(table.voxel(1, 2, 3), 1);
    EXPECT_EQ(table.voxel(20'000 * 64 + 1, 20'000 * 64 + 2, -20'000 * 64 + 3), 1);
    for (int i = 0; i < 8; ++i) table.erase(IVec3{i % 2, i / 2 % 2, i / 4} * 40'000 - 20'000);
    for (int i = 0; i < 4'096; ++i) EXPECT_EQ(table.voxel(i % 16 * 64 + 1, i / 16 % 16 * 64 + 2, i / 256 * 64 + 3), 1);
  }
}

TEST(ChunkTable, KeepsScatteredChunksOutsideWindow) {
  ChunkTable table;
  for (int i = 0; i < 100; ++i) add(table, {i * 1'000, -i * 900, i % 7 * 5'000}, 1);
  EXPECT_LE(table.window_cells(), 64U);
  EXPECT_GE(table.outside(), 99U);
}

TEST(ChunkTable, ReadsVoxelsAfterEditMovesStorage) {
  ChunkTable table;
  const IVec3 at{-3, 4, 5};
  add(table, at, 2);
  const ChunkTable::Slot slot = table.find_to_edit(at);
  const auto voxel = [&] { return table.voxel(-3 * 64 + 1, 4 * 64 + 2, 5 * 64 + 3); };
  EXPECT_EQ(voxel(), 2);
  slot.entry->chunk.fill(9);
  table.voxels_changed(slot);
  EXPECT_EQ(voxel(), 9);
  slot.entry->chunk = Chunk(4);
  slot.entry->chunk.set(0, 0, 0, 5);
  table.voxels_changed(slot);
  EXPECT_EQ(voxel(), 4);
  table.erase(at);
  EXPECT_EQ(voxel(), kAir);
}

}  // namespace
}  // namespace quoin
