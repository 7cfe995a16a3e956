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
      const std::lock_guard lock(counts_->mutex);
      ++counts_->posted[job.name];
    }
    ++counts_->unfinished;
    pool_->post(*new Counted(counts_, job));  // deletes itself
  }

  [[nodiscard]] int most_at_once() const { return counts_->most; }
  [[nodiscard]] int unfinished() const { return counts_->unfinished; }
  [[nodiscard]] std::map<std::string, int> posted() const {
    const std::lock_guard lock(counts_->mutex);
    return counts_->posted;
  }
  /// Returns the names of the jobs of a priority, in the order in which they ran.
  [[nodiscard]] std::vector<std::string> run(JobPriority priority) const {
    const std::lock_guard lock(counts_->mutex);
    return counts_->run[static_cast<std::size_t>(priority)];
  }

 private:
  struct Counts {
    std::atomic<int> running{0};
    std::atomic<int> most{0};
    std::atomic<int> unfinished{0};
    std::mutex mutex;  // of the next two
    std::map<std::string, int> posted;
    std::array<std::vector<std::string>, kJobPriorityCount> run;
  };
  // Shares the counts, because the last job may destroy the job system.
  struct Counted final : Job {
    Counted(std::shared_ptr<Counts> shared, Job& counted) : counts(std::move(shared)), job(counted) {
      priority = counted.priority;
      name = counted.name;
    }
    void run() noexcept override {
      const int now = ++counts->running;
      int most = counts->most;
      while (now > most && !counts->most.compare_exchange_weak(most, now)) {
      }
      {
        const std::lock_guard lock(counts->mutex);
        counts->run[static_cast<std::size_t>(priority)].emplace_back(name);
      }
      job.run();
      --counts->running;
      --counts->unfinished;
      delete this;
    }
    const std::shared_ptr<Counts> counts;
    Job& job;
  };

  const std::chrono::microseconds slowness_;
  const std::shared_ptr<Counts> counts_ = std::make_shared<Counts>();
  const std::shared_ptr<JobSystem> pool_;
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
