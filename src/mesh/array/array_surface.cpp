#include <quoin/mesh/array_surface.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include <quoin/core/assert.h>

#include "mesh/array/cells.h"
#include "mesh/array/corners.h"
#include "mesh/array/sheets.h"
#include "mesh/array/signs.h"

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
