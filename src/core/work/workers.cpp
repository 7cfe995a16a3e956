#include "core/work/workers.h"

#include <quoin/core/assert.h>

namespace quoin {

void Workers::start(unsigned count, Step step) {
  QUOIN_ASSERT(threads_.empty() && !is_stopping_, "workers that have not run");
  step_ = std::move(step);
  threads_.reserve(count);
  for (unsigned i = 0; i < count; ++i) threads_.emplace_back([this, i] { run(i); });
}

void Workers::end(bool drains) {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
    is_draining_ = drains;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
}

void Workers::run(unsigned worker) {
  Lock lock(mutex_);
  while (!is_stopping_ || is_draining_) {
    const Clock::time_point next = guarded_step(lock, worker);
    stepped_.notify_all();
    if (next == kAgain) continue;
    if (is_stopping_ && (next == kWhenWoken || !is_draining_)) return;
    if (next == kWhenWoken) {
      wake_.wait(lock);
    } else {
      wake_.wait_until(lock, next);
    }
  }
}

Workers::Clock::time_point Workers::guarded_step(Lock& lock, unsigned worker) {
  constexpr auto kAfterFailure = std::chrono::milliseconds(20);
  try {
    const Clock::time_point next = step_(lock, worker);
    QUOIN_ASSERT(lock.owns_lock(), "a step returns with the lock held");
    return next;
  } catch (...) {
    if (!lock.owns_lock()) lock.lock();
    keep_failure(std::current_exception());
    return Clock::now() + kAfterFailure;
  }
}

}  // namespace quoin
