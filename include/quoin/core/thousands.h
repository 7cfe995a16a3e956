#pragma once

#include <cstdint>
#include <string>

namespace quoin {

/// "1,234,567", for a person.
[[nodiscard]] std::string with_thousands(std::int64_t number);

}  // namespace quoin
