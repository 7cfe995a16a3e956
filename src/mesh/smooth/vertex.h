#pragma once

// Scalar code that adds single vertices to a chunk's mesh, for the cells that the fast kernels omit.

#include <array>
#include <limits>

#include <quoin/grid/density_chunk.h>
#include <quoin/mesh/smooth.h>

#include "mesh/smooth/cell.h"
#include "mesh/smooth/levels.h"
#include "mesh/smooth/scratch.h"

namespace quoin::smooth {

/// Reads single, nearby densities. Caches four rows along x, by the parity of y and z.
class NearbyDensities {
 public:
  explicit NearbyDensities(const DensityNeighbourhood& chunks) : chunks_(chunks) {}

  [[nodiscard]] Half get(IVec3 sample) {
    Row& row = rows_[static_cast<std::size_t>((sample.y & 1) + 2 * (sample.z & 1))];
    const IVec3 place{sample.x >> kChunkShift, sample.y, sample.z};
    if (place != row.place) row = find(place);
    return row.values == nullptr ? row.only : row.values[sample.x & (kChunkEdge - 1)];
  }

 private:
  struct Row {
    IVec3 place{std::numeric_limits<int>::min()};
    const Half* values = nullptr;
    Half only = 0;  // the value of a row without storage
  };

  [[nodiscard]] Row find(IVec3 place) const {
    const DensityChunk* const chunk = chunks_.at(place.x, place.y >> kChunkShift, place.z >> kChunkShift);
    if (chunk == nullptr) return {place, nullptr, chunks_.outside};
    const int y = place.y & (kChunkEdge - 1);
    const int z = place.z & (kChunkEdge - 1);
    const Half* const values = chunk->row(y, z);
    return {place, values, values == nullptr ? chunk->get(0, y, z) : Half{0}};
  }

  const DensityNeighbourhood& chunks_;
  std::array<Row, 4> rows_;
};

/// Writes all attributes of a vertex to an existing index.
inline void write_vertex(const DensityNeighbourhood& chunks, const SmoothOcclusionOptions& occlusion,
                         const LevelCell& cell, const CellVertex& vertex, std::uint32_t index, SmoothChunkMesh& out) {
  out.positions[index] = Vec3(cell.first) + vertex.snapped * static_cast<float>(cell.size());
  out.normals[index] = vertex.normal;
  if (occlusion.method == SmoothOcclusion::None) return;
  NearbyDensities nearby(chunks);
  const auto density = [&](int x, int y, int z) {
    return float_from_half(nearby.get(cell.first + IVec3{x, y, z} * cell.size())) * depth_unit(cell.level);
  };
  out.occlusion[index] =
      occlusion_at_vertex(vertex.snapped, vertex.normal, within_limits(occlusion, cell.level), density);
}

/// Appends a vertex. Returns its index.
inline std::uint32_t append_vertex(const DensityNeighbourhood& chunks, const SmoothOcclusionOptions& occlusion,
                                   const LevelCell& cell, const CellVertex& vertex, SmoothCell name,
                                   SmoothChunkMesh& out) {
  const std::size_t index = out.positions.size();
  out.positions.resize(index + 1);
  out.normals.resize(index + 1);
  if (occlusion.method != SmoothOcclusion::None) out.occlusion.resize(index + 1);
  out.cells.push_back(name);
  write_vertex(chunks, occlusion, cell, vertex, static_cast<std::uint32_t>(index), out);
  return static_cast<std::uint32_t>(index);
}

/// Returns a vertex at a position in its cell, with the gradient there.
inline CellVertex vertex_at(Vec3 fraction, Vec3 gradient) {
  CellVertex vertex;
  vertex.fraction = fraction;
  for (int i = 0; i < 3; ++i) vertex.snapped[i] = snap(fraction[i]);
  vertex.normal = unit_normal(gradient);
  return vertex;
}

/// Returns the corners of a quad of six indices, in its winding, starting with the corner of the first cell.
inline std::array<std::uint32_t, 4> corners_of_quad(const std::uint32_t* indices, const SmoothChunkMesh& mesh) {
  std::array<std::uint32_t, 4> cycle = {indices[0], indices[1], indices[2], indices[5]};
  const auto cell = [&](std::uint32_t vertex) {
    // At any level: within a quad of one level, cells of the chunk before have lower sums than cells of this chunk.
    const SmoothCell name = mesh.cells[vertex];
    const IVec3 place = name.cell() + name.chunk_offset() * kChunkEdge;
    return place.x + place.y + place.z;
  };
  const auto first =
      std::min_element(cycle.begin(), cycle.end(), [&](std::uint32_t a, std::uint32_t b) { return cell(a) < cell(b); });
  std::rotate(cycle.begin(), first, cycle.end());
  return cycle;
}

}  // namespace quoin::smooth
