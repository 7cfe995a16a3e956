#pragma once

#include <string_view>

/// The version of these headers; CMake reads it from here. Semantic versioning: before 1.0, a minor version may change
/// the API; a patch does not.
#define QUOIN_VERSION_MAJOR 0
#define QUOIN_VERSION_MINOR 1
#define QUOIN_VERSION_PATCH 0

#define QUOIN_QUOTE_EXPANDED(x) #x
#define QUOIN_QUOTE(x) QUOIN_QUOTE_EXPANDED(x)

namespace [[gnu::visibility("default")]] quoin {

/// Returns "MAJOR.MINOR.PATCH".
[[nodiscard]] constexpr std::string_view version() {
  return QUOIN_QUOTE(QUOIN_VERSION_MAJOR) "." QUOIN_QUOTE(QUOIN_VERSION_MINOR) "." QUOIN_QUOTE(QUOIN_VERSION_PATCH);
}

}  // namespace quoin

#undef QUOIN_QUOTE
#undef QUOIN_QUOTE_EXPANDED
