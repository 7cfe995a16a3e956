#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>

namespace quoin::tool {

/// Headings of options in `--help`. `--help-all` also prints the options under the others.
namespace heading {
inline constexpr const char* kInput = "Input";
inline constexpr const char* kOutput = "Output";
inline constexpr const char* kGeneral = "General";
inline constexpr const char* kCamera = "Camera";
inline constexpr const char* kLight = "Light";
inline constexpr const char* kMesh = "Meshes";
// Only in --help-all.
inline constexpr const char* kSeries = "Image series and videos";
inline constexpr const char* kOcclusion = "Ambient occlusion";
inline constexpr const char* kPathTracing = "Path tracing (--light path)";
inline constexpr const char* kDetail = "Levels of detail";
inline constexpr const char* kDevice = "Graphics device";
inline constexpr const char* kMeshFile = "Mesh files";
inline constexpr const char* kManyFiles = "Many files (--to)";
inline constexpr const char* kWorlds = "Minecraft and Luanti worlds";
inline constexpr const char* kVolumes = "Volumes";
inline constexpr const char* kTriangles = "Triangle meshes as input (.obj, .glb, .gltf, .ply, .stl, .3mf, .off)";
inline constexpr const char* kHeights = "Heights";
}  // namespace heading

/// Sets the heading of all options added to the command from now on.
inline void set_heading(CLI::App& command, const char* name) {
  command.option_defaults()->group(name);
}

/// Returns the type of an option's value in help texts, such as "N", "X", "NAME" or "FILE". Empty for a flag.
[[nodiscard]] std::string value_type(const CLI::Option& option);

/// Prints help with an example first, options under headings, and lines of at most 100 columns.
[[nodiscard]] std::shared_ptr<CLI::FormatterBase> help_formatter();

/// Parses the text of an option into a value.
template <class T>
struct TextParser {
  std::function<std::optional<T>(const std::string&)> parse;  ///< returns nullopt for invalid text
  std::string must_be;                                        ///< for messages: "a number of at least 0"
};

/// Parses finite numbers of any size, of at least 0, or from `least` to `most`, which `range` names in messages.
[[nodiscard]] TextParser<double> number();
[[nodiscard]] TextParser<double> number_from_0();
[[nodiscard]] TextParser<double> number_between(double least, double most, std::string range);

/// Adds an option whose value CLI11 cannot parse, and passes the value to `set`.
/// Usage error for invalid text: `NAME: must be MUST_BE, not "TEXT"`.
template <class T>
CLI::Option* add_parsed(CLI::App& command, const std::string& name, const std::string& type, TextParser<T> parser,
                        std::type_identity_t<std::function<void(const T&)>> set, const std::string& help) {
  const auto read = [name, parser = std::move(parser), set = std::move(set)](const std::string& text) {
    const std::optional<T> value = parser.parse(text);
    if (!value) throw CLI::ValidationError(name, "must be " + parser.must_be + ", not \"" + text + "\"");
    set(*value);
  };
  return command.add_option_function<std::string>(name, read, help)->type_name(type);
}
/// Assigns the value to `target`.
template <class T, class Target>
  requires std::is_assignable_v<Target&, const T&>
CLI::Option* add_parsed(CLI::App& command, const std::string& name, const std::string& type, TextParser<T> parser,
                        Target& target, const std::string& help) {
  std::function<void(const T&)> assign = [&target](const T& value) { target = value; };
  return add_parsed<T>(command, name, type, std::move(parser), std::move(assign), help);
}

/// The names of the values that an option accepts, in the order of the help.
template <class T>
using Choices = std::vector<std::pair<std::string, T>>;

/// Adds an option that accepts one of a few names, and passes the value of the name to `set`.
template <class T>
CLI::Option* add_choice(CLI::App& command, const std::string& name, const Choices<T>& choices,
                        std::type_identity_t<std::function<void(const T&)>> set, const std::string& help) {
  std::vector<std::string> names;
  for (const auto& choice : choices) names.push_back(choice.first);
  const auto read = [choices, set = std::move(set)](const std::string& text) {
    set(std::ranges::find(choices, text, &std::pair<std::string, T>::first)->second);
  };
  return command.add_option_function<std::string>(name, read, help)->check(CLI::IsMember(names));
}
/// Assigns the value to `target`.
template <class T, class Target>
  requires std::is_assignable_v<Target&, const T&>
CLI::Option* add_choice(CLI::App& command, const std::string& name, const Choices<T>& choices, Target& target,
                        const std::string& help) {
  std::function<void(const T&)> assign = [&target](const T& value) { target = value; };
  return add_choice<T>(command, name, choices, std::move(assign), help);
}

/// Returns the given options among `options`, as messages name them. A heading stands for all options under it.
[[nodiscard]] std::vector<std::string> given_options(const CLI::App& command, const std::vector<std::string>& options);

/// Returns the end of a message that begins with the name of a given option (" needs --light path"), or "" if the
/// option can be used.
using Reason = std::function<std::string(const CLI::App& command)>;

/// A rule between the options of a command.
struct OptionRule {
  std::vector<std::string> options;   ///< names, or headings for all options under them
  Reason reason;                      ///< called for each of these options that was given
  std::vector<std::string> except{};  ///< options under the headings without this rule
};

/// The options need a setting, for example "--light path".
[[nodiscard]] Reason needs(std::string setting, std::function<bool()> is_set);
/// The options need another option.
[[nodiscard]] Reason needs(std::string option);
/// The options and a setting cannot be used together.
[[nodiscard]] Reason excludes(std::string setting, std::function<bool()> is_set);
/// The options and each of `others` cannot be used together.
[[nodiscard]] Reason excludes(std::vector<std::string> others);

/// Checks the given options of a parsed command line. Errors: InvalidArgument, for the first broken rule.
[[nodiscard]] Status check_rules(const CLI::App& command, const std::vector<OptionRule>& rules);

/// Prints a usage error and returns the exit status.
[[nodiscard]] int wrong_usage(const Error& error);

/// Parses all of `text` as a finite number, independent of the locale. Returns nullopt if it is not one.
[[nodiscard]] std::optional<double> parse_number(std::string_view text);

/// Parses all of `text` as a whole number of at least 0.
[[nodiscard]] std::optional<std::uint64_t> parse_unsigned(std::string_view text);

/// Parses three finite numbers: "x,y,z".
[[nodiscard]] std::optional<DVec3> parse_triple(std::string_view text);

/// Width and height of an image.
struct ImageSize {
  int width = 0;
  int height = 0;
};

/// Parses two positive whole numbers: "1280x720".
[[nodiscard]] std::optional<ImageSize> parse_size(std::string_view text);

/// Parses three whole numbers: "4x2x4".
[[nodiscard]] std::optional<IVec3> parse_box_size(std::string_view text);

}  // namespace quoin::tool
