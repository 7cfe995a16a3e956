#include "options/volume_options.h"

#include <bit>
#include <cmath>

#include "options/parse.h"
#include "shell/help.h"

namespace quoin::tool {

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

Result<Volume> read_input_volume(const CommonOptions& options, const Progress& progress) {
  if (options.load.raw) return read_raw_volume(options.input, *options.load.raw, {}, progress);
  VolumeOptions allowed;
  allowed.sidecar_files = options.load.sidecar_files;
  return read_volume(options.input, allowed, progress);
}

}  // namespace quoin::tool
