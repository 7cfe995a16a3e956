#pragma once

#include <quoin/core/result.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// What files of voxels do not hold is not lost in silence. Errors: Unsupported for a field of densities.
[[nodiscard]] inline Status check_has_no_field(const SceneGrid& grid) {
  if (grid.field.chunk_count() == 0) return {};
  return make_error(ErrorCode::Unsupported,
                    "grid \"" + grid.name + "\" holds a field of densities, which this format does not");
}

}  // namespace quoin
