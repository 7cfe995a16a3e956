#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <quoin/io/loaded_scene.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/render/path_tracer.h>
#include <quoin/scene/look.h>

#include "commands.h"

namespace quoin::tool {

/// "0.05,20": how dense fog is, and up to which height.
struct FogPlace {
  double density = 0.0;
  std::optional<double> top;
};

/// What `quoin render --light path` was asked for besides what all light has.
struct PathArguments {
  std::set<std::string> given;  ///< the names of the options that were; what was not says the file, or the default
  int bounces = 8;
  std::string sky = "gradient";  ///< or the name of a file
  std::string tone = "neutral";
  std::string look = "file";
  double sun_angle_degrees = 0.53;
  double sky_turn_degrees = 0.0;
  std::optional<SunTime> sun_time;
  bool is_exposure_automatic = false;
  bool has_ground = false;
  bool is_transparent = false;
  double lens_radius = 0.0;
  std::optional<double> focus;
  std::optional<FogPlace> fog;
  DVec3 fog_colour{1.0};
  Bloom bloom;
  double vignette = 0.0;
  bool denoise = false;

  /// Whether an option was given.
  [[nodiscard]] bool has(const std::string& option) const { return given.contains(option); }
};

/// How pictures by paths of a scene are taken.
struct PathPlan {
  PathOptions options;
  DevelopOptions develop;
  bool is_exposure_automatic = false;
  bool is_transparent = false;
  bool denoise = false;
  std::optional<double> focus;  ///< none: the scene's middle
  std::vector<std::string> warnings;
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

/// Takes the options, else the settings of the scene's file (IN), else the defaults. `file_camera`: the number of
/// its camera that looks. Errors: of the sky's file where an option names it; the file's own is named in a warning.
[[nodiscard]] Result<PathPlan> plan_paths(const PathArguments& arguments, const RenderOptions& render,
                                          const LoadedScene& loaded, InstanceFilter filter, const CommonOptions& common,
                                          std::optional<int> file_camera);

}  // namespace quoin::tool
