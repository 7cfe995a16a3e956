#include <quoin/core/memory.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <new>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <quoin/core/buffer.h>

#include "core/memory/block_arena_for_tests.h"
#include "core/memory/large_array.h"
#include "core/memory/make_room.h"

namespace quoin {
namespace {

struct alignas(128) WideNumber {
  std::uint64_t value = 0;
};
struct LargeThing : LargeObject {
  std::uint64_t values[1'000] = {};
};
struct alignas(64) LargeAlignedThing : LargeObject {
  std::uint64_t values[1'000] = {};
};

bool is_aligned(const void* block, std::size_t alignment) {
  return reinterpret_cast<std::uintptr_t>(block) % alignment == 0;
}

void serve_large_blocks() {
  static BlockArena arena;
  ASSERT_TRUE(set_block_functions(arena.functions()));
  EXPECT_FALSE(set_block_functions(arena.functions()));
  {
    BlockVector<std::byte> small(kLargeBlock);
    EXPECT_EQ(arena.made, 0);
    BlockVector<std::byte> large(kLargeBlock + 1);
    EXPECT_EQ(arena.made, 1);
    EXPECT_EQ(arena.bytes, static_cast<std::int64_t>(kLargeBlock + 1));
    EXPECT_TRUE(is_aligned(large.data(), 16));
    EXPECT_EQ(large.back(), std::byte{0});
    const BlockVector<std::byte> copy = large;
    const BlockVector<std::byte> moved = std::move(large);
    EXPECT_EQ(arena.blocks, 2);
    BlockVector<WideNumber> wide(100);
    EXPECT_TRUE(is_aligned(wide.data(), 128));
    EXPECT_EQ(arena.blocks, 3);
    const auto thing = std::make_unique<LargeThing>();
    const auto aligned = std::make_unique<LargeAlignedThing>();
    EXPECT_TRUE(is_aligned(aligned.get(), 64));
    EXPECT_EQ(arena.blocks, 5);
    Buffer<std::uint32_t> buffer;
    for (std::uint32_t i = 0; i < 100'000; ++i) buffer.push_back(i);
    EXPECT_EQ(buffer[77'777], 77'777U);
    Buffer<std::uint32_t> other;
    other.resize(2'000);
    other = std::move(buffer);
    EXPECT_EQ(arena.blocks, 6);
  }
  EXPECT_EQ(arena.blocks, 0);
  EXPECT_EQ(arena.bytes, 0);
}
TEST(BlockFunctionsDeathTest, ServeLargeBlocks) {
  QUOIN_EXPECT_IN_NEW_PROCESS(serve_large_blocks);
}

void serve_large_arrays() {
  static BlockArena arena;
  ASSERT_TRUE(set_block_functions(arena.functions()));
  {
    LargeArray<std::uint64_t> array(1'000);
    std::size_t size = array.size();
    for (; size < 1'000'000; size = array.size()) {
      for (std::size_t i = size - 1'000; i < size; ++i) EXPECT_EQ(array[i], 0U);
      for (std::size_t i = 0; i < size; ++i) array[i] = 7 * i;
      array.set_capacity(2 * size);
      EXPECT_EQ(arena.blocks, 1);
      EXPECT_EQ(arena.bytes, static_cast<std::int64_t>(2 * size * sizeof(std::uint64_t)));
      for (std::size_t i = 0; i < size; ++i) ASSERT_EQ(array[i], 7 * i);
      array.append(size);
    }
    LargeArray<std::uint64_t> few(3);
    few[1] = 5;
    few.set_capacity(3'000);
    EXPECT_EQ(arena.blocks, 2);
    few.set_capacity(3);
    EXPECT_EQ(arena.blocks, 1);
    EXPECT_EQ(few[1], 5U);
  }
  EXPECT_EQ(arena.blocks, 0);
}
TEST(BlockFunctionsDeathTest, ServeLargeArrays) {
  QUOIN_EXPECT_IN_NEW_PROCESS(serve_large_arrays);
}

void refuse_after_first_block() {
  static BlockArena arena;
  {
    const BlockVector<std::byte> small(kLargeBlock);
    Buffer<std::byte> buffer;
    buffer.resize(kLargeBlock + 1);
    EXPECT_FALSE(set_block_functions(arena.functions()));
  }
  EXPECT_FALSE(set_block_functions(arena.functions()));
  const BlockVector<std::byte> large(2 * kLargeBlock);
  EXPECT_EQ(arena.made, 0);
}
TEST(BlockFunctionsDeathTest, AreRefusedAfterTheFirstLargeBlock) {
  QUOIN_EXPECT_IN_NEW_PROCESS(refuse_after_first_block);
}

void refuse_after_large_array() {
  static BlockArena arena;
  { const LargeArray<std::uint64_t> array(100'000); }
  EXPECT_FALSE(set_block_functions(arena.functions()));
}
TEST(BlockFunctionsDeathTest, AreRefusedAfterTheFirstLargeArray) {
  QUOIN_EXPECT_IN_NEW_PROCESS(refuse_after_large_array);
}

void throw_if_null() {
  static BlockArena arena;
  ASSERT_TRUE(set_block_functions(arena.functions()));
  {
    Buffer<std::uint32_t> buffer;
    buffer.resize(2'000);
    buffer[1'999] = 5;
    LargeArray<std::uint32_t> array(2'000);
    array[1'999] = 6;
    BlockVector<std::uint32_t> vector(2'000, 7);
    arena.left = 0;
    EXPECT_THROW(buffer.reserve(3'000), std::bad_alloc);
    arena.left = 0;
    EXPECT_THROW(array.set_capacity(3'000), std::bad_alloc);
    arena.left = 0;
    EXPECT_THROW(vector.resize(3'000), std::bad_alloc);
    arena.left = 0;
    EXPECT_THROW((void)std::make_unique<LargeThing>(), std::bad_alloc);
    arena.left = 0;
    EXPECT_THROW((void)LargeArray<std::uint32_t>(3'000), std::bad_alloc);
    arena.left = -1;
    EXPECT_EQ(buffer[1'999], 5U);
    EXPECT_EQ(array[1'999], 6U);
    EXPECT_EQ(vector, BlockVector<std::uint32_t>(2'000, 7));
    EXPECT_EQ(arena.blocks, 3);
  }
  EXPECT_EQ(arena.blocks, 0);
}
TEST(BlockFunctionsDeathTest, ThrowBadAllocIfTheFunctionReturnsNull) {
  QUOIN_EXPECT_IN_NEW_PROCESS(throw_if_null);
}

void serve_threads() {
  static BlockArena arena;
  ASSERT_TRUE(set_block_functions(arena.functions()));
  constexpr std::size_t kThreads = 4;
  std::vector<BlockVector<std::uint32_t>> made(kThreads * 50);
  const auto on_threads = [&](auto&& run) {
    std::vector<std::thread> threads;
    for (std::size_t t = 0; t < kThreads; ++t) threads.emplace_back([&run, t] { run(t); });
    for (std::thread& thread : threads) thread.join();
  };
  on_threads([&](std::size_t t) {
    for (std::size_t i = t; i < made.size(); i += kThreads) made[i].assign(2'000 + i, static_cast<std::uint32_t>(i));
  });
  EXPECT_EQ(arena.blocks, static_cast<std::int64_t>(made.size()));
  // Another thread frees a block than made it.
  on_threads([&](std::size_t t) {
    for (std::size_t i = (t + 1) % kThreads; i < made.size(); i += kThreads) {
      EXPECT_EQ(made[i].back(), i);
      BlockVector<std::uint32_t>().swap(made[i]);
    }
  });
  EXPECT_EQ(arena.blocks, 0);
}
TEST(BlockFunctionsDeathTest, ServeSeveralThreads) {
  QUOIN_EXPECT_IN_NEW_PROCESS(serve_threads);
}

// Compares with std::deque.
TEST(KeptQueue, PassesElementsInOrder) {
  std::mt19937 random(3);
  KeptQueue<int> queue;
  std::deque<int> slow;
  for (int step = 0; step < 5'000; ++step) {
    switch (random() % 9U) {
      case 0: {
        const std::vector<int> all(random() % 20U, step);
        queue.assign(all);
        slow.assign(all.begin(), all.end());
        break;
      }
      case 1: {
        const auto kept = static_cast<std::ptrdiff_t>(slow.size() / 2);
        queue.erase_from(queue.begin() + kept);
        slow.erase(slow.begin() + kept, slow.end());
        break;
      }
      case 2:
      case 3:
      case 4:
        if (slow.empty()) break;
        queue.pop_front();
        slow.pop_front();
        break;
      default:
        queue.push_back(int{step});
        slow.push_back(step);
    }
    ASSERT_EQ(queue.empty(), slow.empty());
    ASSERT_TRUE(std::equal(queue.begin(), queue.end(), slow.begin(), slow.end())) << step;
    if (slow.empty()) continue;
    ASSERT_EQ(queue.front(), slow.front()) << step;
  }
}

TEST(BlockAllocator, RejectsMoreElementsThanMemoryHas) {
  EXPECT_THROW((void)BlockAllocator<std::uint64_t>().allocate(~std::size_t{0} / 4), std::bad_array_new_length);
}

}  // namespace
}  // namespace quoin
