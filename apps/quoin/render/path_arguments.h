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

/// Fog density and upper end: "0.05,20".
struct FogPlace {
  double density = 0.0;
  std::optional<double> top;
};

/// The options of `quoin render --light path` that other light models do not have.
struct PathArguments {
  std::set<std::string> given;  ///< names of the given options; others use the file's settings or the defaults
  int bounces = 8;
  std::string sky = "gradient";  ///< or a file name
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

  /// Returns true if the option was given.
  [[nodiscard]] bool has(const std::string& option) const { return given.contains(option); }
};

/// Settings for path-traced images of a scene.
struct PathPlan {
  PathOptions options;
  DevelopOptions develop;
  bool is_exposure_automatic = false;
  bool is_transparent = false;
  bool denoise = false;
  std::optional<double> focus;  ///< nullopt: the centre of the scene
  std::vector<std::string> warnings;
};

void add_path_options(CLI::App& command, PathArguments& arguments);

/// Returns the first given option that only --light path has, or "".
[[nodiscard]] std::string given_path_option(const CLI::App& command);
/// Returns an error message if a given option cannot be used with --light path, else "".
[[nodiscard]] std::string find_path_options_error(const CLI::App& command);
/// Reads the options that CLI11 leaves as text. Returns a usage error, or "".
[[nodiscard]] std::string read_path_options(const CLI::App& command, PathArguments& arguments);

/// Returns true if the sky is an image file, which `plan_paths` reads.
[[nodiscard]] bool is_sky_file(const PathArguments& arguments);

/// Takes each setting from the options, else from the scene file (IN), else the default. `file_camera`: the number of
/// the camera of the file that is used. Errors: those of reading the sky image of --sky. An unreadable sky image of the
/// scene file only gives a warning.
[[nodiscard]] Result<PathPlan> plan_paths(const PathArguments& arguments, const RenderOptions& render,
                                          const LoadedScene& loaded, InstanceFilter filter, const CommonOptions& common,
                                          std::optional<int> file_camera);

}  // namespace quoin::tool
