#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <quoin/core/assert.h>
#include <quoin/core/direction.h>
#include <quoin/core/vec.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/array_surface.h>
#include <quoin/mesh/blocky.h>
#include <quoin/mesh/smooth_mesh.h>

namespace [[gnu::visibility("default")]] quoin {

/// A non-owning view of one triangle surface, from any mesher. Vertex arrays have one entry per vertex. There are two
/// kinds of view:
///
/// Blocks: `directions` and `types` are set; the types' properties define the appearance, except of vertices with
///         `looks`. `block_occlusion`, `atlas` or neither.
/// Smooth: `normals` and `albedo` are set. `occlusion` is optional. `types` is optional and defines the appearance
///         except the colour.
///
/// Both kinds can have `light`.
///
/// Lifetime: owns no data; the arrays must outlive the view and stay unchanged.
struct MeshView {
  std::span<const Vec3> positions;
  std::span<const std::uint32_t> indices;  ///< three per triangle, counter-clockwise seen from outside

  SurfaceClass surface = SurfaceClass::Opaque;
  std::span<const Direction> directions;          ///< direction of the vertex's face
  std::span<const VoxelType> types;               ///< of blocks; also of smooth surfaces in a scene
  std::span<const std::uint8_t> block_occlusion;  ///< 0 (open) to 3 (dark)
  /// Texture coordinates from the upper left corner, for opaque blocks whose colours and occlusion are in a texture
  /// (SceneMeshes::atlas).
  std::span<const std::array<float, 2>> atlas;

  /// Looks of shapes and turned cubes, empty if there are none, and the faces that they name: BlockyTriangles.
  std::span<const VertexLook> looks;
  std::span<const VoxelFace> faces;

  /// Linear light that arrives at each vertex, for either kind. Multiply the vertex colour by it and show the product
  /// without further shading.
  std::span<const LinearRgba16> light;

  std::span<const Vec3> normals;               ///< unit length
  std::span<const LinearRgba16> albedo;        ///< without occlusion
  std::span<const float> occlusion;            ///< 0 (open) to 1 (dark)
  std::span<const VertexMaterials> materials;  ///< aligned (align_materials); empty: `types`, or unknown

  /// Returns true if the view is of the smooth kind.
  [[nodiscard]] bool has_albedo() const { return !albedo.empty(); }
};

/// Returns a view of one surface class of a blocky mesh. Lifetime: the mesh must outlive the view, unchanged.
[[nodiscard]] inline MeshView view_of(const BlockyTriangles& mesh, SurfaceClass surface) {
  MeshView view;
  view.positions = mesh.positions;
  view.indices = mesh.indices;
  view.surface = surface;
  view.directions = mesh.directions;
  view.types = mesh.types;
  view.block_occlusion = mesh.occlusion;
  view.looks = mesh.looks;
  view.faces = mesh.faces;
  return view;
}

/// Returns the face that a block's vertex shows, or null if it has its type's colour. Requires: a
/// view of blocks with types of `types`.
[[nodiscard]] inline const VoxelFace* face_at(const MeshView& view, std::size_t vertex, const VoxelRegistry& types) {
  QUOIN_ASSERT(vertex < view.types.size() && view.types[vertex] < types.size(), "a vertex of a registered type");
  if (!view.looks.empty() && view.looks[vertex].face != 0) return &view.faces[view.looks[vertex].face - 1];
  const VoxelFaces& faces = types[view.types[vertex]].faces;
  return faces.empty() ? nullptr : &faces[view.directions[vertex]];
}

/// Returns the normal of a block's vertex. Requires: the view is of blocks.
[[nodiscard]] inline Vec3 normal_at(const MeshView& view, std::size_t vertex) {
  const bool is_inclined = !view.looks.empty() && view.looks[vertex].normal != Vec3(0.0F);
  return is_inclined ? view.looks[vertex].normal : Vec3(normal_of(view.directions[vertex]));
}

/// Returns a view of a smooth mesh. Lifetime: the mesh must outlive the view, unchanged.
[[nodiscard]] inline MeshView view_of(const SmoothMesh& mesh) {
  MeshView view;
  view.positions = mesh.positions;
  view.indices = mesh.indices;
  view.normals = mesh.normals;
  view.albedo = mesh.albedo;
  view.occlusion = mesh.occlusion;
  view.materials = mesh.materials;
  return view;
}

/// Returns a view of an array surface or a label's surface (`surface_of_label`), which have no colours of their own.
/// Lifetime: surface and albedo must outlive the view, unchanged.
/// Requires: one albedo per vertex.
[[nodiscard]] inline MeshView view_of(const ArraySurface& surface, std::span<const LinearRgba16> albedo) {
  QUOIN_ASSERT(albedo.size() == surface.positions.size(), "one albedo per vertex");
  MeshView view;
  view.positions = {surface.positions.data(), surface.positions.size()};
  view.indices = {surface.indices.data(), surface.indices.size()};
  view.normals = {surface.normals.data(), surface.normals.size()};
  view.albedo = albedo;
  return view;
}

}  // namespace quoin
