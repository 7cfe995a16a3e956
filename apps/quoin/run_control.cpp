#include "run_control.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <thread>
#include <utility>

#include <quoin/io/formats.h>

#include "commands.h"
#include "output.h"

namespace quoin::tool {
namespace {

std::atomic<int> caught_signal{0};
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler may touch nothing else");

extern "C" void note_signal(int signal) {
  caught_signal.store(signal, std::memory_order_relaxed);
  std::signal(signal, SIG_DFL);
}

/// Returns true if the parent process set the signal to be ignored, as nohup does with SIGHUP and `&` with SIGINT.
bool is_ignored(int signal) {
  struct sigaction current {};
  return ::sigaction(signal, nullptr, &current) == 0 && current.sa_handler == SIG_IGN;
}

}  // namespace

void let_writes_fail() {
  for (const int signal : std::array{SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_IGN);
}

void catch_interrupts() {
  if (was_interrupted()) return;
  for (const int signal : std::array{SIGINT, SIGTERM, SIGHUP}) {
    if (!is_ignored(signal)) std::signal(signal, note_signal);
  }
}

void let_interrupts_end_reads() {
  for (const int signal : std::array{SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction current {};
    if (::sigaction(signal, nullptr, &current) != 0 || current.sa_handler != note_signal) continue;
    current.sa_flags &= ~SA_RESTART;
    ::sigaction(signal, &current, nullptr);
  }
}

bool was_interrupted() {
  return caught_signal.load(std::memory_order_relaxed) != 0;
}

void die_if_interrupted() {
  const int signal = caught_signal.load(std::memory_order_relaxed);
  if (signal == 0) return;
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

namespace {

constexpr int kBarWidth = 40;
constexpr auto kPatience = std::chrono::seconds(1);
constexpr auto kInterval = std::chrono::milliseconds(100);

}  // namespace

ProgressBar::ProgressBar(bool shows)
    : terminal_(shows && !is_quiet() && isatty(STDERR_FILENO) == 1), next_(start_ + kPatience) {}

ProgressBar::~ProgressBar() {
  if (shown_) std::fputs("\r\033[K", stderr);
}

Progress ProgressBar::listener(std::string label) {
  return [this, label = std::move(label)](double fraction) {
    if (terminal_ && Clock::now() >= next_) show(label, fraction);
    return !was_interrupted();
  };
}

void ProgressBar::show(const std::string& label, double fraction) {
  next_ = Clock::now() + kInterval;
  shown_ = true;
  const int filled = static_cast<int>(std::lround(std::clamp(fraction, 0.0, 1.0) * kBarWidth));
  const std::string bar = std::string(static_cast<std::size_t>(filled), '#') +
                          std::string(static_cast<std::size_t>(kBarWidth - filled), '.');
  std::fprintf(stderr, "\r%-8s [%s] %3d%%", label.c_str(), bar.c_str(), filled * 100 / kBarWidth);
  std::fflush(stderr);
}

namespace {

namespace fs = std::filesystem;

constexpr auto kTimeBetweenLooks = std::chrono::milliseconds(250);

void add_folder(const fs::path& folder, Stamps& stamps) {
  std::error_code code;
  for (fs::recursive_directory_iterator at(folder, fs::directory_options::skip_permission_denied, code);
       !code && at != fs::recursive_directory_iterator(); at.increment(code)) {
    std::error_code unknown;
    if (at->is_regular_file(unknown)) stamps[at->path().lexically_normal()] = FileStamp::of(at->path());
  }
}

Stamps stamps_of(const WatchedWork& work) {
  Stamps stamps = tool::stamps_of(work.read);
  for (const fs::path& path : work.written) stamps.erase(path.lexically_normal());
  return stamps;
}

/// Waits until the files differ from `known` and did not change for one interval, because a writer may be unfinished.
void wait_for_change(const WatchedWork& work, const Stamps& known) {
  Stamps last = known;
  while (!was_interrupted()) {
    std::this_thread::sleep_for(kTimeBetweenLooks);
    Stamps now = stamps_of(work);
    if (now != known && now == last) return;
    last = std::move(now);
  }
}

void report_watching(const WatchedWork& work) {
  if (is_quiet()) return;
  const std::string more = work.read.size() > 1 ? " and " + std::to_string(work.read.size() - 1) + " more" : "";
  std::fprintf(stderr, "quoin: watching %s%s; press Ctrl-C to stop\n", on_one_line(work.read.front().string()).c_str(),
               more.c_str());
}

}  // namespace

Stamps stamps_of(const std::vector<fs::path>& paths) {
  Stamps stamps;
  for (const fs::path& path : paths) {
    std::error_code unknown;
    if (fs::is_directory(path, unknown)) {
      add_folder(path, stamps);
    } else {
      stamps[path.lexically_normal()] = FileStamp::of(path);
    }
  }
  return stamps;
}

std::vector<fs::path> files_read(const fs::path& input, SidecarFiles allowed) {
  std::vector<fs::path> files = sidecar_files_of(input, allowed);
  files.insert(files.begin(), input);
  return files;
}

int watch(const std::vector<fs::path>& read, const std::function<WatchedWork()>& work) {
  catch_interrupts();
  bool is_first = true;
  WatchedWork done;
  done.read = read;
  while (!was_interrupted()) {
    // Taken before the run, so that changes during the run count, also for files that were read before.
    const Stamps before = stamps_of(done);
    done = work();
    if (is_first && done.status == kWrongUsage) return done.status;
    if (is_first) report_watching(done);
    is_first = false;
    Stamps known = stamps_of(done);
    for (auto& [path, stamp] : known) {
      if (const auto found = before.find(path); found != before.end()) stamp = found->second;
    }
    wait_for_change(done, known);
  }
  die_if_interrupted();
  return kDone;
}

}  // namespace quoin::tool
