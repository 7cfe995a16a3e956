#pragma once

#include <charconv>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <quoin/core/assert.h>

namespace quoin::triangles {

/// Parses a decimal number, "nan" or "inf" that is the whole word.
[[nodiscard]] inline std::optional<double> number_in(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size() || word.empty()) return std::nullopt;
  // Too large or too small numbers are not finite.
  if (error == std::errc::result_out_of_range) return value;
  return error == std::errc() ? std::optional(value) : std::nullopt;
}

/// Reads the words of a text, separated by blanks and line ends. Lifetime: the text.
class Words {
 public:
  explicit Words(std::string_view text, std::size_t position = 0) : text_(text), at_(position) {
    QUOIN_ASSERT(position <= text.size(), "a position within the text");
  }

  [[nodiscard]] std::optional<std::string_view> next() {
    while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
    const std::size_t first = at_;
    while (at_ < text_.size() && !is_blank(text_[at_])) ++at_;
    if (first == at_) return std::nullopt;
    return text_.substr(first, at_ - first);
  }
  [[nodiscard]] std::optional<double> next_number() {
    const auto word = next();
    return word ? number_in(*word) : std::nullopt;
  }
  /// Returns the position where the search for the next word starts.
  [[nodiscard]] std::size_t position() const { return at_; }

 private:
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

  std::string_view text_;
  std::size_t at_;
};

}  // namespace quoin::triangles
