#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <quoin/core/image.h>
#include <quoin/core/result.h>
#include <quoin/render/cpu_renderer.h>
#include <quoin/render/path_tracer.h>
#include <quoin/render/vulkan_renderer.h>
#include <quoin/scene/camera.h>

#include "options.h"
#include "render/path_arguments.h"

namespace quoin::tool {

class PathImages;
struct RenderArguments;

/// Adds the options under the heading of output.
void add_output_options(CLI::App& command, RenderArguments& arguments);

/// Returns the rules for these options.
[[nodiscard]] std::vector<OptionRule> output_rules(const RenderArguments& arguments);

/// Files that were written.
struct WrittenFiles {
  std::vector<std::filesystem::path> paths;  ///< the image first
  std::uint64_t bytes = 0;
};

/// Writes an image in the format of `path`, and its depth with --depth.
/// `path_traced`: the renderer of the image if it is the path tracer, else null.
[[nodiscard]] Result<WrittenFiles> write_outputs(const RenderArguments& arguments, const RenderedImage& image,
                                                 const PathImages* path_traced, const std::filesystem::path& path);

/// Returns true if the file name has this extension (".png"), ignoring case.
[[nodiscard]] bool has_ending(const std::filesystem::path& path, const std::string& ending);

/// Fails unless the extension is that of an image format this build can write.
[[nodiscard]] Status check_image_name(const std::filesystem::path& path);

/// Writes an image in the format of its extension: .png, .jpg or .webp. Returns the file size.
/// Requires: `check_image_name` succeeds; an image with alpha is not .jpg.
[[nodiscard]] Result<std::uint64_t> write_image_file(const Image& image, const std::filesystem::path& path);
[[nodiscard]] Result<std::uint64_t> write_image_file(const AlphaImage& image, const std::filesystem::path& path);

/// Renders path-traced images with the interface of CpuRenderer, and keeps the layers for .exr files.
class PathImages {
 public:
  /// `with_layers`: keeps the additional layers of .exr files.
  PathImages(const Scene& scene, InstanceFilter filter, Threads threads, PathPlan plan, bool with_layers);

  /// Renders on a Vulkan device, which has the scene. Requires: `device` outlives this.
  PathImages(VulkanRenderer& device, const Scene& scene, InstanceFilter filter, PathPlan plan, bool with_layers);

  /// Uses the exposure of the plan. An automatic exposure is computed from the first image and used for all images.
  [[nodiscard]] Result<RenderedImage> render(const Camera& camera, const RenderOptions& options, Threads threads,
                                             const Progress& progress);

  /// Writes the last image as .exr, or with alpha. Returns the file size.
  [[nodiscard]] Result<std::uint64_t> write(const std::filesystem::path& path) const;
  /// The exposure of the images. To continue a series, call set_exposure before the first image.
  [[nodiscard]] double exposure() const { return exposure_.value_or(1.0); }
  [[nodiscard]] bool is_transparent() const { return plan_.is_transparent; }
  void set_exposure(std::optional<double> exposure) { exposure_ = exposure; }

 private:
  std::optional<PathTracer> tracer_;  // nullopt: `device_` renders
  VulkanRenderer* device_ = nullptr;
  PathPlan plan_;
  bool with_layers_;
  DVec3 middle_{0.0};  // centre of the scene
  std::optional<double> exposure_;
  PathImage last_;
};

/// Reads the cameras of an image series from a JSON array of objects, as `quoin render --json` prints under "camera".
/// Each object has `position` and either `forward` or `look_at`. Optional: `up`, `fov` (degrees) and, for
/// orthographic cameras, `view_height`.
///
/// Errors: CannotRead; BadFormat if the file is not such an array, is empty or has more than a million cameras; for an
///         invalid camera, the message has its index.
[[nodiscard]] Result<std::vector<Camera>> read_camera_path(const std::filesystem::path& path);

/// Returns true for the file name of a video: .mp4 or .webm.
[[nodiscard]] bool is_video(const std::filesystem::path& path);

/// A video that ffmpeg encodes from numbered images. The images are in a folder next to the video until it is complete,
/// so that an interrupted render can resume.
class Video {
 public:
  explicit Video(std::filesystem::path output) : output_(std::move(output)) {}

  /// The folder of the images, and the name in it that the numbered names extend.
  [[nodiscard]] std::filesystem::path folder() const;
  [[nodiscard]] std::filesystem::path image() const;

  /// Creates the folder, and empties it unless `resume`. Errors: Unsupported without ffmpeg; CannotWrite.
  [[nodiscard]] Status begin(bool resume) const;
  /// Encodes the video, complete or not at all, and removes the images. Returns the file size.
  /// `images`: files with consecutive numbers.
  /// Errors: CannotWrite, with the exit status of ffmpeg, which prints its own messages.
  [[nodiscard]] Result<std::uint64_t> write(const std::vector<std::filesystem::path>& images,
                                            double frames_per_second) const;

 private:
  std::filesystem::path output_;
};

}  // namespace quoin::tool
