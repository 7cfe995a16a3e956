#include <charconv>
#include <cmath>
#include <optional>
#include <string>

#include <quoin/io/formats.h>

#include "commands.h"
#include "output.h"
#include "parse.h"

namespace quoin::tool {

namespace {

/// What is wrong with `text` as a number of at least 0; empty when nothing is.
template <class Number>
std::string fault_of_number(const std::string& text) {
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
  return {[](std::string& text) { return fault_of_number<double>(text); }, ""};
}

CLI::Validator not_negative_whole() {
  return {[](std::string& text) { return fault_of_number<int>(text); }, ""};
}

CLI::Validator positive() {
  return {[](std::string& text) {
            const auto number = parse_number(text);
            return number && *number > 0.0 ? std::string() : "must be a number above 0, not \"" + text + "\"";
          },
          ""};
}

CLI::Validator file_name() {
  return {[](std::string& text) { return std::string(text.empty() ? "must be the name of a file, not \"\"" : ""); },
          ""};
}

void add_quiet_option(CLI::App& command) {
  command.add_flag_callback(
      "-q,--quiet", [] { be_quiet(); }, "Print errors alone, and what --json prints; no progress, no warnings");
}

void add_outside_files_option(CLI::App& command, LoadOptions& options) {
  command.add_flag_callback(
      "--allow-outside-files", [&options] { options.sidecar_files = SidecarFiles::Anywhere; },
      "Read files that IN names outside its folder (only for input that you trust)");
}

namespace {

/// Adds options that say how heights become a landscape; any of them makes the input one.
void add_height_options(CLI::App& command, std::optional<HeightOptions>& heights) {
  constexpr const char* kGroup = "Heights";
  const auto wanted = [&heights]() -> HeightOptions& { return heights ? *heights : heights.emplace(); };
  const auto number = [&](const char* name, const char* help, auto set) {
    command
        .add_option_function<double>(
            name, [wanted, set](const double& value) { set(wanted(), value); }, help)
        ->check(positive())
        ->group(kGroup);
  };
  command
      .add_option_function<std::string>(
          "--heights",
          [wanted](const std::string& name) {
            wanted().encoding = name == "grey"     ? HeightEncoding::Grey
                                : name == "mapbox" ? HeightEncoding::Mapbox
                                                   : HeightEncoding::Terrarium;
          },
          "IN is a picture (.png) of heights: grey (of 8 or 16 bits), or terrain-RGB as mapbox or terrarium have it; "
          ".hgt say so themselves")
      ->check(CLI::IsMember({"grey", "mapbox", "terrarium"}))
      ->group(kGroup);
  number("--metres-per-level", "Of grey: the height of one level (default 1)",
         [](HeightOptions& options, double value) { options.metres_per_level = value; });
  number("--metres-per-pixel", "Between neighbouring heights (default: of .hgt what its size says, else 1)",
         [](HeightOptions& options, double value) { options.metres_per_pixel = value; });
  number("--metres-per-voxel", "Edge of a voxel (default: as far as heights are apart)",
         [](HeightOptions& options, double value) { options.metres_per_voxel = value; });
  number("--exaggeration", "Heights times this (default 1)",
         [](HeightOptions& options, double value) { options.vertical_exaggeration = value; });
  command
      .add_option_function<int>(
          "--ground-depth", [wanted](const int& value) { wanted().depth = value; },
          "Voxels of ground below the lowest height (default 8)")
      ->check(CLI::Range(1, 4096))
      ->group(kGroup);
  command
      .add_flag_callback(
          "--smooth-ground", [wanted] { wanted().as_field = true; },
          "Heights become densities, whose surface is smooth, rather than voxels")
      ->group(kGroup);
}

}  // namespace

void add_dimension_option(CLI::App& command, LoadOptions& load) {
  command
      .add_option(
          "--dimension", load.dimension,
          "Dimension of a Minecraft world: overworld, nether, end or NAMESPACE:NAME (default overworld; quoin info "
          "lists those of a world)")
      ->check(CLI::Validator(
          [](const std::string& text) { return std::string(text.empty() ? "must name a dimension" : ""); }, ""));
}

Status check_dimension(const std::filesystem::path& path, const LoadOptions& load) {
  if (load.dimension.empty()) return {};
  const auto format = detect_format(path);
  if (!format) return format.error();
  const bool is_heeded = *format == FileFormat::Minecraft || *format == FileFormat::Scene;
  if (is_heeded) return {};
  const std::string found = *format ? std::string(format_info(**format).name) : "of no format that is known";
  return make_error(ErrorCode::InvalidArgument,
                    "cannot choose a dimension: --dimension is for worlds of Minecraft, and this is " + found,
                    path.string());
}

void add_common_options(CLI::App& command, CommonOptions& options) {
  command.add_option("IN", options.input, "File to read")->required()->check(file_name());
  command.add_flag("--hidden", options.load.show_hidden, "Include hidden layers and nodes");
  command
      .add_option("--around", options.load.radius,
                  "Of a world of Minecraft's or Luanti's: how far around its spawn, in chunks of 64 blocks to each "
                  "side (default 4; "
                  "converted to .quoin it is all there)")
      ->check(CLI::Range(0, 1'000));
  add_dimension_option(command, options.load);
  command.add_option("--frame", options.load.frame, "Animation frame to take (default 0)")
      ->check(not_negative_whole())
      ->each([&options](const std::string&) { options.takes_frame = true; });
  add_height_options(command, options.load.heights);
  add_outside_files_option(command, options.load);
  command.add_flag("--json", options.json, "Print one JSON object instead of text");
  add_quiet_option(command);
  command.add_option("--threads", options.threads.count, "Threads to use (default: all)")->check(CLI::Range(1U, 1024U));
}

}  // namespace quoin::tool
