#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "parse.h"

namespace quoin::tool {

/// Adds an option whose text is read after all options are parsed.
inline CLI::Option* add_text_option(CLI::App& command, const std::string& name, const std::string& type,
                                    const std::string& description) {
  return command.add_option(name, description)->type_name(type);
}

/// Parses the text of an option into `value` if the option was given. Returns a usage error, or "".
template <class Read, class Value>
std::string read_option(const CLI::App& command, const std::string& name, Read read, const std::string& must_be,
                        Value& value) {
  if (command.count(name) == 0) return "";
  const std::string text = command.get_option(name)->results().back();
  const auto found = read(text);
  if (!found) return name + ": must be " + must_be + ", not \"" + text + "\"";
  value = *found;
  return "";
}

inline std::optional<double> read_not_negative(const std::string& text) {
  const auto number = parse_number(text);
  return number && *number >= 0.0 ? number : std::nullopt;
}

inline std::optional<double> read_positive(const std::string& text) {
  const auto number = parse_number(text);
  return number && *number > 0.0 ? number : std::nullopt;
}

}  // namespace quoin::tool
