#pragma once

#include <atomic>
#include <cstddef>
#include <mutex>

#include <quoin/core/progress.h>

namespace quoin {

/// Reports the fraction of `total` finished steps to a progress callback, and remembers if it cancelled. Threads: all
/// functions may run concurrently.
class ProgressSteps {
 public:
  ProgressSteps(const Progress& progress, std::size_t total) : progress_(&progress), total_(total) {}
  void step() {
    if (!*progress_) return;
    const std::lock_guard lock(mutex_);
    ++done_;
    if (!cancelled_ && !(*progress_)(static_cast<double>(done_) / static_cast<double>(total_))) cancelled_ = true;
  }
  [[nodiscard]] bool cancelled() const { return cancelled_; }

 private:
  const Progress* progress_;
  std::size_t total_;
  std::size_t done_ = 0;
  std::mutex mutex_;
  std::atomic<bool> cancelled_{false};
};

}  // namespace quoin
