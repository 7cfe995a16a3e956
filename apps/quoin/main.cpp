#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <sstream>
#include <string>
#include <vector>

#include <quoin/version.h>

#include "commands.h"
#include "options.h"
#include "output.h"
#include "run_control.h"

namespace quoin::tool {

namespace {

using Arguments = std::vector<std::string>;

std::string command_names(const CLI::App& app) {
  std::string names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    names += (names.empty() ? "" : ", ") + command->get_name();
  }
  return names;
}

/// Returns the first argument that starts with a dash but is neither an option of `command` nor a number, or "".
std::string unknown_option(const CLI::App& command, const Arguments& arguments) {
  for (const std::string& argument : arguments) {
    if (argument == "--") break;
    if (argument.size() < 2 || argument[0] != '-' ||
        std::string("0123456789.").find(argument[1]) != std::string::npos) {
      continue;
    }
    if (command.get_option_no_throw(argument.substr(0, argument.find('='))) == nullptr) return argument;
  }
  return "";
}

/// Returns the innermost parsed subcommand.
const CLI::App& innermost(CLI::App& command) {
  const auto chosen = command.get_subcommands();
  return chosen.empty() ? command : innermost(*chosen[0]);
}

/// Returns the message of a usage error; replaces unclear messages of CLI11.
std::string usage_error(CLI::App& app, const CLI::ParseError& error, const Arguments& arguments) {
  const auto chosen = app.get_subcommands();
  if (chosen.empty() && arguments.empty()) return "missing command; use one of: " + command_names(app);
  if (chosen.empty() && !arguments[0].starts_with('-')) {
    return "unknown command \"" + arguments[0] + "\"; use one of: " + command_names(app);
  }
  const auto code = static_cast<CLI::ExitCodes>(error.get_exit_code());
  if (code == CLI::ExitCodes::ExtrasError || code == CLI::ExitCodes::RequiredError) {
    const std::string unknown = unknown_option(chosen.empty() ? app : innermost(*chosen[0]), arguments);
    if (unknown.starts_with("--") || (chosen.empty() && !unknown.empty())) return "unknown option \"" + unknown + "\"";
    if (!unknown.empty()) return "unknown option \"" + unknown + "\"; for a file with this name use ./" + unknown;
  }
  if (!chosen.empty()) {
    const CLI::App& command = innermost(*chosen[0]);
    const std::string inner = command_names(command);
    if (!inner.empty()) return command.get_name() + " needs one of: " + inner;
  }
  const std::string message = error.what();
  if (code == CLI::ExitCodes::RequiredError && message.starts_with("--output")) return "-o OUT is required";
  const std::size_t end = message.find(": 1 required ");
  if (code == CLI::ExitCodes::ArgumentMismatch && end != std::string::npos && !chosen.empty()) {
    const std::string name = message.substr(0, end);
    const CLI::Option* option = innermost(*chosen[0]).get_option_no_throw(name);
    if (option != nullptr) return name + " needs a value: " + value_type(*option);
  }
  return message;
}

/// Returns the arguments with "-.5" written as "-0.5", because CLI11 takes "-.5" for an option.
Arguments readable_arguments(int argc, char** argv) {
  Arguments arguments(argv + std::min(argc, 1), argv + argc);
  for (std::string& argument : arguments) {
    const bool is_fraction =
        argument.starts_with("-.") && argument.size() > 2 && argument[2] >= '0' && argument[2] <= '9';
    if (is_fraction) argument.insert(1, "0");
  }
  return arguments;
}

/// Prints the text of --help or --version.
int print_answer(const CLI::App& app, const CLI::ParseError& request) {
  std::ostringstream text;
  app.exit(request, text, text);
  return print(text.str());
}

int run(int argc, char** argv) {
  let_writes_fail();
  CLI::App app("Converts, renders and edits voxel worlds.", "quoin");
  app.formatter(help_formatter());
  set_heading(app, heading::kGeneral);
  app.set_help_flag("-h,--help", "Print help and exit");
  app.set_help_all_flag("--help-all", "Print help with all options and exit");
  app.set_version_flag("--version", "quoin " + std::string(version()), "Print the version and exit");
  app.require_subcommand(1);
  app.footer("Example: quoin convert castle.vox castle.glb\n`quoin COMMAND --help` prints the help of a command.");
  int status = kDone;
  add_info_command(app, status);
  add_convert_command(app, status);
  add_render_command(app, status);
  add_thumbnail_command(app, status);
  add_generate_command(app, status);
  add_view_command(app, status);
  add_map_command(app, status);
  add_world_command(app, status);
  add_shell_commands(app, status);
  const Arguments arguments = readable_arguments(argc, argv);
  try {
    app.parse(Arguments(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return print_answer(app, error);
    return wrong_usage({ErrorCode::InvalidArgument, usage_error(app, error, arguments), {}, {}});
  }
  return status;
}

}  // namespace

}  // namespace quoin::tool

int main(int argc, char** argv) {
  try {
    return quoin::tool::run(argc, argv);
  } catch (const std::bad_alloc&) {
    quoin::tool::print_error("out of memory");
  } catch (const std::exception& error) {
    quoin::tool::print_error(error.what());
  }
  return quoin::tool::kFailed;
}
