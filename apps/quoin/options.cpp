#include "options.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

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

namespace {

constexpr std::size_t kWidth = 100;
constexpr std::size_t kIndent = 28;
constexpr std::array kAlwaysShown = {heading::kInput, heading::kOutput, heading::kCamera,
                                     heading::kLight, heading::kMesh,   heading::kGeneral};
constexpr std::string_view kExample = "Example: ";

bool is_always_shown(const std::string& group) {
  return std::ranges::find(kAlwaysShown, group) != kAlwaysShown.end();
}

/// Returns the heading of an option: General for options that CLI11 adds.
std::string group_of(const CLI::Option& option) {
  return option.get_group() == "Options" ? heading::kGeneral : option.get_group();
}

/// Wraps words to kWidth columns. The first line starts in column `indent`; the others get that many spaces.
std::string wrapped(const std::string& text, std::size_t indent) {
  std::size_t column = indent;
  std::istringstream words(text);
  std::string out;
  std::string word;
  bool is_first = true;
  while (words >> word) {
    if (!is_first && column + 1 + word.size() > kWidth) {
      out += "\n" + std::string(indent, ' ');
      column = indent;
      is_first = true;
    }
    if (!is_first) out += ' ', ++column;
    out += word;
    column += word.size();
    is_first = false;
  }
  return out;
}

/// Formats a name and, in the second column, its description.
std::string entry(const std::string& name, const std::string& description) {
  std::string line = "  " + name;
  if (description.empty()) return line + "\n";
  line += line.size() + 2 > kIndent ? "\n" + std::string(kIndent, ' ') : std::string(kIndent - line.size(), ' ');
  return line + wrapped(description, kIndent) + "\n";
}

/// Returns the names and type of an option, as in "-o,--output FILE", without the choices and ranges from CLI11.
std::string name_of(const CLI::Option& option) {
  std::string name = option.get_positional() ? option.get_name(true, false) : option.get_name(false, true);
  std::ranges::replace(name, '{', ' ');
  name = name.substr(0, name.find(' '));
  const std::string type = value_type(option);
  return option.get_positional() || type.empty() ? name : name + " " + type;
}

class HelpFormatter : public CLI::FormatterBase {
 public:
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    const bool shows_all = mode != CLI::AppFormatMode::Normal;
    std::vector<std::string> examples;
    std::string notes;
    std::istringstream footer(app->get_footer());
    for (std::string line; std::getline(footer, line);) {
      if (line.starts_with(kExample)) {
        examples.push_back(line.substr(kExample.size()));
      } else {
        notes += wrapped(line, 0) + "\n";
      }
    }
    std::string out = app->get_description() + "\n\nUsage: " + (name.empty() ? app->get_name() : name);
    out += usage_of(*app) + "\n";
    if (!examples.empty()) out += std::string(kExample) + examples.front() + "\n";
    out += options_of(*app, shows_all) + commands_of(*app);
    if (!notes.empty()) out += "\n" + notes;
    if (examples.size() > 1) {
      out += "\nMore examples:\n";
      const std::size_t end = shows_all ? examples.size() : std::min(examples.size(), std::size_t{4});
      for (std::size_t i = 1; i < end; ++i) out += "  " + examples[i] + "\n";
      if (end < examples.size()) out += "  ... and more with --help-all\n";
    }
    return out;
  }

 private:
  static std::string usage_of(const CLI::App& app) {
    std::string out;
    const auto options = app.get_options([](const CLI::Option* option) { return option->nonpositional(); });
    if (!options.empty()) out += " [OPTIONS]";
    for (const CLI::Option* option : app.get_options([](const CLI::Option* o) { return o->get_positional(); })) {
      const bool is_list = option->get_items_expected_max() >= CLI::detail::expected_max_vector_size;
      const std::string its_name = name_of(*option) + (is_list ? "..." : "");
      out += option->get_required() ? " " + its_name : " [" + its_name + "]";
    }
    for (const CLI::Option* option : options) {
      if (option->get_required()) out += " " + name_of(*option);
    }
    if (!app.get_subcommands([](const CLI::App*) { return true; }).empty()) out += " COMMAND";
    return out;
  }

  static std::string options_of(const CLI::App& app, bool shows_all) {
    std::string out;
    std::string positionals;
    for (const CLI::Option* option : app.get_options([](const CLI::Option* o) { return o->get_positional(); })) {
      positionals += entry(name_of(*option), option->get_description());
    }
    if (!positionals.empty()) out += "\n" + positionals;
    std::vector<std::string> groups;
    for (const CLI::Option* option : app.get_options([](const CLI::Option* o) { return o->nonpositional(); })) {
      const std::string group = group_of(*option);
      if (std::ranges::find(groups, group) == groups.end()) groups.push_back(group);
    }
    // General options come last.
    std::ranges::stable_partition(groups, [](const std::string& group) { return group != heading::kGeneral; });
    std::string hidden;
    for (const std::string& group : groups) {
      const auto options = app.get_options(
          [&](const CLI::Option* option) { return group_of(*option) == group && option->nonpositional(); });
      if (group.empty() || options.empty()) continue;
      if (!shows_all && !is_always_shown(group)) {
        hidden += (hidden.empty() ? "" : "; ") + group;
        continue;
      }
      out += "\n" + group + ":\n";
      for (const CLI::Option* option : options) out += entry(name_of(*option), option->get_description());
    }
    if (!hidden.empty()) out += "\n" + wrapped("More options with --help-all: " + hidden + ".", 0) + "\n";
    return out;
  }

  static std::string commands_of(const CLI::App& app) {
    std::string out;
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
      out += entry(command->get_name(), command->get_description());
    }
    return out.empty() ? out : "\nCommands:\n" + out;
  }
};

}  // namespace

std::string value_type(const CLI::Option& option) {
  if (option.get_items_expected_max() == 0) return "";
  std::string type = option.get_type_name();
  type = type.substr(0, type.find(":{"));
  if (type.starts_with("INT") || type.starts_with("UINT")) return "N";
  if (type.starts_with("FLOAT")) return "X";
  if (type.starts_with("TEXT")) return "NAME";
  return type.empty() ? "VALUE" : type;
}

std::shared_ptr<CLI::FormatterBase> help_formatter() {
  return std::make_shared<HelpFormatter>();
}

}  // namespace quoin::tool
