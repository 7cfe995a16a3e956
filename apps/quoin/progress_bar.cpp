#include "progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "interrupt.h"
#include "output.h"

namespace quoin::tool {

namespace {

constexpr int kWidth = 40;
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
  const int filled = static_cast<int>(std::lround(std::clamp(fraction, 0.0, 1.0) * kWidth));
  const std::string bar =
      std::string(static_cast<std::size_t>(filled), '#') + std::string(static_cast<std::size_t>(kWidth - filled), '.');
  std::fprintf(stderr, "\r%-8s [%s] %3d%%", label.c_str(), bar.c_str(), filled * 100 / kWidth);
  std::fflush(stderr);
}

}  // namespace quoin::tool
