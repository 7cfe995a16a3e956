#pragma once

#include <string>

#include <CLI/CLI.hpp>
#include <quoin/mesh/smooth.h>

namespace quoin::tool {

/// Adds --ao-form, --ao-spread, --ao-offset and --ao-power. `read_field_occlusion` parses them.
void add_field_occlusion_options(CLI::App& command);

/// Returns the first of these options that was given, or null.
[[nodiscard]] const char* given_field_occlusion(const CLI::App& command);

/// Parses the given options into `options`. Returns a usage error, or "".
[[nodiscard]] std::string read_field_occlusion(const CLI::App& command, SmoothOcclusionOptions& options);

}  // namespace quoin::tool
