#include "options.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

#include "commands.h"
#include "output.h"

namespace quoin::tool {

namespace {

constexpr const char* kNotTogether = " cannot be used together";

}  // namespace

TextParser<double> number() {
  return {parse_number, "a number"};
}

TextParser<double> number_from_0() {
  return {number_between(0.0, std::numeric_limits<double>::max(), "").parse, "a number of at least 0"};
}

TextParser<double> number_between(double least, double most, std::string range) {
  const auto parse = [least, most](const std::string& text) {
    const auto value = parse_number(text);
    return value && *value >= least && *value <= most ? value : std::nullopt;
  };
  return {parse, std::move(range)};
}

std::vector<std::string> given_options(const CLI::App& command, const std::vector<std::string>& options) {
  std::vector<std::string> given;
  for (const std::string& name : options) {
    if (name.starts_with('-')) {
      if (command.count(name) > 0) given.push_back(name);
      continue;
    }
    for (const CLI::Option* option : command.get_options()) {
      if (option->get_group() == name && option->count() > 0) given.push_back(option->get_name());
    }
  }
  return given;
}

Reason needs(std::string setting, std::function<bool()> is_set) {
  return [setting = std::move(setting), is_set = std::move(is_set)](const CLI::App&) {
    return is_set() ? "" : " needs " + setting;
  };
}

Reason needs(std::string option) {
  return [option = std::move(option)](const CLI::App& command) {
    return command.count(option) > 0 ? "" : " needs " + option;
  };
}

Reason excludes(std::string setting, std::function<bool()> is_set) {
  return [setting = std::move(setting), is_set = std::move(is_set)](const CLI::App&) {
    return is_set() ? " and " + setting + kNotTogether : "";
  };
}

Reason excludes(std::vector<std::string> others) {
  return [others = std::move(others)](const CLI::App& command) {
    for (const std::string& other : others) {
      if (command.count(other) > 0) return " and " + other + kNotTogether;
    }
    return std::string();
  };
}

Status check_rules(const CLI::App& command, const std::vector<OptionRule>& rules) {
  for (const OptionRule& rule : rules) {
    for (const std::string& option : given_options(command, rule.options)) {
      if (std::ranges::count(rule.except, option) > 0) continue;
      const std::string reason = rule.reason(command);
      if (!reason.empty()) return make_error(ErrorCode::InvalidArgument, option + reason);
    }
  }
  return {};
}

int wrong_usage(const Error& error) {
  print_error(to_string(error) + " (try --help)");
  return kWrongUsage;
}

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
