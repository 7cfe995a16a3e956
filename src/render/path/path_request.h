#pragma once

#include <quoin/core/result.h>
#include <quoin/render/path_tracer.h>
#include <quoin/scene/camera.h>

namespace quoin::path {

/// What PathTracer::render refuses. Requires: the camera's axes are perpendicular.
[[nodiscard]] Status check(const Camera& camera, const PathOptions& options);

/// With room for all that the options ask for.
[[nodiscard]] PathPicture empty_picture(const PathOptions& options);

}  // namespace quoin::path
