#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <vector>

namespace [[gnu::visibility("default")]] quoin {

/// Returns the memory still available to this process, in bytes. Exceeding it can end the process. The result is the
/// lowest of three limits: available system memory plus swap, the cgroup limit, and RLIMIT_AS. Returns nullopt if the
/// system reports none of them.
[[nodiscard]] std::optional<std::uint64_t> available_memory();

/// Makes the C library return each freed block of 32 KiB or more to the system at once, for the whole process.
///
/// Resident memory then follows the memory in use. Programs that stream worlds need this to keep their memory budget;
/// without it they use about 20 % more. Call it first in `main`.
/// Cost:     8 to 20 % more processor time in a streamed world, because the system must supply new pages. Each block's
///           release takes time of the thread that frees it. Workers free surfaces of LiveMeshes and unloaded chunks of
///           StreamedWorld; large blocks of the program itself are freed by its own threads.
/// Returns:  false, without a change, if the C library is not glibc. Has no effect if another allocator replaces
///           malloc.
/// See docs/performance.md, "Worlds larger than memory".
bool return_freed_memory();

/// A block of memory of more than this many bytes is a large block.
inline constexpr std::size_t kLargeBlock = 4096;

/// Two functions of a program that supply the large blocks of Quoin: see set_block_functions.
///
/// Threads: both are called from any thread, and from several at once.
struct BlockFunctions {
  /// Returns a block of exactly `bytes` bytes with any content, or null if there is no memory.
  /// bytes:     more than kLargeBlock, not always a multiple of `alignment`.
  /// alignment: a power of two, at least 16.
  void* (*allocate)(std::size_t bytes, std::size_t alignment, void* context) noexcept = nullptr;
  /// Takes a block back, with the `bytes` and `alignment` that `allocate` received.
  void (*free)(void* block, std::size_t bytes, std::size_t alignment, void* context) noexcept = nullptr;
  /// Passed to both functions.
  void* context = nullptr;
};

/// Makes two functions of the program supply Quoin's large blocks, for the whole process. Smaller blocks come from
/// `operator new`, and without this call all blocks do, or are pages of the system.
///
///   quoin::BlockFunctions arena;
///   arena.allocate = [](std::size_t bytes, std::size_t alignment, void* arena) noexcept { ... };
///   arena.free = [](void* block, std::size_t bytes, std::size_t alignment, void* arena) noexcept { ... };
///   arena.context = &my_arena;
///   if (!quoin::set_block_functions(arena)) ...
///
/// Call it once, first in `main`, so that each block is freed by the function that belongs to the one that made it.
/// Returns:  false, without a change, if functions were set before, or if Quoin has already made a large block.
/// Blocks:   those of voxels, densities, meshes, trees, light, tracers, impostors and saves. See docs/games.md for
///           blocks from elsewhere, for example vectors of public types and those of SQLite.
/// Errors:   if `allocate` returns null, the call of Quoin that needs the block throws std::bad_alloc, or handles it as
///           it handles bad_alloc of `operator new`.
/// Lifetime: the functions must work until all objects of Quoin are destroyed and all threads that called Quoin have
///           ended. Scratch memory of a thread is freed when the thread ends, that of the main thread after `main`.
///           Without a job system, parallel loops run on threads of oneTBB, which may keep theirs until the process
///           ends: the functions must then work even after static objects are destroyed.
/// Requires: both functions are set.
/// Threads:  any.
[[nodiscard]] bool set_block_functions(const BlockFunctions& functions);

/// Returns a large block of undefined content, from the functions of the program or `operator new`.
/// Requires: more than kLargeBlock bytes; `alignment` is a power of two. Errors: bad_alloc.
[[nodiscard]] void* allocate_large_block(std::size_t bytes, std::size_t alignment);
/// Frees a block of `allocate_large_block`. Requires: the same `bytes` and `alignment`.
void free_large_block(void* block, std::size_t bytes, std::size_t alignment) noexcept;

/// An allocator for standard containers. Large blocks come from the functions of the program, if it has set any.
template <class T>
class BlockAllocator {
 public:
  using value_type = T;

  BlockAllocator() noexcept = default;
  template <class U>
  BlockAllocator(const BlockAllocator<U>& /*other*/) noexcept {}

  [[nodiscard]] T* allocate(std::size_t count) {
    if (count > std::numeric_limits<std::size_t>::max() / kSize) throw std::bad_array_new_length();
    const std::size_t bytes = count * kSize;
    if (bytes > kLargeBlock) return static_cast<T*>(allocate_large_block(bytes, alignof(T)));
    return std::allocator<T>().allocate(count);
  }
  void deallocate(T* block, std::size_t count) noexcept {
    const std::size_t bytes = count * kSize;
    if (bytes > kLargeBlock) return free_large_block(block, bytes, alignof(T));
    std::allocator<T>().deallocate(block, count);
  }
  bool operator==(const BlockAllocator& /*other*/) const noexcept { return true; }

 private:
  static constexpr std::size_t kSize = sizeof(T);  // NOLINT(bugprone-sizeof-expression): T may be a pointer
};

/// Base of types with large objects: `new` and `delete` of them, also within std::make_unique, take blocks as
/// BlockAllocator does. Requires: `delete` names their own type.
class LargeObject {
 public:
  static void* operator new(std::size_t bytes) { return BlockAllocator<std::byte>().allocate(bytes); }
  static void* operator new(std::size_t bytes, std::align_val_t alignment) {
    if (bytes > kLargeBlock) return allocate_large_block(bytes, static_cast<std::size_t>(alignment));
    return ::operator new(bytes, alignment);
  }
  static void operator delete(void* object, std::size_t bytes) noexcept {
    BlockAllocator<std::byte>().deallocate(static_cast<std::byte*>(object), bytes);
  }
  static void operator delete(void* object, std::size_t bytes, std::align_val_t alignment) noexcept {
    if (bytes > kLargeBlock) return free_large_block(object, bytes, static_cast<std::size_t>(alignment));
    ::operator delete(object, alignment);
  }
};

/// A std::vector whose large blocks come from the functions of the program, if it has set any.
template <class T>
using BlockVector = std::vector<T, BlockAllocator<T>>;

}  // namespace quoin
