#pragma once

#include <cstddef>
#include <string_view>

namespace quoin {

/// The structure of a JSON text, known before a recursive parser builds anything. It need not be valid JSON.
struct JsonExtent {
  int depth = 0;                          ///< of nested brackets, outside strings
  std::size_t bytes_outside_strings = 0;  ///< with one byte per string
};

/// Returns the extent of a text. Compare it with limits before parsing: deep nesting overflows the stack of a recursive
/// parser.
[[nodiscard]] JsonExtent json_extent(std::string_view text);

}  // namespace quoin
