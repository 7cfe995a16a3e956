#include "interrupt.h"

#include <atomic>
#include <csignal>

namespace quoin::tool {

namespace {

std::atomic<int> caught_signal{0};
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler may touch nothing else");

extern "C" void note_signal(int signal) {
  caught_signal.store(signal, std::memory_order_relaxed);
  std::signal(signal, SIG_DFL);
}

}  // namespace

void catch_interrupts() {
  std::signal(SIGINT, note_signal);
  std::signal(SIGTERM, note_signal);
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

}  // namespace quoin::tool
