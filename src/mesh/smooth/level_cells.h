// The cells of a chunk and its neighbours, where each chunk has its own level of detail, with their quads and vertices:
// for all code except the fast kernels. Coordinates are in samples of level 0, relative to the centre chunk's sample
// (0, 0, 0), unless stated otherwise.

#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>

#include <quoin/core/assert.h>
#include <quoin/core/buffer.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/mesh/smooth.h>

#include "grid/density/density_storage.h"
#include "mesh/smooth/smooth_cell.h"
#include "mesh/smooth/smooth_mesher.h"

namespace quoin::smooth {

/// Returns the name of a cell of a chunk at `offset` (0 or -1 on each axis) from the mesh's chunk.
inline SmoothCell cell_name(IVec3 cell, IVec3 offset) {
  QUOIN_ASSERT((cell.x | cell.y | cell.z) >= 0 && (cell.x | cell.y | cell.z) < kChunkEdge, "a cell of the chunk");
  QUOIN_ASSERT((IBox{IVec3(-1), IVec3(1)}.contains(offset)), "0 or -1 on each axis");
  std::uint32_t bits = 0;
  for (int axis = 0; axis < 3; ++axis) {
    bits |= static_cast<std::uint32_t>(cell[axis]) << (kChunkShift * axis);
    bits |= static_cast<std::uint32_t>(offset[axis] != 0) << (SmoothCell::kPreviousShift + axis);
  }
  return {bits};
}

/// A corner of a quad. Corners are compared in units of 1/64 cell, so that length comparisons are exact.
struct QuadCorner {
  std::uint32_t vertex;
  int level;    ///< level of its cell
  IVec3 place;  ///< in 1/64 of a sample
};

/// Returns a vertex in the cell that starts at the sample `first` and has width 2^level.
inline QuadCorner quad_corner(std::uint32_t vertex, Vec3 position, IVec3 first, int level) {
  QUOIN_ASSERT(level >= 0 && level <= kMaxSmoothLevel, "a level of detail");
  const auto size = static_cast<float>(1 << level);
  QuadCorner corner{vertex, level, first * 64};
  for (int axis = 0; axis < 3; ++axis) {
    const float fraction = (position[axis] - static_cast<float>(first[axis])) / size;
    corner.place[axis] += std::min(static_cast<int>(fraction * 64.0F), 63) * (1 << level);
  }
  return corner;
}

inline bool quad_is_split_at_first(const std::array<QuadCorner, 4>& q) {
  const auto is_finest = [&](std::size_t i) {
    return q[i].level <= q[0].level && q[i].level <= q[1].level && q[i].level <= q[2].level && q[i].level <= q[3].level;
  };
  // A triangle without a cell of the finest level might exist twice: again around the next part of a long edge.
  const bool first_allowed = is_finest(0) || is_finest(2);
  const bool second_allowed = is_finest(1) || is_finest(3);
  if (first_allowed != second_allowed) return first_allowed;
  const auto squared_length = [](IVec3 v) { return v.x * v.x + v.y * v.y + v.z * v.z; };
  return squared_length(q[0].place - q[2].place) <= squared_length(q[1].place - q[3].place);
}

/// Returns two triangles along the shorter diagonal with an end at the finest level; of equal ones, the diagonal from
/// corner 0.
inline std::array<std::uint32_t, 6> triangles_of(const std::array<QuadCorner, 4>& q) {
  const auto [a, b, c, d] =
      split_quad(q[0].vertex, q[1].vertex, q[2].vertex, q[3].vertex, true, !quad_is_split_at_first(q));
  return {a, b, c, a, c, d};
}

/// A cell of the centre chunk or a neighbour.
struct LevelCell {
  IVec3 chunk;  ///< -1 to 1 on each axis
  IVec3 first;  ///< its first corner
  int level;

  [[nodiscard]] int size() const { return 1 << level; }
  [[nodiscard]] SmoothCell name() const { return cell_name((first - chunk * kChunkEdge) / size(), chunk); }
};

/// The coarsest and finest level of some chunks.
struct LevelRange {
  int finest;
  int coarsest;
};

class ChunkLevels {
 public:
  /// `levels`: as in SmoothOptions, clamped in the same way.
  explicit ChunkLevels(const std::array<std::uint8_t, 27>& levels) : levels_(levels) {
    for (std::uint8_t& level : levels_) level = std::min<std::uint8_t>(level, kMaxSmoothLevel);
  }

  [[nodiscard]] int of_chunk(IVec3 chunk) const {
    QUOIN_ASSERT((IBox{IVec3(-1), IVec3(2)}.contains(chunk)), "the chunk or one of its 26 neighbours");
    return levels_[static_cast<std::size_t>((chunk.z + 1) * 9 + (chunk.y + 1) * 3 + chunk.x + 1)];
  }
  [[nodiscard]] bool all_same() const {
    return std::all_of(levels_.begin(), levels_.end(), [&](std::uint8_t level) { return level == levels_[0]; });
  }

  /// Returns the cell that starts at a sample or contains the unit cube that starts there.
  [[nodiscard]] LevelCell cell_at(IVec3 sample) const {
    const IVec3 chunk = chunk_of(sample);
    const int level = of_chunk(chunk);
    return {chunk, sample & IVec3{-(1 << level)}, level};
  }
  /// Returns the cell of a mesh vertex.
  [[nodiscard]] LevelCell cell_of(SmoothCell name) const {
    // Constructed in place: a copy of three integers would wait for their stores.
    LevelCell cell{name.chunk_offset(), name.cell(), 0};
    cell.level = of_chunk(cell.chunk);
    for (int axis = 0; axis < 3; ++axis) {
      cell.first[axis] = cell.chunk[axis] * kChunkEdge + (cell.first[axis] << cell.level);
    }
    return cell;
  }

  /// Returns the levels of the chunks that meet in the line along `axis` through a sample: one, two or four chunks.
  [[nodiscard]] LevelRange around_line(IVec3 sample, int axis) const {
    IVec3 step{0};
    for (const int other : {(axis + 1) % 3, (axis + 2) % 3}) step[other] = (sample[other] & (kChunkEdge - 1)) == 0;
    return range(chunk_of(sample) - step, chunk_of(sample), [](IVec3) { return true; });
  }
  /// Returns the range of levels of the chunks that a cell touches along a face or an edge, including its own.
  [[nodiscard]] LevelRange around_cell(const LevelCell& cell) const {
    IVec3 min = cell.chunk;
    IVec3 max = cell.chunk;
    for (int axis = 0; axis < 3; ++axis) {
      if (cell.first[axis] == cell.chunk[axis] * kChunkEdge) --min[axis];
      if (cell.first[axis] + cell.size() == (cell.chunk[axis] + 1) * kChunkEdge) ++max[axis];
    }
    return range(min, max, [&](IVec3 chunk) {
      const IVec3 away = glm::abs(chunk - cell.chunk);
      return away.x + away.y + away.z < 3;
    });
  }
  [[nodiscard]] bool touches_finer(const LevelCell& cell) const { return around_cell(cell).finest < cell.level; }
  [[nodiscard]] bool touches_another(const LevelCell& cell) const {
    const LevelRange levels = around_cell(cell);
    return levels.finest != levels.coarsest;
  }

 private:
  template <class Counts>
  [[nodiscard]] LevelRange range(IVec3 min, IVec3 max, const Counts& counts) const {
    LevelRange found{kMaxSmoothLevel, 0};
    for (int z = min.z; z <= max.z; ++z) {
      for (int y = min.y; y <= max.y; ++y) {
        for (int x = min.x; x <= max.x; ++x) {
          if (!counts(IVec3{x, y, z})) continue;
          const int level = of_chunk({x, y, z});
          found = {std::min(found.finest, level), std::max(found.coarsest, level)};
        }
      }
    }
    return found;
  }

  std::array<std::uint8_t, 27> levels_;
};

/// Returns the densities of a cell's corners.
inline Corners corners_of(const DensityNeighbourhood& chunks, const LevelCell& cell) {
  Corners corners;
  const auto find_chunk = [&](IVec3 chunk) { return chunks.at(chunk.x, chunk.y, chunk.z); };
  const auto outside = [&] { return float_from_half(chunks.outside); };
  read_cell_corners(cell.first, cell.size(), find_chunk, outside, corners.data());
  return corners;
}

/// Returns the signs of a row of a chunk's samples: the bits of solid samples are set.
inline std::uint64_t signs_of(const DensityChunk& chunk, int y, int z) {
  QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
  const DensityStorage* const storage = DensityStorage::of(chunk);
  if (storage == nullptr) return chunk.solid_row(0, 0);
  return storage->solid[static_cast<std::size_t>(z * kChunkEdge + y)];
}

/// Returns true if a sample in or next to the chunk is solid. Faster than to read its density.
inline bool is_solid_at(const DensityNeighbourhood& chunks, IVec3 sample) {
  const IVec3 chunk = chunk_of(sample);
  const IVec3 local = local_of(sample);
  const DensityChunk* const found = chunks.at(chunk.x, chunk.y, chunk.z);
  if (found == nullptr) return DensityChunk::is_solid(chunks.outside);
  return (signs_of(*found, local.y, local.z) >> local.x & 1U) != 0;
}

/// Returns the solid corners of a cell as bits, like solid_corners.
inline std::uint32_t solid_corners_of(const DensityNeighbourhood& chunks, const LevelCell& cell) {
  const IVec3 first = cell.first;
  const bool inside = cell.level == 0 && cell.chunk == IVec3{0} && std::max({first.x, first.y, first.z}) < 63;
  if (const DensityChunk* centre = chunks.centre(); inside && centre != nullptr) {
    const DensityStorage* const storage = DensityStorage::of(*centre);
    if (storage == nullptr) return centre->solid_row(0, 0) != 0 ? 255U : 0U;
    const std::uint64_t* const rows = storage->solid.data() + first.z * kChunkEdge + first.y;
    const auto pair = [&](int y, int z) {
      return static_cast<std::uint32_t>(rows[z * kChunkEdge + y] >> first.x & 3U);
    };
    return pair(0, 0) | pair(1, 0) << 2 | pair(0, 1) << 4 | pair(1, 1) << 6;
  }
  std::uint32_t solid = 0;
  for (int i = 0; i < 8; ++i) {
    solid |= static_cast<std::uint32_t>(is_solid_at(chunks, first + corner_place(i) * cell.size())) << i;
  }
  return solid;
}

/// Returns true if all samples within a cell and on its boundary have the same sign.
inline bool is_of_one_sign(const DensityNeighbourhood& chunks, const LevelCell& cell) {
  const int x = cell.first.x & (kChunkEdge - 1);
  const bool ends_within = x + cell.size() < kChunkEdge;
  const std::uint64_t samples = ((std::uint64_t{2} << cell.size()) - 1) << x;
  std::uint64_t any = 0;
  std::uint64_t all = samples;
  for (int z = cell.first.z; z <= cell.first.z + cell.size(); ++z) {
    for (int y = cell.first.y; y <= cell.first.y + cell.size(); ++y) {
      const IVec3 chunk = chunk_of({cell.first.x, y, z});
      const IVec3 local = local_of({0, y, z});
      const auto row = [&](int chunk_x) {
        const DensityChunk* found = chunks.at(chunk_x, chunk.y, chunk.z);
        if (found != nullptr) return found->solid_row(local.y, local.z);
        return DensityChunk::is_solid(chunks.outside) ? ~std::uint64_t{0} : 0;
      };
      any |= row(chunk.x) & samples;
      all &= row(chunk.x);
      // The last sample of the cell may be the first of the next chunk; the bit beyond the word represents it.
      if (ends_within) continue;
      const bool last = (row(chunk.x + 1) & 1U) != 0;
      any |= last ? std::uint64_t{1} << 63 : 0;
      if (!last) all = 0;
    }
  }
  return any == 0 || all == samples;
}

/// Replaces `out` by the vertices of the centre chunk's own cells, 0 to n - 1 on each axis at its level, sorted by
/// name, and the quads around the edges between four of these cells.
using MeshOwnCells = std::function<void(SmoothChunkMesh& out)>;

/// Replaces `out` by the surface of the centre chunk, if the chunk or a neighbour has another level of detail.
///
/// Edges:    the shortest lattice edges at each position: on a face or a line between chunks, the edges of the finest
///           chunk that touches it. Each crossed edge gives a polygon that connects the vertices of the three or four
///           cells around it.
/// Vertices: a cell that touches no finer chunk along a face or an edge has the exact vertex of the fast kernels.
///           Any other cell has a vertex if a shortest edge on its boundary is crossed: at the mean of the crossings,
///           weighted by length.
/// Order:    the fast kernel's vertices and quads, then the missing vertices, the quads, the triangles.
/// Requires: options.border is Shared.
/// Source:   T. Ju, F. Losasso, S. Schaefer, J. Warren, "Dual Contouring of Hermite Data" (2002): polygons of the
///           minimal edges of an octree; here for chunks of any levels. docs/decisions/020-smooth-chunk-borders.md.
void mesh_with_transitions(const DensityNeighbourhood& chunks, const SmoothOptions& options,
                           const MeshOwnCells& mesh_own_cells, SmoothChunkMesh& out);

/// Gives each cell of `out` that several sheets cross one vertex per sheet. The vertices of other cells stay unchanged.
/// Cells that touch a chunk of another level along a face or an edge keep one vertex. A sheet's vertex is the mean of
/// its crossings, its normal the gradient there.
///
/// Quads:    the first `quad_indices` of the indices, six per quad.
/// Bridges:  with `join_diagonals`, two cells that both have all crossings of their common face in one sheet get two
///           vertices on that face, one for each of its air corners, on the edge that joins the two cells. Each of the
///           edges then has two triangles instead of four. Quads along such an edge become polygons, which come last.
/// Order:    a cell's first sheet keeps the cell's vertex index; the other sheets are appended.
/// Proof:    docs/decisions/archive/021-two-sheets.md.
void split_sheets(const DensityNeighbourhood& chunks, const SmoothOptions& options, std::size_t quad_indices,
                  SmoothChunkMesh& out);

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
