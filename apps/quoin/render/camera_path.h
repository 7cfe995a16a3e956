#pragma once

#include <filesystem>
#include <vector>

#include <quoin/scene/camera.h>

namespace quoin::tool {

/// The cameras of a film: a JSON array of objects as `quoin render --json` prints them under "camera", with `position`;
/// `forward` or `look_at`; and, where they are not the usual ones, `up`, `fov` (degrees) and `view_height`, which makes
/// one orthographic.
///
/// Errors: CannotRead; BadFormat, which names the camera, for what is no such array, empty ones, more than a million
///         cameras, and cameras that cannot be.
[[nodiscard]] Result<std::vector<Camera>> read_camera_path(const std::filesystem::path& path);

}  // namespace quoin::tool
