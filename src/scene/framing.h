#pragma once

#include <array>
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

/// The same where it looks along `forward`, a unit vector.
[[nodiscard]] Camera frame(DVec3 middle, const Reach& reach, DVec3 forward, double aspect);

/// The four directions whose reaches `frame` asks for, in its order.
[[nodiscard]] std::array<DVec3, 4> framing_directions(DVec3 forward, double aspect);

}  // namespace quoin
