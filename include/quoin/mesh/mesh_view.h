#pragma once

#include <cstdint>
#include <span>

#include <quoin/mesh/blocky_mesh.h>
#include <quoin/mesh/smooth_mesh.h>

namespace quoin {

/// Triangles of one surface of any mesh, borrowed, for whoever reads them without minding who made them. Arrays of
/// vertices have one entry a vertex. A view is one of two kinds:
///
/// Blocks: `directions` and `types`, whose properties say how it looks, and `levels` unless there is no occlusion.
/// Smooth: `normals` and `albedo`, and `openness` unless there is no occlusion.
struct MeshView {
  std::span<const Vec3> positions;
  std::span<const std::uint32_t> indices;  ///< three a triangle, counter-clockwise seen from outside

  SurfaceClass surface = SurfaceClass::Opaque;
  std::span<const Direction> directions;  ///< of the face
  std::span<const VoxelType> types;       ///< of blocks
  std::span<const std::uint8_t> levels;   ///< occlusion, 0 (open) to 3

  std::span<const Vec3> normals;         ///< unit
  std::span<const LinearRgba16> albedo;  ///< without occlusion
  std::span<const float> openness;       ///< 0 (dark) to 1

  /// Whether it is of the smooth kind.
  [[nodiscard]] bool has_albedo() const { return !albedo.empty(); }
};

/// Requires: the mesh outlives the view, unchanged.
[[nodiscard]] inline MeshView view_of(const BlockyTriangles& mesh, SurfaceClass surface) {
  MeshView view;
  view.positions = mesh.positions;
  view.indices = mesh.indices;
  view.surface = surface;
  view.directions = mesh.directions;
  view.types = mesh.types;
  view.levels = mesh.levels;
  return view;
}

/// Requires: likewise.
[[nodiscard]] inline MeshView view_of(const SmoothMesh& mesh) {
  MeshView view;
  view.positions = mesh.positions;
  view.indices = mesh.indices;
  view.normals = mesh.normals;
  view.albedo = mesh.albedo;
  view.openness = mesh.openness;
  return view;
}

}  // namespace quoin
