#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>

namespace quoin {

/// Parses all of `text` as a decimal integer; nullopt if it is not a number or does not fit.
[[nodiscard]] std::optional<std::int64_t> parse_integer(std::string_view text);

/// Parses all of `text` as a finite number, independent of the locale; nullopt if that fails.
[[nodiscard]] std::optional<float> parse_float(std::string_view text);

/// Parses exactly `out.size()` numbers separated by blanks. Returns false on failure; `out` is then unspecified.
[[nodiscard]] bool parse_floats(std::string_view text, std::span<float> out);

/// Returns the shortest text that `parse_float` maps to the same number.
[[nodiscard]] std::string to_text(float value);

[[nodiscard]] bool is_utf8(std::string_view text);

/// Returns `text` as valid UTF-8 on one line: bytes that are not UTF-8 become U+FFFD, control characters become blanks.
[[nodiscard]] std::string printable(std::string_view text);

/// The structure of a JSON text, known before a recursive parser builds anything. It need not be valid JSON.
struct JsonExtent {
  int depth = 0;                          ///< of nested brackets, outside strings
  std::size_t bytes_outside_strings = 0;  ///< with one byte per string
};

enum class JsonComments : bool { NotAllowed, Allowed };

/// Returns the extent of a text, outside comments (//, /* */) if they are allowed. Compare it with limits before
/// parsing: deep nesting overflows the stack of a recursive parser.
[[nodiscard]] JsonExtent json_extent(std::string_view text, JsonComments comments = JsonComments::NotAllowed);

/// Encodes bytes as base64 with padding (RFC 4648, section 4).
[[nodiscard]] std::string to_base64(std::span<const std::byte> bytes);

/// Decodes base64. Errors: BadFormat for text that `to_base64` does not produce, with the offset in `text`.
[[nodiscard]] Result<std::vector<std::byte>> from_base64(std::string_view text);

}  // namespace quoin
