#include <quoin/mesh/array_surface.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/buffer.h>
#include <quoin/core/parallel.h>
#include <quoin/core/result.h>
#include <quoin/core/vec.h>

#include "core/work/progress_steps.h"
#include "mesh/array/array_cells.h"
#include "mesh/array/array_kernel.h"
#include "mesh/array/array_lattice.h"
#include "mesh/array/array_samples.h"
#include "mesh/array/array_vertex.h"
#include "mesh/nets/cell.h"
#include "mesh/nets/sheets.h"

namespace quoin::array {
namespace {

// The cells that several sheets of the surface cross. Each sheet gets a vertex. The first sheet has the cell's own
// vertex; the vertices of other sheets follow the vertices of all cells. mesh/nets/sheets.h defines sheets. Cells at an
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
  std::vector<std::uint64_t> is_split_;  // one bit per vertex
  std::uint64_t extra_ = 0;
};

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
  return smooth::face_joined_in_both(solid, [&](int face) {
    const IVec3 other = cell + smooth::step_across(face);
    return may_have_sheets(lattice, signs.is_open(), other) ? signs.solid_corners(other) : 0;
  });
}

// Returns the mean of the crossings of one sheet, and the gradient there.
smooth::CellVertex vertex_of_sheet(const ArrayField& field, const smooth::Corners& d, const smooth::Sheets& sheets,
                                   int sheet) {
  const smooth::SheetCrossings crossings = smooth::crossings_of_sheet(d, sheets, sheet, crossing_of<float>);
  const Vec3 fraction = crossings.sum * (1.0F / crossings.count);
  return smooth::vertex_at(fraction, field.normal_of(smooth::trilinear_gradient(d, fraction)));
}

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
  const smooth::Sheets& sheets = smooth::sheets_of(cell.solid, cell.flipped_face);
  for (int sheet = 0; sheet < sheets.count; ++sheet) {
    const smooth::CellVertex vertex = vertex_of_sheet({placement.gradient_scale}, d, sheets, sheet);
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
  QUOIN_ASSERT(cell != cells.end() && cell->vertex == vertex && edge < smooth::kEdges,
               "an edge of a cell with several sheets");
  const unsigned sheet = smooth::sheets_of(cell->solid, cell->flipped_face).of_edge[edge];
  return sheet == 0 ? vertex : cell->first_extra + sheet - 1;
}

}  // namespace
}  // namespace quoin::array

namespace quoin {
namespace {

using namespace array;

// Computes vertices in batches of cells.
class VertexMaker {
 public:
  VertexMaker(const Lattice& lattice, const SolidRule& rule, ArraySurface& out)
      : lattice_(lattice),
        rule_(rule),
        reader_(corner_reader(lattice.type)),
        placement_(placement_of(lattice)),
        out_(out) {}

  // Adds the vertices of a slice of cells.
  void add(const RankedRows& ranked, std::size_t slice) {
    for (std::size_t row = 0; row <= lattice_.rows(); ++row) {
      if (ranked.first[row] == ranked.first[row + 1]) continue;
      if (count_ == 0) first_ = ranked.first[row];
      add_row(ranked.active + row * lattice_.words, static_cast<std::int64_t>(row), static_cast<std::int64_t>(slice));
    }
  }
  void finish() {
    if (count_ == 0) return;
    QUOIN_ASSERT(first_ + count_ <= out_.positions.size(), "vertices that were counted");
    reader_.convert(raw_, rule_, count_, corners_);
    kernel().vertices(corners_, count_, placement_, batch_, out_.positions.data() + first_,
                      out_.normals.data() + first_);
    first_ += static_cast<std::uint32_t>(count_);
    count_ = 0;
    raw_.has_beyond = false;
  }

 private:
  void add_row(const std::uint64_t* active, std::int64_t row, std::int64_t slice) {
    const CornerRows corners = corner_rows(lattice_, row, slice);
    std::size_t begin = count_;
    for (std::size_t w = 0; w < lattice_.words; ++w) {
      for (std::uint64_t left = active[w]; left != 0; left &= left - 1) {
        batch_.cells[0][count_] = static_cast<std::int32_t>(64 * w) + std::countr_zero(left);
        batch_.cells[1][count_] = static_cast<std::int32_t>(row);
        batch_.cells[2][count_] = static_cast<std::int32_t>(slice);
        if (++count_ < kBatch) continue;
        reader_.read(corners, batch_.cells[0] + begin, count_ - begin, begin, raw_);
        finish();
        begin = 0;
      }
    }
    if (count_ > begin) reader_.read(corners, batch_.cells[0] + begin, count_ - begin, begin, raw_);
  }

  const Lattice& lattice_;
  SolidRule rule_;
  CornerReader reader_;
  Placement placement_;
  ArraySurface& out_;
  std::uint32_t first_ = 0;  // vertex of the batch
  std::size_t count_ = 0;    // of the batch
  RawCorners raw_{};
  CornerBatch corners_{};
  VertexBatch batch_{};
};

Status make_vertices(const Lattice& lattice, const SolidRule& rule, const CellIndex& index, Threads threads,
                     ProgressSteps& steps, ArraySurface& out) {
  return for_each_slab(lattice, threads, steps, [&](std::size_t, std::size_t first, std::size_t end) {
    VertexMaker maker(lattice, rule, out);
    for (std::size_t slice = first; slice < end; ++slice) maker.add(index.rows_of(lattice, slice), slice);
    maker.finish();
  });
}

Status make_quads(const Lattice& lattice, const Signs& signs, const CellIndex& index, const SplitCells& split,
                  Threads threads, ProgressSteps& steps, ArraySurface& out) {
  QuadRules rules{out.positions.data(), lattice.is_mirrored};
  split.add_to(rules);
  return for_each_slab(lattice, threads, steps, [&](std::size_t slab, std::size_t first, std::size_t end) {
    EdgeWindow window(lattice, Borrowed<const Signs>{&signs});
    std::uint32_t* to = out.indices.data() + 6 * index.quads_before[slab];
    for (std::size_t slice = first; slice < end; ++slice) {
      const std::uint64_t* const solid = slice == 0 ? nullptr : signs.slice(slice - 1);
      to = kernel().quads(window.at(slice), solid, index.rows_of(lattice, slice), rules, to);
    }
    QUOIN_ASSERT(to == out.indices.data() + 6 * index.quads_before[slab + 1], "the quads that were counted");
  });
}

}  // namespace

Result<ArraySurface> surface_from_array(const ArrayView& array, const ArraySurfaceOptions& options, Threads threads,
                                        const Progress& progress) {
  if (std::isnan(options.iso)) {
    return make_error(ErrorCode::InvalidArgument, "the surface value must not be NaN");
  }
  const Result<Lattice> found = lattice_of(array);
  if (!found) return found.error();
  const Lattice& lattice = *found;
  ProgressSteps steps(progress, (options.split_sheets ? 5 : 4) * slab_count(lattice));
  Signs signs(lattice, options);
  if (Status status = signs.find(threads, steps); !status) return status.error();
  CellIndex index;
  const auto source = [&] { return Borrowed<const Signs>{&signs}; };
  Status done = find_cells(lattice, source, threads, steps, index, [](auto...) {});
  SplitCells split;
  if (done && options.split_sheets) done = split.find(lattice, signs, index, threads, steps);
  if (!done) return done.error();
  ArraySurface out;
  out.positions.resize(index.vertices() + split.extra_vertices());
  out.normals.resize(out.positions.size());
  out.indices.resize(6 * index.quads());
  done = make_vertices(lattice, signs.rule(), index, threads, steps, out);
  if (!done) return done.error();
  split.place(lattice, signs.rule(), threads, out);
  done = make_quads(lattice, signs, index, split, threads, steps, out);
  if (!done) return done.error();
  return out;
}

}  // namespace quoin
