#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/mesh/smooth_mesh.h>

#include "mesh/surface/faces.h"

namespace quoin::smooth {

/// A welded surface whose vertices stand there once each, and what its triangles are the faces of.
struct Surface {
  SmoothMesh mesh;
  std::vector<TriangleFace> faces;  ///< by triangle; empty where nobody asked for them
};

struct SurfaceRequest {
  /// Where the field is one body of several: all of them together, with the materials that tell them apart.
  const DensityGrid* whole = nullptr;
  bool with_faces = false;
};

/// `build_smooth_mesh`, before vertices are split by colours and normals. With sharp colours, albedo and types are
/// those of the faces only.
[[nodiscard]] Result<Surface> build_surface(const DensityGrid& field, const VoxelRegistry& types,
                                            const SmoothMeshOptions& options, const SurfaceRequest& request,
                                            Threads threads, const Progress& progress);

/// Splits the vertices as the options have it; returns the group of each vertex where the triangles' are given.
/// Requires: with sharp colours, or a smoothness below 1, the surface has its faces.
std::vector<std::uint32_t> finish_surface(Surface& surface, const VoxelRegistry& types,
                                          const SmoothMeshOptions& options, std::span<const std::uint32_t> groups = {});

/// Appends vertex `i` of a mesh, which may be the same one, with all that it has there. Returns its index.
/// Requires: both have occlusion, or `to` has no vertex yet, or neither has it.
std::uint32_t append_vertex(SmoothMesh& to, const SmoothMesh& from, std::size_t i);

/// The smoothness that options mean.
[[nodiscard]] float smoothness_of(const SmoothMeshOptions& options);

}  // namespace quoin::smooth
