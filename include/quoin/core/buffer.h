#pragma once

#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

namespace [[gnu::visibility("default")]] quoin {

/// A growable array of trivially copyable values that leaves new elements uninitialised. Use it for large output that
/// is rebuilt often. It can be moved but not copied. Pointers and iterators stay valid until the buffer grows beyond
/// its capacity.
/// Requires: indices are less than `size()`.
template <class T>
class Buffer {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  Buffer() = default;
  /// Moves the contents. The other buffer is left empty, without memory.
  Buffer(Buffer&& other) noexcept
      : values_(std::exchange(other.values_, nullptr)),
        size_(std::exchange(other.size_, 0)),
        capacity_(std::exchange(other.capacity_, 0)) {}
  Buffer& operator=(Buffer&& other) noexcept {
    Buffer(std::move(other)).swap(*this);
    return *this;
  }
  ~Buffer() { release(); }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] T* data() { return values_; }
  [[nodiscard]] const T* data() const { return values_; }
  [[nodiscard]] T& operator[](std::size_t i) {
    QUOIN_ASSERT(i < size_, "i < size()");
    return values_[i];
  }
  [[nodiscard]] const T& operator[](std::size_t i) const {
    QUOIN_ASSERT(i < size_, "i < size()");
    return values_[i];
  }
  [[nodiscard]] T* begin() { return values_; }
  [[nodiscard]] T* end() { return values_ + size_; }
  [[nodiscard]] const T* begin() const { return values_; }
  [[nodiscard]] const T* end() const { return values_ + size_; }
  [[nodiscard]] std::size_t capacity() const { return capacity_; }

  /// Sets the size to 0 and keeps the memory.
  void clear() { size_ = 0; }
  /// Changes the size. Elements beyond the old size are uninitialised.
  void resize(std::size_t size) {
    reserve(size);
    size_ = size;
  }
  void push_back(const T& value) {
    const T copy = value;
    resize(size_ + 1);
    values_[size_ - 1] = copy;
  }
  /// Reserves memory for at least `capacity` elements. A growing buffer grows by at least half its old capacity.
  void reserve(std::size_t capacity) {
    if (capacity <= capacity_) return;
    const std::size_t larger = capacity > capacity_ + capacity_ / 2 ? capacity : capacity_ + capacity_ / 2;
    T* const grown = BlockAllocator<T>().allocate(larger);
    if (size_ != 0) std::memcpy(static_cast<void*>(grown), values_, size_ * sizeof(T));
    release();
    values_ = grown;
    capacity_ = larger;
  }

 private:
  void release() noexcept {
    if (values_ != nullptr) BlockAllocator<T>().deallocate(values_, capacity_);
  }
  void swap(Buffer& other) noexcept {
    std::swap(values_, other.values_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
  }

  T* values_ = nullptr;
  std::size_t size_ = 0;
  std::size_t capacity_ = 0;
};

}  // namespace quoin
