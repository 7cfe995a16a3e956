#include "options/parse.h"

#include <charconv>
#include <cmath>
#include <system_error>

namespace quoin::tool {

namespace {

template <class Number>
std::optional<Number> parse_all(std::string_view text) {
  Number value{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}

/// Parses three values with separators between them. `read` parses one value.
template <class Triple, class Read>
std::optional<Triple> parse_three(std::string_view text, char separator, Read read) {
  Triple triple{0};
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t end = axis < 2 ? text.find(separator) : text.size();
    if (end == std::string_view::npos) return std::nullopt;
    const auto value = read(text.substr(0, end));
    if (!value) return std::nullopt;
    triple[axis] = *value;
    text.remove_prefix(axis < 2 ? end + 1 : end);
  }
  return triple;
}

}  // namespace

std::optional<double> parse_number(std::string_view text) {
  const auto value = parse_all<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<std::uint64_t> parse_unsigned(std::string_view text) {
  return parse_all<std::uint64_t>(text);
}

std::optional<DVec3> parse_triple(std::string_view text) {
  return parse_three<DVec3>(text, ',', parse_number);
}

std::optional<ImageSize> parse_size(std::string_view text) {
  const std::size_t cross = text.find('x');
  if (cross == std::string_view::npos) return std::nullopt;
  const auto width = parse_all<int>(text.substr(0, cross));
  const auto height = parse_all<int>(text.substr(cross + 1));
  if (!width || !height || *width <= 0 || *height <= 0) return std::nullopt;
  return ImageSize{*width, *height};
}

std::optional<IVec3> parse_box_size(std::string_view text) {
  return parse_three<IVec3>(text, 'x', parse_all<int>);
}

}  // namespace quoin::tool
