#pragma once

#include <cstdint>
#include <vector>

#include <quoin/core/parallel.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/grid/density_grid.h>
#include <quoin/grid/voxel_registry.h>
#include <quoin/mesh/smooth.h>

namespace quoin::smooth {

/// Returns the body of a material: 0 for all opaque materials, a separate body for each transparent material.
[[nodiscard]] inline std::uint32_t body_of(const VoxelRegistry& types, VoxelType material) {
  return types.is_transparent(material) ? std::uint32_t{material} + 1U : 0U;
}

/// Returns the distinct bodies of some materials, sorted.
[[nodiscard]] std::vector<std::uint32_t> bodies_of(const VoxelRegistry& types, const std::vector<VoxelType>& materials);

/// Returns the bodies of a field, sorted. Solid samples without a material are opaque. Cost: O(chunks), except if there
/// is no transparent material.
[[nodiscard]] std::vector<std::uint32_t> bodies_of(const VoxelRegistry& types, const DensityGrid& field);

/// Returns true if any material of a chunk belongs to another body.
[[nodiscard]] bool holds_others(const DensityChunk& chunk, const VoxelRegistry& types, std::uint32_t body);

/// The samples of a chunk that are solid and of another body, row by row.
class OtherBodies {
 public:
  /// Lifetime: `chunk` must outlive this.
  OtherBodies(const DensityChunk& chunk, const VoxelRegistry& types, std::uint32_t body);

  /// Returns the samples of a row as bits. Requires: 0 <= y, z < 64.
  [[nodiscard]] std::uint64_t row(int y, int z) const;
  /// Returns true if the chunk certainly has no such samples. Always false for a transparent body.
  [[nodiscard]] bool empty() const { return listed_are_others_ && listed_.empty(); }

 private:
  const DensityChunk& chunk_;
  std::vector<VoxelType> listed_;
  bool listed_are_others_;
};

/// Returns a copy of a chunk in which solid samples of other bodies have their sign flipped.
[[nodiscard]] DensityChunk without_others(const DensityChunk& whole, const VoxelRegistry& types, std::uint32_t body);

/// Returns the densities of one of several bodies: `without_others` of all chunks. Shares the chunks of `whole` without
/// other bodies. For a transparent body, omits chunks that are not near it.
[[nodiscard]] DensityGrid field_of_body(const DensityGrid& whole, const VoxelRegistry& types, std::uint32_t body,
                                        Threads threads);

/// Returns a chunk of such a field.
[[nodiscard]] DensityChunk chunk_of_body(const DensityChunk& whole, const VoxelRegistry& types, std::uint32_t body);

/// Options for moving the vertices of a voxel field within their cells.
struct Shape {
  float smoothness = 1.0F;  ///< 0 to 1
  bool keep_thin = false;
  /// If the field is one of several bodies: the densities of all bodies together, with the materials that distinguish
  /// them. The vertices of cells with several bodies are then equal in each body. Null: there is one body.
  const DensityNeighbourhood* whole = nullptr;
  const VoxelRegistry* types = nullptr;  ///< not null with `whole`

  [[nodiscard]] bool moves() const { return smoothness < 1.0F || keep_thin || whole != nullptr; }
};

/// Moves the vertices of a chunk's mesh. Vertices of cells before the chunk get the same bits as in the chunk before.
///
/// Smoothness: the remaining share of the way from the middle of the cell to the vertex. For a cell with several sheets
///             it is at least 1/256, so that the sheets do not meet.
/// Thin:       a sample is thin along an axis if both neighbours there have the other sign, and it does not continue
///             diagonally on either side. A wall at 45 degrees, smooth and thick enough, is therefore not thin.
///             Vertices of level-0 cells with a corner that is thin along an axis keep a third of that way along it.
/// Bodies:     in a level-0 cell with samples of several bodies and one sheet, the vertex is the mean of the
///             crossings of all edges between different bodies or air, in the middle if both ends are solid. It is kept
///             as if thin. The normal is the normal of the whole field, if that is crossed. Quads with such a vertex
///             are split again, so that two bodies choose the same diagonal.
/// Cost:       up to 0.5 ms per chunk for thin features.
void shape_vertices(const DensityNeighbourhood& chunks, const SmoothOptions& options, const Shape& shape,
                    SmoothChunkMesh& mesh);

}  // namespace quoin::smooth
