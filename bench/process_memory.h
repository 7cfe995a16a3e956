#pragma once

#include <cstdlib>
#include <fstream>
#include <string>
#include <string_view>

// The memory of this process, for counters of benchmarks.

namespace quoin {

// Returns a figure of /proc/self/status in MB; 0 if the system has none.
inline double status_megabytes(std::string_view name) {
  std::ifstream in("/proc/self/status");
  std::string line;
  while (std::getline(in, line)) {
    if (line.starts_with(name)) return std::strtod(line.c_str() + name.size() + 1, nullptr) * 1024.0 / 1e6;
  }
  return 0.0;
}

// Lets VmHWM start again from the present memory.
inline void reset_peak() {
  std::ofstream("/proc/self/clear_refs") << 5;
}

}  // namespace quoin
