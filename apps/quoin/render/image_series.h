#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/scene/camera.h>

namespace quoin::tool {

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
