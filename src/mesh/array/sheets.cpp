#include "mesh/array/sheets.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

#include <quoin/core/assert.h>

#include "mesh/array/cell.h"
#include "mesh/array/corners.h"
#include "mesh/smooth/split.h"

namespace quoin::array {
namespace {

// Returns true if a cell exists and does not touch an open border.
bool may_have_sheets(const Lattice& lattice, bool is_open, IVec3 cell) {
  const int margin = is_open ? 2 : 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto size = static_cast<int>(lattice.size[static_cast<std::size_t>(axis)]);
    if (cell[axis] < margin || cell[axis] > size - margin) return false;
  }
  return true;
}

// Returns the face with flipped pairs of crossings, or kNoFace. The cell on its other side flips them too: both cells
// have all four crossings in one sheet.
int flipped_face_of(const Lattice& lattice, const Signs& signs, IVec3 cell, std::uint32_t solid) {
  const int face = smooth::joined_face(solid);
  if (face == smooth::kNoFace) return face;
  IVec3 other = cell;
  other[face / 2] += face % 2 != 0 ? 1 : -1;
  if (!may_have_sheets(lattice, signs.is_open(), other)) return smooth::kNoFace;
  return smooth::joined_face(signs.solid_corners(other)) == (face ^ 1) ? face : smooth::kNoFace;
}

// Returns the mean of the crossings of one sheet, and the gradient there.
smooth::CellVertex vertex_of_sheet(const smooth::Corners& d, const smooth::Sheets& sheets, int sheet,
                                   const float* scale) {
  Vec3 sum(0.0F);
  float count = 0.0F;
  for (std::size_t edge = 0; edge < 12; ++edge) {
    if (sheets.of_edge[edge] != sheet) continue;
    const int axis = static_cast<int>(edge / 4);
    Vec3 at(0.0F);
    at[(axis + 1) % 3] = static_cast<float>(edge & 1U);
    at[(axis + 2) % 3] = static_cast<float>(edge >> 1U & 1U);
    const auto first = static_cast<std::size_t>(at.x + 2.0F * at.y + 4.0F * at.z);
    at[axis] = crossing_of(d[first], d[first + (std::size_t{1} << axis)]);
    sum += at;
    count += 1.0F;
  }
  QUOIN_ASSERT(count > 0.0F, "a sheet of the cell");
  smooth::CellVertex vertex;
  vertex.fraction = sum * (1.0F / count);
  const Vec3 g = smooth::trilinear_gradient(d, vertex.fraction);
  vertex.normal = unit_of_any({g.x * scale[0], g.y * scale[1], g.z * scale[2]});
  for (int axis = 0; axis < 3; ++axis) vertex.snapped[axis] = smooth::snap(vertex.fraction[axis]);
  return vertex;
}

}  // namespace

Status SplitCells::find(const Lattice& lattice, const Signs& signs, const CellIndex& index, Threads threads,
                        ProgressSteps& steps) {
  std::vector<std::vector<Cell>> found(slab_count(lattice));
  const Status done = for_each_slab(lattice, threads, steps, [&](std::size_t slab, std::size_t first, std::size_t end) {
    std::uint32_t vertex = index.first[first * (lattice.rows() + 1)];
    for_each_cell(lattice, index, first, end, [&](IVec3 cell) {
      const std::uint32_t own = vertex++;
      if (!may_have_sheets(lattice, signs.is_open(), cell)) return;
      const std::uint32_t solid = signs.solid_corners(cell);
      const int flipped = flipped_face_of(lattice, signs, cell, solid);
      const int count = smooth::sheets_of(solid, flipped).count;
      if (count < 2) return;
      found[slab].push_back({cell, own, static_cast<std::uint32_t>(count - 1), static_cast<std::uint8_t>(solid),
                             static_cast<std::uint8_t>(flipped)});
    });
  });
  if (!done) return done.error();
  for (std::vector<Cell>& cells : found) {
    cells_.insert(cells_.end(), cells.begin(), cells.end());
    cells = {};
  }
  number(index.vertices());
  if (index.vertices() + extra_ >= std::numeric_limits<std::uint32_t>::max()) {
    return make_error(ErrorCode::LimitExceeded, "the surface needs more than 2^32 - 2 vertices");
  }
  return {};
}

void SplitCells::number(std::uint64_t vertices) {
  is_split_.assign(vertices / 64 + 1, 0);
  for (Cell& cell : cells_) {
    QUOIN_ASSERT(cell.vertex < vertices, "a vertex that was counted");
    is_split_[cell.vertex / 64] |= std::uint64_t{1} << (cell.vertex % 64);
    const std::uint32_t count = cell.first_extra;
    cell.first_extra = static_cast<std::uint32_t>(vertices + extra_);
    extra_ += count;
  }
}

void SplitCells::place(const Lattice& lattice, const SolidRule& rule, Threads threads, ArraySurface& out) const {
  const CornerReader reader = corner_reader(lattice.type);
  const Placement placement = placement_of(lattice);
  parallel_for((cells_.size() + kBatch - 1) / kBatch, threads, [&](std::size_t batch) {
    const Cell* const cells = cells_.data() + batch * kBatch;
    const std::size_t count = std::min(kBatch, cells_.size() - batch * kBatch);
    RawCorners raw{};
    CornerBatch corners;
    for (std::size_t i = 0; i < count; ++i) {
      const IVec3 cell = cells[i].place;
      reader.read(corner_rows(lattice, cell.y, cell.z), &cell.x, 1, i, raw);
    }
    reader.convert(raw, rule, count, corners);
    for (std::size_t i = 0; i < count; ++i) {
      smooth::Corners d;
      for (std::size_t corner = 0; corner < 8; ++corner) d[corner] = corners.densities[corner][i];
      make_finite(d);
      place_sheets(cells[i], d, placement, out);
    }
  });
}

void SplitCells::place_sheets(const Cell& cell, const smooth::Corners& d, const Placement& placement,
                              ArraySurface& out) {
  const smooth::Sheets sheets = smooth::sheets_of(cell.solid, cell.flipped_face);
  for (int sheet = 0; sheet < sheets.count; ++sheet) {
    const smooth::CellVertex vertex = vertex_of_sheet(d, sheets, sheet, placement.gradient_scale);
    const std::uint32_t at = sheet == 0 ? cell.vertex : cell.first_extra + static_cast<std::uint32_t>(sheet - 1);
    QUOIN_ASSERT(at < out.positions.size(), "a vertex that was counted");
    for (int axis = 0; axis < 3; ++axis) {
      const int view_axis = placement.view_axis[axis];
      out.positions[at][view_axis] = in_space(placement, axis, cell.place[axis], vertex.snapped[axis]);
      out.normals[at][view_axis] = vertex.normal[axis];
    }
  }
}

void SplitCells::add_to(QuadRules& rules) const {
  if (cells_.empty()) return;
  rules.split = is_split_.data();
  rules.split_cells = this;
  rules.vertex_on_edge = vertex_on_edge;
}

std::uint32_t SplitCells::vertex_on_edge(const void* split_cells, std::uint32_t vertex, unsigned edge) {
  const auto& cells = static_cast<const SplitCells*>(split_cells)->cells_;
  const auto cell =
      std::lower_bound(cells.begin(), cells.end(), vertex, [](const Cell& a, std::uint32_t b) { return a.vertex < b; });
  QUOIN_ASSERT(cell != cells.end() && cell->vertex == vertex && edge < 12, "an edge of a cell with several sheets");
  const unsigned sheet = smooth::sheets_of(cell->solid, cell->flipped_face).of_edge[edge];
  return sheet == 0 ? vertex : cell->first_extra + sheet - 1;
}

}  // namespace quoin::array
