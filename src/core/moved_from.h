#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <memory>
#include <new>

#include <quoin/core/assert.h>
#include <quoin/core/changes.h>

#include "core/memory/large_array.h"

namespace quoin {

/// Returns the implementation of an object. Requires: the object was not moved from.
template <class Content>
[[nodiscard]] Content& impl_of(const std::unique_ptr<Content>& content) {
  QUOIN_ASSERT(content != nullptr, "an object that was not moved from");
  return *content;
}

/// Memory for the private implementations of many copies, for example of the grids in a scene's snapshot:
///
///   struct Grid::Impl : BulkAllocated { ... };
///   BulkMemory memory(grids.size());  // 2 * grids.size() if their fields get memory from it, too
///   for (...) copies.push_back(std::unique_ptr<Grid::Impl>(new (memory) Grid::Impl(impl)));
///
///   | block: users | block, object | block, object | ...     one allocation for kMost objects
///
/// A block is freed with its last object, so an object that outlives the others keeps up to kMost objects' memory.
/// Objects may have several sizes: begin with the largest one.
/// Threads:  one. The objects can be destroyed on any thread.
class [[gnu::visibility("hidden")]] BulkMemory {
 public:
  static constexpr std::size_t kMost = 32;

  /// `objects`: expected number. More are possible.
  explicit BulkMemory(std::size_t objects) : expected_(objects) {}
  BulkMemory(const BulkMemory&) = delete;
  BulkMemory& operator=(const BulkMemory&) = delete;
  ~BulkMemory() { drop(block_); }

 private:
  friend class BulkAllocated;
  struct alignas(__STDCPP_DEFAULT_NEW_ALIGNMENT__) Block {
    explicit Block(std::size_t of_block) : bytes(of_block) {}
    std::atomic<std::size_t> users{1};  // objects, and the BulkMemory that still fills it
    std::size_t bytes;
  };
  struct alignas(__STDCPP_DEFAULT_NEW_ALIGNMENT__) Head {
    Block* block = nullptr;  // null: the object has memory of its own
  };

  static void drop(Block* block) {
    if (block == nullptr || block->users.fetch_sub(1, std::memory_order_acq_rel) != 1) return;
    const std::size_t bytes = block->bytes;
    block->~Block();
    free_block(block, bytes);
  }
  void* allocate(std::size_t bytes) {
    const std::size_t size = sizeof(Head) + (bytes + alignof(Head) - 1) / alignof(Head) * alignof(Head);
    if (left_ < size) {
      const std::size_t block_bytes = sizeof(Block) + std::clamp<std::size_t>(expected_, 1, kMost) * size;
      void* const memory = allocate_block(block_bytes);
      drop(block_);
      block_ = new (memory) Block(block_bytes);
      next_ = static_cast<std::byte*>(memory) + sizeof(Block);
      left_ = block_bytes - sizeof(Block);
    }
    QUOIN_ASSERT(left_ >= size, "room for the object");
    Head* const head = new (next_) Head{block_};
    block_->users.fetch_add(1, std::memory_order_relaxed);
    next_ += size;
    left_ -= size;
    expected_ -= std::min<std::size_t>(expected_, 1);
    return head + 1;
  }

  std::size_t expected_;
  Block* block_ = nullptr;
  std::byte* next_ = nullptr;
  std::size_t left_ = 0;  // bytes of the block
};

/// Base of objects that can be created in a BulkMemory, or alone. Requires: `delete` names their own type.
class BulkAllocated {
 public:
  // Not inlined: GCC would warn that `operator delete` does not match them.
  [[gnu::noinline]] static void* operator new(std::size_t bytes) {
    return new (::operator new(sizeof(BulkMemory::Head) + bytes)) BulkMemory::Head{} + 1;
  }
  [[gnu::noinline]] static void* operator new(std::size_t bytes, BulkMemory& memory) { return memory.allocate(bytes); }
  static void operator delete(void* object) {
    if (object == nullptr) return;
    auto* const head = static_cast<BulkMemory::Head*>(object) - 1;
    BulkMemory::Block* const block = head->block;
    if (block == nullptr) return ::operator delete(head);
    BulkMemory::drop(block);
  }
  static void operator delete(void* object, BulkMemory& /*memory*/) { operator delete(object); }
};

}  // namespace quoin
