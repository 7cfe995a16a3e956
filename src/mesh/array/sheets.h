#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <quoin/core/buffer.h>
#include <quoin/core/parallel.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>
#include <quoin/mesh/array_surface.h>

#include "core/work/progress_steps.h"
#include "mesh/array/cells.h"
#include "mesh/array/kernel.h"
#include "mesh/array/placement.h"
#include "mesh/array/signs.h"
#include "mesh/smooth/cell.h"

namespace quoin::array {

// The cells that several sheets of the surface cross. Each sheet gets a vertex. The first sheet has the cell's own
// vertex; the vertices of other sheets follow the vertices of all cells. smooth/split.h defines sheets. Cells at an
// open border keep one vertex.
class SplitCells {
 public:
  Status find(const Lattice& lattice, const Signs& signs, const CellIndex& index, Threads threads,
              ProgressSteps& steps);

  // The number of vertices in addition to the cells' own.
  [[nodiscard]] std::uint64_t extra_vertices() const { return extra_; }
  // Writes the vertices of the sheets.
  void place(const Lattice& lattice, const SolidRule& rule, Threads threads, ArraySurface& out) const;
  // Adds these cells to the rules for quads.
  void add_to(QuadRules& rules) const;

 private:
  struct Cell {
    IVec3 place;
    std::uint32_t vertex;
    std::uint32_t first_extra;  // vertex of the second sheet; while counting: the number of additional vertices
    std::uint8_t solid;         // corners
    std::uint8_t flipped_face;
  };

  void number(std::uint64_t vertices);
  static void place_sheets(const Cell& cell, const smooth::Corners& d, const Placement& placement, ArraySurface& out);
  static std::uint32_t vertex_on_edge(const void* split_cells, std::uint32_t vertex, unsigned edge);

  std::vector<Cell> cells_;              // by vertex
  std::vector<std::uint64_t> is_split_;  // a bit a vertex
  std::uint64_t extra_ = 0;
};

}  // namespace quoin::array
