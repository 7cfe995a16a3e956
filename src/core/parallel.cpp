#include <quoin/core/parallel.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#ifdef __linux__
#include <pthread.h>
#endif

#include <quoin/core/assert.h>

#include "core/work/workers.h"

// Thread-sanitizer builds (QUOIN_PARALLEL_WITH_JTHREAD): oneTBB is not instrumented and gives false reports.
#if !defined(QUOIN_PARALLEL_WITH_JTHREAD) && !defined(QUOIN_PARALLEL_ON_ONE_THREAD)
#include <map>

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#endif

namespace quoin {
namespace {

// The job system of the process.
struct Current {
  std::mutex mutex;  // of `jobs`
  std::shared_ptr<JobSystem> jobs;
  std::atomic<unsigned> workers{0};  // 0: there is none
};

Current& current() {
  static Current the_current;
  return the_current;
}

thread_local JobPriority priority_here = JobPriority::High;

// Read once: glibc opens a file in /sys, which takes 7 microseconds.
unsigned hardware_threads() {
  static const unsigned processors = std::max(1U, std::thread::hardware_concurrency());
  return processors;
}

// Threads that run jobs. They share ownership of the state, so that one of them may destroy the pool.
class WorkerPool final : public JobSystem {
 public:
  explicit WorkerPool(unsigned count) : count_(count) {
    threads_.reserve(count);
    try {
      for (unsigned i = 1; i <= count; ++i) {
        threads_.emplace_back([state = state_, name = "quoin worker " + std::to_string(i)] {
          name_thread(name.c_str());
          state->run_until_end();
        });
      }
    } catch (...) {
      end();
      throw;
    }
  }
  ~WorkerPool() override { end(); }

  [[nodiscard]] unsigned worker_count() const noexcept override { return count_; }
  void post(Job& job) noexcept override { state_->post(job); }

 private:
  struct Waiting {
    Job* first = nullptr;
    Job* last = nullptr;
  };
  struct State {
    void post(Job& job) {
      {
        const std::lock_guard lock(mutex);
        Waiting& list = waiting[static_cast<std::size_t>(job.priority)];
        job.next = nullptr;
        (list.first == nullptr ? list.first : list.last->next) = &job;
        list.last = &job;
      }
      posted.notify_one();
    }
    [[nodiscard]] Job* take() {
      for (Waiting& list : waiting) {
        if (list.first != nullptr) return std::exchange(list.first, list.first->next);
      }
      return nullptr;
    }
    void run_until_end() {
      std::unique_lock lock(mutex);
      for (;;) {
        if (Job* const job = take()) {
          lock.unlock();
          job->run();
          lock.lock();
        } else if (is_ending) {
          return;
        } else {
          posted.wait(lock);
        }
      }
    }

    std::mutex mutex;  // of all below; no other code runs while it is held
    std::condition_variable posted;
    std::array<Waiting, kJobPriorityCount> waiting;
    bool is_ending = false;
  };

  void end() {
    {
      const std::lock_guard lock(state_->mutex);
      state_->is_ending = true;
    }
    state_->posted.notify_all();
    for (std::thread& thread : threads_) {
      if (thread.get_id() == std::this_thread::get_id()) {
        thread.detach();  // ends when it has run the waiting jobs
      } else {
        thread.join();
      }
    }
  }

  const unsigned count_;
  const std::shared_ptr<State> state_ = std::make_shared<State>();
  std::vector<std::thread> threads_;
};

// A parallel loop on the calling thread and jobs. Jobs that start after the end of the loop do nothing.
class Loop : public std::enable_shared_from_this<Loop> {
 public:
  Loop(std::size_t count, FunctionRef<void(std::size_t i)> body, std::size_t helpers)
      : count_(count), body_(body), helpers_(helpers) {}

  void run(JobSystem& jobs) {
    for (Helper& helper : helpers_) {
      helper.loop = shared_from_this();
      helper.name = "loop";
      helper.priority = priority_here;
      jobs.post(helper);
    }
    work();
    std::unique_lock lock(mutex_);
    is_closed_ = true;
    left_.wait(lock, [&] { return inside_ == 0; });
    if (failure_ != nullptr) std::rethrow_exception(std::exchange(failure_, nullptr));
  }

 private:
  struct Helper final : Job {
    void run() noexcept override {
      const std::shared_ptr<Loop> kept = std::move(loop);  // destroys this job at the end
      const JobPriorityScope scope(priority);
      kept->help();
    }
    std::shared_ptr<Loop> loop;
  };

  void help() noexcept {
    {
      const std::lock_guard lock(mutex_);
      if (is_closed_) return;
      ++inside_;
    }
    work();
    const std::lock_guard lock(mutex_);
    QUOIN_ASSERT(inside_ != 0, "helpers that leave have entered");
    if (--inside_ == 0) left_.notify_all();
  }
  void work() noexcept {
    try {
      for (std::size_t i = next_++; i < count_; i = next_++) body_(i);
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (failure_ == nullptr) failure_ = std::current_exception();
      next_ = count_;
    }
  }

  const std::size_t count_;
  const FunctionRef<void(std::size_t i)> body_;  // the caller's, until the loop is closed
  std::atomic<std::size_t> next_{0};
  std::mutex mutex_;  // of the next four
  std::condition_variable left_;
  unsigned inside_ = 0;
  bool is_closed_ = false;
  std::exception_ptr failure_;
  std::vector<Helper> helpers_;
};

// Runs a loop on the calling thread and on workers of the job system. Returns false if there is none.
[[maybe_unused]] bool run_as_jobs(std::size_t count, Threads threads, FunctionRef<void(std::size_t i)> body) {
  const std::shared_ptr<JobSystem> jobs = job_system();
  if (jobs == nullptr) return false;
  const std::size_t workers = std::min<std::size_t>(thread_count(threads), std::size_t{jobs->worker_count()} + 1);
  const std::size_t helpers = std::min(workers, count) - std::min<std::size_t>(count, 1);
  if (helpers == 0) {
    for (std::size_t i = 0; i < count; ++i) body(i);
  } else {
    std::make_shared<Loop>(count, body, helpers)->run(*jobs);
  }
  return true;
}

}  // namespace

void name_thread(const char* name) {
#ifdef __linux__
  (void)::pthread_setname_np(::pthread_self(), name);  // fails for names of more than 15 characters
#else
  (void)name;
#endif
}

JobPriorityScope::JobPriorityScope(JobPriority priority) : before_(std::exchange(priority_here, priority)) {}
JobPriorityScope::~JobPriorityScope() {
  priority_here = before_;
}

std::shared_ptr<JobSystem> make_worker_pool(Threads workers) {
  return std::make_shared<WorkerPool>(worker_count(workers, hardware_threads()));
}

void set_job_system(std::shared_ptr<JobSystem> jobs) {
  const unsigned workers = jobs == nullptr ? 0 : jobs->worker_count();
  QUOIN_ASSERT(jobs == nullptr || workers > 0, "a job system has workers");
  const std::lock_guard lock(current().mutex);
  current().workers = workers;
  std::swap(current().jobs, jobs);
}

std::shared_ptr<JobSystem> job_system() {
  if (current().workers == 0) return nullptr;
  const std::lock_guard lock(current().mutex);
  return current().jobs;
}

#ifdef QUOIN_PARALLEL_ON_ONE_THREAD

// WebAssembly: there are neither threads nor oneTBB.
unsigned thread_count(Threads /*threads*/) {
  return 1;
}

void parallel_for(std::size_t count, Threads /*threads*/, FunctionRef<void(std::size_t i)> body) {
  for (std::size_t i = 0; i < count; ++i) body(i);
}

#else

unsigned thread_count(Threads threads) {
  if (threads.count != 0) return threads.count;
  const unsigned workers = current().workers;
  return workers != 0 ? workers + 1 : hardware_threads();
}

#ifdef QUOIN_PARALLEL_WITH_JTHREAD

void parallel_for(std::size_t count, Threads threads, FunctionRef<void(std::size_t i)> body) {
  if (run_as_jobs(count, threads, body)) return;
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_lock;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) body(i);
    } catch (...) {
      const std::lock_guard lock(failure_lock);
      failure = std::current_exception();
      next = count;
    }
  };
  {
    std::vector<std::jthread> workers;
    const std::size_t helpers = std::min<std::size_t>(thread_count(threads), count);
    for (std::size_t i = 1; i < helpers; ++i) workers.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

#else

namespace {

// Arenas of one thread, by their number of workers. oneTBB 2021.8 never frees some 7 KB per arena, so a program that
// created an arena per call would grow without limit.
oneapi::tbb::task_arena& arena_of(unsigned workers) {
  thread_local std::map<unsigned, oneapi::tbb::task_arena> arenas;
  return arenas.try_emplace(workers, static_cast<int>(workers)).first->second;
}

}  // namespace

void parallel_for(std::size_t count, Threads threads, FunctionRef<void(std::size_t i)> body) {
  if (count == 0 || run_as_jobs(count, threads, body)) return;
  // With more workers than processors, oneTBB starts no more threads but prints a warning to standard error.
  static const auto processors = static_cast<unsigned>(std::max(1, oneapi::tbb::info::default_concurrency()));
  const unsigned workers = count == 1 ? 1 : std::min(thread_count(threads), processors);
  if (workers == 1) {
    for (std::size_t i = 0; i < count; ++i) body(i);
    return;
  }
  arena_of(workers).execute([&] { oneapi::tbb::parallel_for(std::size_t{0}, count, body); });
}

#endif
#endif

}  // namespace quoin
