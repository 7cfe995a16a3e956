#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>

#include <quoin/core/parallel.h>
#include <quoin/io/vox.h>

namespace quoin::tool {

/// The tool's exit statuses.
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kWrongUsage = 2;

/// What every command takes.
struct CommonOptions {
  std::filesystem::path input;
  LoadOptions load;
  Threads threads;
  bool json = false;
  bool takes_frame = false;  ///< --frame was given

  [[nodiscard]] InstanceFilter instances() const {
    return load.show_hidden ? InstanceFilter::All : InstanceFilter::Visible;
  }
};

/// Adds --dimension.
void add_dimension_option(CLI::App& command, LoadOptions& load);
/// Refuses --dimension for a file that has no dimensions.
[[nodiscard]] Status check_dimension(const std::filesystem::path& path, const LoadOptions& load);

/// Adds IN, --json, --threads, --hidden, --dimension and --frame to a command.
void add_common_options(CLI::App& command, CommonOptions& options);

/// Adds --allow-outside-files.
void add_outside_files_option(CLI::App& command, LoadOptions& options);

/// What --force is for.
inline constexpr const char* kForceHelp = "Overwrite OUT even if it is a model or a world";

/// Refuses what is not a number of at least 0 (a whole one), in words for a person.
[[nodiscard]] CLI::Validator not_negative();
[[nodiscard]] CLI::Validator not_negative_whole();
/// Refuses what is not a number above 0.
[[nodiscard]] CLI::Validator positive();
/// Refuses an empty name of a file.
[[nodiscard]] CLI::Validator file_name();

/// Each adds one command; once it has been parsed, `status` becomes what the command ends with.
void add_info_command(CLI::App& app, int& status);
void add_convert_command(CLI::App& app, int& status);
void add_render_command(CLI::App& app, int& status);
void add_thumbnail_command(CLI::App& app, int& status);
void add_generate_command(CLI::App& app, int& status);
void add_view_command(CLI::App& app, int& status);
void add_world_command(CLI::App& app, int& status);
/// `completions` and `man`, which tell of all commands.
void add_shell_commands(CLI::App& app, int& status);

/// Adds -q.
void add_quiet_option(CLI::App& command);

}  // namespace quoin::tool
