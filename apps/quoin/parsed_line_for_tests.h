#pragma once

#include <string>

#include <CLI/CLI.hpp>

#include <quoin/core/result.h>

namespace quoin::tool {

/// A command line of one command, without the command's name, parsed and settled.
template <class Arguments>
struct ParsedLine {
  CLI::App command;
  Arguments arguments;
  std::string fault;  ///< the usage error, or ""

  ParsedLine(const std::string& line, void (*add_options)(CLI::App&, Arguments&)) {
    add_options(command, arguments);
    try {
      command.parse(line);
    } catch (const CLI::ParseError& error) {
      fault = error.what();
      return;
    }
    const Status fits = settle(command, arguments);
    if (!fits) fault = to_string(fits.error());
  }
};

}  // namespace quoin::tool
