#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace quoin {

/// Drops the least recently used entries of a cache until it holds at most `max_bytes`. Returns the bytes still held:
/// more than the limit if other entries must stay.
///
/// Requires: a map whose values have `last_use`, a number that grows with each use, and whose iterators stay valid when
///           other entries are erased. `held` is the sum over its entries.
/// Entries:  the functions get iterators. `may_drop(entry)` selects, `bytes_of(entry)` measures, `drop(entry)` erases.
/// Order:    by `last_use`; entries with equal numbers in the map's order.
/// Cost:     none within the limit, else O(entries log entries). Frequent callers pass less than their limit.
template <class Map, class MayDrop, class BytesOf, class Drop>
std::uint64_t drop_oldest(Map& entries, std::uint64_t held, std::uint64_t max_bytes, MayDrop may_drop, BytesOf bytes_of,
                          Drop drop) {
  if (held <= max_bytes) return held;
  std::vector<typename Map::iterator> oldest;
  for (auto each = entries.begin(); each != entries.end(); ++each) {
    if (may_drop(each)) oldest.push_back(each);
  }
  std::ranges::stable_sort(oldest, {}, [](const auto& entry) { return entry->second.last_use; });
  for (auto each = oldest.begin(); each != oldest.end() && held > max_bytes; ++each) {
    held -= bytes_of(*each);
    drop(*each);
  }
  return held;
}

/// A pool that lends one object per concurrent caller and keeps objects between loans. Its memory never shrinks.
template <class T>
class ObjectPool {
 public:
  /// Calls `use(T&)` with an object that no other thread uses during the call.
  template <class Use>
  void with(const Use& use) {
    std::unique_ptr<T> lent = take();
    use(*lent);
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(lent));
  }

 private:
  std::unique_ptr<T> take() {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) return std::make_unique<T>();
    std::unique_ptr<T> last = std::move(free_.back());
    free_.pop_back();
    return last;
  }

  std::mutex mutex_;
  std::vector<std::unique_ptr<T>> free_;
};

}  // namespace quoin
