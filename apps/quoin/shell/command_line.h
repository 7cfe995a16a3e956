#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace quoin::tool {

/// An option of a command, as its help has it.
struct OptionOfCommand {
  std::vector<std::string> names;  ///< with their dashes; of what is no option its name
  std::string description;
  std::string value;                 ///< what follows: "TEXT", "WIDTHxHEIGHT"; empty for a flag
  std::vector<std::string> choices;  ///< all that may follow; empty: anything
};

/// A command and what can be said with it.
struct CommandOfTool {
  std::string path;  ///< "quoin generate terrain"
  std::string name;
  std::string description;
  std::string footer;
  std::vector<OptionOfCommand> options;
  std::vector<OptionOfCommand> positionals;
  std::vector<CommandOfTool> commands;
};

/// All that `app` takes.
[[nodiscard]] CommandOfTool describe(const CLI::App& app, const std::string& above = "");

/// Scripts that complete the tool's command lines.
[[nodiscard]] std::string bash_completion(const CommandOfTool& tool);
[[nodiscard]] std::string zsh_completion(const CommandOfTool& tool);
[[nodiscard]] std::string fish_completion(const CommandOfTool& tool);

/// A page for `man`, in roff.
[[nodiscard]] std::string man_page(const CommandOfTool& tool, const std::string& version);

}  // namespace quoin::tool
