#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

namespace quoin {

/// Reserves memory, so that adding `more` elements cannot fail. If memory must grow, also reserves room for `spare`
/// further elements.
template <class T>
void make_room(std::vector<T>& all, std::size_t more, std::size_t spare) {
  if (all.size() + more > all.capacity()) all.reserve(all.size() + more + spare);
}
/// Reserves memory for the next element; doubles it if it must grow.
template <class T>
void make_room(std::vector<T>& all) {
  make_room(all, 1, all.size());
}

/// A list that uses memory of the calling thread, and leaves it there, so that repeated calls of a function do not
/// allocate. A list within the life of another one with the same `Use` has memory of its own.
///
///   KeptList<std::size_t, struct NearInstances> near;
///   near->push_back(i);
///
/// A thread keeps at most kMostKeptBytes for each `Use`.
/// Threads: destroy the list on the thread that made it.
template <class T, class Use>
class KeptList {
 public:
  static constexpr std::size_t kMostKeptBytes = std::size_t{256} << 10;

  KeptList() { std::swap(list_, kept()); }
  KeptList(const KeptList&) = delete;
  KeptList& operator=(const KeptList&) = delete;
  ~KeptList() {
    list_.clear();
    const bool is_larger = list_.capacity() > kept().capacity();
    if (is_larger && list_.capacity() * sizeof(T) <= kMostKeptBytes) std::swap(list_, kept());
  }

  [[nodiscard]] std::vector<T>& operator*() { return list_; }
  [[nodiscard]] std::vector<T>* operator->() { return &list_; }

 private:
  static std::vector<T>& kept() {
    thread_local std::vector<T> list;
    return list;
  }

  std::vector<T> list_;
};

/// A queue that keeps its memory, unlike std::deque, which allocates and frees blocks as elements pass through.
template <class T>
class KeptQueue {
 public:
  [[nodiscard]] std::size_t size() const { return all_.size() - first_; }
  [[nodiscard]] bool empty() const { return size() == 0; }
  [[nodiscard]] auto begin() { return all_.begin() + static_cast<std::ptrdiff_t>(first_); }
  [[nodiscard]] auto end() { return all_.end(); }
  [[nodiscard]] T& front() {
    QUOIN_ASSERT(!empty(), "an element");
    return all_[first_];
  }
  /// If it throws, the element is still the caller's.
  void push_back(T&& element) {
    if (all_.size() == all_.capacity() && first_ > all_.size() / 2) {
      all_.erase(all_.begin(), begin());
      first_ = 0;
    }
    all_.push_back(std::move(element));
  }
  void pop_front() {
    QUOIN_ASSERT(!empty(), "an element");
    all_[first_] = T();  // not kept until the queue is empty
    if (++first_ != all_.size()) return;
    all_.clear();
    first_ = 0;
  }
  /// Drops all elements from one on.
  void erase_from(typename std::vector<T>::iterator first) { all_.erase(first, all_.end()); }
  /// Replaces the elements.
  void assign(const std::vector<T>& elements) {
    all_ = elements;
    first_ = 0;
  }

 private:
  std::vector<T> all_;
  std::size_t first_ = 0;  // those before were taken
};

}  // namespace quoin
