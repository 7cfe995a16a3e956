#pragma once

#include <functional>

#include <quoin/scene/camera.h>

namespace quoin {

/// How far something reaches along a direction (of any length) from the point called its middle: the greatest dot
/// product with any of its points.
using Reach = std::function<double(DVec3 direction)>;

/// A camera that has all of it in the picture, filling it but for a margin.
///
/// Requires: it has an inside; everything is finite.
[[nodiscard]] Camera frame(DVec3 middle, const Reach& reach, View view, double aspect);

}  // namespace quoin
