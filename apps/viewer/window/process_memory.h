#pragma once

// For the panel, and for tests that find leaks.

#include <fstream>

#include <unistd.h>

namespace quoin::viewer {

/// Returns the resident memory of this process, in 10^6 bytes; 0 if the system does not report it.
inline double resident_megabytes() {
  std::ifstream in("/proc/self/statm");
  long long total = 0;
  long long resident = 0;
  in >> total >> resident;
  return static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

}  // namespace quoin::viewer
