#include <quoin/version.h>

#include <memory>
#include <string>

#include "commands.h"
#include "output.h"
#include "shell/command_line.h"

namespace quoin::tool {

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
