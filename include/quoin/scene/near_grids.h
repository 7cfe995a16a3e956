#pragma once

#include <quoin/scene/scene.h>

namespace quoin {

/// The range around a grid's origin in which float vertices keep fractions of 1/128 voxel, in voxels.
inline constexpr int kNearVoxels = 1 << 16;

/// Returns a snapshot whose grids lie near their own origins, for meshers, whose vertices are floats: at 20,000,000
/// voxels floats are 2 apart. The scene shows the same voxels and densities at the same world positions.
///
/// Grids within kNearVoxels of their origin stay as they are. The chunks of others move towards the origin by whole
/// chunks, and the pivot moves with them. Chunks that are far apart become grids of their own, which copies of the
/// instances place: the first piece keeps the handles of grid and instances, further pieces get new ones.
///
///   const Scene near = near_grids(scene);
///   auto meshes = mesh_scene(near);
///
/// Pieces: are at least two chunks apart, so no face and no occlusion changes.
/// Order:  pieces by z, y, x of their places, the same on every run.
/// Cost:   a pointer per grid and chunk; O(chunks) of grids that are far.
[[nodiscard]] Scene near_grids(const Scene& scene);

}  // namespace quoin
