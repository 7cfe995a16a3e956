#include "trace/brick_store.h"

#include <algorithm>
#include <array>
#include <random>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"
namespace quoin::trace {
namespace {

constexpr std::uint64_t kEveryVoxel = ~std::uint64_t{0};

// Returns a brick whose 64 cells, in layer order, are full below `from`, mixed up to `to`, and empty from there on;
// or with full and empty swapped.
Node layered(int from, int to, bool is_turned, std::mt19937_64& random) {
  Node words;
  for (int cell = 0; cell < 64; ++cell) {
    const int place = (cell & 3) + 4 * (cell >> 4) + 16 * (cell >> 2 & 3);
    const bool is_below = place < from;
    const std::uint64_t mixed = random() | 1;
    const std::uint64_t uniform = is_below != is_turned ? kEveryVoxel : 0;
    words[static_cast<std::size_t>(cell)] = is_below || place >= to ? uniform : mixed & ~std::uint64_t{2};
  }
  return words;
}

TEST(BrickStore, RoundTripsBricksWithoutUniformEnds) {
  std::mt19937_64 random(7);
  BrickStore store;
  std::array<int, 8> shifts{};
  for (int from = 0; from <= 60; from += 3) {
    for (int to = from + 1; to <= 64; to += 3) {
      for (const bool is_turned : {false, true}) {
        const Node words = layered(from, to, is_turned, random);
        const std::size_t lines = store.line_count();
        const BrickCode brick = store.put(kEmptyBrick, words);
        EXPECT_EQ(store.words(brick).node(), words);
        for (std::size_t cell = 0; cell < 64; ++cell) EXPECT_EQ(store.words(brick)[cell], words[cell]);
        EXPECT_FALSE(store.is_full(brick));
        const BrickRun run = BrickRun::of(brick);
        EXPECT_EQ(run.code(), brick);
        EXPECT_EQ(store.line_count() - lines, static_cast<std::size_t>(run.count()));
        // One line, which represents the omitted lines, stays.
        const int below = std::min((from - 1) / 8, 4);
        const int above = std::min((63 - to) / 8, 3);
        EXPECT_EQ(run.count(), 8 - std::max(below, above)) << from << " to " << to;
        ++shifts[static_cast<std::size_t>(run.shift + 4)];
      }
    }
  }
  EXPECT_EQ(std::count(shifts.begin(), shifts.end(), 0), 0) << "every shift was met";
}

TEST(BrickStore, SingleSlabsMatchWholeBrick) {
  std::mt19937_64 random(11);
  BrickStore store;
  BrickCode brick = kEmptyBrick;
  Node words{};
  for (int i = 0; i < 20'000; ++i) {
    const std::size_t slab = random() % 16;
    std::array<std::uint64_t, 4> four{};
    for (std::uint64_t& word : four) word = random() % 3 == 0 ? random() : random() % 2 == 0 ? 0 : kEveryVoxel;
    if (random() % 2 == 0) four.fill(random() % 2 == 0 ? 0 : kEveryVoxel);
    std::copy(four.begin(), four.end(), words.begin() + static_cast<std::ptrdiff_t>(4 * slab));
    const bool is_empty = std::all_of(words.begin(), words.end(), [](std::uint64_t word) { return word == 0; });
    if (is_empty) {
      store.release(brick);
      brick = kEmptyBrick;
      continue;
    }
    brick = store.put_slab(brick, slab, four);
    ASSERT_EQ(store.words(brick).node(), words) << "edit " << i;
    ASSERT_TRUE(store.words(brick).has_four(4 * slab, four.data()));
    ASSERT_EQ(store.count(), 1U);
    if (i % 100 == 99) {
      store.release(brick);
      brick = kEmptyBrick;
      words = {};
    }
  }
  // The empty and the full brick, and one or two runs of each length: released runs are used again.
  EXPECT_LE(store.line_count(), 16U + 3U * (4 + 5 + 6 + 7 + 8));
}

TEST(BrickStore, NeverWritesEmptyOrFullBrick) {
  BrickStore store;
  const std::array<std::uint64_t, 4> full = {kEveryVoxel, kEveryVoxel, kEveryVoxel, kEveryVoxel};
  const BrickCode with_slab = store.put_slab(kEmptyBrick, 5, full);
  const BrickCode with_hole = store.put_slab(kFullBrick, 5, std::array<std::uint64_t, 4>{});
  EXPECT_EQ(store.words(kEmptyBrick).node(), Node{});
  EXPECT_TRUE(store.is_full(kFullBrick));
  EXPECT_EQ(store.words(with_slab)[20], kEveryVoxel);
  EXPECT_EQ(store.words(with_hole)[20], 0U);
  store.release(kEmptyBrick);
  store.release(kFullBrick);
  EXPECT_EQ(store.count(), 2U);
}

TEST(BrickStoreDeathTest, RejectsSlabsAndBricksOutsideTheStore) {
  BrickStore store;
  QUOIN_EXPECT_MISTAKE((void)store.put_slab(kEmptyBrick, 16, std::array<std::uint64_t, 4>{1}),
                       "a slab of a brick of the store");
  QUOIN_EXPECT_MISTAKE((void)store.is_full(BrickRun{1'000, 0}.code()), "a brick of the store");
  QUOIN_EXPECT_MISTAKE(store.release(BrickRun{1'000, 0}.code()), "a brick of the store");
  QUOIN_EXPECT_MISTAKE((void)BrickRun({1, 4}).code(), "a shift of 3 bits");
}

}  // namespace
}  // namespace quoin::trace
