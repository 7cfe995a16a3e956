#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/camera.h>

#include "commands.h"

namespace quoin::tool {

/// What `quoin render` was asked for.
struct RenderArguments {
  CommonOptions common;
  std::filesystem::path output;
  std::filesystem::path depth;  ///< empty: none
  RenderOptions render;         ///< size, samples and light
  View view = View::Iso;
  std::optional<DVec3> position;  ///< with `target`, instead of the view
  std::optional<DVec3> target;
  double fov_degrees = 45.0;
  std::string preset = "full";
  std::string occlusion = "rays";
  std::string backend = "cpu";
  std::string missing;  ///< an option that this version does not have; empty when none was given
};

/// Adds the command's options, which fill in `arguments` as they are parsed.
void add_render_options(CLI::App& command, RenderArguments& arguments);

/// Once all are parsed: settles what several options decide together. Answers what is wrong with the usage, or "".
[[nodiscard]] std::string settle(const CLI::App& command, RenderArguments& arguments);

}  // namespace quoin::tool
