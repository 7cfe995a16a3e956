#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/io/formats.h>
#include <quoin/io/volume.h>
#include <quoin/io/vox.h>
#include <quoin/mesh/smooth.h>

#include "options.h"

namespace quoin::tool {

/// The tool's exit statuses.
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kWrongUsage = 2;

/// Options of all commands that read a file.
struct CommonOptions {
  std::filesystem::path input;
  LoadOptions load{.sky_image = false};  ///< only path tracing sets sky_image
  Threads threads;
  bool json = false;
  bool takes_frame = false;  ///< --frame was given

  [[nodiscard]] InstanceFilter instances() const {
    return load.show_hidden ? InstanceFilter::All : InstanceFilter::Visible;
  }
};

/// Adds --dimension.
void add_dimension_option(CLI::App& command, LoadOptions& load);
/// The look of Minecraft blocks without --pack.
enum class PlainBlocks : std::uint8_t {
  Cubes,    ///< cubes of one colour: for files that other programs read
  OwnPack,  ///< as in kBuiltinPack, which also lies below other packs: for images
};

/// Adds --pack, which can be given several times.
void add_pack_option(CLI::App& command, LoadOptions& load, PlainBlocks plain);
/// Adds IN and the options of CommonOptions to a command.
void add_common_options(CLI::App& command, CommonOptions& options, PlainBlocks plain);

/// Adds --allow-outside-files.
void add_outside_files_option(CLI::App& command, LoadOptions& options);

/// Returns a sentence with the files that the tool reads, for the end of a help text.
[[nodiscard]] std::string readable_files();

/// Help of --force.
inline constexpr const char* kForceHelp = "Overwrite OUT even if it is a voxel file";

/// Accepts a number of at least 0.
[[nodiscard]] CLI::Validator not_negative();
/// Accepts a whole number of at least 0.
[[nodiscard]] CLI::Validator not_negative_whole();
/// Accepts a number above 0.
[[nodiscard]] CLI::Validator positive();
/// Accepts a file name that is not empty.
[[nodiscard]] CLI::Validator file_name();

/// Adds --quiet.
void add_quiet_option(CLI::App& command);

/// Adds --raw-size, --raw-type and --raw-order.
void add_raw_options(CLI::App& command, std::optional<RawVolume>& raw);
/// Adds --iso and the raw options. `exact_iso`: also receives the value of --iso, which `load` rounds to float.
void add_volume_options(CLI::App& command, LoadOptions& load, std::optional<double>* exact_iso = nullptr);

/// Returns the rules of the raw options.
[[nodiscard]] std::vector<OptionRule> raw_rules();

/// Reads the input as a volume. Errors: those of read_volume and read_raw_volume.
[[nodiscard]] Result<Volume> read_input_volume(const CommonOptions& options, const DetectedFile& file,
                                               const Progress& progress);

/// The options of smooth occlusion.
inline const std::vector<std::string> kFieldOcclusion = {"--ao-form", "--ao-spread", "--ao-offset", "--ao-power"};

/// Adds these options.
void add_field_occlusion_options(CLI::App& command, SmoothOcclusionOptions& options);

/// Returns the rules between these options. Requires: `options` outlives the rules.
[[nodiscard]] std::vector<OptionRule> field_occlusion_rules(const SmoothOcclusionOptions& options);

/// Each function adds one command. When the command is parsed it runs, and sets `status` to its exit status.
void add_info_command(CLI::App& app, int& status);
void add_convert_command(CLI::App& app, int& status);
void add_render_command(CLI::App& app, int& status);
void add_thumbnail_command(CLI::App& app, int& status);
void add_generate_command(CLI::App& app, int& status);
void add_view_command(CLI::App& app, int& status);
void add_map_command(CLI::App& app, int& status);
void add_world_command(CLI::App& app, int& status);
/// Adds `completions` and `man`, which describe all commands.
void add_shell_commands(CLI::App& app, int& status);

}  // namespace quoin::tool
