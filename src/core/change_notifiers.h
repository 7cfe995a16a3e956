#pragma once

#include <cstdint>
#include <mutex>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/changes.h>

namespace quoin {

/// The notifiers of one container: lists which of its items were edited since the last `take`.
///
/// Threads: notifiers of different items may notify concurrently.
class ChangeNotifiers {
 public:
  ChangeNotifiers() = default;
  ChangeNotifiers(const ChangeNotifiers&) = delete;
  ChangeNotifiers& operator=(const ChangeNotifiers&) = delete;

  /// Reserves memory for the number, so that neither following an item nor notifying allocates.
  void make_room(std::uint32_t index) {
    const std::lock_guard lock(mutex_);
    if (index < is_notified_.size()) return;
    given_.reserve(std::size_t{2} * index + 1);
    is_notified_.resize(std::size_t{2} * index + 1);
  }
  /// Makes the notifier report to this object under a number. Requires: this object outlives the notifier.
  void follow(ChangeNotifier& notifier, std::uint32_t index) {
    make_room(index);
    const std::lock_guard lock(mutex_);
    notifier.to_ = this;
    notifier.index_ = index;
    notifier.is_notified_ = false;
  }
  /// Appends the numbers of the edited items. Each is reported again only after it is followed again.
  void take(std::vector<std::uint32_t>& taken) {
    const std::lock_guard lock(mutex_);
    taken.insert(taken.end(), given_.begin(), given_.end());
    for (const std::uint32_t index : given_) is_notified_[index] = false;
    given_.clear();
  }

 private:
  friend class ChangeNotifier;
  void notify(std::uint32_t index) {
    const std::lock_guard lock(mutex_);
    QUOIN_ASSERT(index < is_notified_.size(), "an index of a followed item");
    // A number is listed once, even if its item was removed and another item now has the number.
    if (is_notified_[index]) return;
    is_notified_[index] = true;
    given_.push_back(index);
  }

  std::mutex mutex_;
  std::vector<std::uint32_t> given_;  // with room for every number
  std::vector<bool> is_notified_;     // by number
};

}  // namespace quoin
