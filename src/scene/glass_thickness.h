#pragma once

#include <span>
#include <vector>

#include <quoin/grid/grid.h>
#include <quoin/scene/scene_meshes.h>

namespace quoin {

/// How thick the bodies of each transparent type are, by type: looked up straight in from the middle of each triangle
/// of the grid's surfaces, 1,024 voxels deep at most.
///
/// Cost: a voxel for each that lies behind a triangle's middle.
[[nodiscard]] std::vector<GlassThickness> glass_thickness(const Grid& grid, std::span<const MeshView> surfaces);

}  // namespace quoin
