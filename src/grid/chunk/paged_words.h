#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/ref.h>

#include "core/memory/large_array.h"

namespace quoin {

/// Words in pages that copies share until one of them writes to a page. The costs of a copy and of a first write do not
/// depend on the number of words.
///
/// Threads: as for copies of a Ref. An object with several owners may be copied by several threads at once. Only a
/// thread that has seen that it is the sole owner may write it (Ref::is_shared).
class PagedWords {
 public:
  static constexpr std::size_t kPageWords = 512;
  static constexpr std::size_t kMaxWords = 65'536;  // for a chunk at 16 bits per voxel
  static constexpr std::size_t kMaxPages = kMaxWords / kPageWords;

  PagedWords() = default;
  /// Creates zeros or a copy of `words`, without spare capacity.
  explicit PagedWords(std::size_t zeros);
  explicit PagedWords(std::span<const std::uint64_t> words);
  PagedWords(const PagedWords& other) : pages_(other.pages_), size_(other.size_) { other.share(); }
  PagedWords(PagedWords&& other) noexcept : pages_(std::move(other.pages_)), size_(std::exchange(other.size_, 0)) {
    take_own_bits(other);
  }
  PagedWords& operator=(const PagedWords& other) {
    if (this != &other) *this = PagedWords(other);
    return *this;
  }
  PagedWords& operator=(PagedWords&& other) noexcept {
    pages_ = std::move(other.pages_);
    size_ = std::exchange(other.size_, 0);
    take_own_bits(other);
    return *this;
  }
  ~PagedWords() = default;

  [[nodiscard]] std::size_t size() const { return size_; }
  /// Returns a pointer to the word and those after it in its page.
  [[nodiscard]] const std::uint64_t* at(std::size_t word) const {
    QUOIN_ASSERT(word < size_, "an existing word");
    return pages_[word / kPageWords]->words() + word % kPageWords;
  }
  /// Returns true if its page is known to be unshared.
  [[nodiscard]] bool owns(std::size_t word) const {
    QUOIN_ASSERT(word < kMaxWords, "a word of a chunk");
    const std::size_t page = word / kPageWords;
    return (own_[page / 64].load(std::memory_order_relaxed) >> (page % 64) & 1U) != 0;
  }
  /// Returns writable words. Requires: `owns(word)`.
  [[nodiscard]] std::uint64_t* own_at(std::size_t word) {
    QUOIN_ASSERT(word < size_ && owns(word), "a word on an unshared page");
    return pages_[word / kPageWords]->words() + word % kPageWords;
  }
  /// Copies the page of the word if it is shared. Requires: this object is not shared.
  void make_own(std::size_t word) {
    if (!owns(word)) make_page_own(word / kPageWords);
  }
  /// Appends words with unspecified values; their pages become unshared. Requires: this object is not shared; at most
  /// kMaxWords.
  void grow(std::size_t size);
  /// Releases the spare capacity.
  void shrink_to_fit();
  /// Calls `visit(words)` for each page.
  template <class Visit>
  void for_each_page(Visit&& visit) const {
    for (std::size_t first = 0; first < size_; first += kPageWords) {
      visit(std::span(pages_[first / kPageWords]->words(), std::min(kPageWords, size_ - first)));
    }
  }
  /// Returns true if some pages are shared with copies.
  [[nodiscard]] bool has_shared_pages() const {
    return std::ranges::any_of(pages_, [](const Ref<Page>& page) { return page.is_shared(); });
  }
  /// Returns the allocated bytes, including shared ones.
  [[nodiscard]] std::size_t allocated() const;

 private:
  // The words follow this object in memory.
  class alignas(16) Page : public RefCounted {
   public:
    // Words with unspecified values.
    static Ref<Page> make(std::size_t capacity);
    void operator delete(Page* page, std::destroying_delete_t) {
      const std::size_t bytes = bytes_of(page->capacity_);
      page->~Page();
      free_block(page, bytes);
    }
    [[nodiscard]] std::size_t capacity() const { return capacity_; }
    [[nodiscard]] std::uint64_t* words() { return reinterpret_cast<std::uint64_t*>(this + 1); }
    [[nodiscard]] const std::uint64_t* words() const { return reinterpret_cast<const std::uint64_t*>(this + 1); }

   private:
    [[nodiscard]] static std::size_t bytes_of(std::size_t capacity) {
      return sizeof(Page) + capacity * sizeof(std::uint64_t);
    }
    explicit Page(std::size_t capacity) : capacity_(static_cast<std::uint32_t>(capacity)) {}
    std::uint32_t capacity_;
  };

  // Clears the bits after a copy.
  void share() const {
    for (auto& bits : own_) bits.store(0, std::memory_order_relaxed);
  }
  void take_own_bits(PagedWords& other) {
    for (std::size_t i = 0; i < own_.size(); ++i) own_[i].store(other.own_[i].exchange(0), std::memory_order_relaxed);
  }
  void add_page(std::size_t capacity);
  void make_page_own(std::size_t page);
  // Replaces a page by a copy with the given capacity.
  void replace_page(std::size_t page, std::size_t capacity);
  // Marks a page as unshared. No other thread writes the bits, since this object is not shared.
  void mark_own(std::size_t page) {
    std::atomic<std::uint64_t>& bits = own_[page / 64];
    bits.store(bits.load(std::memory_order_relaxed) | std::uint64_t{1} << (page % 64), std::memory_order_relaxed);
  }
  [[nodiscard]] std::size_t used_of(std::size_t page) const {
    QUOIN_ASSERT(page * kPageWords < size_, "a page in use");
    return std::min(kPageWords, size_ - page * kPageWords);
  }

  std::vector<Ref<Page>> pages_;
  std::size_t size_ = 0;
  // Pages known to be unshared. A copy of this object, which is shared then, clears the bits.
  mutable std::array<std::atomic<std::uint64_t>, kMaxPages / 64> own_{};
};

}  // namespace quoin
