#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <mutex>

#include <quoin/core/progress.h>

namespace quoin {

/// Reports the fraction of `total` finished steps to a progress callback, at most 1, and remembers if it cancelled.
/// A step is a unit of work: a chunk, a sample, a byte. Threads: all functions may run concurrently.
class ProgressSteps {
 public:
  ProgressSteps(const Progress& progress, std::size_t total)
      : progress_(&progress), total_(static_cast<double>(std::max<std::size_t>(total, 1))) {}
  /// Reports `steps` more as finished; fractions are allowed. Returns false once the callback has cancelled.
  bool add(double steps) {
    if (!*progress_) return true;
    const std::lock_guard lock(mutex_);
    done_ += steps;
    if (!cancelled_ && !(*progress_)(std::min(1.0, done_ / total_))) cancelled_ = true;
    return !cancelled_;
  }
  void step() { add(1.0); }
  [[nodiscard]] bool cancelled() const { return cancelled_; }

 private:
  const Progress* progress_;
  double total_;
  double done_ = 0.0;
  std::mutex mutex_;
  std::atomic<bool> cancelled_{false};
};

}  // namespace quoin
