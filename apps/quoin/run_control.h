#pragma once

#include <chrono>
#include <string>

#include <quoin/core/progress.h>

namespace quoin::tool {

/// Makes writes to a closed pipe or beyond the file size limit fail with an error. By default SIGPIPE and SIGXFSZ
/// end the program and leave incomplete files.
void let_writes_fail();

/// Makes the first Ctrl-C (or SIGTERM, or SIGHUP from a closed terminal) only request a stop, so that incomplete files
/// are removed. A second one ends the program at once. Ignored signals stay ignored.
void catch_interrupts();

/// Makes caught signals also end a blocking read, which then fails with EINTR. Call after `catch_interrupts`.
void let_interrupts_end_reads();

[[nodiscard]] bool was_interrupted();

/// Ends the program with the caught signal, so that shells and scripts see the cause. Returns if no signal was caught.
void die_if_interrupted();

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

class Stopwatch {
 public:
  /// Seconds since the last call, or since the start.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace quoin::tool
