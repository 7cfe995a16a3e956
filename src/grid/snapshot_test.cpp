// Grids that share chunks until one of them is edited.

#include <atomic>
#include <map>
#include <mutex>
#include <random>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/grid/density_grid.h>
#include <quoin/grid/grid.h>

#include "core/work/nightly_for_tests.h"
#include "grid/chunk/chunk_storage.h"

namespace quoin {
namespace {

using Voxels = std::map<std::tuple<int, int, int>, VoxelType>;

// A grid and its expected voxels.
struct CheckedGrid {
  Grid grid;
  Voxels voxels;
};

void set_both(CheckedGrid& checked, IVec3 at, VoxelType type) {
  checked.grid.set(at, type);
  if (type == kAir) {
    checked.voxels.erase({at.x, at.y, at.z});
  } else {
    checked.voxels[{at.x, at.y, at.z}] = type;
  }
}

void expect_equal(const CheckedGrid& checked) {
  Voxels found;
  checked.grid.for_each([&](IVec3 at, VoxelType type) { found[{at.x, at.y, at.z}] = type; });
  ASSERT_EQ(found, checked.voxels);
  ASSERT_EQ(checked.grid.voxel_count(), static_cast<std::int64_t>(checked.voxels.size()));
  IBox bounds;
  for (const auto& [at, type] : checked.voxels) {
    const IVec3 v{std::get<0>(at), std::get<1>(at), std::get<2>(at)};
    bounds = unite(bounds, {v, v + 1});
    ASSERT_EQ(checked.grid.get(v), type);
  }
  ASSERT_EQ(checked.grid.bounds(), bounds);
}

// Edits and destroys snapshots of snapshots in random order.
TEST(Snapshot, StaysUnchangedByOtherEdits) {
  for (unsigned seed = 1; seed <= static_cast<unsigned>(cases(3, 6)); ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto below = [&](std::size_t limit) { return static_cast<std::size_t>(random() % limit); };
    const auto place = [&] {
      // Edits near each other, and sometimes far apart.
      const int spread = random() % 8 == 0 ? 100'000 : 300;
      return static_cast<int>(random() % static_cast<unsigned>(2 * spread)) - spread;
    };
    std::vector<CheckedGrid> all(1);
    for (int round = 0; round < 1'500; ++round) {
      CheckedGrid& one = all[below(all.size())];
      switch (random() % 12) {
        case 0:
          if (all.size() < 7) {
            CheckedGrid copy{one.grid.snapshot(), one.voxels};
            all.push_back(std::move(copy));
          }
          break;
        case 1:
          if (all.size() > 1) all.erase(all.begin() + static_cast<std::ptrdiff_t>(below(all.size())));
          break;
        case 2:
          one.grid.compact();
          break;
        case 3:
          if (random() % 20 == 0) {
            one.grid.clear();
            one.voxels.clear();
          }
          break;
        case 4:
          if (!one.voxels.empty()) {
            const auto at = std::next(one.voxels.begin(), static_cast<std::ptrdiff_t>(below(one.voxels.size())))->first;
            set_both(one, {std::get<0>(at), std::get<1>(at), std::get<2>(at)}, kAir);
          }
          break;
        default:
          for (int i = 0; i < 4; ++i) {
            set_both(one, {place(), place() / 8, place()}, static_cast<VoxelType>(1 + random() % 20));
          }
      }
      if (round % 50 == 49) {
        for (const CheckedGrid& each : all) ASSERT_NO_FATAL_FAILURE(expect_equal(each));
      }
    }
  }
}

TEST(Snapshot, SharesChunksUntilTheyAreEdited) {
  Grid grid;
  for (int i = 0; i < 64; ++i) grid.set({64 * i + 3, 5, 7}, 1);
  const Grid copy = grid.snapshot();
  grid.set({64 * 20 + 4, 5, 7}, 2);
  grid.set({64 * 21 + 3, 5, 7}, 1);  // restores the voxel
  for (int i = 0; i < 64; ++i) {
    EXPECT_EQ(grid.find_chunk({i, 0, 0})->shares_storage_with(*copy.find_chunk({i, 0, 0})), i != 20) << i;
  }
}

TEST(Snapshot, EditsUnsharedChunkInPlace) {
  Grid grid;
  grid.fill_sphere({32, 32, 32}, 20.0, 1);
  { const Grid copy = grid.snapshot(); }
  const ChunkStorage* const before = ChunkStorage::of(*grid.find_chunk({0, 0, 0}));
  grid.set({32, 32, 32}, 2);
  EXPECT_EQ(ChunkStorage::of(*grid.find_chunk({0, 0, 0})), before);
}

TEST(Snapshot, DensitySnapshotsStayUnchanged) {
  std::mt19937 random(4);
  DensityGrid grid;
  std::vector<std::pair<DensityGrid, std::uint64_t>> copies;
  const auto hash = [](const DensityGrid& of) {
    std::uint64_t sum = 0;
    for (const IVec3 at : of.chunks()) sum = sum * 31 + of.find_chunk(at)->content_hash();
    return sum;
  };
  for (int round = 0; round < 40; ++round) {
    const auto place = [&] { return static_cast<double>(random() % 200) - 100.0; };
    if (round % 2 == 0) {
      grid.add_sphere({place(), place(), place()}, 12.0, static_cast<VoxelType>(1 + round % 5));
    } else {
      grid.remove_sphere({place(), place(), place()}, 15.0);
    }
    if (round % 5 == 0) copies.emplace_back(grid.snapshot(), hash(grid));
    for (const auto& [copy, was] : copies) ASSERT_EQ(hash(copy), was) << round;
  }
}

// Threads keep, read and release snapshots while the grid is edited.
TEST(Snapshot, IsReadableOnThreadsDuringEdits) {
  Grid grid;
  grid.fill_box({{0, 0, 0}, {256, 64, 256}}, 1);
  std::vector<std::jthread> readers;
  std::mt19937 random(9);
  for (int round = 0; round < 60; ++round) {
    readers.emplace_back([copy = grid.snapshot(), expected = grid.voxel_count(), cursor = ChangeCursor()]() mutable {
      EXPECT_EQ(copy.voxel_count(), expected);
      EXPECT_TRUE(copy.changes_since(cursor).all);
      const Grid again = copy.snapshot();
      copy.set({1, 1, 1}, 7);
      EXPECT_EQ(copy.get({1, 1, 1}), 7);
      EXPECT_EQ(again.voxel_count(), expected);
    });
    for (int i = 0; i < 200; ++i) {
      const auto place = [&] { return static_cast<int>(random() % 256); };
      grid.set({place(), place() / 4, place()}, static_cast<VoxelType>(random() % 3));
    }
    if (readers.size() > 3) readers.erase(readers.begin());
  }
}

// Workers read snapshots, edit their own copies and release both at any time while the grid is edited.
TEST(Snapshot, IsEditableOnThreadsDuringEdits) {
  std::mt19937 random(3);
  const auto below = [](std::mt19937& from, unsigned end) { return static_cast<int>(from() % end); };
  const auto edit = [&](Grid& grid, std::mt19937& from) {
    grid.set({below(from, 128), below(from, 64), below(from, 64)}, static_cast<VoxelType>(below(from, 200)));
  };
  const auto sum_of = [](const Grid& grid) {
    std::int64_t sum = 0;
    grid.for_each([&](IVec3, VoxelType type) { sum += type; });
    return sum;
  };
  Grid grid;
  for (int i = 0; i < 20'000; ++i) edit(grid, random);
  std::mutex mutex;
  std::vector<Grid> ready;
  std::atomic<bool> is_done{false};
  std::vector<std::jthread> workers;
  for (unsigned worker = 0; worker < 3; ++worker) {
    workers.emplace_back([&, own = std::mt19937(worker)]() mutable {
      std::vector<Grid> kept;
      while (!is_done) {
        if (const std::lock_guard lock(mutex); !ready.empty()) {
          kept.push_back(std::move(ready.back()));
          ready.pop_back();
        }
        if (kept.empty()) continue;
        const Grid& one = kept[own() % kept.size()];
        const std::int64_t sum = sum_of(one);
        Grid copy = one.snapshot();
        for (int i = 0; i < 50; ++i) edit(copy, own);
        EXPECT_EQ(sum_of(one), sum);
        if (kept.size() > 3) kept.erase(kept.begin());
        if (own() % 2 == 0) kept.push_back(std::move(copy));
      }
    });
  }
  for (int frame = 0; frame < 100; ++frame) {
    for (int i = 0; i < 40; ++i) edit(grid, random);
    if (frame % 7 == 0) {
      grid.fill_box({{0, below(random, 60), 0}, {64, 64, 4}}, static_cast<VoxelType>(below(random, 200)));
    }
    const std::lock_guard lock(mutex);
    if (ready.size() < 6) ready.push_back(grid.snapshot());
  }
  is_done = true;
}

TEST(Chunk, HashIgnoresEditHistory) {
  std::mt19937 random(12);
  Chunk chunk(3);
  const std::uint64_t uniform = chunk.content_hash();
  EXPECT_NE(uniform, Chunk(4).content_hash());
  EXPECT_NE(uniform, Chunk().content_hash());
  std::vector<std::tuple<IVec3, VoxelType>> undo;
  for (int i = 0; i < 2'000; ++i) {
    const auto place = [&] { return static_cast<int>(random() % 64); };
    const IVec3 at{place(), place(), place()};
    undo.emplace_back(at, chunk.get(at));
    chunk.set(at, static_cast<VoxelType>(random() % 400));
  }
  const Chunk other = chunk;
  const std::uint64_t edited = chunk.content_hash();
  EXPECT_NE(edited, uniform);
  std::vector<VoxelType> dense(kChunkVoxels);
  for (std::size_t i = 0; i < kChunkVoxels; ++i) {
    dense[i] = chunk.get(static_cast<int>(i % 64), static_cast<int>(i / 64 % 64), static_cast<int>(i / 4096));
  }
  const Chunk rebuilt = Chunk::from_dense(std::span(dense).first<kChunkVoxels>());
  EXPECT_EQ(rebuilt.content_hash(), edited);
  EXPECT_TRUE(rebuilt == chunk);
  std::swap(dense[0], dense[64]);
  const bool is_same = dense[0] == dense[64];
  EXPECT_EQ(Chunk::from_dense(std::span(dense).first<kChunkVoxels>()).content_hash() == edited, is_same);
  for (auto it = undo.rbegin(); it != undo.rend(); ++it) chunk.set(std::get<0>(*it), std::get<1>(*it));
  EXPECT_EQ(chunk.content_hash(), uniform);
  EXPECT_TRUE(chunk == Chunk(3));
  EXPECT_EQ(other.content_hash(), edited) << "a copy keeps its contents";
  EXPECT_FALSE(other == chunk);
}

TEST(Chunk, IsFullWithoutAir) {
  Chunk chunk;
  EXPECT_FALSE(chunk.is_full());
  chunk.fill(1);
  EXPECT_TRUE(chunk.is_full());
  chunk.set(5, 6, 7, 2);
  EXPECT_TRUE(chunk.is_full());
  chunk.set(5, 6, 7, kAir);
  EXPECT_FALSE(chunk.is_full());
}

}  // namespace
}  // namespace quoin
