#pragma once

#include <glm/mat3x3.hpp>

#include <quoin/scene/scene.h>

namespace quoin {

/// The grid's axes in the world, as columns: the rotation after the mirror, without the voxels' size. Exact for quarter
/// turns, whose quaternions hold the irrational square root of one half.
[[nodiscard]] glm::dmat3 world_axes(const Instance& instance);

}  // namespace quoin
