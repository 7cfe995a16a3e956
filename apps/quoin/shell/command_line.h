#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace quoin::tool {

/// An option or positional argument of a command.
struct OptionOfCommand {
  std::vector<std::string> names;  ///< with their dashes; for a positional argument its name
  std::string description;
  std::string value;                 ///< type of the value: "NAME", "WxH"; empty for a flag
  std::vector<std::string> choices;  ///< all allowed values; empty: any value
};

/// A command with its options and subcommands.
struct CommandOfTool {
  std::string path;  ///< "quoin generate terrain"
  std::string name;
  std::string description;
  std::string footer;
  std::vector<OptionOfCommand> options;
  std::vector<OptionOfCommand> positionals;
  std::vector<CommandOfTool> commands;
};

/// Describes `app` and its subcommands. `above`: path of the parent command.
[[nodiscard]] CommandOfTool describe(const CLI::App& app, const std::string& above = "");

/// Return scripts that complete command lines in a shell.
[[nodiscard]] std::string bash_completion(const CommandOfTool& tool);
[[nodiscard]] std::string zsh_completion(const CommandOfTool& tool);
[[nodiscard]] std::string fish_completion(const CommandOfTool& tool);

/// Returns the manual page in roff format.
[[nodiscard]] std::string man_page(const CommandOfTool& tool, const std::string& version);

}  // namespace quoin::tool
