#pragma once

#include <cstdint>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/core/progress.h>
#include <quoin/core/result.h>
#include <quoin/mesh/blocky_mesh.h>
#include <quoin/scene/scene.h>

namespace quoin {

/// The mesh of one grid of a scene.
struct GridMesh {
  GridHandle grid;
  BlockyMesh mesh;  ///< may be without a face
};

/// The meshes of every grid that a drawn instance places; a grid that is placed several times is meshed once.
struct SceneMeshes {
  std::vector<GridMesh> grids;  ///< in the order of their handles
  bool occlusion = true;        ///< whether the levels say anything
  bool hidden = false;          ///< whether instances that are not visible count as drawn

  std::int64_t faces_visible = 0;
  std::int64_t faces_total = 0;
  std::int64_t quads = 0;
  std::int64_t triangles = 0;
  std::int64_t vertices = 0;

  /// Null for a grid that no drawn instance places. Cost: O(log grids).
  [[nodiscard]] const BlockyMesh* find(GridHandle grid) const;
};

/// Whether an instance is drawn: its grid exists, and it is visible or hidden ones are asked for.
[[nodiscard]] bool is_drawn(const Scene& scene, const Instance& instance, bool hidden);

/// Meshes every grid that a drawn instance places.
///
/// Order:  the same bytes at any thread count.
/// Errors: those of build_blocky_mesh; Cancelled when `progress` says so; InvalidArgument when a voxel that has a
///         visible face is of a type that is not registered, since files could not say what it looks like.
[[nodiscard]] Result<SceneMeshes> mesh_scene(const Scene& scene, const BlockyMeshOptions& options, bool hidden = false,
                                             Threads threads = {}, const Progress& progress = {});

}  // namespace quoin
