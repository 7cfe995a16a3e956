#pragma once

#include <optional>
#include <vector>

#include <CLI/CLI.hpp>
#include <quoin/io/volume.h>

#include "commands.h"
#include "options/options.h"

namespace quoin::tool {

/// Adds --raw-size, --raw-type and --raw-order.
void add_raw_options(CLI::App& command, std::optional<RawVolume>& raw);
/// Adds --iso and the raw options. `exact_iso`: also receives the value of --iso, which `load` rounds to float.
void add_volume_options(CLI::App& command, LoadOptions& load, std::optional<double>* exact_iso = nullptr);

/// Returns the rules of the raw options.
[[nodiscard]] std::vector<OptionRule> raw_rules();

/// Reads the input as a volume. Errors: those of read_volume and read_raw_volume.
[[nodiscard]] Result<Volume> read_input_volume(const CommonOptions& options, const Progress& progress);

}  // namespace quoin::tool
