#include "io/obj_lines.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>

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

constexpr std::size_t kMostDigits = 40;

/// Writes what the corners of voxels are mostly, whole and half numbers, as std::to_chars does; null for other ones.
/// From 100,000 on that may choose an exponent.
char* write_halves(double value, char* out) {
  constexpr double kMost = 99'999.0;
  if (!(value >= -kMost && value <= kMost)) return nullptr;
  const auto halves = static_cast<std::int32_t>(value * 2.0);
  if (static_cast<double>(halves) != value * 2.0) return nullptr;
  if (halves < 0) *out++ = '-';
  const auto size = static_cast<std::uint32_t>(halves < 0 ? -halves : halves);
  out = std::to_chars(out, out + kMostDigits, size / 2).ptr;
  if (size % 2 != 0) {
    *out++ = '.';
    *out++ = '5';
  }
  return out;
}

char* write_number(double value, char* out) {
  if (char* end = write_halves(value, out)) return end;
  const double rounded = std::round(value * 1e6) / 1e6 + 0.0;
  return std::to_chars(out, out + kMostDigits, rounded).ptr;
}

}  // namespace

void ObjLines::index(std::uint64_t value) {
  char* room = out_.room(kMostDigits);
  out_.advance(std::to_chars(room, room + kMostDigits, value).ptr);
}

void ObjLines::number(double value) {
  char* room = out_.room(kMostDigits);
  out_.advance(write_number(value, room));
}

std::string ObjLines::text_of(double value) {
  std::array<char, kMostDigits> room{};
  return {room.data(), write_number(value, room.data())};
}

void ObjLines::number(double value, int digits) {
  char* room = out_.room(kMostDigits);
  out_.advance(std::to_chars(room, room + kMostDigits, value + 0.0, std::chars_format::general, digits).ptr);
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
