#include <quoin/core/result.h>

namespace quoin {

std::string to_string(const Error& error) {
  std::string text;
  if (!error.path.empty()) text += error.path + ": ";
  if (error.byte_offset.has_value()) text += "byte " + std::to_string(*error.byte_offset) + ": ";
  return text + error.message;
}

}  // namespace quoin
