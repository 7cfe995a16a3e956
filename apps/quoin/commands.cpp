#include "commands.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>

#include <quoin/io/block_packs.h>

#include "options.h"
#include "output.h"

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

void add_pack_option(CLI::App& command, LoadOptions& load, PlainBlocks plain) {
  std::string help =
      "Resource pack of Minecraft for shapes and textures of its blocks: a folder, zip file or client .jar, or builtin "
      "for Quoin's own pack; can be given several times, later packs override earlier ones and those of a scene file";
  if (plain == PlainBlocks::OwnPack) {
    load.packs = {kBuiltinPack};
    help += " (default builtin, which also has the blocks that other packs lack; none: cubes)";
  } else {
    help += " (none: also without those of a scene file)";
  }
  command
      .add_option_function<std::vector<std::string>>(
          "--pack",
          [&load, plain](const std::vector<std::string>& packs) {
            load.packs.assign(packs.begin(), packs.end());
            load.scene_packs = packs != std::vector<std::string>{kNoPack};
            if (!load.scene_packs) load.packs.clear();
            if (load.scene_packs && plain == PlainBlocks::OwnPack) load.packs = packs_for_images(std::move(load.packs));
          },
          help)
      ->type_name("PATH")
      ->expected(1)
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->check(file_name());
}

void add_common_options(CLI::App& command, CommonOptions& options, PlainBlocks plain) {
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
  add_pack_option(command, options.load, plain);
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

namespace {

std::optional<IVec3> parse_raw_size(const std::string& text) {
  const auto size = parse_box_size(text);
  return size && size->x >= 1 && size->y >= 1 && size->z >= 1 ? size : std::nullopt;
}

std::optional<ScalarType> scalar_type(const std::string& name) {
  for (int i = 0; i <= static_cast<int>(ScalarType::Float64); ++i) {
    if (name_of(static_cast<ScalarType>(i)) == name) return static_cast<ScalarType>(i);
  }
  return std::nullopt;
}

/// Accepts numbers in the range of float, and texts that are no numbers.
CLI::Validator in_range_of_float() {
  return {[](std::string& text) {
            const auto number = parse_number(text);
            if (!number || std::isfinite(static_cast<float>(*number))) return std::string();
            return "must be from -3.4e38 to 3.4e38, the range of 32-bit floats, not \"" + text + "\"";
          },
          ""};
}

}  // namespace

void add_raw_options(CLI::App& command, std::optional<RawVolume>& raw) {
  set_heading(command, heading::kVolumes);
  add_parsed<IVec3>(
      command, "--raw-size", "XxYxZ", {parse_raw_size, "XxYxZ, as in 256x256x128"},
      [&raw](const IVec3& size) { raw.emplace().size = size; },
      "Read IN as raw values without a header: number of values along each axis, x fastest");
  // CLI11 reads options in the order in which they were added; raw_rules() refuses these without --raw-size.
  add_parsed<ScalarType>(
      command, "--raw-type", "TEXT",
      {scalar_type, "uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32 or float64"},
      [&raw](const ScalarType& type) {
        if (raw) raw->type = type;
      },
      "Type of raw values: uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32 or float64 "
      "(default uint8)");
  add_choice<std::endian>(
      command, "--raw-order", {{"little", std::endian::little}, {"big", std::endian::big}},
      [&raw](const std::endian& order) {
        if (raw) raw->order = order;
      },
      "Byte order of raw values: little or big (default little)");
}

void add_volume_options(CLI::App& command, LoadOptions& load, std::optional<double>* exact_iso) {
  set_heading(command, heading::kVolumes);
  add_parsed<double>(
      command, "--iso", "X", number(),
      [&load, exact_iso](const double& iso) {
        load.iso = static_cast<float>(iso);
        if (exact_iso != nullptr) *exact_iso = iso;
      },
      "Surface value of a volume or of a fog grid of a .vdb. Greater values are solid (default: a value "
      "that separates the two main groups of values)")
      ->check(in_range_of_float());
  add_raw_options(command, load.raw);
}

std::vector<OptionRule> raw_rules() {
  return {{{"--raw-type", "--raw-order"}, needs("--raw-size")}};
}

Result<Volume> read_input_volume(const CommonOptions& options, const DetectedFile& file, const Progress& progress) {
  if (options.load.raw) return read_raw_volume(file.path, *options.load.raw, {}, progress);
  VolumeOptions allowed;
  allowed.sidecar_files = options.load.sidecar_files;
  const auto opened = file.open();
  return opened ? read_volume(*opened, allowed, progress) : Result<Volume>(opened.error());
}

namespace {

std::optional<SmoothOcclusion> parse_form(const std::string& text) {
  const Choices<SmoothOcclusion> forms = {{"none", SmoothOcclusion::None},
                                          {"soft-share", SmoothOcclusion::SoftShare},
                                          {"share", SmoothOcclusion::SolidShare},
                                          {"weighted", SmoothOcclusion::Weighted},
                                          {"weighted-published", SmoothOcclusion::WeightedPublished}};
  const auto found = std::ranges::find(forms, text, &std::pair<std::string, SmoothOcclusion>::first);
  return found == forms.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace

void add_field_occlusion_options(CLI::App& command, SmoothOcclusionOptions& options) {
  add_parsed<SmoothOcclusion>(
      command, "--ao-form", "FORM", {parse_form, "none, soft-share, share, weighted or weighted-published"},
      options.method,
      "Ambient occlusion of smooth surfaces from 27 density samples around each vertex (default soft-share). "
      "soft-share: share of solid samples, without steps. share: count of solid samples. weighted: by their depth in "
      "the solid. weighted-published: by the published curve, which darkens open surfaces slightly. none: no "
      "occlusion");
  const auto add = [&](const char* name, const char* type, double least, double most, const char* range, float& value,
                       const char* help) {
    const auto set = [&value](const double& number) { value = static_cast<float>(number); };
    add_parsed<double>(command, name, type, number_between(least, most, range), set, help);
  };
  add("--ao-spread", "SAMPLES", 0.0625, 4.0, "0.0625 to 4", options.spread,
      "Spacing of the density samples of --ao-form, 0.0625 to 4 (default 2)");
  add("--ao-offset", "X", 0.0, 0.99, "0 to 0.99", options.offset,
      "Offset of the weights of the weighted forms, 0 to 0.99; greater is darker (default 0.4)");
  add("--ao-power", "X", 0.0625, 64.0, "0.0625 to 64", options.power,
      "Exponent of the weighted forms, 0.0625 to 64 (default 2)");
}

std::vector<OptionRule> field_occlusion_rules(const SmoothOcclusionOptions& options) {
  const auto has_form = [&options](SmoothOcclusion form) { return options.method == form; };
  const auto is_weighted = [has_form] {
    return has_form(SmoothOcclusion::Weighted) || has_form(SmoothOcclusion::WeightedPublished);
  };
  return {{{"--ao-spread"}, excludes("--ao-form none", [has_form] { return has_form(SmoothOcclusion::None); })},
          {{"--ao-offset", "--ao-power"}, needs("--ao-form weighted", is_weighted)}};
}

}  // namespace quoin::tool
