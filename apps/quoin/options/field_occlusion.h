#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <quoin/mesh/smooth.h>

#include "options/options.h"

namespace quoin::tool {

/// The options of smooth occlusion.
inline const std::vector<std::string> kFieldOcclusion = {"--ao-form", "--ao-spread", "--ao-offset", "--ao-power"};

/// Adds these options.
void add_field_occlusion_options(CLI::App& command, SmoothOcclusionOptions& options);

/// Returns the rules between these options. Requires: `options` outlives the rules.
[[nodiscard]] std::vector<OptionRule> field_occlusion_rules(const SmoothOcclusionOptions& options);

}  // namespace quoin::tool
