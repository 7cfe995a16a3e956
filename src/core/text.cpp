// Texts for people.

#include <quoin/core/result.h>
#include <quoin/core/thousands.h>

namespace quoin {

std::string to_string(const Error& error) {
  std::string text;
  if (!error.path.empty()) text += error.path + ": ";
  if (error.byte_offset.has_value()) text += "byte " + std::to_string(*error.byte_offset) + ": ";
  return text + error.message;
}

std::string with_thousands(std::int64_t number) {
  const std::string digits = std::to_string(number);
  const std::size_t first = number < 0 ? 1 : 0;
  std::string text;
  for (std::size_t at = 0; at < digits.size(); ++at) {
    if (at > first && (digits.size() - at) % 3 == 0) text += ',';
    text += digits[at];
  }
  return text;
}

}  // namespace quoin
