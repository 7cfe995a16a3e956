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

/// Frames of an animation, both included.
struct FrameRange {
  int first = 0;
  int last = 0;
};

/// What `quoin render` was asked for.
struct RenderArguments {
  CommonOptions common;
  std::filesystem::path output;
  std::filesystem::path depth;  ///< empty: none
  RenderOptions render;         ///< size, samples, light and detail
  std::string view_name = "iso";
  View view = View::Iso;
  std::optional<DVec3> position;  ///< with `target`, instead of the view
  std::optional<DVec3> target;
  std::optional<int> file_camera;  ///< number of a camera of the file, instead of the view
  double fov_degrees = 45.0;
  std::optional<double> azimuth;  ///< with or without `elevation`, instead of the view
  std::optional<double> elevation;
  int turns = 1;                      ///< pictures once round the scene
  std::optional<FrameRange> frames;   ///< a picture of each
  std::filesystem::path camera_path;  ///< a picture of each camera in that file; empty: none
  bool resume = false;                ///< pictures of a film that are there stay
  double frames_per_second = 24.0;    ///< of a film in one file
  bool has_view = false;              ///< --view was given: a scene file's camera does not count
  bool has_sun = false;               ///< likewise
  bool has_fixed_sky = false;
  bool has_plain_glass = false;
  bool watch = false;  ///< draws again whenever the input changes
  std::string light_model = "rays";
  double emission_scale = 1.0;
  PathArguments path;  ///< of the light model path
  std::string preset = "full";
  std::string occlusion = "rays";
  std::string occlusion_affects = "ambient";
  std::string backend = "cpu";
  std::string device;  ///< as VulkanOptions::device
  std::string detail = "near";
  VolumeTexts volume_texts;
  VolumeArguments volume;
  DensitySliceOptions slice;  ///< of the preset density

  [[nodiscard]] bool is_film() const { return frames || turns > 1 || !camera_path.empty(); }
  /// Where the camera of views and films looks first.
  [[nodiscard]] DVec3 forward() const;
};

/// Adds the command's options, which fill in what CLI11 can read by itself.
void add_render_options(CLI::App& command, RenderArguments& arguments);

/// Once all are parsed: reads the rest, settles what several options decide together, and returns what is wrong with
/// the usage, or "".
[[nodiscard]] std::string settle(const CLI::App& command, RenderArguments& arguments);

}  // namespace quoin::tool
