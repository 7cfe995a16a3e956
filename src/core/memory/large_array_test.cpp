#include "core/memory/large_array.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <new>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"

namespace quoin {
namespace {

constexpr std::size_t kSystemNumbers = kSystemBlock / sizeof(std::uint32_t);

TEST(LargeArray, MatchesVector) {
  std::mt19937 random(3);
  std::vector<std::uint32_t> expected;
  LargeArray<std::uint32_t> array;
  for (int step = 0; step < 60; ++step) {
    const std::size_t more = random() % (kSystemNumbers / 8);
    if (expected.size() + more > array.capacity()) array.set_capacity(expected.size() + more + random() % 1'000);
    if (step % 16 == 9) array.set_capacity(array.size() + more);
    array.append(more);
    expected.resize(expected.size() + more);
    ASSERT_EQ(array.size(), expected.size());
    for (int i = 0; i < 50 && !expected.empty(); ++i) {
      const std::size_t at = random() % expected.size();
      array[at] = expected[at] = static_cast<std::uint32_t>(random());
    }
    ASSERT_TRUE(std::equal(expected.begin(), expected.end(), array.data())) << step;
  }
  EXPECT_GT(array.size(), 2 * kSystemNumbers);
}

TEST(LargeArray, BeginsWithZeros) {
  for (const std::size_t size : {std::size_t{1}, kSystemNumbers - 1, kSystemNumbers, 3 * kSystemNumbers + 5}) {
    LargeArray<std::uint32_t> array(size);
    EXPECT_EQ(array.size(), size);
    std::uint32_t any = 0;
    for (std::size_t i = 0; i < size; ++i) any |= std::exchange(array[i], 7U);
    EXPECT_EQ(any, 0U);
    array.set_capacity(size + kSystemNumbers);
    array.append(kSystemNumbers);
    EXPECT_EQ(array[size - 1], 7U);
    EXPECT_EQ(array[size], 0U);
  }
}

TEST(LargeArray, Moves) {
  LargeArray<std::uint32_t> array(5);
  array[4] = 9;
  LargeArray<std::uint32_t> other = std::move(array);
  EXPECT_EQ(other[4], 9U);
  LargeArray<std::uint32_t> third(kSystemNumbers);
  third = std::move(other);
  EXPECT_EQ(third.size(), 5U);
  third = {};
  EXPECT_EQ(third.size(), 0U);
}

TEST(LargeArray, KeepsElementsIfMemoryRunsOut) {
  LargeArray<std::uint32_t> array(kSystemNumbers);
  array[5] = 8;
  EXPECT_THROW(array.set_capacity(std::size_t{1} << 60), std::bad_alloc);
  EXPECT_EQ(array.capacity(), kSystemNumbers);
  EXPECT_EQ(array[5], 8U);
}

TEST(LargeArrayDeathTest, RejectsElementsWithoutRoom) {
  LargeArray<std::uint32_t> array(4);
  QUOIN_EXPECT_MISTAKE(array.append(1), "room for the new elements");
  QUOIN_EXPECT_MISTAKE(array.set_capacity(3), "room for all elements");
}

}  // namespace
}  // namespace quoin
