#pragma once

#include <cstdlib>

namespace quoin {

/// Returns true in `./dev nightly`, whose tests go through more cases.
inline bool is_nightly() {
  return std::getenv("QUOIN_NIGHTLY") != nullptr;
}

/// Returns the number of cases of a slow test: `night` in `./dev nightly`, otherwise `day`.
inline int cases(int day, int night) {
  return is_nightly() ? night : day;
}

}  // namespace quoin
