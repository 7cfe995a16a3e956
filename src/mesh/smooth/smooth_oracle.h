#pragma once

// The slow, obvious Surface Nets, one cell and one edge at a time: the reference for the fast ones.

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <tuple>

#include <quoin/grid/density_chunk.h>
#include <quoin/mesh/smooth.h>

#include "mesh/smooth/level_cells.h"
#include "mesh/smooth/smooth_cell.h"
#include "mesh/smooth/smooth_mesher.h"

namespace quoin::oracle {

/// Returns the sample at a lattice point of the meshed level.
using LatticeDensity = std::function<float(IVec3 point)>;

/// The part of a field to mesh: vertices of the cells in `cells`, and quads around the edges that start in `edges` and
/// have all their cells in `cells`.
struct SmoothPart {
  IBox cells;
  IBox edges;
  int level = 0;
  SmoothOcclusionOptions occlusion;
};

/// Returns the part that SmoothMesher::mesh covers for this border and level. Requires: all levels are equal.
inline SmoothPart part_of_chunk(const SmoothOptions& options) {
  const int n = kChunkEdge >> options.levels[13];
  SmoothPart part{{IVec3{-1}, IVec3{n}}, {IVec3{0}, IVec3{n}}, options.levels[13], options.occlusion};
  if (options.border == SmoothBorder::Open) part.cells = {IVec3{0}, IVec3{n - 1}};
  return part;
}

inline smooth::Corners corners_of(const LatticeDensity& density, IVec3 cell) {
  smooth::Corners corners;
  for (int i = 0; i < 8; ++i) {
    corners[static_cast<std::size_t>(i)] = density(cell + IVec3{i & 1, i >> 1 & 1, i >> 2});
  }
  return corners;
}

class SmoothOracle {
 public:
  SmoothOracle(LatticeDensity density, const SmoothPart& part) : density_(std::move(density)), part_(part) {}

  void mesh(SmoothChunkMesh& out) {
    out.clear();
    const IBox& cells = part_.cells;
    for (int z = cells.min.z; z < cells.max.z; ++z) {
      for (int y = cells.min.y; y < cells.max.y; ++y) {
        for (int x = cells.min.x; x < cells.max.x; ++x) add_vertex({x, y, z}, out);
      }
    }
    const IBox& edges = part_.edges;
    for (int z = edges.min.z; z < edges.max.z; ++z) {
      for (int axis = 0; axis < 3; ++axis) {
        for (int y = edges.min.y; y < edges.max.y; ++y) {
          for (int x = edges.min.x; x < edges.max.x; ++x) add_quad({x, y, z}, axis, out);
        }
      }
    }
  }

 private:
  void add_vertex(IVec3 cell, SmoothChunkMesh& out) {
    const smooth::Corners corners = corners_of(density_, cell);
    const std::uint32_t solid = smooth::solid_corners(corners);
    if (solid == 0 || solid == 0xFF) return;
    const smooth::CellVertex vertex = smooth::cell_vertex(corners);
    vertices_[{cell.x, cell.y, cell.z}] = static_cast<std::uint32_t>(out.positions.size());
    const auto size = static_cast<float>(1 << part_.level);
    out.positions.push_back((Vec3(cell) + vertex.snapped) * size);
    out.normals.push_back(vertex.normal);
    const int n = kChunkEdge >> part_.level;
    const IVec3 offset{cell.x < 0 ? -1 : 0, cell.y < 0 ? -1 : 0, cell.z < 0 ? -1 : 0};
    out.cells.push_back(smooth::cell_name(cell & IVec3{n - 1}, offset));
    if (part_.occlusion.method == SmoothOcclusion::None) return;
    // In cells of the level, like the scaled spread.
    const auto from_cell = [&](int x, int y, int z) { return density_(cell + IVec3{x, y, z}) / size; };
    const SmoothOcclusionOptions occlusion = smooth::within_limits(part_.occlusion, part_.level);
    out.occlusion.push_back(smooth::occlusion_at_vertex(vertex.snapped, vertex.normal, occlusion, from_cell));
  }

  [[nodiscard]] std::optional<smooth::QuadCorner> corner(IVec3 cell, const SmoothChunkMesh& out) const {
    const auto found = vertices_.find({cell.x, cell.y, cell.z});
    if (found == vertices_.end()) return std::nullopt;
    return smooth::quad_corner(found->second, out.positions[found->second], cell * (1 << part_.level), part_.level);
  }

  void add_quad(IVec3 p, int axis, SmoothChunkMesh& out) {
    const bool solid = density_(p) < 0.0F;
    if (solid == (density_(p + smooth::unit_axis(axis)) < 0.0F)) return;
    std::array<smooth::QuadCorner, 4> quad;
    const std::array<IVec3, 4> cells = smooth::cells_around(p, axis);
    for (std::size_t i = 0; i < 4; ++i) {
      const auto found = corner(cells[solid ? i : (4 - i) % 4], out);
      if (!found) return;
      quad[i] = *found;
    }
    for (const std::uint32_t index : smooth::triangles_of(quad)) out.indices.push_back(index);
  }

  LatticeDensity density_;
  SmoothPart part_;
  std::map<std::tuple<int, int, int>, std::uint32_t> vertices_;
};

inline LatticeDensity lattice_density(const DensityNeighbourhood& chunks, int level) {
  return [chunks, level](IVec3 point) { return float_from_half(chunks.get(point * (1 << level))); };
}

/// Like SmoothMesher::mesh with one level everywhere and without splitting sheets.
inline void smooth_mesh(const DensityNeighbourhood& chunks, const SmoothOptions& options, SmoothChunkMesh& out) {
  SmoothOracle(lattice_density(chunks, options.levels[13]), part_of_chunk(options)).mesh(out);
}

}  // namespace quoin::oracle
