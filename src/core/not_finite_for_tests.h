#pragma once

#include <limits>

namespace quoin {

// Numbers that tests try where finite ones are asked for.
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace quoin
