#pragma once

#include <cstdint>
#include <string>

namespace [[gnu::visibility("default")]] quoin {

/// Formats a number with thousands separators for people: "1,234,567".
[[nodiscard]] std::string with_thousands(std::int64_t number);

}  // namespace quoin
