#pragma once

#include <string>

#include <CLI/CLI.hpp>
#include <quoin/mesh/smooth.h>

namespace quoin::tool {

/// Adds --ao-form, --ao-spread, --ao-offset and --ao-power, whose texts `read_field_occlusion` reads.
void add_field_occlusion_options(CLI::App& command);

/// The first of these that was given; null when none was.
[[nodiscard]] const char* given_field_occlusion(const CLI::App& command);

/// Reads those that were given into `options`; returns what is wrong with them, or "".
[[nodiscard]] std::string read_field_occlusion(const CLI::App& command, SmoothOcclusionOptions& options);

}  // namespace quoin::tool
