#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <quoin/core/parallel.h>

namespace quoin {

/// A job system that counts jobs, by name and at once.
class CountingJobs final : public JobSystem {
 public:
  /// Each post sleeps for `slowness`.
  explicit CountingJobs(unsigned workers, std::chrono::microseconds slowness = {})
      : slowness_(slowness), pool_(make_worker_pool({workers})) {}

  [[nodiscard]] unsigned worker_count() const noexcept override { return pool_->worker_count(); }
  void post(Job& job) noexcept override {
    if (slowness_.count() != 0) std::this_thread::sleep_for(slowness_);
    {
      const std::lock_guard lock(mutex_);
      ++posted_[job.name];
    }
    ++unfinished_;
    pool_->post(*new Counted(*this, job));  // deletes itself
  }

  [[nodiscard]] int most_at_once() const { return most_; }
  [[nodiscard]] int unfinished() const { return unfinished_; }
  [[nodiscard]] std::map<std::string, int> posted() const {
    const std::lock_guard lock(mutex_);
    return posted_;
  }
  /// Returns the names of the jobs of a priority, in the order in which they ran.
  [[nodiscard]] std::vector<std::string> run(JobPriority priority) const {
    const std::lock_guard lock(mutex_);
    return run_[static_cast<std::size_t>(priority)];
  }

 private:
  struct Counted final : Job {
    Counted(CountingJobs& counting, Job& counted) : jobs(counting), job(counted) {
      priority = counted.priority;
      name = counted.name;
    }
    void run() noexcept override {
      const int now = ++jobs.running_;
      int most = jobs.most_;
      while (now > most && !jobs.most_.compare_exchange_weak(most, now)) {
      }
      {
        const std::lock_guard lock(jobs.mutex_);
        jobs.run_[static_cast<std::size_t>(priority)].emplace_back(name);
      }
      job.run();
      --jobs.running_;
      --jobs.unfinished_;
      delete this;
    }
    CountingJobs& jobs;
    Job& job;
  };

  const std::chrono::microseconds slowness_;
  std::atomic<int> running_{0};
  std::atomic<int> most_{0};
  std::atomic<int> unfinished_{0};
  mutable std::mutex mutex_;  // of the next two
  std::map<std::string, int> posted_;
  std::array<std::vector<std::string>, kJobPriorityCount> run_;
  std::shared_ptr<JobSystem> pool_;  // last: its jobs use the others
};

/// Runs a function as a job, and returns when it has ended. Only the job may destroy the job system.
template <class Function>
void call_as_job(JobSystem& jobs, Function function) {
  struct State {
    std::atomic<bool> is_done{false};
  };
  struct Call final : Job {
    Call(Function called, std::shared_ptr<State> shared) : function(std::move(called)), state(std::move(shared)) {}
    void run() noexcept override {
      const std::unique_ptr<Call> itself(this);
      function();
      state->is_done = true;
      state->is_done.notify_all();
    }
    Function function;
    std::shared_ptr<State> state;
  };
  const auto state = std::make_shared<State>();
  jobs.post(*new Call(std::move(function), state));
  state->is_done.wait(false);
}

/// Sets the job system of the process for the duration of a scope.
class ScopedJobSystem {
 public:
  explicit ScopedJobSystem(std::shared_ptr<JobSystem> jobs) { set_job_system(std::move(jobs)); }
  ScopedJobSystem(const ScopedJobSystem&) = delete;
  ScopedJobSystem& operator=(const ScopedJobSystem&) = delete;
  ~ScopedJobSystem() { set_job_system(nullptr); }
};

}  // namespace quoin
