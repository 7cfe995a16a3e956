#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <quoin/render/cpu_renderer.h>
#include <quoin/render/path_tracer.h>

#include "commands.h"

namespace quoin::tool {

/// What `quoin render --light path` was asked for besides what all light has.
struct PathArguments {
  int bounces = 8;
  std::string sky = "physical";  ///< or the name of a file
  std::string tone = "neutral";
  double sun_angle_degrees = 0.53;
  double sky_turn_degrees = 0.0;
  bool is_exposure_automatic = false;
  bool has_ground = false;
  bool is_transparent = false;
  double lens_radius = 0.0;
  std::optional<double> focus;

  /// Of the tool's own names.
  [[nodiscard]] ToneCurve tone_curve() const;
};

void add_path_options(CLI::App& command, PathArguments& arguments);

/// The options that only --light path has.
[[nodiscard]] std::string given_path_option(const CLI::App& command);
/// What --light path does not have, of the options that were given; "": nothing.
[[nodiscard]] std::string fault_of_path_options(const CLI::App& command);
/// Reads those that are texts; returns what is wrong, or "".
[[nodiscard]] std::string read_path_options(const CLI::App& command, PathArguments& arguments);

/// Whether the sky is a file, which is then read when the picture is taken.
[[nodiscard]] bool is_sky_file(const PathArguments& arguments);

/// The options of a picture of a scene. Errors: of the sky's file.
[[nodiscard]] Result<PathOptions> path_options(const PathArguments& arguments, const RenderOptions& render,
                                               const Scene& scene, InstanceFilter filter);

}  // namespace quoin::tool
