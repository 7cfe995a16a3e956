#pragma once

#include <array>
#include <functional>

#include <quoin/scene/camera.h>

namespace quoin {

/// A function that returns the maximum dot product of a direction (of any length) with the vectors from the middle
/// point to the points of an object.
using Reach = std::function<double(DVec3 direction)>;

/// Returns a camera whose image shows the whole object, filling it except for a margin.
///
/// Requires: the object has an inside; everything is finite.
[[nodiscard]] Camera frame(DVec3 middle, const Reach& reach, View view, double aspect);

/// As above, for a camera that looks along `forward`, a unit vector.
[[nodiscard]] Camera frame(DVec3 middle, const Reach& reach, DVec3 forward, double aspect);

/// Returns the four directions that `frame` passes to `reach`, in order.
[[nodiscard]] std::array<DVec3, 4> framing_directions(DVec3 forward, double aspect);

}  // namespace quoin
