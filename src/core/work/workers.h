#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <quoin/core/parallel.h>

namespace quoin {

/// Worker threads of an object. They look for work in its state, which its mutex guards:
///
///   owner:    lock, add work, unlock, wake_one()         lock, wait(lock, is_finished)
///   worker:   lock, step(lock) -> kAgain, step(lock) -> kWhenWoken, wait, step(lock), ...
///
/// The owner keeps the waiting work in containers of its choice: a queue, a list by priority, or the newest request
/// alone. It cancels waiting work by removing it under the lock.
///
/// An exception that leaves a step ends neither the worker nor the process. The worker keeps the first one for
/// `take_failure` and continues after a short pause, because memory may have run out.
///
/// Threads: start, is_started, stop and drain must not run at the same time. All other functions may run on any thread.
class Workers {
 public:
  using Clock = std::chrono::steady_clock;
  using Lock = std::unique_lock<std::mutex>;
  /// Looks for work and does one piece of it. Called with the lock held; may unlock it meanwhile. Returns the time of
  /// the worker's next step: kAgain after work, kWhenWoken if no work waits. Wakes bring a later time forward.
  using Step = std::function<Clock::time_point(Lock& lock, unsigned worker)>;
  static constexpr Clock::time_point kAgain = Clock::time_point::min();
  static constexpr Clock::time_point kWhenWoken = Clock::time_point::max();

  /// Lifetime: `mutex`, and the state that steps use, must outlive the object. As the owner's last member it ends
  /// first.
  explicit Workers(std::mutex& mutex) : mutex_(mutex) {}
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  ~Workers() { stop(); }

  /// Starts `count` threads, which call `step` until `stop` or `drain`.
  /// Throws std::system_error if a thread cannot start; earlier ones continue. Requires: not started, not stopped.
  void start(unsigned count, Step step);
  [[nodiscard]] bool is_started() const { return !threads_.empty(); }

  /// Ends the workers after their current steps. Waiting work stays where it is. Requires: the lock is not held.
  void stop() { end(false); }
  /// Ends each worker at its first step without work. Requires: the lock is not held.
  void drain() { end(true); }
  /// Returns true once `stop` or `drain` was called, so that long steps can end early. Requires: the lock is held.
  [[nodiscard]] bool is_stopping() const { return is_stopping_; }

  void wake_one() { wake_.notify_one(); }
  void wake_all() { wake_.notify_all(); }

  /// Waits until `is_finished()`, which is called with the lock held, after each step and each `notify`.
  template <class IsFinished>
  void wait(Lock& lock, IsFinished is_finished) {
    stepped_.wait(lock, std::move(is_finished));
  }
  /// As `wait`, for at most `seconds`. Returns the last result of `is_finished`.
  template <class IsFinished>
  bool wait_for(Lock& lock, double seconds, IsFinished is_finished) {
    return stepped_.wait_for(lock, std::chrono::duration<double>(seconds), std::move(is_finished));
  }
  /// Lets waiting callers check again, in the middle of a step.
  void notify() { stepped_.notify_all(); }

  /// Keeps an exception for `take_failure`, unless there is an earlier one. Steps call it before they report the end of
  /// failed work, so that a caller who waits for this end finds the exception. Requires: the lock is held.
  void keep_failure(std::exception_ptr failure) {
    if (failure_ == nullptr) failure_ = std::move(failure);
  }
  /// Returns the first exception of a step since the last call, or null. Requires: the lock is held.
  [[nodiscard]] std::exception_ptr take_failure() { return std::exchange(failure_, nullptr); }

 private:
  void end(bool drains);
  void run(unsigned worker);
  [[nodiscard]] Clock::time_point guarded_step(Lock& lock, unsigned worker);

  std::mutex& mutex_;
  Step step_;
  std::condition_variable wake_;
  std::condition_variable stepped_;
  bool is_stopping_ = false;
  bool is_draining_ = false;
  std::exception_ptr failure_;
  std::vector<std::thread> threads_;
};

/// Returns the number of worker threads in addition to the calling thread. Unlike `thread_count`, 0 means one less than
/// the machine has, at least 1.
[[nodiscard]] inline unsigned worker_count(Threads threads) {
  return threads.count != 0 ? threads.count : std::max(2U, thread_count(threads)) - 1;
}

}  // namespace quoin
