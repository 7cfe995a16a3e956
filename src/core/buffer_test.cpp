#include <quoin/core/buffer.h>

#include <utility>

#include <gtest/gtest.h>

#include "core/death_for_tests.h"

namespace quoin {
namespace {

TEST(Buffer, IsEmptyAndUsableAfterMove) {
  Buffer<int> from;
  for (int i = 0; i < 100; ++i) from.push_back(i);
  Buffer<int> to = std::move(from);
  EXPECT_EQ(from.size(), 0U);  // NOLINT(bugprone-use-after-move): the documented guarantee
  EXPECT_EQ(from.capacity(), 0U);
  for (int i = 0; i < 10; ++i) from.push_back(-i);
  EXPECT_EQ(from[9], -9);
  EXPECT_EQ(to[99], 99);
  from = std::move(to);
  EXPECT_EQ(from.size(), 100U);
  EXPECT_EQ(to.capacity(), 0U);  // NOLINT(bugprone-use-after-move)
  to.resize(3);
  EXPECT_EQ(to.size(), 3U);
}

TEST(Buffer, KeepsElementsWhenGrowing) {
  Buffer<int> buffer;
  for (int i = 0; i < 10'000; ++i) buffer.push_back(i);
  buffer.resize(20'000);
  for (int i = 0; i < 10'000; ++i) ASSERT_EQ(buffer[static_cast<std::size_t>(i)], i);
  buffer.push_back(buffer[7]);
  EXPECT_EQ(buffer[20'000], 7);
}

TEST(BufferDeathTest, RejectsIndexBeyondSize) {
  Buffer<int> buffer;
  buffer.reserve(10);
  QUOIN_EXPECT_MISTAKE((void)buffer[0], "i < size");
  buffer.resize(3);
  QUOIN_EXPECT_MISTAKE((void)std::as_const(buffer)[3], "i < size");
}

}  // namespace
}  // namespace quoin
