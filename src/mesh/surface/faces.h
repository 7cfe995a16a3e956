#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <quoin/core/direction.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/mesh/smooth.h>

#include "mesh/surface/material.h"

namespace quoin::smooth {

/// What a triangle is the face of.
struct TriangleFace {
  IVec3 sample{0};  ///< the solid one, in the field's coordinates; of coarse cells, near there
  VoxelType type = kAir;
  Direction direction = Direction::PosX;  ///< from it into the air
};

/// The blended materials of a chunk's vertices; one of a cell before the chunk looks as it does in that chunk's mesh.
[[nodiscard]] std::vector<CellMaterial> materials_of(const DensityNeighbourhood& chunks, const SmoothOptions& options,
                                                     const SurfaceMaterials& materials, const SmoothChunkMesh& mesh);

/// How many of the indices are quads, six each, where all is of one level: the triangles after them have a vertex in a
/// bridge each.
[[nodiscard]] std::size_t quad_indices_of(const SmoothChunkMesh& mesh);

/// The faces of the triangles of a chunk's mesh, in the chunk's coordinates.
void find_faces(const DensityNeighbourhood& chunks, const SmoothOptions& options, const SurfaceMaterials& materials,
                const SmoothChunkMesh& mesh, std::vector<TriangleFace>& faces);

/// What tells the copies of a vertex apart, as far as that is asked for.
struct FaceLook {
  VoxelType type = kAir;
  Direction direction = Direction::PosX;
  std::uint32_t group = 0;

  bool operator==(const FaceLook&) const = default;
};

/// What of their faces tells triangles apart that share a vertex.
struct FaceDifferences {
  bool types = false;
  bool directions = false;
  std::span<const std::uint32_t> groups;  ///< by triangle; empty: all are one
};

/// A copy of a vertex, for the triangles whose faces look alike.
struct VertexCopy {
  std::uint32_t vertex = 0;
  FaceLook look;
};

/// Gives each of `vertices` vertices as many copies as its triangles' faces have looks: returns them, those of a vertex
/// next to each other in the order in which triangles need them, and makes `indices` name them. Vertices that no
/// triangle has get none. `faces`: by triangle.
std::vector<VertexCopy> split_by_faces(std::span<std::uint32_t> indices, std::size_t vertices,
                                       std::span<const TriangleFace> faces, const FaceDifferences& differences);

}  // namespace quoin::smooth
