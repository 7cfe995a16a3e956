#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <quoin/io/volume.h>

#include "commands.h"

namespace quoin::tool {

/// Unparsed volume options; `read_volume_options` parses them.
struct VolumeTexts {
  std::string iso;
  std::string raw_size;
  std::string raw_type = "uint8";
  std::string raw_order = "little";
};

/// Adds --raw-size, --raw-type and --raw-order.
void add_raw_options(CLI::App& command, VolumeTexts& texts);
/// Adds --iso and the raw options.
void add_volume_options(CLI::App& command, VolumeTexts& texts);

/// Parsed volume options.
struct VolumeArguments {
  std::optional<double> iso;  ///< the given value; within the range of float
  std::optional<RawVolume> raw;
};

/// Parses the volume options. Returns a usage error, or "".
[[nodiscard]] std::string read_volume_options(const CLI::App& command, const VolumeTexts& texts,
                                              VolumeArguments& arguments);

/// Returns true if the input is a volume, by --raw-size or by its content. Errors: CannotRead.
[[nodiscard]] Result<bool> holds_volume(const CommonOptions& options);

/// Returns true if --iso applies to the input: a volume, or a .vdb, which may have fog grids.
[[nodiscard]] bool heeds_iso(const CommonOptions& options);

/// Reads the input as a volume. Errors: those of read_volume and read_raw_volume.
[[nodiscard]] Result<Volume> read_input_volume(const CommonOptions& options, const Progress& progress);

}  // namespace quoin::tool
