#pragma once

#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "commands.h"

namespace quoin::tool {

/// Given options for converting triangles to voxels.
struct MeshInputTexts {
  bool is_solid = false;
  bool is_surface = false;
  bool is_field = false;
  bool by_parity = false;
  int separating = 6;
  std::string up;
};

/// Adds --size, --voxel, --solid, --surface, --field, --separating, --parity, --band, --max-colours and --input-up.
void add_mesh_input_options(CLI::App& command, MeshInputTexts& texts, MeshLoadOptions& options);

/// Reads these options. Returns a usage error, or "".
[[nodiscard]] std::string read_mesh_input_options(const CLI::App& command, const MeshInputTexts& texts,
                                                  MeshLoadOptions& options);

/// Returns the first of these options that was given, or null.
[[nodiscard]] const char* given_mesh_input(const CLI::App& command);

}  // namespace quoin::tool
