#pragma once

#include <vector>

#include <CLI/CLI.hpp>
#include <quoin/io/loaded_scene.h>

#include "options.h"

namespace quoin::tool {

/// Adds --size, --voxel, --solid, --surface, --field, --separating, --parity, --band, --max-colours and --input-up.
void add_mesh_input_options(CLI::App& command, MeshLoadOptions& options);

/// Returns the rules between these options.
[[nodiscard]] std::vector<OptionRule> mesh_input_rules();

}  // namespace quoin::tool
