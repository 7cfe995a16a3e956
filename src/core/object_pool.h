#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace quoin {

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
