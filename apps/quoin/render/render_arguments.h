#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <quoin/render/cpu_renderer.h>
#include <quoin/scene/camera.h>
#include <quoin/scene/environment.h>

#include "commands.h"
#include "options.h"
#include "render/path_arguments.h"

namespace quoin::tool {

/// A range of animation frames, including both ends.
struct FrameRange {
  int first = 0;
  int last = 0;
};

/// The values of --light, --preset, --detail and --backend.
enum class LightChoice : std::uint8_t { Rays, Path, Propagated };
enum class Preset : std::uint8_t { Full, NoShadows, NoAo, Unlit, Ao, Density };
enum class DetailChoice : std::uint8_t { Near, Radius, Pixels };
enum class Backend : std::uint8_t { Cpu, Vulkan };

/// The options that replace settings of the environment, in all light models.
struct EnvironmentArguments {
  std::optional<DVec3> sun;
  bool is_sun_off = false;
  bool is_sky_fixed = false;
  std::optional<double> sky_brightness;
  std::optional<double> lamp_brightness;
  std::optional<double> exposure;

  void apply_to(Environment& environment) const;
};

/// The options of `quoin render`.
struct RenderArguments {
  CommonOptions common;
  std::filesystem::path output;
  std::filesystem::path depth;  ///< empty: none
  RenderOptions render;         ///< size, samples, light and detail; not the environment
  std::optional<int> samples;
  std::optional<View> view;
  std::optional<DVec3> position;  ///< with `target`; replaces the view
  std::optional<DVec3> target;
  std::optional<int> file_camera;  ///< number of a camera in the file; replaces the view
  double fov_degrees = 45.0;
  std::optional<double> azimuth;  ///< with or without `elevation`; replaces the view
  std::optional<double> elevation;
  int turns = 1;                      ///< number of images of a turntable
  std::optional<FrameRange> frames;   ///< one image per frame
  std::filesystem::path camera_path;  ///< file with one camera per image; empty: none
  bool resume = false;                ///< keeps existing images of a series
  double frames_per_second = 24.0;    ///< for a video
  bool watch = false;                 ///< renders again when the input changes
  LightChoice light = LightChoice::Rays;
  Preset preset = Preset::Full;
  EnvironmentArguments environment;
  bool is_exposure_automatic = false;
  double emission_scale = 1.0;
  PathArguments path;  ///< for --light path
  std::optional<DetailChoice> detail;
  Backend backend = Backend::Cpu;
  std::string device;         ///< see VulkanOptions::device
  DensitySliceOptions slice;  ///< for --preset density

  [[nodiscard]] bool is_image_series() const { return frames || turns > 1 || !camera_path.empty(); }
  /// Returns true if a view option was given, which replaces the camera of the scene file.
  [[nodiscard]] bool has_view() const { return view || azimuth || elevation || turns > 1; }
  /// Returns the view direction for framing; for a turntable that of the first image.
  [[nodiscard]] DVec3 forward() const;
};

/// Adds the options of the command, which CLI11 reads into `arguments`.
void add_render_options(CLI::App& command, RenderArguments& arguments);

/// After parsing: checks the rules between options and sets what follows from several options.
/// Errors: InvalidArgument, for a command line that breaks a rule.
[[nodiscard]] Status settle(const CLI::App& command, RenderArguments& arguments);

}  // namespace quoin::tool
