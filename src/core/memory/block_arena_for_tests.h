#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <gtest/gtest.h>

#include <quoin/core/memory.h>

namespace quoin {

/// Functions for large blocks that check all calls. They end the program if a block is freed with another size or
/// alignment than it was made with, or was made elsewhere. New blocks are full of 0xA5.
///
///   | ... Head | block |     the head ends where the block begins
class BlockArena {
 public:
  /// Lifetime: the functions refer to this arena.
  [[nodiscard]] BlockFunctions functions() { return {&BlockArena::allocate, &BlockArena::free, this}; }

  std::atomic<std::int64_t> blocks{0};     ///< that are not freed
  std::atomic<std::int64_t> bytes{0};      ///< of these
  std::atomic<std::int64_t> made{0};       ///< blocks so far
  std::atomic<std::int64_t> left{-1};      ///< blocks before one cannot be made; negative: no limit
  std::atomic<bool (*)()> fails{nullptr};  ///< if set: returns true if the next block cannot be made

 private:
  struct Head {
    std::size_t bytes;
    std::size_t alignment;
    std::uint64_t mark;
  };
  static constexpr std::uint64_t kMark = 0x51A7'0C8E'2D93'B640;

  static void expect(bool condition, const char* text) {
    if (condition) return;
    std::fprintf(stderr, "wrong use of the functions for large blocks: %s\n", text);
    std::abort();
  }
  static std::size_t offset_of(std::size_t alignment) { return std::max<std::size_t>(alignment, 32); }

  static void* allocate(std::size_t bytes, std::size_t alignment, void* context) noexcept {
    auto& arena = *static_cast<BlockArena*>(context);
    expect(bytes > kLargeBlock, "a small block");
    expect(alignment >= 16 && (alignment & (alignment - 1)) == 0, "the alignment");
    const auto fails = arena.fails.load();
    if (fails != nullptr && fails()) return nullptr;
    if (arena.left.load() >= 0 && arena.left.fetch_sub(1) == 0) return nullptr;
    const std::size_t offset = offset_of(alignment);
    const std::size_t all = (offset + bytes + alignment - 1) / alignment * alignment;
    void* const memory = std::aligned_alloc(alignment, all);  // NOLINT(*-no-malloc): not the counted operator new
    if (memory == nullptr) return nullptr;
    std::byte* const block = static_cast<std::byte*>(memory) + offset;
    new (block - sizeof(Head)) Head{bytes, alignment, kMark};
    std::memset(block, 0xA5, bytes);
    ++arena.blocks;
    ++arena.made;
    arena.bytes += static_cast<std::int64_t>(bytes);
    return block;
  }
  static void free(void* block, std::size_t bytes, std::size_t alignment, void* context) noexcept {
    auto& arena = *static_cast<BlockArena*>(context);
    expect(block != nullptr, "a null block");
    auto* const head = reinterpret_cast<Head*>(static_cast<std::byte*>(block) - sizeof(Head));
    expect(head->mark == kMark, "a block from elsewhere, or freed twice");
    expect(head->bytes == bytes && head->alignment == alignment, "another size or alignment");
    head->mark = 0;
    std::memset(block, 0xD7, bytes);
    --arena.blocks;
    arena.bytes -= static_cast<std::int64_t>(bytes);
    std::free(static_cast<std::byte*>(block) - offset_of(alignment));  // NOLINT(*-no-malloc)
  }
};

/// Runs `check` in a new process, because functions for large blocks are set once per process, before the first block.
/// Fails if an expectation in it fails. Requires: the test does nothing else.
#define QUOIN_EXPECT_IN_NEW_PROCESS(check)                 \
  do {                                                     \
    GTEST_FLAG_SET(death_test_style, "threadsafe");        \
    EXPECT_EXIT(                                           \
        {                                                  \
          check();                                         \
          std::_Exit(testing::Test::HasFailure() ? 1 : 0); \
        },                                                 \
        testing::ExitedWithCode(0), "");                   \
  } while (false)

}  // namespace quoin
