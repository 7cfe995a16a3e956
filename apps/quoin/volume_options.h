#pragma once

#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <quoin/io/volume.h>

#include "commands.h"

namespace quoin::tool {

/// The texts of options that are of volumes, which `read_volume_options` reads.
struct VolumeTexts {
  std::string iso;
  std::string raw_size;
  std::string raw_type = "uint8";
  std::string raw_order = "little";
};

/// Adds --raw-size, --raw-type and --raw-order.
void add_raw_options(CLI::App& command, VolumeTexts& texts);
/// These and --iso.
void add_volume_options(CLI::App& command, VolumeTexts& texts);

/// What these options say.
struct VolumeArguments {
  std::optional<double> iso;  ///< as it was written; a float holds it
  std::optional<RawVolume> raw;
};

/// Reads those that were given; returns what is wrong with them, or "".
[[nodiscard]] std::string read_volume_options(const CLI::App& command, const VolumeTexts& texts,
                                              VolumeArguments& arguments);

/// Whether a command's input is a volume, by what the options say or by what it holds. Errors: CannotRead.
[[nodiscard]] Result<bool> holds_volume(const CommonOptions& options);

/// Whether --iso means something to a command's input: a volume, or what may hold fog (.vdb).
[[nodiscard]] bool heeds_iso(const CommonOptions& options);

/// Reads it as one. Errors: those of read_volume and read_raw_volume.
[[nodiscard]] Result<Volume> read_input_volume(const CommonOptions& options, const Progress& progress);

}  // namespace quoin::tool
