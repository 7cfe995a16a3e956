#pragma once

#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// Errors: InvalidArgument, naming the first drawn instance whose transform is not finite, whose rotation is no
/// rotation or whose voxel size is not positive.
[[nodiscard]] Status check_placements(const Scene& scene, bool hidden);

}  // namespace quoin
