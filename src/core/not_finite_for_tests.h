#pragma once

#include <limits>

namespace quoin {

// Non-finite numbers for tests of functions that require finite ones.
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace quoin
