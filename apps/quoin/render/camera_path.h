#pragma once

#include <filesystem>
#include <vector>

#include <quoin/scene/camera.h>

namespace quoin::tool {

/// Reads the cameras of an image series from a JSON array of objects, as `quoin render --json` prints under "camera".
/// Each object has `position` and either `forward` or `look_at`. Optional: `up`, `fov` (degrees) and, for
/// orthographic cameras, `view_height`.
///
/// Errors: CannotRead; BadFormat if the file is not such an array, is empty or has more than a million cameras; for an
///         invalid camera, the message has its index.
[[nodiscard]] Result<std::vector<Camera>> read_camera_path(const std::filesystem::path& path);

}  // namespace quoin::tool
