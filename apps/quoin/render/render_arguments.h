#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <quoin/render/cpu_renderer.h>
#include <quoin/render/density_slice.h>
#include <quoin/scene/camera.h>

#include "commands.h"
#include "render/path_arguments.h"
#include "volume_options.h"

namespace quoin::tool {

/// A range of animation frames, including both ends.
struct FrameRange {
  int first = 0;
  int last = 0;
};

/// The options of `quoin render`.
struct RenderArguments {
  CommonOptions common;
  std::filesystem::path output;
  std::filesystem::path depth;  ///< empty: none
  RenderOptions render;         ///< size, samples, light and detail
  std::string view_name = "iso";
  View view = View::Iso;
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
  bool has_view = false;              ///< a view option was given: ignores the camera of the scene file
  bool has_sun = false;               ///< --sun was given: ignores the sun of the scene file
  bool has_fixed_sky = false;
  bool has_plain_glass = false;
  bool watch = false;  ///< renders again when the input changes
  std::string light_model = "rays";
  double emission_scale = 1.0;
  PathArguments path;  ///< for the light model path
  std::string preset = "full";
  std::string occlusion = "rays";
  std::string occlusion_affects = "ambient";
  std::string backend = "cpu";
  std::string device;  ///< see VulkanOptions::device
  std::string detail = "near";
  VolumeTexts volume_texts;
  VolumeArguments volume;
  DensitySliceOptions slice;  ///< for the preset density

  [[nodiscard]] bool is_film() const { return frames || turns > 1 || !camera_path.empty(); }
  /// Returns the view direction for framing; for a turntable that of the first image.
  [[nodiscard]] DVec3 forward() const;
};

/// Adds the options of the command. CLI11 reads some into `arguments`; `settle` reads the others.
void add_render_options(CLI::App& command, RenderArguments& arguments);

/// After parsing: reads the remaining options and resolves combinations of options. Returns a usage error, or "".
[[nodiscard]] std::string settle(const CLI::App& command, RenderArguments& arguments);

}  // namespace quoin::tool
