#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <quoin/core/parallel.h>

namespace quoin {

class Workers;

/// Objects that workers destroy, because freeing large memory takes time: after `return_freed_memory`, each block of
/// 32 KiB or more costs the thread that frees it a call of the system.
///
///   surface = workers.releases()->defer(std::move(surface), bytes);  // points to the same surface
///   surface.reset();                                                 // the last copy: a worker destroys the surface
///
/// A worker destroys waiting objects before its next step; a sleeping worker is woken for it. The thread that drops the
/// last copy destroys the object itself if the workers have ended, or if too much waits already, for example because
/// all workers are in long steps: more than kMaxObjects objects, or kMaxBytes of those whose size was given.
/// Threads: any. Copies of deferred pointers may be dropped while any lock is held, and after the workers have ended.
class ReleaseQueue : public std::enable_shared_from_this<ReleaseQueue> {
 public:
  static constexpr std::size_t kMaxObjects = 4096;
  static constexpr std::size_t kMaxBytes = std::size_t{64} << 20;

  ReleaseQueue() = default;
  ReleaseQueue(const ReleaseQueue&) = delete;
  ReleaseQueue& operator=(const ReleaseQueue&) = delete;
  ~ReleaseQueue() { close(); }

  /// Returns once all objects that waited at the time of the call are destroyed, by this thread or by workers, and so
  /// are the deferred objects that only they owned.
  /// Requires: the caller is not the destructor of such an object.
  void finish() noexcept;

  /// Returns a pointer to the same object. Once its last copy is dropped, a worker drops `object`. The object counts as
  /// `bytes` towards kMaxBytes. Null stays null. Errors: bad_alloc; `object` is then dropped.
  template <class T>
  [[nodiscard]] std::shared_ptr<T> defer(std::shared_ptr<T> object, std::size_t bytes = 0) {
    if (object == nullptr) return object;
    T* const address = object.get();
    auto held = std::make_unique<Held>(std::move(object), bytes);
    return std::shared_ptr<T>(address, Release{shared_from_this(), held.release()});
  }

 private:
  friend class Workers;
  struct Held {
    Held(std::shared_ptr<const void> kept, std::size_t size) : object(std::move(kept)), bytes(size) {}
    std::shared_ptr<const void> object;
    std::size_t bytes = 0;
    Held* next = nullptr;
  };
  struct Release {
    void operator()(const void* /*object*/) const noexcept { queue->put(held); }
    std::shared_ptr<ReleaseQueue> queue;
    Held* held = nullptr;
  };

  void put(Held* held) noexcept;
  void open(Workers& workers);
  void close() noexcept;
  [[nodiscard]] bool has_objects() {
    const std::lock_guard lock(mutex_);
    return objects_ != 0;
  }
  /// Destroys some of the waiting objects. Returns false if none waited.
  bool destroy_some() noexcept;

  std::mutex mutex_;            // of all below; no other code runs while it is held, except Workers::wake_one
  Workers* workers_ = nullptr;  // null: not started, or ended
  Held* first_ = nullptr;
  std::size_t objects_ = 0;
  std::size_t bytes_ = 0;
  std::size_t destroyers_ = 0;  // threads that destroy objects they have taken from the list
  std::condition_variable destroyed_;
};

/// As `queue->defer`; returns `object` itself if there is no queue.
template <class T>
[[nodiscard]] std::shared_ptr<T> deferred(const std::shared_ptr<ReleaseQueue>& queue, std::shared_ptr<T> object,
                                          std::size_t bytes = 0) {
  return queue == nullptr ? object : queue->defer(std::move(object), bytes);
}

/// A function or object of the program that workers use, and that its owner can replace while they do.
///
///   worker   const auto use = function.use(); (*use)(...);
///   owner    function.replace(newer);  // returns when no worker uses the former one
///
/// Threads: any. A thread must not replace the value that it uses.
template <class T>
class Replaceable {
  struct Held {
    T value;
    std::size_t uses = 0;
  };

 public:
  /// A value that is not in use, or no longer.
  class Value {
   public:
    explicit Value(T value) : held_(std::make_unique<Held>(Held{std::move(value)})) {}

   private:
    friend class Replaceable;
    std::unique_ptr<Held> held_;
  };

  /// Keeps the value of a moment until the end of its scope.
  class Use {
   public:
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;
    ~Use() {
      const std::lock_guard lock(owner_.mutex_);
      if (--held_.uses == 0) owner_.unused_.notify_all();
    }
    [[nodiscard]] const T& operator*() const { return held_.value; }

   private:
    friend class Replaceable;
    // Requires: the owner's mutex is held.
    explicit Use(const Replaceable& owner) : owner_(owner), held_(*owner.current_.held_) { ++held_.uses; }
    const Replaceable& owner_;
    Held& held_;
  };

  explicit Replaceable(T value = {}) : current_(std::move(value)) {}
  Replaceable(const Replaceable&) = delete;
  Replaceable& operator=(const Replaceable&) = delete;

  [[nodiscard]] Use use() const {
    const std::lock_guard lock(mutex_);
    return Use(*this);
  }
  /// Exchanges the values. From now on, threads use the new one. Does not throw.
  void exchange(Value& next) noexcept {
    const std::lock_guard lock(mutex_);
    std::swap(current_.held_, next.held_);
  }
  /// Returns when no thread uses a value that `exchange` returned.
  void wait_until_unused(const Value& former) const {
    std::unique_lock lock(mutex_);
    unused_.wait(lock, [&] { return former.held_->uses == 0; });
  }
  /// Replaces the value. Returns when no thread uses the former one any more, and destroys it. If it throws
  /// (bad_alloc), nothing has changed.
  void replace(T value) {
    Value next(std::move(value));
    exchange(next);
    wait_until_unused(next);
  }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable unused_;
  Value current_;
};

/// The workers of an object. They look for work in its state, which its mutex guards:
///
///   owner:    lock, add work, unlock, wake_one()         lock, wait(lock, is_finished)
///   worker:   lock, step(lock) -> kAgain, step(lock) -> kWhenWoken, wait, step(lock), ...
///
/// The owner keeps the waiting work in containers of its choice: a queue, a list by priority, or the newest request
/// alone. It cancels waiting work by removing it under the lock.
///
/// A worker is a thread. With a job system (quoin/core/parallel.h), it is a number that jobs of one step each use in
/// turn: a wake posts a job for a worker that is in no step, and a job that has found work posts the next one.
///
///   wake_one -> post -> [step] -> kAgain: post -> [step] -> kWhenWoken -> nothing until the next wake
///
/// There, `wait` does steps itself, and `drain` does the last steps, so that neither waits for a free thread of the
/// pool. A step that returns a time keeps its thread until then.
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

  struct Options {
    const char* name = "worker";  ///< of jobs and threads: a string literal of at most 9 characters
    JobPriority priority = JobPriority::Normal;
    bool has_own_threads = false;  ///< also with a job system: for steps that return times again and again
  };
  /// Starts `count` workers, which call `step` until `stop` or `drain`.
  /// Throws std::system_error if a thread cannot start; earlier ones continue. Requires: not started, not stopped.
  void start(unsigned count, Step step, Options options);
  void start(unsigned count, Step step) { start(count, std::move(step), Options()); }
  [[nodiscard]] bool is_started() const { return is_started_; }

  /// Ends the workers after their current steps. Waiting work stays where it is. Requires: the lock is not held.
  void stop() { end(false); }
  /// Ends each worker at its first step without work. Requires: the lock is not held.
  void drain() { end(true); }
  /// Returns true once `stop` or `drain` was called, so that long steps can end early. Requires: the lock is held.
  [[nodiscard]] bool is_stopping() const { return is_stopping_; }

  /// Possible under any lock. Work is found even if it comes during a step.
  void wake_one() { wake(false); }
  void wake_all() { wake(true); }
  /// Lets workers that are in a step look again, and wakes no others.
  void note_work() {
    const std::lock_guard lock(wake_mutex_);
    ++wakes_;
  }
  /// Sets the priority of jobs that are posted from now on. Any thread.
  void set_priority(JobPriority priority) { priority_ = priority; }

  /// Returns the queue of objects that these workers destroy.
  [[nodiscard]] const std::shared_ptr<ReleaseQueue>& releases() const { return releases_; }

  /// Waits until `is_finished()`, which is called with the lock held, after each step and each `notify`.
  template <class IsFinished>
  void wait(Lock& lock, IsFinished is_finished) {
    while (!is_finished()) {
      if (help(lock)) continue;
      if (is_finished()) return;  // by a last step that found no more work
      stepped_.wait(lock);
    }
  }
  /// As `wait`, for at most `seconds`. Returns the last result of `is_finished`. Unless `helps`, does no steps of its
  /// own, which could take longer.
  template <class IsFinished>
  bool wait_for(Lock& lock, double seconds, IsFinished is_finished, bool helps = false) {
    const Clock::time_point begun = Clock::now();
    const auto left = [&] { return std::chrono::duration<double>(seconds) - (Clock::now() - begun); };
    while (!is_finished()) {
      if (left().count() <= 0) return false;
      if (helps && help(lock)) continue;
      if (is_finished()) return true;
      stepped_.wait_for(lock, left());
    }
    return true;
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
  struct Jobs;

  void end(bool drains);
  void run(unsigned worker);
  void drain_here();
  void wake(bool all);
  [[nodiscard]] std::uint32_t wakes() {
    const std::lock_guard lock(wake_mutex_);
    return wakes_;
  }
  void sleep(Lock& lock, Clock::time_point until, std::uint32_t seen);
  [[nodiscard]] bool step_as_job(Lock& lock, unsigned worker, std::uint32_t& seen);
  /// With a job system: does one step on this thread, if work waits and a worker is free. Returns false otherwise.
  bool help(Lock& lock);
  /// Destroys released objects, or does a step. Returns the time of the next one.
  [[nodiscard]] Clock::time_point look(Lock& lock, unsigned worker);
  [[nodiscard]] Clock::time_point guarded_step(Lock& lock, unsigned worker);

  std::mutex& mutex_;
  Step step_;
  std::mutex wake_mutex_;  // of `wakes_`; taken last, so that wakes are possible under any other lock
  std::uint32_t wakes_ = 0;
  std::condition_variable wake_;
  std::condition_variable stepped_;
  std::atomic<JobPriority> priority_{JobPriority::Normal};
  bool is_started_ = false;
  bool is_stopping_ = false;
  bool is_draining_ = false;
  std::exception_ptr failure_;
  std::shared_ptr<ReleaseQueue> releases_ = std::make_shared<ReleaseQueue>();
  std::shared_ptr<Jobs> jobs_;  // with a job system; set by `start`
  std::vector<std::thread> threads_;
};

/// Returns the number of workers of an object or a pool: by default all of `available` threads except the calling one.
[[nodiscard]] inline unsigned worker_count(Threads threads, unsigned available) {
  return threads.count != 0 ? threads.count : std::max(2U, available) - 1;
}
/// Returns the number of workers of an object: see Threads.
[[nodiscard]] inline unsigned worker_count(Threads threads) {
  return worker_count(threads, thread_count(threads));
}

/// Names the calling thread for debuggers and profilers: at most 15 characters.
void name_thread(const char* name);

/// The priority of the job that the calling thread runs. Loops within it post theirs with the same.
class JobPriorityScope {
 public:
  explicit JobPriorityScope(JobPriority priority);
  JobPriorityScope(const JobPriorityScope&) = delete;
  JobPriorityScope& operator=(const JobPriorityScope&) = delete;
  ~JobPriorityScope();

 private:
  JobPriority before_;
};

}  // namespace quoin
