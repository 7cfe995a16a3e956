#include "core/bytes/json_extent.h"

#include <algorithm>

namespace quoin {

JsonExtent json_extent(std::string_view text) {
  JsonExtent extent;
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    extent.bytes_outside_strings += in_string ? 0 : 1;
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      extent.depth = std::max(extent.depth, ++depth);
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return extent;
}

}  // namespace quoin
