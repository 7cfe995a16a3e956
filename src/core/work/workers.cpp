#include "core/work/workers.h"

#include <quoin/core/assert.h>

namespace quoin {

void ReleaseQueue::put(Held* held) noexcept {
  {
    const std::lock_guard lock(mutex_);
    if (workers_ != nullptr && objects_ < kMaxObjects && bytes_ + held->bytes <= kMaxBytes) {
      held->next = std::exchange(first_, held);
      bytes_ += held->bytes;
      if (++objects_ == 1) workers_->wake_one();
      return;
    }
  }
  delete held;
}

void ReleaseQueue::open(Workers& workers) {
  const std::lock_guard lock(mutex_);
  workers_ = &workers;
}

void ReleaseQueue::close() noexcept {
  {
    const std::lock_guard lock(mutex_);
    workers_ = nullptr;
  }
  while (destroy_some()) {
  }
}

// A limited number: after a change of the whole world, new work must not wait for the release of all old memory.
bool ReleaseQueue::destroy_some() noexcept {
  constexpr int kAtATime = 64;
  Held* first = nullptr;
  {
    const std::lock_guard lock(mutex_);
    for (int i = 0; i < kAtATime && first_ != nullptr; ++i) {
      Held* const held = std::exchange(first_, first_->next);
      held->next = std::exchange(first, held);
      --objects_;
      bytes_ -= held->bytes;
    }
    QUOIN_ASSERT((objects_ == 0) == (first_ == nullptr), "every waiting object is counted");
    if (first == nullptr) return false;
    ++destroyers_;
  }
  while (first != nullptr) delete std::exchange(first, first->next);
  const std::lock_guard lock(mutex_);
  if (--destroyers_ == 0) destroyed_.notify_all();
  return true;
}

void ReleaseQueue::finish() noexcept {
  while (destroy_some()) {
  }
  std::unique_lock lock(mutex_);
  destroyed_.wait(lock, [&] { return destroyers_ == 0; });
}

void Workers::start(unsigned count, Step step) {
  QUOIN_ASSERT(threads_.empty() && !is_stopping_, "workers that have not run");
  step_ = std::move(step);
  threads_.reserve(count);
  releases_->open(*this);
  for (unsigned i = 0; i < count; ++i) threads_.emplace_back([this, i] { run(i); });
}

void Workers::end(bool drains) {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
    is_draining_ = drains;
  }
  wake_all();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
  releases_->close();
}

void Workers::run(unsigned worker) {
  Lock lock(mutex_);
  while (!is_stopping_ || is_draining_) {
    const std::uint32_t seen = wakes();
    const bool has_released = releases_->has_objects();
    if (has_released) {
      lock.unlock();
      releases_->destroy_some();
      lock.lock();
      if (is_stopping_ && !is_draining_) return;
    }
    const Clock::time_point next = guarded_step(lock, worker);
    stepped_.notify_all();
    if (next == kAgain || has_released) continue;
    if (is_stopping_ && (next == kWhenWoken || !is_draining_)) return;
    sleep(lock, next, seen);
  }
}

// Sleeps until `until`, or a wake after `seen`: its work, or its object to destroy, may be newer than the last step.
void Workers::sleep(Lock& lock, Clock::time_point until, std::uint32_t seen) {
  lock.unlock();
  {
    Lock wake_lock(wake_mutex_);
    const auto is_woken = [&] { return wakes_ != seen; };
    if (until == kWhenWoken) {
      wake_.wait(wake_lock, is_woken);
    } else {
      wake_.wait_until(wake_lock, until, is_woken);
    }
  }
  lock.lock();
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
