#pragma once

#include <cstddef>
#include <utility>
#include <vector>

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

}  // namespace quoin
