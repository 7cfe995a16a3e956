// The walk over the slices of a chunk, for every kernel. Included within a namespace, after what finds the places of
// bits (`append_places`, `append_edges`), makes vertices (`make_vertices`, `add_occlusion`) and quads (`make_quads`).

#include "mesh/smooth_active.inl"

// Lists the active cells of slice z of cells.
std::size_t list_cells(Work& work, int z) {
  const RowSet& rows = work.active_rows[static_cast<std::size_t>(z + 1)];
  std::uint16_t* end = work.places;
  const auto list_row = [&](int y) {
    if (work.active_before[z + 1][y + 1] != 0) *end++ = static_cast<std::uint16_t>(place_of(-1, y));
    end = append_places(work.active[z + 1][y + 1], place_of(0, y), end);
  };
  for (std::uint64_t left = rows.low; left != 0; left &= left - 1) list_row(std::countr_zero(left) - 16);
  for (std::uint64_t left = rows.high; left != 0; left &= left - 1) list_row(std::countr_zero(left) + 48);
  return static_cast<std::size_t>(end - work.places);
}

// Which edges along an axis are crossed that start in the row of points (y, z).
template <Axis kAxis>
std::uint64_t crossed_edges(const Work& work, int y, int z, std::uint64_t columns) {
  const std::uint64_t start = work.solid[z + 1][y + 1];
  std::uint64_t end = 0;
  if constexpr (kAxis == Axis::X) {
    end = start >> 1 | work.after[z + 1][y + 1] << (work.n - 1);
  } else if constexpr (kAxis == Axis::Y) {
    end = work.solid[z + 1][y + 2];
  } else {
    end = work.solid[z + 2][y + 1];
  }
  return (start ^ end) & columns;
}

// Lists the crossed edges along an axis that start at points of slice z.
template <Axis kAxis>
std::size_t list_edges(Work& work, int z) {
  const CellRange& cells = work.cells;
  const auto first = [&](Axis axis) { return kAxis == axis ? cells.first_edge() : cells.first + 1; };
  if (z < first(Axis::Z)) return 0;
  const std::uint64_t columns =
      (~std::uint64_t{0} >> (kChunkEdge - cells.last)) & (~std::uint64_t{0} << first(Axis::X));
  // A crossed edge belongs to an active cell of its own row, or of the one before; the row's own is always in range.
  const RowSet& rows = work.active_rows[static_cast<std::size_t>(z + 1)];
  std::uint16_t* end = work.places;
  const auto list_row = [&](int y) {
    if (y < first(Axis::Y)) return;
    const std::uint64_t crossed = crossed_edges<kAxis>(work, y, z, columns);
    if (crossed != 0) end = append_edges(crossed, work.solid[z + 1][y + 1], place_of(0, y), end);
  };
  for (std::uint64_t left = rows.low; left != 0; left &= left - 1) list_row(std::countr_zero(left) - 16);
  for (std::uint64_t left = rows.high; left != 0; left &= left - 1) list_row(std::countr_zero(left) + 48);
  return static_cast<std::size_t>(end - work.places);
}

template <Axis kAxis>
void quads_of_slice(Work& work, const Slice& slice, SmoothChunkMesh& out) {
  const std::size_t count = list_edges<kAxis>(work, slice.z);
  if (count == 0) return;
  const std::size_t before = out.indices.size();
  out.indices.reserve(before + 6 * (count + kSlack));
  make_quads<kAxis>(work, slice, count, out.indices.data() + before);
  out.indices.resize(before + 6 * count);
}

void mesh_slices(Work& work, SmoothChunkMesh& out) {
  find_active(work);
  if (!find_needed(work)) return;
  const bool has_occlusion = work.occlusion.form != SmoothOcclusion::None;
  Slice slice;
  if (has_occlusion) begin_occlusion(work);
  gather_slice(work, work.cells.first);
  for (slice.z = work.cells.first; slice.z < work.cells.last; ++slice.z) {
    slice.first_vertex_of_last = slice.first_vertex;
    slice.first_vertex = static_cast<std::uint32_t>(out.positions.size());
    const std::size_t count = list_cells(work, slice.z);
    const std::size_t vertices = slice.first_vertex + count;
    gather_slice(work, slice.z + 1);
    out.positions.reserve(vertices + kSlack);
    out.normals.reserve(vertices + kSlack);
    out.cells.reserve(vertices + kSlack);
    make_vertices(work, slice, count, out);
    out.positions.resize(vertices);
    out.normals.resize(vertices);
    out.cells.resize(vertices);
    if (has_occlusion) {
      out.openness.reserve(vertices + kSlack);
      add_occlusion(work, slice, count, out, out.openness.data() + slice.first_vertex);
      out.openness.resize(vertices);
    }
    quads_of_slice<Axis::X>(work, slice, out);
    quads_of_slice<Axis::Y>(work, slice, out);
    quads_of_slice<Axis::Z>(work, slice, out);
  }
}
