#include "options/options.h"

#include <limits>

#include "commands.h"
#include "options/parse.h"
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

}  // namespace quoin::tool
