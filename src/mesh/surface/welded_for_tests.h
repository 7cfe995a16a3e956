#pragma once

#include <array>
#include <cstdint>
#include <map>

#include <quoin/mesh/smooth_mesh.h>

namespace quoin {

/// Welds vertices by position and removes normals.
inline SmoothMesh welded(const SmoothMesh& mesh) {
  SmoothMesh whole;
  std::map<std::array<float, 3>, std::uint32_t> known;
  for (const std::uint32_t index : mesh.indices) {
    const Vec3 p = mesh.positions[index];
    const auto [found, is_new] = known.try_emplace({p.x, p.y, p.z}, static_cast<std::uint32_t>(whole.positions.size()));
    if (is_new) whole.positions.push_back(p);
    whole.indices.push_back(found->second);
  }
  return whole;
}

}  // namespace quoin
