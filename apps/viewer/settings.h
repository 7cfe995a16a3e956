#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/io/block_packs.h>
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
  double exposure = 1.0;  ///< factor on the environment's exposure
  /// The resource pack for blocks of Minecraft: kBuiltinPack, kNoPack, or the path of a pack, such as a client's .jar.
  std::string pack = kBuiltinPack;
  std::vector<std::string> recent;  ///< files, newest first

  /// Moves a file to the front of `recent`, which keeps at most ten.
  void note_recent(const std::filesystem::path& file);
  /// Returns the packs of `pack` for LoadOptions::packs.
  [[nodiscard]] std::vector<std::filesystem::path> packs() const { return packs_for_images({pack}); }
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

/// The sun's position in degrees. Azimuth 0 is south (+Z), positive towards the east (+X); elevation is above the
/// horizon.
struct SunAngles {
  double azimuth = 0.0;    ///< -180 to 180
  double elevation = 0.0;  ///< -90 to 90
};

/// Returns the angles of a direction towards the sun. Requires: `sun` is not zero.
[[nodiscard]] SunAngles sun_angles(DVec3 sun);
/// Returns the unit vector towards the sun.
[[nodiscard]] DVec3 sun_direction(const SunAngles& angles);

/// Returns the lowest elevation that can be set, in degrees: night if the sky follows the sun, else just high enough to
/// light surfaces from above.
[[nodiscard]] double lowest_sun(const Environment& environment);

/// Returns the sun after a drag in pixels: dx turns it, an upward drag raises it, limited to the zenith and
/// `lowest_sun`.
[[nodiscard]] DVec3 drag_sun(const Environment& environment, double dx, double dy);

}  // namespace quoin::viewer
