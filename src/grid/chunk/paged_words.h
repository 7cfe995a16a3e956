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

namespace quoin {

/// Words in pages that copies share until one of them writes to a page: what a copy costs, and a write to one, does not
/// grow with the words there are.
///
/// Threads: as copies of a Ref. What has owners of its own may be copied by several threads at once, and is written by
/// one that has seen that it is the only owner (Ref::is_shared).
class PagedWords {
 public:
  static constexpr std::size_t kPageWords = 512;
  static constexpr std::size_t kMaxWords = 65'536;  // of a chunk at 16 bits a voxel
  static constexpr std::size_t kMaxPages = kMaxWords / kPageWords;

  PagedWords() = default;
  /// Zeros, or these; no more room than they take.
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
  /// That word and those after it in its page.
  [[nodiscard]] const std::uint64_t* at(std::size_t word) const {
    QUOIN_ASSERT(word < size_, "a word that there is");
    return pages_[word / kPageWords]->words() + word % kPageWords;
  }
  /// Whether its page is known to be this one's alone.
  [[nodiscard]] bool owns(std::size_t word) const {
    const std::size_t page = word / kPageWords;
    return (own_[page / 64].load(std::memory_order_relaxed) >> (page % 64) & 1U) != 0;
  }
  /// The same, to be written. Requires: `owns(word)`.
  [[nodiscard]] std::uint64_t* own_at(std::size_t word) {
    QUOIN_ASSERT(word < size_ && owns(word), "a word whose page was made one's own");
    return pages_[word / kPageWords]->words() + word % kPageWords;
  }
  /// Copies its page where others have it, too. Requires: this is not shared.
  void make_own(std::size_t word) {
    if (!owns(word)) make_page_own(word / kPageWords);
  }
  /// Adds words of any value at the end; the pages that they are in are then this one's own. Requires: this is not
  /// shared; at most kMaxWords.
  void grow(std::size_t size);
  /// Gives back the room that growing left.
  void shrink_to_fit();
  /// For each page: its words.
  template <class Visit>
  void for_each_page(Visit&& visit) const {
    for (std::size_t first = 0; first < size_; first += kPageWords) {
      visit(std::span(pages_[first / kPageWords]->words(), std::min(kPageWords, size_ - first)));
    }
  }
  /// Whether others have some of the pages, too.
  [[nodiscard]] bool has_shared_pages() const {
    return std::ranges::any_of(pages_, [](const Ref<Page>& page) { return page.is_shared(); });
  }
  /// Bytes allocated, those that are shared too.
  [[nodiscard]] std::size_t allocated() const;

 private:
  // The words lie behind it.
  class alignas(16) Page : public RefCounted {
   public:
    // Words of any value.
    static Ref<Page> make(std::size_t capacity);
    static void operator delete(void* page) { ::operator delete(page); }
    [[nodiscard]] std::size_t capacity() const { return capacity_; }
    [[nodiscard]] std::uint64_t* words() { return reinterpret_cast<std::uint64_t*>(this + 1); }
    [[nodiscard]] const std::uint64_t* words() const { return reinterpret_cast<const std::uint64_t*>(this + 1); }

   private:
    explicit Page(std::size_t capacity) : capacity_(static_cast<std::uint32_t>(capacity)) {}
    std::uint32_t capacity_;
  };

  // A copy was made.
  void share() const {
    for (auto& bits : own_) bits.store(0, std::memory_order_relaxed);
  }
  void take_own_bits(PagedWords& other) {
    for (std::size_t i = 0; i < own_.size(); ++i) own_[i].store(other.own_[i].exchange(0), std::memory_order_relaxed);
  }
  void add_page(std::size_t capacity);
  void make_page_own(std::size_t page);
  // The page anew, with room for so many words.
  void replace_page(std::size_t page, std::size_t capacity);
  // That a page is own. Nobody else writes the bits, since this is not shared.
  void mark_own(std::size_t page) {
    std::atomic<std::uint64_t>& bits = own_[page / 64];
    bits.store(bits.load(std::memory_order_relaxed) | std::uint64_t{1} << (page % 64), std::memory_order_relaxed);
  }
  [[nodiscard]] std::size_t used_of(std::size_t page) const { return std::min(kPageWords, size_ - page * kPageWords); }

  std::vector<Ref<Page>> pages_;
  std::size_t size_ = 0;
  // Pages that no other has, as far as is known: whoever copies this, which is shared then, takes the bits away.
  mutable std::array<std::atomic<std::uint64_t>, kMaxPages / 64> own_{};
};

}  // namespace quoin
