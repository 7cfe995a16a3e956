#pragma once

#include <cstdint>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/mesh/smooth_mesh.h>

namespace quoin {

/// Like `simplify_smooth_mesh`, with an optional number per vertex that stays with it.
[[nodiscard]] Result<float> simplify_tagged(SmoothMesh& mesh, float error_in_samples, std::vector<std::uint32_t>& tags);

}  // namespace quoin
