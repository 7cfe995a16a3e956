#pragma once

#include <glm/mat4x4.hpp>

#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// Errors: InvalidArgument, naming the first drawn instance whose transform is not finite, whose rotation is no
/// rotation or whose voxel size is not positive.
[[nodiscard]] Status check_placements(const Scene& scene, bool hidden);

/// Takes points of the instance's grid, relative to its pivot, to the world.
[[nodiscard]] glm::dmat4 world_from_pivot(const Instance& instance);

}  // namespace quoin
