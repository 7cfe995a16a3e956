#pragma once

// The cells of a chunk and its neighbours, where each chunk has its own level of detail. Coordinates are in samples of
// level 0, relative to the centre chunk's sample (0, 0, 0), unless stated otherwise.

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>

#include <quoin/core/assert.h>
#include <quoin/core/vec.h>
#include <quoin/grid/chunk.h>
#include <quoin/grid/density_chunk.h>
#include <quoin/mesh/smooth.h>

#include "grid/density/density_storage.h"
#include "mesh/smooth/cell.h"
#include "mesh/smooth/quad.h"

namespace quoin::smooth {

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
  explicit ChunkLevels(const std::array<std::uint8_t, 27>& levels) : levels_(levels) {}

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
    const IVec3 sample = first + corner_place(i) * cell.size();
    solid |= static_cast<std::uint32_t>(DensityChunk::is_solid(chunks.get(sample))) << i;
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

}  // namespace quoin::smooth
