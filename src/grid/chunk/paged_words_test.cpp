#include "grid/chunk/paged_words.h"

#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/grid/chunk.h>

#include "core/death_for_tests.h"
#include "grid/chunk/chunk_storage.h"

namespace quoin {
namespace {

std::vector<std::uint64_t> numbers(std::size_t count, std::uint64_t first) {
  std::vector<std::uint64_t> words(count);
  for (std::size_t i = 0; i < count; ++i) words[i] = first + i;
  return words;
}

std::vector<std::uint64_t> all_of(const PagedWords& words) {
  std::vector<std::uint64_t> all;
  words.for_each_page([&](std::span<const std::uint64_t> page) { all.insert(all.end(), page.begin(), page.end()); });
  return all;
}

TEST(PagedWords, KeepInitialWords) {
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{1}, std::size_t{1'024}, std::size_t{1'025}, std::size_t{65'536}}) {
    const std::vector<std::uint64_t> wanted = numbers(size, 7);
    const PagedWords words{std::span(wanted)};
    EXPECT_EQ(words.size(), size);
    EXPECT_EQ(all_of(words), wanted);
    EXPECT_EQ(all_of(PagedWords(size)), std::vector<std::uint64_t>(size));
    // Allocates no more room than words, heads and pointers need.
    EXPECT_LE(words.allocated(), size * 8 + (size / PagedWords::kPageWords + 1) * 40);
  }
}

TEST(PagedWords, CopyOnePageOnWrite) {
  const std::vector<std::uint64_t> before = numbers(5'000, 1);
  PagedWords first{std::span(before)};
  PagedWords second = first;
  EXPECT_FALSE(first.owns(0));
  EXPECT_FALSE(second.owns(0));
  second.make_own(2'500);
  *second.own_at(2'500) = 0;
  EXPECT_EQ(all_of(first), before);
  EXPECT_EQ(*second.at(2'500), 0U);
  for (std::size_t word = 0; word < 5'000; word += 1'000) {
    EXPECT_EQ(first.at(word) == second.at(word), word / PagedWords::kPageWords != 2'500 / PagedWords::kPageWords)
        << word;
  }
  EXPECT_TRUE(first.has_shared_pages());
  // Now the first owns that page alone, and detects this on access.
  const std::uint64_t* const place = first.at(2'500);
  first.make_own(2'500);
  EXPECT_TRUE(first.owns(2'500));
  EXPECT_EQ(first.at(2'500), place);
  second = PagedWords();
  EXPECT_FALSE(first.has_shared_pages());
}

TEST(PagedWords, GrowAndShrinkWithoutTouchingCopies) {
  PagedWords words;
  std::vector<std::uint64_t> wanted;
  std::vector<std::pair<PagedWords, std::vector<std::uint64_t>>> copies;
  for (std::size_t i = 0; i < 60; ++i) {
    const std::size_t begin = words.size();
    words.grow(begin + 128);
    ASSERT_TRUE(words.owns(begin));
    for (std::size_t word = begin; word < words.size(); ++word) {
      *words.own_at(word) = 3 * word;
      wanted.push_back(3 * word);
    }
    if (i % 7 == 0) copies.emplace_back(words, wanted);
    if (i % 11 == 0) words.shrink_to_fit();
    std::size_t pages = 0;
    words.for_each_page([&](std::span<const std::uint64_t>) { ++pages; });
    EXPECT_GE(words.allocated(), 8 * words.size() + 16 * pages);
    EXPECT_LE(words.allocated(), 8 * PagedWords::kPageWords * pages + 48 * pages);
  }
  EXPECT_EQ(all_of(words), wanted);
  for (const auto& [copy, its] : copies) EXPECT_EQ(all_of(copy), its);
}

TEST(PagedWordsDeathTest, AssertsOnWriteToSharedPage) {
  PagedWords words(10);
  const PagedWords copy = words;
  QUOIN_EXPECT_MISTAKE((void)words.own_at(3), "a word on an unshared page");
}

// Compares chunks and copies of them, written in turn, with plain arrays.
TEST(Chunk, CopiesShareUnwrittenData) {
  for (const int types : {2, 4, 16, 200, 300}) {
    std::mt19937 random(static_cast<unsigned>(types));
    std::vector<VoxelType> dense(kChunkVoxels);
    for (VoxelType& type : dense) type = static_cast<VoxelType>(random() % static_cast<unsigned>(types));
    struct Version {
      Chunk chunk;
      std::vector<VoxelType> dense;
    };
    std::vector<Version> versions{{Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(dense)), dense}};
    for (int step = 0; step < 400; ++step) {
      const std::size_t which = random() % versions.size();
      if (random() % 8 == 0 && versions.size() < 6) versions.push_back(versions[which]);
      if (random() % 16 == 0 && versions.size() > 1)
        versions.erase(versions.begin() + static_cast<std::ptrdiff_t>(random() % versions.size()));
      Version& version = versions[random() % versions.size()];
      const auto type = static_cast<VoxelType>(random() % static_cast<unsigned>(types));
      const auto y = static_cast<int>(random() % 64);
      const auto z = static_cast<int>(random() % 64);
      if (random() % 4 == 0) {
        // Fills whole slabs to free slots and use them again.
        version.chunk.fill_box({{0, y & ~3, z & ~3}, {64, (y & ~3) + 4, (z & ~3) + 4}}, type,
                               [](int, int, std::uint64_t) {});
        for (int row = 0; row < 16; ++row) {
          const int at = ((z & ~3) + row / 4) * 4'096 + ((y & ~3) + row % 4) * 64;
          std::fill_n(version.dense.begin() + at, 64, type);
        }
      } else {
        const auto x = static_cast<int>(random() % 64);
        version.chunk.set(x, y, z, type);
        version.dense[static_cast<std::size_t>(z * 4'096 + y * 64 + x)] = type;
      }
    }
    for (const Version& version : versions) {
      const Chunk wanted = Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(version.dense));
      EXPECT_EQ(version.chunk, wanted) << types;
      EXPECT_EQ(version.chunk.non_air_count(), wanted.non_air_count());
      EXPECT_EQ(version.chunk.types(), wanted.types());
    }
  }
}

TEST(Chunk, KeepsOtherSlabsSharedAfterWrite) {
  std::mt19937 random(5);
  std::vector<VoxelType> dense(kChunkVoxels);
  for (VoxelType& type : dense) type = static_cast<VoxelType>(random() % 200);
  const Chunk before = Chunk::from_dense(std::span<const VoxelType, kChunkVoxels>(dense));
  Chunk after = before;
  ASSERT_TRUE(after.set(1, 2, 3, static_cast<VoxelType>((dense[3 * 4'096 + 2 * 64 + 1] + 1) % 200)));
  int shared = 0;
  for (std::uint32_t slab = 0; slab < 256; ++slab) {
    shared += ChunkStorage::of(before)->row(slab, 0) == ChunkStorage::of(after)->row(slab, 0) ? 1 : 0;
  }
  EXPECT_EQ(shared, 252);
}

TEST(PagedWordsDeathTest, RejectsMoreWordsThanAChunkHas) {
  PagedWords words(10);
  QUOIN_EXPECT_MISTAKE((void)words.at(10), "an existing word");
  QUOIN_EXPECT_MISTAKE(words.grow(PagedWords::kMaxWords + 1), "at most kMaxWords");
}

}  // namespace
}  // namespace quoin
