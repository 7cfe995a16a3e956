#pragma once

#include <chrono>
#include <string>

#include <quoin/core/progress.h>

namespace quoin::tool {

/// A bar on standard error for work that lasts longer than a second; nothing when standard error is no terminal.
class ProgressBar {
 public:
  /// `shows`: false for work that is part of another that has a bar.
  explicit ProgressBar(bool shows = true);
  /// Wipes the bar.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// A listener for one piece of work, called `label` in the bar, which returns false once the user has interrupted.
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
