#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>

namespace quoin::nrrd {

/// What follows the colon of a field, and where in the file.
struct Field {
  std::string_view text;
  std::size_t at = 0;
};

/// The fields of a header by their names in lower case without blanks ("spacedirections"), which views `bytes`.
struct Fields {
  std::map<std::string, Field, std::less<>> all;
  std::size_t end = 0;   ///< behind the empty line that ends the header
  bool has_end = false;  ///< whether there is such a line

  /// Null when the header has no such field.
  [[nodiscard]] const Field* find(std::string_view name) const;
};

/// Splits a header into its fields; comments and keys with values of their own are left out.
/// Errors: BadFormat for lines that are neither, and for fields that are there twice.
[[nodiscard]] Result<Fields> split_header(std::string_view bytes);

/// `text`, or as much of it as a message can hold, on one line between quotation marks.
[[nodiscard]] std::string quoted(std::string_view text);
/// `text` without blanks at its ends.
[[nodiscard]] std::string_view trimmed(std::string_view text);
/// In lower case, with one blank between words.
[[nodiscard]] std::string normalised(std::string_view text);
/// The words between blanks.
[[nodiscard]] std::vector<std::string_view> words_of(std::string_view text);
/// A finite number, "nan" or an infinity, in any case; nothing when `text` is neither.
[[nodiscard]] std::optional<double> parse_number(std::string_view text);

/// A list of vectors as "(1,0,0) none (0,0,2.5)": as many numbers as each has, none for "none". Nothing when it is
/// none.
[[nodiscard]] std::optional<std::vector<std::vector<double>>> parse_vectors(std::string_view text);

}  // namespace quoin::nrrd
