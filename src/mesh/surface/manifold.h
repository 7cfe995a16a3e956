#pragma once

#include <cstdint>
#include <vector>

#include <quoin/mesh/smooth_mesh.h>

namespace quoin {

/// The triangles of a mesh, and the position of each vertex.
struct Triangulation {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;  ///< three a triangle
  std::vector<std::uint32_t> corners;  ///< one per index: a value that stays with the corner
};

/// Gives every edge of a closed mesh one triangle on each side. Removes pairs of triangles that are back to back. A
/// vertex with several rings of triangles becomes one vertex per ring. These vertices move by `apart` (a length), each
/// towards its own ring, so that welding vertices by position does not join them again.
///
/// Triangles that form no ring (the mesh is open there) stay together. Cost: O(triangles), more if many triangles share
/// a vertex.
void make_manifold(Triangulation& mesh, float distance);

}  // namespace quoin
