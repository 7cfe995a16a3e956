#pragma once

#include <cstdint>
#include <vector>

#include <quoin/mesh/smooth_mesh.h>

namespace quoin {

/// The triangles of a mesh, and the place of each vertex.
struct Triangulation {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;  ///< three a triangle
  std::vector<std::uint32_t> corners;  ///< one an index: whatever the corner is to keep
};

/// Makes every edge of a closed mesh have one triangle on each side: pairs of triangles that lie back to back are
/// removed, and a vertex whose triangles form several rings becomes one vertex a ring. These are drawn `apart` (a
/// length) from their place, each towards its own ring, so that whoever takes vertices of one place for one finds
/// nothing else.
///
/// What is no ring (the mesh is open there) stays together. Cost: O(triangles), more where many meet in one vertex.
void make_manifold(Triangulation& mesh, float apart);

}  // namespace quoin
