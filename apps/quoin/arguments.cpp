#include <charconv>
#include <cmath>
#include <optional>
#include <string>

#include "commands.h"
#include "options/parse.h"
#include "output.h"
#include "shell/help.h"

namespace quoin::tool {

namespace {

/// Returns an error message if `text` is not a number of at least 0, else "".
template <class Number>
std::string find_number_error(const std::string& text) {
  Number value{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  const bool is_negative = text.starts_with('-') && value <= 0 && text.find_first_not_of("-0.") != std::string::npos;
  if (error == std::errc::result_out_of_range && stop == end && !is_negative) return "too large: \"" + text + "\"";
  const bool is_number = error == std::errc() && stop == end && std::isfinite(static_cast<double>(value));
  return is_number && !is_negative ? "" : "must be 0 or more, not \"" + text + "\"";
}

}  // namespace

CLI::Validator not_negative() {
  return {[](std::string& text) { return find_number_error<double>(text); }, ""};
}

CLI::Validator not_negative_whole() {
  return {[](std::string& text) { return find_number_error<int>(text); }, ""};
}

CLI::Validator positive() {
  return {[](std::string& text) {
            const auto number = parse_number(text);
            return number && *number > 0.0 ? std::string() : "must be a number above 0, not \"" + text + "\"";
          },
          ""};
}

CLI::Validator file_name() {
  return {[](std::string& text) { return std::string(text.empty() ? "must be a file name, not \"\"" : ""); }, ""};
}

void add_quiet_option(CLI::App& command) {
  command.add_flag_callback(
      "-q,--quiet", [] { be_quiet(); }, "Print only errors and --json output: no progress, no warnings");
}

void add_outside_files_option(CLI::App& command, LoadOptions& options) {
  command.add_flag_callback(
      "--allow-outside-files", [&options] { options.sidecar_files = SidecarFiles::Anywhere; },
      "Read files outside the folder of IN if IN names them; only for trusted input");
}

namespace {

/// Adds the options for height maps. Any of them makes the input a height map.
void add_height_options(CLI::App& command, std::optional<HeightOptions>& heights) {
  const auto wanted = [&heights]() -> HeightOptions& { return heights ? *heights : heights.emplace(); };
  const auto number = [&](const char* name, const char* help, auto set) {
    command
        .add_option_function<double>(
            name, [wanted, set](const double& value) { set(wanted(), value); }, help)
        ->check(positive());
  };
  command
      .add_option_function<std::string>(
          "--heights",
          [wanted](const std::string& name) {
            wanted().encoding = name == "grey"     ? HeightEncoding::Grey
                                : name == "mapbox" ? HeightEncoding::Mapbox
                                                   : HeightEncoding::Terrarium;
          },
          "Read a .png as a height map: grey (8 or 16 bits), or the terrain-RGB encodings mapbox or terrarium. .hgt "
          "files need no option; every option under this heading makes the input a height map")
      ->check(CLI::IsMember({"grey", "mapbox", "terrarium"}));
  number("--metres-per-level", "Height of one grey level in metres (default 1)",
         [](HeightOptions& options, double value) { options.metres_per_level = value; });
  number("--metres-per-pixel", "Distance between neighbouring heights in metres (default 1; .hgt: from the file)",
         [](HeightOptions& options, double value) { options.metres_per_pixel = value; });
  number("--metres-per-voxel", "Edge of a voxel in metres (default: --metres-per-pixel)",
         [](HeightOptions& options, double value) { options.metres_per_voxel = value; });
  number("--exaggeration", "Vertical exaggeration (default 1)",
         [](HeightOptions& options, double value) { options.vertical_exaggeration = value; });
  command
      .add_option_function<int>(
          "--ground-depth", [wanted](const int& value) { wanted().depth = value; },
          "Voxels of ground below the lowest height, 1 to 4096 (default 8)")
      ->check(CLI::Range(1, 4096));
  command.add_flag_callback(
      "--smooth-ground", [wanted] { wanted().as_field = true; },
      "Make a density field with a smooth surface instead of voxels");
}

}  // namespace

void add_dimension_option(CLI::App& command, LoadOptions& load) {
  command
      .add_option(
          "--dimension", load.dimension,
          "Dimension of a Minecraft world: overworld, nether, end or NAMESPACE:NAME (default overworld). quoin info "
          "lists the dimensions of a world")
      ->check(CLI::Validator(
          [](const std::string& text) { return std::string(text.empty() ? "must name a dimension" : ""); }, ""));
}

void add_common_options(CLI::App& command, CommonOptions& options) {
  command.add_option("IN", options.input, "File to read, or - for standard input")->required()->check(file_name());
  set_heading(command, heading::kInput);
  command.add_flag("--hidden", options.load.show_hidden, "Include hidden layers and nodes");
  command.add_option("--frame", options.load.frame, "Animation frame (default 0)")
      ->check(not_negative_whole())
      ->each([&options](const std::string&) { options.takes_frame = true; });
  add_outside_files_option(command, options.load);
  set_heading(command, heading::kWorlds);
  command
      .add_option("--around", options.load.radius,
                  "Radius around the spawn in chunks of 64 blocks, 0 to 1000 (default 4). quoin convert WORLD "
                  "NAME.quoin converts all of a world")
      ->check(CLI::Range(0, 1'000));
  add_dimension_option(command, options.load);
  set_heading(command, heading::kHeights);
  add_height_options(command, options.load.heights);
  set_heading(command, heading::kGeneral);
  command.add_flag("--json", options.json, "Print one JSON object instead of text");
  add_quiet_option(command);
  command.add_option("--threads", options.threads.count, "Number of threads, 1 to 1024 (default: all)")
      ->check(CLI::Range(1U, 1024U));
}

std::string readable_files() {
  return "Reads " + extensions_with(FormatCapability::Read) +
         ".\nAlso reads .mcr, .linear, .hdr (NIfTI pairs), and world folders of Minecraft and Luanti.\n";
}

}  // namespace quoin::tool
