#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <quoin/io/loaded_scene.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/render/path_tracer.h>
#include <quoin/scene/environment.h>

#include "commands.h"

namespace quoin::tool {

struct RenderArguments;

/// Fog density and upper end: "0.05,20".
struct FogPlace {
  double density = 0.0;
  std::optional<double> top;
};

/// The value of --sky.
struct SkyArgument {
  SkyModel model = SkyModel::Gradient;
  std::filesystem::path image;  ///< of SkyModel::Image
};

/// The options of `quoin render --light path` that other light models do not have. Settings without a value come from
/// the file or are the defaults.
struct PathArguments {
  std::optional<int> bounces;
  std::optional<SkyArgument> sky;
  std::optional<ToneCurve> tone;
  bool uses_file_look = true;
  std::optional<double> sun_angle_degrees;
  double sky_turn_degrees = 0.0;
  std::optional<SunTime> sun_time;
  std::optional<bool> ground;
  bool is_transparent = false;
  std::optional<double> lens_radius;
  std::optional<double> focus;
  std::optional<FogPlace> fog;
  DVec3 fog_colour{1.0};
  std::optional<Bloom> bloom;
  std::optional<double> vignette;
  bool denoise = false;
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

/// Adds the options under the heading of path tracing.
void add_path_options(CLI::App& command, PathArguments& arguments);

/// Returns the rules between these options. That they need --light path holds for the whole heading.
[[nodiscard]] std::vector<OptionRule> path_rules(const PathArguments& arguments);

/// Takes each setting from the options, else from the scene file (IN), else the default. An unreadable sky image of a
/// .vox file gives a warning; load_scene warns of those of scene files.
/// Errors: those of reading the sky image of --sky.
[[nodiscard]] Result<PathPlan> plan_paths(const RenderArguments& all, const LoadedScene& loaded);

}  // namespace quoin::tool
