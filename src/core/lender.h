#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace quoin {

/// Lends objects of a kind to as many threads as ask, and keeps them between loans: memory that only grows.
template <class T>
class Lender {
 public:
  /// Calls `use(T&)` with an object that no other thread has meanwhile.
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
