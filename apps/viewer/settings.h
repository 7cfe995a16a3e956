#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/render/light_options.h>
#include <quoin/scene/environment.h>

#include "camera/camera_control.h"
#include "view_backend.h"

namespace quoin::viewer {

/// Settings that the viewer keeps between runs.
struct Settings {
  int width = 1280;  ///< window size
  int height = 720;
  bool is_panel_shown = true;
  CameraMode camera_mode = CameraMode::Orbit;
  double ui_scale = 0.0;  ///< 0: the display's
  int samples = 16;
  bool detail_by_pixels = false;
  bool detail_colours = false;  ///< not saved, like the next two
  Wireframe wireframe = Wireframe::Off;
  DrawMode mode = DrawMode::Rays;
  SlicePlane slice;
  LightOptions light = natural_light();
  /// For files without an environment of their own. Saved are its sun direction, brightnesses and whether the sky
  /// follows the sun.
  Environment environment;
  double exposure = 1.0;            ///< factor on the environment's exposure
  std::vector<std::string> recent;  ///< files, newest first

  /// Moves a file to the front of `recent`, which keeps at most ten.
  void note_recent(const std::filesystem::path& file);
};

/// Returns $XDG_CONFIG_HOME/quoin/viewer.json or ~/.config/quoin/viewer.json; empty if neither variable holds an
/// absolute path.
[[nodiscard]] std::filesystem::path settings_path();

/// Parses settings. Values that are missing, of the wrong type or out of range keep their defaults.
[[nodiscard]] Settings parse_settings(std::string_view json);
[[nodiscard]] std::string to_json(const Settings& settings);

/// Reads settings from a file; returns the defaults if it is missing or invalid.
[[nodiscard]] Settings read_settings(const std::filesystem::path& path);
/// Writes the file atomically and creates its folders. Errors: CannotWrite.
[[nodiscard]] Status write_settings(const Settings& settings, const std::filesystem::path& path);

}  // namespace quoin::viewer
