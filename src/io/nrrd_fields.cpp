#include "io/nrrd_fields.h"

#include <charconv>
#include <cmath>
#include <limits>

#include "io/text.h"

namespace quoin::nrrd {

namespace {

constexpr std::string_view kBlanks = " \t\r";

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

std::string key_of(std::string_view text) {
  std::string key;
  for (const char c : text) {
    if (kBlanks.find(c) == std::string_view::npos) key += lower(c);
  }
  return key;
}

tl::unexpected<Error> bad(std::string message, std::size_t at) {
  return fail(ErrorCode::BadFormat, std::move(message), {}, at);
}

Status add_line(std::string_view line, std::size_t at, Fields& fields) {
  if (line.front() == '#') return {};
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos || colon + 1 == line.size()) {
    return bad("the line " + quoted(line) + " is no field of a NRRD header", at);
  }
  if (line[colon + 1] == '=') return {};
  const Field field{trimmed(line.substr(colon + 1)), at};
  if (fields.all.emplace(key_of(line.substr(0, colon)), field).second) return {};
  return bad("the field " + quoted(line.substr(0, colon)) + " is there twice", at);
}

}  // namespace

const Field* Fields::find(std::string_view name) const {
  const auto found = all.find(name);
  return found == all.end() ? nullptr : &found->second;
}

std::string quoted(std::string_view text) {
  constexpr std::size_t kMost = 40;
  // Appended piece by piece: GCC 12 warns of what it makes of operator+ here.
  std::string shown = "\"";
  shown.append(printable(text.substr(0, kMost)));
  if (text.size() > kMost) shown.append("...");
  return shown.append("\"");
}

Result<Fields> split_header(std::string_view bytes) {
  Fields fields;
  // The first line is the magic number.
  std::size_t at = bytes.find('\n');
  while (at != std::string_view::npos && at + 1 < bytes.size()) {
    const std::size_t begin = at + 1;
    at = bytes.find('\n', begin);
    std::string_view line = bytes.substr(begin, at == std::string_view::npos ? at : at - begin);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty()) {
      fields.has_end = at != std::string_view::npos;
      fields.end = fields.has_end ? at + 1 : bytes.size();
      return fields;
    }
    if (auto status = add_line(line, begin, fields); !status) return tl::unexpected<Error>(status.error());
  }
  fields.end = bytes.size();
  return fields;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> words;
  for (std::size_t at = text.find_first_not_of(kBlanks); at != std::string_view::npos;) {
    const std::size_t end = text.find_first_of(kBlanks, at);
    words.push_back(text.substr(at, end == std::string_view::npos ? end : end - at));
    at = end == std::string_view::npos ? end : text.find_first_not_of(kBlanks, end);
  }
  return words;
}

std::string normalised(std::string_view text) {
  std::string words;
  for (const std::string_view word : words_of(text)) {
    if (!words.empty()) words += ' ';
    for (const char c : word) words += lower(c);
  }
  return words;
}

std::optional<double> parse_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<std::vector<std::vector<double>>> parse_vectors(std::string_view text) {
  std::vector<std::vector<double>> vectors;
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    if (text.starts_with("none")) {
      vectors.emplace_back();
      text.remove_prefix(4);
      continue;
    }
    const std::size_t close = text.find(')');
    if (text.front() != '(' || close == std::string_view::npos) return std::nullopt;
    std::string_view inner = text.substr(1, close - 1);
    std::vector<double>& vector = vectors.emplace_back();
    while (true) {
      const std::size_t comma = inner.find(',');
      const auto number = parse_number(trimmed(inner.substr(0, comma)));
      if (!number) return std::nullopt;
      vector.push_back(*number);
      if (comma == std::string_view::npos) break;
      inner.remove_prefix(comma + 1);
    }
    text.remove_prefix(close + 1);
  }
  return vectors;
}

}  // namespace quoin::nrrd
