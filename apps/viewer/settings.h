#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/light/light_options.h>

#include "camera/camera_control.h"
#include "view_backend.h"

namespace quoin::viewer {

/// What the viewer remembers from one start to the next.
struct Settings {
  int width = 1280;  ///< of the window
  int height = 720;
  bool is_panel_shown = true;
  CameraMode camera_mode = CameraMode::Orbit;
  double ui_scale = 0.0;  ///< 0: by the display
  int samples = 16;
  bool detail_by_pixels = false;
  bool detail_colours = false;  ///< not remembered, as the two after it
  Wireframe wireframe = Wireframe::Off;
  DrawMode mode = DrawMode::Rays;
  SlicePlace slice;
  LightOptions light = natural_light();
  std::vector<std::string> recent;  ///< files, the newest first

  /// Puts a file at the front of `recent`, once, and keeps at most ten.
  void note_recent(const std::filesystem::path& file);
};

/// $XDG_CONFIG_HOME/quoin/viewer.json, or ~/.config/quoin/viewer.json; empty when there is neither.
[[nodiscard]] std::filesystem::path settings_path();

/// Reads what can be read: whatever is missing, of the wrong kind or out of range stays as it is by default.
[[nodiscard]] Settings parse_settings(std::string_view json);
[[nodiscard]] std::string to_json(const Settings& settings);

/// The file's settings; the default ones where there is no such file, or it says nothing that makes sense.
[[nodiscard]] Settings read_settings(const std::filesystem::path& path);
/// Makes the folders there must be. The file appears whole or not at all. Errors: CannotWrite.
[[nodiscard]] Status write_settings(const Settings& settings, const std::filesystem::path& path);

}  // namespace quoin::viewer
