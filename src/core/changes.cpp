#include <quoin/core/changes.h>

#include <atomic>

#include <quoin/core/assert.h>

#include "core/change_journal.h"

namespace quoin {

std::uint64_t next_serial() {
  static std::atomic<std::uint64_t> count{0};
  return count.fetch_add(1, std::memory_order_relaxed) + 1;
}

void ChangeNotifier::notify_first() {
  QUOIN_ASSERT(to_ != nullptr, "a followed notifier");
  to_->notify(index_);
  is_notified_ = true;
}

}  // namespace quoin
