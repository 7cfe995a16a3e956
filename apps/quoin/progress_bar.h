#pragma once

#include <chrono>
#include <string>

#include <quoin/core/progress.h>

namespace quoin::tool {

/// A progress bar on standard error for work that takes more than 1 s. Shown only if standard error is a terminal.
class ProgressBar {
 public:
  /// `shows`: false if the work is a part of other work that has a bar.
  explicit ProgressBar(bool shows = true);
  /// Removes the bar.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Returns a progress callback that shows `label` in the bar and returns false after an interrupt.
  /// Requires: this outlives it.
  [[nodiscard]] Progress listener(std::string label);

 private:
  using Clock = std::chrono::steady_clock;

  void show(const std::string& label, double fraction);

  bool terminal_;
  bool shown_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point next_;
};

}  // namespace quoin::tool
