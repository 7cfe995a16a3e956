#pragma once

#include <quoin/scene/scene.h>

namespace quoin {

/// The range around a grid's origin, in voxels, in which float vertices resolve 1/128 voxel.
inline constexpr int kNearVoxels = 1 << 16;

/// Returns a snapshot whose grids lie near their own origins. Use it before meshing, because mesh vertices are floats:
/// at 20,000,000 voxels, neighbouring floats are 2 apart. The snapshot shows the same voxels and densities at the same
/// world positions.
///
/// Grids within kNearVoxels of their origin stay as they are. In other grids, chunks and pivot move towards the origin
/// by whole chunks. Groups of chunks that are far apart become separate grids ("pieces"), placed by copies of the
/// instances. The first piece keeps the handles of the grid and its instances; further pieces get new handles.
///
///   const Scene near = near_grids(scene);
///   auto meshes = mesh_scene(near);
///
/// Pieces: at least two chunks apart, so faces and occlusion do not change.
/// Order:  pieces by the z, y, x of their position; the same on every run.
/// Cost:   one pointer per grid and chunk; O(chunks) for grids that move.
[[nodiscard]] Scene near_grids(const Scene& scene);

}  // namespace quoin
