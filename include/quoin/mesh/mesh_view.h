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

namespace quoin {

/// Triangles of one surface of any mesh, whichever mesher made them. Arrays of vertices have one entry a vertex. A view
/// is one of two kinds:
///
/// Blocks: `directions` and `types`, whose properties say how it looks; `block_occlusion`, or `atlas`, or none.
/// Smooth: `normals` and `albedo`; `occlusion`, or none; `types`, or none, whose properties except the colour say how
///         it looks.
/// Both: `light`, or none.
///
/// Lifetime: owns nothing; the arrays must outlive it, unchanged.
struct MeshView {
  std::span<const Vec3> positions;
  std::span<const std::uint32_t> indices;  ///< three a triangle, counter-clockwise seen from outside

  SurfaceClass surface = SurfaceClass::Opaque;
  std::span<const Direction> directions;          ///< of the face
  std::span<const VoxelType> types;               ///< of blocks; of smooth surfaces of a scene too
  std::span<const std::uint8_t> block_occlusion;  ///< 0 (open) to 3 (dark)
  /// Of opaque blocks whose colours and occlusion are in a texture (SceneMeshes::atlas): texture coordinates from its
  /// upper left corner.
  std::span<const std::array<float, 2>> atlas;

  /// What light arrives at a vertex, linear: its colour is to be multiplied with it and shown as it is. Of either kind.
  std::span<const LinearRgba16> light;

  std::span<const Vec3> normals;         ///< unit
  std::span<const LinearRgba16> albedo;  ///< without occlusion
  std::span<const float> occlusion;      ///< 0 (open) to 1 (dark)

  /// Whether it is of the smooth kind.
  [[nodiscard]] bool has_albedo() const { return !albedo.empty(); }
};

/// Lifetime: the mesh must outlive the view, unchanged.
[[nodiscard]] inline MeshView view_of(const BlockyTriangles& mesh, SurfaceClass surface) {
  MeshView view;
  view.positions = mesh.positions;
  view.indices = mesh.indices;
  view.surface = surface;
  view.directions = mesh.directions;
  view.types = mesh.types;
  view.block_occlusion = mesh.occlusion;
  return view;
}

/// Lifetime: the mesh must outlive the view, unchanged.
[[nodiscard]] inline MeshView view_of(const SmoothMesh& mesh) {
  MeshView view;
  view.positions = mesh.positions;
  view.indices = mesh.indices;
  view.normals = mesh.normals;
  view.albedo = mesh.albedo;
  view.occlusion = mesh.occlusion;
  return view;
}

/// A surface from an array (or that of a label, by `surface_of_label`), which has no colours of its own.
/// Lifetime: surface and albedo must outlive the view, unchanged.
/// Requires: as many of `albedo` as vertices.
[[nodiscard]] inline MeshView view_of(const ArraySurface& surface, std::span<const LinearRgba16> albedo) {
  QUOIN_ASSERT(albedo.size() == surface.positions.size(), "an albedo a vertex");
  MeshView view;
  view.positions = {surface.positions.data(), surface.positions.size()};
  view.indices = {surface.indices.data(), surface.indices.size()};
  view.normals = {surface.normals.data(), surface.normals.size()};
  view.albedo = albedo;
  return view;
}

}  // namespace quoin
