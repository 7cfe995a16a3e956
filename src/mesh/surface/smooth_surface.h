#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/mesh/smooth_mesh.h>

#include "mesh/surface/face_materials.h"

namespace quoin::smooth {

/// A welded surface without duplicate vertices, and the voxel faces of its triangles.
struct Surface {
  SmoothMesh mesh;
  std::vector<TriangleFace> faces;  ///< by triangle; empty if not requested
};

struct SurfaceRequest {
  /// If the field is one of several bodies: the field of all bodies, with the materials that distinguish them.
  const DensityGrid* whole = nullptr;
  bool with_faces = false;
};

/// Like `build_smooth_mesh`, before vertices are split by colours and normals. With sharp colours, only the faces have
/// albedo and types.
[[nodiscard]] Result<Surface> build_surface(const DensityGrid& field, const VoxelRegistry& types,
                                            const SmoothMeshOptions& options, const SurfaceRequest& request,
                                            Threads threads, const Progress& progress);

/// Splits the vertices according to the options. Returns the group of each vertex if the triangles' groups are given.
/// Requires: with sharp colours, or a smoothness below 1, the surface has its faces.
std::vector<std::uint32_t> finish_surface(Surface& surface, const VoxelRegistry& types,
                                          const SmoothMeshOptions& options, std::span<const std::uint32_t> groups = {});

/// Appends vertex `i` of `from` with all its attributes. `from` may be `to` itself. Returns its index. Requires: both
/// have occlusion, or neither, or `to` has no vertex yet.
std::uint32_t append_vertex(SmoothMesh& to, const SmoothMesh& from, std::size_t i);

/// Returns the effective smoothness of the options.
[[nodiscard]] float smoothness_of(const SmoothMeshOptions& options);

}  // namespace quoin::smooth
