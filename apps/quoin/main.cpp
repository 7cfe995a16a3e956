#include <CLI/CLI.hpp>
#include <exception>

#include "commands.h"
#include "output.h"

namespace quoin::tool {

void add_common_options(CLI::App& command, CommonOptions& options) {
  command.add_option("IN", options.input, "File to read")->required();
  command.add_flag("--hidden", options.load.hidden, "Include hidden layers and nodes");
  command.add_option("--frame", options.load.frame, "Animation frame to take (default 0)")
      ->check(CLI::NonNegativeNumber);
  command.add_flag("--json", options.json, "Print one JSON object instead of text");
  command.add_option("--threads", options.threads.count, "Threads to use (default: all)")->check(CLI::Range(1U, 1024U));
}

namespace {

int run(int argc, char** argv) {
  CLI::App app("Voxel worlds in, lit meshes out.", "quoin");
  app.set_version_flag("--version", "quoin " QUOIN_VERSION);
  app.require_subcommand(1);
  app.get_formatter()->column_width(28);
  int status = kDone;
  add_info_command(app, status);
  add_convert_command(app, status);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return app.exit(error);
    print_error(std::string(error.what()) + " (try --help)");
    return kWrongUsage;
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
