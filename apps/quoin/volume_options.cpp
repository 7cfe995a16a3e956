#include "volume_options.h"

#include <bit>
#include <cmath>

#include <quoin/io/formats.h>

#include "parse.h"
#include "shell/help.h"

namespace quoin::tool {

namespace {

std::optional<ScalarType> scalar_type(const std::string& name) {
  for (int i = 0; i <= static_cast<int>(ScalarType::Float64); ++i) {
    if (name_of(static_cast<ScalarType>(i)) == name) return static_cast<ScalarType>(i);
  }
  return std::nullopt;
}

std::string read_iso(const std::string& text, std::optional<double>& iso) {
  iso = parse_number(text);
  if (!iso) return "--iso: must be a number, not \"" + text + "\"";
  if (std::isfinite(static_cast<float>(*iso))) return "";
  return "--iso: must be from -3.4e38 to 3.4e38, the range of 32-bit floats, not \"" + text + "\"";
}

}  // namespace

void add_raw_options(CLI::App& command, VolumeTexts& texts) {
  set_heading(command, heading::kVolumes);
  command
      .add_option("--raw-size", texts.raw_size,
                  "Read IN as raw values without a header: number of values along each axis, x fastest")
      ->type_name("XxYxZ");
  command.add_option("--raw-type", texts.raw_type,
                     "Type of raw values: uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32 or float64 "
                     "(default uint8)");
  command.add_option("--raw-order", texts.raw_order, "Byte order of raw values: little or big (default little)")
      ->check(CLI::IsMember({"little", "big"}));
}

void add_volume_options(CLI::App& command, VolumeTexts& texts) {
  set_heading(command, heading::kVolumes);
  command
      .add_option("--iso", texts.iso,
                  "Surface value of a volume or of a fog grid of a .vdb. Greater values are solid (default: a value "
                  "that separates the two main groups of values)")
      ->type_name("X");
  add_raw_options(command, texts);
}

std::string read_volume_options(const CLI::App& command, const VolumeTexts& texts, VolumeArguments& arguments) {
  if (command.get_option_no_throw("--iso") != nullptr && command.count("--iso") > 0) {
    if (std::string fault = read_iso(texts.iso, arguments.iso); !fault.empty()) return fault;
  }
  if (command.count("--raw-size") == 0) {
    const bool is_lone = command.count("--raw-type") + command.count("--raw-order") > 0;
    return is_lone ? "--raw-type and --raw-order need --raw-size" : "";
  }
  const auto size = parse_box_size(texts.raw_size);
  if (!size || size->x < 1 || size->y < 1 || size->z < 1) {
    return "--raw-size: must be XxYxZ, as in 256x256x128, not \"" + texts.raw_size + "\"";
  }
  const auto type = scalar_type(texts.raw_type);
  if (!type) {
    return "--raw-type: must be uint8, int8, uint16, int16, uint32, int32, uint64, int64, float32 or float64, not \"" +
           texts.raw_type + "\"";
  }
  arguments.raw = RawVolume{*size, *type, texts.raw_order == "big" ? std::endian::big : std::endian::little};
  return "";
}

Result<bool> holds_volume(const CommonOptions& options) {
  if (options.load.raw) return true;
  const auto format = detect_format(options.input);
  if (!format) return format.error();
  return can(*format, FormatCapability::Volume);
}

bool heeds_iso(const CommonOptions& options) {
  const auto format = detect_format(options.input);
  return holds_volume(options).value_or(false) || (format && *format == FileFormat::Vdb);
}

Result<Volume> read_input_volume(const CommonOptions& options, const Progress& progress) {
  if (options.load.raw) return read_raw_volume(options.input, *options.load.raw, {}, progress);
  VolumeOptions allowed;
  allowed.sidecar_files = options.load.sidecar_files;
  return read_volume(options.input, allowed, progress);
}

}  // namespace quoin::tool
