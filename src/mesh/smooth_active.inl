// Which cells make vertices, and which rows of points are read for them. Included within a namespace: plain loops over
// words, which compilers make wide.

// A row of cells is active where its 2x2 rows of points are neither all solid nor all air.
void find_active(Work& work) {
  const CellRange& cells = work.cells;
  const std::uint64_t in_range = ~std::uint64_t{0} >> (kChunkEdge - std::min(cells.last, work.n));
  const std::uint64_t with_before = cells.first < 0 ? 1 : 0;
  const int top = work.n - 1;
  for (int z = cells.first; z < cells.last; ++z) {
    const auto s = [&](const auto& words, int dy, int dz) { return words[z + 1 + dz] + dy; };
    const std::uint64_t* const s00 = s(work.solid, 0, 0);
    const std::uint64_t* const s01 = s(work.solid, 0, 1);
    const std::uint64_t* const a00 = s(work.after, 0, 0);
    const std::uint64_t* const a01 = s(work.after, 0, 1);
    const std::uint64_t* const b00 = s(work.before, 0, 0);
    const std::uint64_t* const b01 = s(work.before, 0, 1);
    std::uint64_t* const active = work.active[z + 1];
    std::uint64_t* const active_before = work.active_before[z + 1];
    for (int i = cells.first + 1; i <= cells.last; ++i) {
      const std::uint64_t any = s00[i] | s00[i + 1] | s01[i] | s01[i + 1];
      const std::uint64_t all = s00[i] & s00[i + 1] & s01[i] & s01[i + 1];
      const std::uint64_t any_after = a00[i] | a00[i + 1] | a01[i] | a01[i + 1];
      const std::uint64_t all_after = a00[i] & a00[i + 1] & a01[i] & a01[i + 1];
      const std::uint64_t any_before = b00[i] | b00[i + 1] | b01[i] | b01[i + 1];
      const std::uint64_t all_before = b00[i] & b00[i + 1] & b01[i] & b01[i + 1];
      active[i] = (any | any >> 1 | any_after << top) & ~(all & (all >> 1 | all_after << top)) & in_range;
      active_before[i] = (any | any_before) & ~(all & all_before) & with_before;
    }
    // Row y stands at [y + 1]; -1 is alone.
    std::uint64_t rows = 0;
    for (int y = 0; y < cells.last; ++y) {
      rows |= std::uint64_t{(active[y + 1] | active_before[y + 1]) != 0} << y;
    }
    const bool has_first = cells.first < 0 && (active[0] | active_before[0]) != 0;
    work.active_rows[static_cast<std::size_t>(z + 1)] = RowSet::of(has_first, rows);
  }
}

// Rows of points that are corners of an active cell, and those within the apron of one.
bool find_needed(Work& work) {
  work.corner_rows.fill({});
  work.occlusion_rows.fill({});
  bool is_any = false;
  for (int z = work.cells.first; z < work.cells.last; ++z) {
    RowSet rows = work.active_rows[static_cast<std::size_t>(z + 1)];
    if (rows.empty()) continue;
    is_any = true;
    rows.unite(rows.raised());
    const auto slice = [z](auto& sets, int dz) -> RowSet& {
      return sets[static_cast<std::size_t>(z + dz + kWidestApron)];
    };
    for (int dz = 0; dz <= 1; ++dz) slice(work.corner_rows, dz).unite(rows);
    if (work.occlusion.form == SmoothOcclusion::None) continue;
    for (int i = 0; i < work.apron; ++i) {
      const RowSet raised = rows.raised();
      rows.unite(rows.lowered());
      rows.unite(raised);
    }
    for (int dz = -work.apron; dz <= work.apron + 1; ++dz) slice(work.occlusion_rows, dz).unite(rows);
  }
  return is_any;
}
