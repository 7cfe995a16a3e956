#include "run_control.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <utility>

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

}  // namespace quoin::tool
