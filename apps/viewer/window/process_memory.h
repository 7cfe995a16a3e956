#pragma once

// For the panel, and for tests of what is left behind.

#include <fstream>

#include <unistd.h>

namespace quoin::viewer {

/// The memory of this process that is in RAM, in 10^6 bytes; 0 where the system does not say.
inline double resident_megabytes() {
  std::ifstream in("/proc/self/statm");
  long long total = 0;
  long long resident = 0;
  in >> total >> resident;
  return static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

}  // namespace quoin::viewer
