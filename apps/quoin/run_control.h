#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <quoin/core/progress.h>
#include <quoin/io/file.h>

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

/// The result of one run of watched work. Only `watch` uses the files.
struct WatchedWork {
  int status = 0;
  std::vector<std::filesystem::path> read;     ///< files, and folders with all their files
  std::vector<std::filesystem::path> written;  ///< changes to these files are ignored
};

/// File stamps by path; folders include all files in them.
using Stamps = std::map<std::filesystem::path, std::optional<FileStamp>>;
[[nodiscard]] Stamps stamps_of(const std::vector<std::filesystem::path>& paths);

/// Returns a file and its sidecar files, as far as they are known before reading.
[[nodiscard]] std::vector<std::filesystem::path> files_read(const std::filesystem::path& input, SidecarFiles allowed);

/// Runs `work`, and again each time its input files have changed and are stable, until an interrupt ends the program.
/// `read`: the files it will read, as far as known. Returns only if the first run fails with wrong usage. Polls the
/// files four times per second, which works on any file system.
[[nodiscard]] int watch(const std::vector<std::filesystem::path>& read, const std::function<WatchedWork()>& work);

}  // namespace quoin::tool
