#pragma once

// The cells of an array that have a vertex, and their vertex indices. Shared by fields and labels.

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>
#include <quoin/core/buffer.h>
#include <quoin/core/parallel.h>
#include <quoin/core/result.h>

#include "core/work/progress_steps.h"
#include "mesh/array/array_kernel.h"
#include "mesh/array/array_lattice.h"

namespace quoin::array {

// The number of slices of cells per slab. It does not depend on the number of threads, so the order stays the same.
inline constexpr std::size_t kSlabSlices = 16;

inline std::size_t slab_count(const Lattice& lattice) {
  return lattice.slices() / kSlabSlices + 1;
}

// The planes of crossed edges around consecutive slices of cells. A source provides a slice's edges:
//
//   void within(std::size_t z, std::uint64_t* along_rows, std::uint64_t* between_rows);
//   void between(std::size_t slice, std::uint64_t* out);      from sample slice - 1 to `slice`; either may not exist
template <class Source>
class EdgeWindow {
 public:
  EdgeWindow(const Lattice& lattice, Source source)
      : rows_(lattice.rows()), slices_(lattice.slices()), words_(lattice.words), source_(std::move(source)) {
    for (Planes& planes : planes_) {
      planes.along_rows.assign(rows_ * words_, 0);
      planes.between_rows.assign((rows_ + 1) * words_, 0);
    }
    between_.assign(rows_ * words_, 0);
    no_edges_.assign(words_, 0);
  }

  // Slices must be requested in order; the first may be any slice.
  CellSlice at(std::size_t slice) {
    QUOIN_ASSERT(slice <= slices_, "a slice of cells");
    if (is_new_ && slice != 0) load(slice - 1, planes_[0]);
    if (!is_new_) std::swap(planes_[0], planes_[1]);
    is_new_ = false;
    load(slice, planes_[1]);
    source_.between(slice, between_.data());
    return {rows_, words_, no_edges_.data(), planes_[0].view(), planes_[1].view(), between_.data()};
  }

 private:
  struct Planes {
    std::vector<std::uint64_t> along_rows;
    std::vector<std::uint64_t> between_rows;
    [[nodiscard]] EdgePlanes view() const { return {along_rows.data(), between_rows.data()}; }
  };

  void load(std::size_t z, Planes& planes) {
    if (z < slices_) return source_.within(z, planes.along_rows.data(), planes.between_rows.data());
    std::fill(planes.along_rows.begin(), planes.along_rows.end(), 0);
    std::fill(planes.between_rows.begin(), planes.between_rows.end(), 0);
  }

  std::size_t rows_;
  std::size_t slices_;
  std::size_t words_;
  Source source_;
  bool is_new_ = true;
  Planes planes_[2];
  std::vector<std::uint64_t> between_;
  std::vector<std::uint64_t> no_edges_;
};

// A source shared by many windows.
template <class Source>
struct Borrowed {
  Source* source;
  void within(std::size_t z, std::uint64_t* along_rows, std::uint64_t* between_rows) const {
    source->within(z, along_rows, between_rows);
  }
  void between(std::size_t slice, std::uint64_t* out) const { source->between(slice, out); }
};

struct CellIndex {
  Buffer<std::uint64_t> active;                // [slice][row][word] of cells
  Buffer<std::uint32_t> first;                 // [slice][row]: the number of vertices before; one more at the end
  std::vector<std::uint64_t> quads_before;     // by slab; one more at the end
  std::vector<std::uint64_t> vertices_before;  // by slab; one more at the end

  [[nodiscard]] std::uint64_t vertices() const { return vertices_before.back(); }
  [[nodiscard]] std::uint64_t quads() const { return quads_before.back(); }
  [[nodiscard]] RankedRows rows_of(const Lattice& lattice, std::size_t slice) const {
    QUOIN_ASSERT(slice <= lattice.slices(), "a slice of cells");
    return {active.data() + slice * lattice.cell_slice_words(), first.data() + slice * (lattice.rows() + 1)};
  }
};

// Calls work(slab, first, end) for each slab of slices of cells, unless cancelled.
template <class Work>
Status for_each_slab(const Lattice& lattice, Threads threads, ProgressSteps& steps, Work work) {
  const std::size_t cells = lattice.slices() + 1;
  parallel_for(slab_count(lattice), threads, [&](std::size_t slab) {
    if (steps.cancelled()) return;
    work(slab, slab * kSlabSlices, std::min(cells, (slab + 1) * kSlabSlices));
    steps.step();
  });
  if (steps.cancelled()) return make_error(ErrorCode::Cancelled, "cancelled");
  return {};
}

// Calls visit(cell) for each cell with a vertex in some slices, in the order of the vertices.
template <class Visit>
void for_each_cell(const Lattice& lattice, const CellIndex& index, std::size_t first, std::size_t end, Visit visit) {
  QUOIN_ASSERT(first <= end && end <= lattice.slices() + 1, "slices of cells");
  for (std::size_t slice = first; slice < end; ++slice) {
    const RankedRows ranked = index.rows_of(lattice, slice);
    for (std::size_t row = 0; row <= lattice.rows(); ++row) {
      if (ranked.first[row] == ranked.first[row + 1]) continue;
      for (std::size_t w = 0; w < lattice.words; ++w) {
        for (std::uint64_t left = ranked.active[row * lattice.words + w]; left != 0; left &= left - 1) {
          visit(
              IVec3(static_cast<int>(64 * w) + std::countr_zero(left), static_cast<int>(row), static_cast<int>(slice)));
        }
      }
    }
  }
}

// Replaces the counts of rows by prefix sums.
[[nodiscard]] inline Status sum_up(const Lattice& lattice, CellIndex& index) {
  for (std::vector<std::uint64_t>* counts : {&index.quads_before, &index.vertices_before}) {
    std::uint64_t sum = 0;
    for (std::uint64_t& count : *counts) count = std::exchange(sum, sum + count);
  }
  if (index.vertices() >= std::numeric_limits<std::uint32_t>::max()) {
    return make_error(ErrorCode::LimitExceeded, "the surface needs more than 2^32 - 2 vertices");
  }
  const std::size_t rows = (lattice.slices() + 1) * (lattice.rows() + 1);
  std::uint32_t sum = 0;
  for (std::size_t row = 0; row < rows; ++row) index.first[row] = std::exchange(sum, sum + index.first[row]);
  index.first[rows] = sum;
  QUOIN_ASSERT(sum == index.vertices(), "rows have the vertices of their slabs");
  return {};
}

// Finds the cells with a vertex. Calls also(slab, slice, edges) for each slice of cells.
template <class MakeSource, class Also>
Status find_cells(const Lattice& lattice, MakeSource make_source, Threads threads, ProgressSteps& steps,
                  CellIndex& index, Also also) {
  const std::size_t cell_slices = lattice.slices() + 1;
  const std::size_t cell_rows = lattice.rows() + 1;
  const Kernel& k = kernel();
  index.active.resize(cell_slices * lattice.cell_slice_words());
  index.first.resize(cell_slices * cell_rows + 1);
  index.quads_before.assign(slab_count(lattice) + 1, 0);
  index.vertices_before.assign(slab_count(lattice) + 1, 0);
  Status found = for_each_slab(lattice, threads, steps, [&](std::size_t slab, std::size_t first, std::size_t end) {
    EdgeWindow window(lattice, make_source());
    for (std::size_t slice = first; slice < end; ++slice) {
      const CellSlice edges = window.at(slice);
      std::uint32_t* const counts = index.first.data() + slice * cell_rows;
      k.find_active(edges, index.active.data() + slice * lattice.cell_slice_words(), counts);
      for (std::size_t row = 0; row < cell_rows; ++row) index.vertices_before[slab] += counts[row];
      index.quads_before[slab] += k.count_bits(edges.between_slices, lattice.slice_words()) +
                                  k.count_bits(edges.low.along_rows, lattice.slice_words()) +
                                  k.count_bits(edges.low.between_rows, lattice.cell_slice_words());
      also(slab, slice, edges);
    }
  });
  if (!found) return found;
  return sum_up(lattice, index);
}

}  // namespace quoin::array
