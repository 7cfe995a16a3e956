#pragma once

#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

namespace quoin {

/// Changes the size of a block of memory that was empty (null, 0) or returned by this function; frees it if `wanted` is
/// 0. Returns the block, perhaps at another address, with its former bytes. All bytes of a new block are 0;
/// those that a block gains are undefined.
///
/// Blocks of at least kSystemBlock bytes are pages of the system. On Linux they grow without a copy: their pages move
/// to another address. Pages that were never written take no memory. Neither holds with functions of the program
/// (set_block_functions): then these supply all large blocks.
/// Errors: bad_alloc, unless `wanted` is 0; the block is then unchanged.
[[nodiscard]] void* resize_block(void* block, std::size_t bytes, std::size_t wanted);
inline constexpr std::size_t kSystemBlock = std::size_t{1} << 20;

/// Returns memory of any size, as BlockAllocator does. Errors: bad_alloc.
[[nodiscard]] inline void* allocate_block(std::size_t bytes) {
  return BlockAllocator<std::byte>().allocate(bytes);
}
/// Frees memory of `allocate_block`. Requires: the same `bytes`.
inline void free_block(void* block, std::size_t bytes) noexcept {
  BlockAllocator<std::byte>().deallocate(static_cast<std::byte*>(block), bytes);
}

/// A contiguous array of plain numbers, for tables of many megabytes that grow during frames (`resize_block`).
///
/// Unlike std::vector, `reserve` costs little for large arrays.
template <class T>
class LargeArray {
  static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

 public:
  LargeArray() = default;
  /// Makes `size` elements whose bytes are 0. Cost: O(1) for large arrays; each page costs time when first written.
  explicit LargeArray(std::size_t size) : data_(resized(nullptr, 0, size)), size_(size), capacity_(size) {}
  LargeArray(LargeArray&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)),
        size_(std::exchange(other.size_, 0)),
        capacity_(std::exchange(other.capacity_, 0)) {}
  LargeArray& operator=(LargeArray&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
    return *this;
  }
  ~LargeArray() { (void)resized(data_, capacity_, 0); }

  [[nodiscard]] T* data() { return data_; }
  [[nodiscard]] const T* data() const { return data_; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t capacity() const { return capacity_; }
  [[nodiscard]] T& operator[](std::size_t i) {
    QUOIN_ASSERT(i < size_, "an element of the array");
    return data_[i];
  }
  [[nodiscard]] const T& operator[](std::size_t i) const {
    QUOIN_ASSERT(i < size_, "an element of the array");
    return data_[i];
  }

  /// Changes the capacity. Requires: it is not below the size. Moves the elements.
  void set_capacity(std::size_t capacity) {
    QUOIN_ASSERT(capacity >= size_, "room for all elements");
    data_ = resized(data_, capacity_, capacity);
    capacity_ = capacity;
  }
  /// Appends elements whose bytes are 0. Requires: there is room for them.
  void append(std::size_t count) {
    QUOIN_ASSERT(count <= capacity_ - size_, "room for the new elements");
    std::fill_n(data_ + size_, count, T{});
    size_ += count;
  }

 private:
  [[nodiscard]] static T* resized(T* data, std::size_t from, std::size_t to) {
    return static_cast<T*>(resize_block(data, from * sizeof(T), to * sizeof(T)));
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
  std::size_t capacity_ = 0;
};

}  // namespace quoin
