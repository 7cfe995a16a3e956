#pragma once

#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "commands.h"

namespace quoin::tool {

/// The texts of options that say how triangles become voxels.
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

/// Reads those that were given; returns what is wrong with them, or "".
[[nodiscard]] std::string read_mesh_input_options(const CLI::App& command, const MeshInputTexts& texts,
                                                  MeshLoadOptions& options);

/// The first of these options that was given; null without any.
[[nodiscard]] const char* given_mesh_input(const CLI::App& command);

}  // namespace quoin::tool
