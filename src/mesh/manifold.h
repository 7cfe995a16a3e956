#pragma once

#include <quoin/mesh/smooth_mesh.h>

namespace quoin {

/// Makes every edge of a closed mesh have one triangle on each side, without moving anything: pairs of triangles that
/// lie back to back are removed, and a vertex whose triangles form several rings becomes one vertex a ring.
///
/// What is no ring (the mesh is open there) stays together. Cost: O(triangles), more where many meet in one vertex.
void make_manifold(SmoothMesh& mesh);

}  // namespace quoin
