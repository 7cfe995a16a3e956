#include "grid/chunk/paged_words.h"

#include <quoin/core/assert.h>

namespace quoin {

Ref<PagedWords::Page> PagedWords::Page::make(std::size_t capacity) {
  QUOIN_ASSERT(capacity != 0 && capacity <= kPageWords, "the words of a page");
  static_assert(alignof(Page) <= __STDCPP_DEFAULT_NEW_ALIGNMENT__);
  void* const memory = allocate_block(bytes_of(capacity));
  return Ref<Page>(new (memory) Page(capacity));
}

PagedWords::PagedWords(std::size_t zeros) {
  while (size_ < zeros) {
    const std::size_t words = std::min(kPageWords, zeros - size_);
    add_page(words);
    std::fill_n(pages_.back()->words(), words, 0);
    size_ += words;
  }
}

PagedWords::PagedWords(std::span<const std::uint64_t> words) {
  while (size_ < words.size()) {
    const std::span<const std::uint64_t> page = words.subspan(size_, std::min(kPageWords, words.size() - size_));
    add_page(page.size());
    std::copy(page.begin(), page.end(), pages_.back()->words());
    size_ += page.size();
  }
}

void PagedWords::add_page(std::size_t capacity) {
  QUOIN_ASSERT(pages_.size() < kMaxPages, "no more pages than a chunk has");
  pages_.push_back(Page::make(capacity));
  mark_own(pages_.size() - 1);
}

void PagedWords::replace_page(std::size_t page, std::size_t capacity) {
  QUOIN_ASSERT(used_of(page) <= capacity, "room for the words in use");
  Ref<Page> made = Page::make(capacity);
  std::copy_n(pages_[page]->words(), used_of(page), made->words());
  pages_[page] = std::move(made);
  mark_own(page);
}

void PagedWords::make_page_own(std::size_t page) {
  QUOIN_ASSERT(page < pages_.size(), "an existing page");
  if (pages_[page].is_shared()) {
    replace_page(page, pages_[page]->capacity());
  } else {
    mark_own(page);
  }
}

void PagedWords::grow(std::size_t size) {
  QUOIN_ASSERT(size >= size_ && size <= kMaxWords, "more words, at most kMaxWords");
  while (size_ < size) {
    const std::size_t page = size_ / kPageWords;
    const std::size_t wanted = std::min(size - page * kPageWords, kPageWords);
    if (page == pages_.size()) {
      // The first page grows like a vector. If there are several pages, the last one gets full capacity, since it will
      // be filled.
      add_page(page == 0 ? wanted : kPageWords);
    } else if (wanted > pages_[page]->capacity()) {
      replace_page(page, std::min(std::max(wanted, 2 * pages_[page]->capacity()), kPageWords));
    } else {
      make_own(size_);
    }
    size_ = page * kPageWords + wanted;
  }
}

void PagedWords::shrink_to_fit() {
  if (pages_.empty()) return;
  const std::size_t last = pages_.size() - 1;
  if (used_of(last) < pages_[last]->capacity()) replace_page(last, used_of(last));
}

// Without a look at each page: all except the last one have full capacity.
std::size_t PagedWords::allocated() const {
  if (pages_.empty()) return pages_.capacity() * sizeof(Ref<Page>);
  const std::size_t words = (pages_.size() - 1) * kPageWords + pages_.back()->capacity();
  return pages_.capacity() * sizeof(Ref<Page>) + pages_.size() * sizeof(Page) + words * sizeof(std::uint64_t);
}

}  // namespace quoin
