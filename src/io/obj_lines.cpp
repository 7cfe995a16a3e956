#include "io/obj_lines.h"

#include <array>
#include <charconv>
#include <cmath>

namespace quoin {

namespace {

/// Names in a line-based format: control characters and spaces become '_'.
std::string one_word(const std::string& name) {
  std::string word = name;
  for (char& c : word) {
    if (static_cast<unsigned char>(c) <= ' ' || c == '\x7F') c = '_';
  }
  return word;
}

}  // namespace

void ObjLines::index(std::uint64_t value) {
  std::array<char, 24> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  out_.put_text({digits.data(), end});
}

void ObjLines::number(double value) {
  std::array<char, 40> digits{};
  const double rounded = std::round(value * 1e6) / 1e6 + 0.0;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), rounded).ptr;
  out_.put_text({digits.data(), end});
}

void ObjLines::number(double value, int digits) {
  std::array<char, 40> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value + 0.0, std::chars_format::general, digits).ptr;
  out_.put_text({text.data(), end});
}

void ObjLines::triple(std::string_view keyword, const DVec3& v, int digits) {
  out_.put_text(keyword);
  for (int axis = 0; axis < 3; ++axis) {
    out_.put(' ');
    if (digits == 0) {
      number(v[axis]);
    } else {
      number(v[axis], digits);
    }
  }
}

void ObjLines::object(const std::string& name) {
  std::string word = one_word(name);
  if (word.empty()) word = "object";
  std::string unique = word;
  for (int n = 2; !names_.insert(unique).second; ++n) unique = word + "_" + std::to_string(n);
  out_.put_text("o " + unique + "\n");
}

}  // namespace quoin
