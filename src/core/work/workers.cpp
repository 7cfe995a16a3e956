#include "core/work/workers.h"

#include <algorithm>
#include <optional>
#include <span>
#include <string>

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

// Repeats, because an object that a worker destroys may have owned others, which then wait.
void ReleaseQueue::finish() noexcept {
  for (bool has_objects = true; has_objects;) {
    while (destroy_some()) {
    }
    std::unique_lock lock(mutex_);
    destroyed_.wait(lock, [&] { return destroyers_ == 0; });
    has_objects = objects_ != 0;
  }
}

// Workers with a job system. Posted jobs share ownership, because they may start after the workers have ended.
struct Workers::Jobs : std::enable_shared_from_this<Jobs> {
  Jobs(Workers& workers, std::shared_ptr<JobSystem> job_system, unsigned most, const char* job_name)
      : system(std::move(job_system)), of(workers), name(job_name), count(most), slots(kJobPriorityCount * most) {
    for (unsigned worker = count; worker != 0; --worker) idle.push_back(worker - 1);
  }

  void wake(bool all, JobPriority priority) {
    Job* first = nullptr;
    {
      const std::lock_guard lock(mutex);
      first = reserve(all ? count : 1, priority);
    }
    post(first);
  }
  // Returns the number of a worker that is in no step, for `leave`.
  [[nodiscard]] std::optional<unsigned> enter() {
    const std::lock_guard lock(mutex);
    if (is_closed || idle.empty()) return std::nullopt;
    const unsigned worker = idle.back();
    idle.pop_back();
    return worker;
  }
  // Posts the next job after work, or if there were wakes after `seen`, which found no free worker.
  void leave(unsigned worker, bool again, std::uint32_t seen) {
    Job* first = nullptr;
    {
      const std::lock_guard lock(mutex);
      QUOIN_ASSERT(idle.size() < count, "a worker that entered");
      idle.push_back(worker);
      if (again || of.wakes() != seen) first = reserve(1, of.priority_);
      left.notify_all();
    }
    post(first);  // the workers may have ended
  }
  // Returns once no worker is in a step. No step begins from now on.
  void close() {
    Lock lock(mutex);
    is_closed = true;
    left.wait(lock, [&] { return idle.size() == count; });
  }

  const std::shared_ptr<JobSystem> system;

 private:
  struct Slot final : Job {
    void run() noexcept override { Jobs::run(*this); }
    std::shared_ptr<Jobs> jobs;  // while it is posted
  };

  // Marks up to `wanted` jobs as posted, and returns them as a list for `post`, which needs no lock: a job system may
  // take its time. Per priority, no more jobs are posted than workers are in no step. Requires: the mutex is held.
  [[nodiscard]] Job* reserve(unsigned wanted, JobPriority priority) {
    if (is_closed) return nullptr;
    const auto of_priority = std::span(slots).subspan(static_cast<std::size_t>(priority) * count, count);
    std::size_t posted = static_cast<std::size_t>(std::ranges::count_if(of_priority, &is_posted));
    Job* first = nullptr;
    for (Slot& slot : of_priority) {
      if (wanted == 0 || posted >= idle.size()) break;
      if (is_posted(slot)) continue;
      slot.jobs = shared_from_this();
      slot.name = name;
      slot.priority = priority;
      slot.next = std::exchange(first, &slot);
      --wanted;
      ++posted;
    }
    return first;
  }
  static bool is_posted(const Slot& slot) { return slot.jobs != nullptr; }
  void post(Job* first) {
    while (first != nullptr) system->post(*std::exchange(first, first->next));
  }

  static void run(Slot& slot) {
    const JobPriorityScope scope(slot.priority);
    std::shared_ptr<Jobs> jobs;
    {
      const std::lock_guard lock(slot.jobs->mutex);
      jobs = std::move(slot.jobs);  // the slot can be posted again
    }
    const std::optional<unsigned> worker = jobs->enter();
    if (!worker) return;  // the workers in steps look again, or have ended
    std::uint32_t seen = 0;
    bool again = false;
    {
      Lock lock(jobs->of.mutex_);
      again = jobs->of.step_as_job(lock, *worker, seen);
    }
    jobs->leave(*worker, again, seen);
  }

  Workers& of;  // exists while a worker is in a step
  const char* const name;
  const unsigned count;
  std::mutex mutex;  // of all below; no other lock is taken while it is held, except Workers::wake_mutex_
  std::condition_variable left;
  bool is_closed = false;      // the workers have ended, or do so once no worker is in a step
  std::vector<unsigned> idle;  // numbers of the workers that are in no step
  std::vector<Slot> slots;     // `count` of each priority, so that urgent work need not wait for the start of others
};

void Workers::start(unsigned count, Step step, Options options) {
  QUOIN_ASSERT(!is_started_ && !is_stopping_ && count > 0, "workers that have not run");
  step_ = std::move(step);
  priority_ = options.priority;
  std::shared_ptr<JobSystem> system = options.has_own_threads ? nullptr : job_system();
  if (system != nullptr) {
    jobs_ = std::make_shared<Jobs>(*this, std::move(system), count, options.name);
    is_started_ = true;
    releases_->open(*this);
    return wake_all();
  }
  threads_.reserve(count);
  releases_->open(*this);
  is_started_ = true;
  for (unsigned i = 0; i < count; ++i) {
    threads_.emplace_back([this, i, name = options.name] {
      name_thread((std::string("quoin ") + name).c_str());
      run(i);
    });
  }
}

void Workers::end(bool drains) {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
    is_draining_ = drains;
  }
  note_work();
  wake_.notify_all();
  if (jobs_ != nullptr && is_started_) {
    jobs_->close();
    if (drains) drain_here();
  }
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
  is_started_ = false;
  releases_->close();
}

void Workers::wake(bool all) {
  note_work();
  if (jobs_ == nullptr) return all ? wake_.notify_all() : wake_.notify_one();
  wake_.notify_all();     // steps that returned a time
  stepped_.notify_all();  // callers that wait, and may do the work
  jobs_->wake(all, priority_);
}

void Workers::run(unsigned worker) {
  Lock lock(mutex_);
  while (!is_stopping_ || is_draining_) {
    const std::uint32_t seen = wakes();
    const Clock::time_point next = look(lock, worker);
    if (next == kAgain) continue;
    if (is_stopping_ && (next == kWhenWoken || !is_draining_)) return;
    sleep(lock, next, seen);
  }
}

void Workers::drain_here() {
  Lock lock(mutex_);
  for (;;) {
    const std::uint32_t seen = wakes();
    const Clock::time_point next = look(lock, 0);
    if (next == kWhenWoken) return;
    if (next != kAgain) sleep(lock, next, seen);
  }
}

bool Workers::help(Lock& lock) {
  if (jobs_ == nullptr || is_stopping_) return false;
  const std::optional<unsigned> worker = jobs_->enter();
  if (!worker) return false;
  std::uint32_t seen = 0;
  const bool again = step_as_job(lock, *worker, seen);
  jobs_->leave(*worker, again, seen);
  return again;
}

// Returns true if there may be more work. `seen`: the wakes that the step has followed.
bool Workers::step_as_job(Lock& lock, unsigned worker, std::uint32_t& seen) {
  seen = wakes();
  if (is_stopping_) return false;
  const Clock::time_point next = look(lock, worker);
  if (next == kAgain || next == kWhenWoken || is_stopping_) return next == kAgain;
  sleep(lock, next, seen);
  return true;
}

Workers::Clock::time_point Workers::look(Lock& lock, unsigned worker) {
  const bool has_released = releases_->has_objects();
  if (has_released) {
    lock.unlock();
    releases_->destroy_some();
    lock.lock();
    if (is_stopping_ && !is_draining_) return kWhenWoken;
  }
  const Clock::time_point next = guarded_step(lock, worker);
  stepped_.notify_all();
  return has_released ? kAgain : next;
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
