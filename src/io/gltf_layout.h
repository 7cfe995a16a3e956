#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/io/scene_meshes.h>
#include <quoin/scene/scene.h>

#include "io/gltf_views.h"
#include "io/material_palette.h"
#include "io/surface_parts.h"

namespace quoin {

/// One primitive's arrays and where they lie, in the order in which they are written.
struct GltfPrimitive {
  const BlockyTriangles* triangles = nullptr;
  std::size_t material = 0;
  bool wide_indices = false;  ///< 32 bits instead of 16
  Vec3 min{0.0F};             ///< of the positions as written
  Vec3 max{0.0F};
  GltfView positions;
  GltfView normals;
  GltfView texture_coordinates;
  GltfView colours;  ///< 0 bytes without occlusion
  GltfView indices;

  [[nodiscard]] std::uint64_t vertex_count() const { return triangles->positions.size(); }
};

/// A grid's mesh as the file has it: as it is, or reflected for mirrored instances.
struct GltfMesh {
  std::string name;
  DVec3 pivot{0.0};  ///< subtracted from the vertices
  bool mirrored = false;
  std::vector<GltfPrimitive> primitives;
};

struct GltfImage {
  std::string name;
  std::vector<std::byte> png;
  GltfView view;
};

/// Where everything lies in the buffer of a glTF file; borrows the meshes' arrays.
struct GltfLayout {
  MaterialPalette palette;
  std::vector<GltfMesh> meshes;
  std::map<std::pair<GridHandle, bool>, std::size_t> mesh_of;  ///< by grid and reflection; meshes with faces only
  std::vector<GltfImage> images;                               ///< base colour, metallic-roughness, perhaps emissive
  std::vector<SurfaceParts> parts;
  bool occlusion = true;
  std::uint64_t buffer_bytes = 0;
};

/// A point of the grid as the mesh has it: relative to the pivot, and reflected when the mesh is.
[[nodiscard]] inline Vec3 position_in_mesh(const GltfMesh& mesh, Vec3 in_grid) {
  Vec3 position(DVec3(in_grid) - mesh.pivot);
  if (mesh.mirrored) position.x = 0.0F - position.x;
  return position;
}

/// Requires: `scene` and `meshes` outlive the layout. Errors: LimitExceeded from the PNG encoder.
[[nodiscard]] Result<GltfLayout> lay_out_gltf(const Scene& scene, const SceneMeshes& meshes);

}  // namespace quoin
