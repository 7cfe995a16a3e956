#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include <quoin/version.h>

#include "commands.h"
#include "options.h"
#include "output.h"

namespace quoin::tool {

namespace {

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

/// Returns the choices in a type: {"front", "back"} for "TEXT:{front,back}".
std::vector<std::string> choices_in(const std::string& type) {
  const std::size_t begin = type.find('{');
  const std::size_t end = type.find('}', begin);
  std::vector<std::string> choices;
  if (begin == std::string::npos || end == std::string::npos) return choices;
  std::size_t at = begin + 1;
  while (at < end) {
    const std::size_t comma = std::min(type.find(',', at), end);
    choices.push_back(type.substr(at, comma - at));
    at = comma + 1;
  }
  return choices;
}

OptionOfCommand option_of(const CLI::Option& option) {
  OptionOfCommand out;
  for (const std::string& name : option.get_snames()) out.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) out.names.push_back("--" + name);
  if (out.names.empty()) out.names.push_back(option.get_name());
  out.description = option.get_description();
  if (option.get_items_expected_max() > 0) {
    out.value = value_type(option);
    out.choices = choices_in(option.get_type_name());
  }
  return out;
}

std::string joined(const std::vector<std::string>& words, const char* between) {
  std::string text;
  for (const std::string& word : words) text.append(text.empty() ? "" : between).append(word);
  return text;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size())) {
    text.replace(at, what.size(), by);
  }
  return text;
}

/// Returns "_quoin_generate_terrain" for "quoin generate terrain".
std::string function_name(const CommandOfTool& command) {
  return "_" + replaced(command.path, " ", "_");
}

std::vector<std::string> names_of_options(const CommandOfTool& command) {
  std::vector<std::string> names;
  for (const OptionOfCommand& option : command.options) {
    names.insert(names.end(), option.names.begin(), option.names.end());
  }
  return names;
}

std::vector<std::string> names_of_commands(const CommandOfTool& command) {
  std::vector<std::string> names;
  names.reserve(command.commands.size());
  for (const CommandOfTool& inner : command.commands) names.push_back(inner.name);
  return names;
}

/// Calls `use` for a command and all its subcommands.
template <class Use>
void for_each_command(const CommandOfTool& command, const Use& use) {
  use(command);
  for (const CommandOfTool& inner : command.commands) for_each_command(inner, use);
}

/// Describes `app` and its subcommands. `above`: path of the parent command.
CommandOfTool describe(const CLI::App& app, const std::string& above = "") {
  CommandOfTool command;
  command.name = app.get_name();
  command.path = above.empty() ? command.name : above + " " + command.name;
  command.description = app.get_description();
  command.footer = app.get_footer();
  for (const CLI::Option* option : app.get_options()) {
    (option->get_positional() ? command.positionals : command.options).push_back(option_of(*option));
  }
  for (const CLI::App* inner : app.get_subcommands([](const CLI::App*) { return true; })) {
    command.commands.push_back(describe(*inner, command.path));
  }
  return command;
}

/// The lines of the three case statements in the script.
struct BashCases {
  std::string walk;    // selects the command from the preceding words
  std::string values;  // completes the value of an option
  std::string words;   // lists the options and subcommands of a command
};

BashCases bash_cases(const CommandOfTool& tool) {
  BashCases cases;
  for_each_command(tool, [&](const CommandOfTool& command) {
    for (const CommandOfTool& inner : command.commands) {
      cases.walk += "      '" + command.path + " " + inner.name + "') command='" + inner.path + "' ;;\n";
    }
    for (const OptionOfCommand& option : command.options) {
      if (option.value.empty()) continue;
      std::vector<std::string> patterns;
      patterns.reserve(option.names.size());
      for (const std::string& name : option.names) patterns.push_back("'" + command.path + " " + name + "'");
      const std::string reply = option.choices.empty()
                                    ? ""
                                    : "COMPREPLY=($(compgen -W '" + joined(option.choices, " ") + "' -- \"$word\")); ";
      cases.values += "    " + joined(patterns, "|") + ") " + reply + "return ;;\n";
    }
    cases.words += "    '" + command.path + "') options='" + joined(names_of_options(command), " ") + "'; commands='" +
                   joined(names_of_commands(command), " ") + "' ;;\n";
  });
  return cases;
}

std::string bash_completion(const CommandOfTool& tool) {
  const BashCases cases = bash_cases(tool);
  return "# Completes quoin in bash: source <(quoin completions bash)\n"
         "_quoin() {\n"
         "  local word=${COMP_WORDS[COMP_CWORD]} command=quoin options= commands= i\n"
         "  for ((i = 1; i < COMP_CWORD; ++i)); do\n"
         "    case \"$command ${COMP_WORDS[i]}\" in\n" +
         cases.walk +
         "    esac\n"
         "  done\n"
         "  case \"$command ${COMP_WORDS[COMP_CWORD - 1]}\" in\n" +
         cases.values +
         "  esac\n"
         "  case $command in\n" +
         cases.words +
         "  esac\n"
         "  if [[ $word == -* ]]; then\n"
         "    COMPREPLY=($(compgen -W \"$options\" -- \"$word\"))\n"
         "  elif [[ -n $commands ]]; then\n"
         "    COMPREPLY=($(compgen -W \"$commands\" -- \"$word\"))\n"
         "  fi\n"
         "}\n"
         "complete -o default -F _quoin quoin\n";
}

/// Escapes text for single quotes and brackets in _arguments.
std::string zsh_text(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\'') {
      out += "'\\''";
      continue;
    }
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

std::string zsh_options(const CommandOfTool& command) {
  std::string text;
  for (const OptionOfCommand& option : command.options) {
    const std::string value = option.value.empty() ? ""
                              : option.choices.empty()
                                  ? ":" + zsh_text(option.value) + ":_files"
                                  : ":" + zsh_text(option.value) + ":(" + joined(option.choices, " ") + ")";
    const std::string rest = "[" + zsh_text(option.description) + "]" + value + "' \\\n";
    for (const std::string& name : option.names) text.append("    '").append(name).append(rest);
  }
  return text;
}

std::string zsh_completion(const CommandOfTool& tool) {
  std::string functions;
  for_each_command(tool, [&](const CommandOfTool& command) {
    functions += function_name(command) + "() {\n";
    if (command.commands.empty()) {
      functions += "  _arguments \\\n" + zsh_options(command) + "    '*:file:_files'\n}\n";
      return;
    }
    functions += "  local state line\n  _arguments -C \\\n" + zsh_options(command) +
                 "    '1:command:->command' '*::argument:->argument'\n"
                 "  case $state in\n"
                 "    command)\n"
                 "      local -a commands=(\n";
    for (const CommandOfTool& inner : command.commands) {
      functions += "        '" + inner.name + ":" + zsh_text(inner.description) + "'\n";
    }
    functions += "      )\n      _describe command commands ;;\n    argument)\n      case $line[1] in\n";
    for (const CommandOfTool& inner : command.commands) {
      functions += "        " + inner.name + ") " + function_name(inner) + " ;;\n";
    }
    functions += "      esac ;;\n  esac\n}\n";
  });
  return "#compdef quoin\n# Completes quoin in zsh: source <(quoin completions zsh), or a file _quoin in $fpath\n" +
         functions + "if [[ $funcstack[1] == _quoin ]]; then\n  _quoin \"$@\"\nelse\n  compdef _quoin quoin\nfi\n";
}

std::string fish_completion(const CommandOfTool& tool) {
  const auto quoted = [](const std::string& text) {
    return "'" + replaced(replaced(text, "\\", "\\\\"), "'", "\\'") + "'";
  };
  std::string text = "# Completes quoin in fish: quoin completions fish | source\n";
  for_each_command(tool, [&](const CommandOfTool& command) {
    const bool is_tool = command.path == tool.path;
    const std::string here = is_tool ? "__fish_use_subcommand" : "__fish_seen_subcommand_from " + command.name;
    for (const CommandOfTool& inner : command.commands) {
      const std::string unless =
          is_tool ? here : here + "; and not __fish_seen_subcommand_from " + joined(names_of_commands(command), " ");
      text +=
          "complete -c quoin -n " + quoted(unless) + " -f -a " + inner.name + " -d " + quoted(inner.description) + "\n";
    }
    for (const OptionOfCommand& option : command.options) {
      text += "complete -c quoin -n " + quoted(here);
      for (const std::string& name : option.names) {
        text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      }
      if (!option.choices.empty()) {
        text += " -x -a " + quoted(joined(option.choices, " "));
      } else if (!option.value.empty()) {
        text += " -r";
      }
      text += " -d " + quoted(option.description) + "\n";
    }
  });
  return text;
}

/// Escapes text so that roff takes no line for a request.
std::string roff(const std::string& text) {
  std::string out = replaced(replaced(text, "\\", "\\e"), "-", "\\-");
  if (out.starts_with('.') || out.starts_with('\'')) out.insert(0, "\\&");
  return replaced(replaced(out, "\n.", "\n\\&."), "\n'", "\n\\&'");
}

std::string man_synopsis(const CommandOfTool& command) {
  std::string text = ".B " + roff(command.path) + "\n";
  if (!command.options.empty()) text += "[\\fIoptions\\fR]\n";
  for (const OptionOfCommand& positional : command.positionals) text += "\\fI" + roff(positional.names[0]) + "\\fR\n";
  return text;
}

void add_options(const std::vector<OptionOfCommand>& options, std::string& text) {
  for (const OptionOfCommand& option : options) {
    text += ".TP\n\\fB" + roff(joined(option.names, ", ")) + "\\fR";
    if (!option.value.empty() && option.names[0].starts_with('-')) text += " \\fI" + roff(option.value) + "\\fR";
    text += "\n" + roff(option.description) + "\n";
    if (!option.choices.empty()) text += ".br\nOne of: " + roff(joined(option.choices, ", ")) + "\n";
  }
}

/// Returns the manual page in roff format.
std::string man_page(const CommandOfTool& tool, const std::string& version) {
  std::string text = ".TH QUOIN 1 \"\" \"quoin " + roff(version) + "\" \"User Commands\"\n.SH NAME\nquoin \\- " +
                     roff(tool.description) + "\n.SH SYNOPSIS\n";
  for_each_command(tool, [&](const CommandOfTool& command) {
    if (command.commands.empty()) text += man_synopsis(command) + ".br\n";
  });
  text += ".SH OPTIONS\n";
  add_options(tool.options, text);
  text += ".SH COMMANDS\n";
  for_each_command(tool, [&](const CommandOfTool& command) {
    if (&command == &tool) return;
    text += ".SS " + roff(command.path) + "\n" + roff(command.description) + ".\n";
    add_options(command.positionals, text);
    add_options(command.options, text);
    if (!command.footer.empty()) text += ".PP\n.nf\n" + roff(command.footer) + "\n.fi\n";
  });
  return text +
         ".SH EXIT STATUS\n.TP\n0\nSuccess.\n.TP\n1\nFailure: a file could not be read, written or rendered. Standard "
         "error "
         "gives the reason.\n.TP\n2\nThe command line is invalid.\n";
}

}  // namespace

void add_shell_commands(CLI::App& app, int& status) {
  CLI::App* completions = app.add_subcommand("completions", "Print a script that completes command lines in a shell");
  const auto shell = std::make_shared<std::string>();
  completions->add_option("SHELL", *shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  completions->footer(
      "Example: quoin completions bash > ~/.local/share/bash-completion/completions/quoin\n"
      "Example: quoin completions zsh > ~/.zfunc/_quoin\n"
      "Example: quoin completions fish > ~/.config/fish/completions/quoin.fish");
  completions->callback([&app, shell, &status] {
    const CommandOfTool tool = describe(app);
    status = print(*shell == "bash"  ? bash_completion(tool)
                   : *shell == "zsh" ? zsh_completion(tool)
                                     : fish_completion(tool));
  });
  CLI::App* man = app.add_subcommand("man", "Print the manual page, in roff");
  man->footer("Example: quoin man > ~/.local/share/man/man1/quoin.1");
  man->callback([&app, &status] { status = print(man_page(describe(app), std::string(version()))); });
}

}  // namespace quoin::tool
