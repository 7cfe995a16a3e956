// Bringing points to where the kernels read them, slice by slice. Included within a namespace, after `decode_row`.

void gather_slice(Work& work, int z) {
  const RowSet& needed = work.corner_rows[static_cast<std::size_t>(z + kWidestApron)];
  if (needed.empty()) return;
  for (int y = -1; y <= work.n; ++y) {
    if (needed.has(y)) gather_row(work, y, z, work.row(y, z));
  }
}

void decode_part(const RowPart& part, int first, int count, float* to) {
  if (part.samples != nullptr) return decode_row(part.samples + first, to, count);
  alignas(64) Half same[kChunkEdge];
  std::fill_n(same, count, part.value);
  decode_row(same, to, count);
}

// The row of points (y, z), with sixteen before and after; x = 0 is at `to`.
void decode_points(const Work& work, int y, int z, float* to) {
  if (work.level == 0) {
    const std::array<RowPart, 3> parts = row_parts(work, y, z);
    decode_part(parts[0], kChunkEdge - kPointX, kPointX, to - kPointX);
    decode_part(parts[1], 0, kChunkEdge, to);
    decode_part(parts[2], 0, kPointX, to + kChunkEdge);
    return;
  }
  alignas(64) Half halves[kPlaceStride] = {};
  gather_row(work, y, z, halves + kPointX);
  const int count = work.n + 2 * kPointX;
  decode_row(halves, to - kPointX, count);
  // Exact: the unit is a power of two.
  const float unit = depth_unit(work.level);
  for (int i = 0; i < count; ++i) to[i - kPointX] *= unit;
}

void decode_slice(Work& work, int z) {
  const RowSet& needed = work.occlusion_rows[static_cast<std::size_t>(z + kWidestApron)];
  if (needed.empty()) return;
  const int slices = work.decoded_mask + 1;
  const bool is_repeated = (z & work.decoded_mask) < kRepeatedSlices;
  for (int y = -work.apron - 1; y <= work.n + work.apron; ++y) {
    if (!needed.has(y)) continue;
    float* const row = work.decoded_row(y, z);
    decode_points(work, y, z, row);
    if (!is_repeated) continue;
    std::memcpy(row - kPointX + std::ptrdiff_t{slices} * kDecodedSlice, row - kPointX, sizeof(float) * kDecodedStride);
  }
}

void begin_occlusion(Work& work) {
  // The slices from `apron` below a cell to as many above its upper points.
  const int slices = work.apron <= 6 ? 16 : 32;
  work.decoded_mask = slices - 1;
  const std::size_t size = static_cast<std::size_t>(slices + kRepeatedSlices) * kDecodedSlice + 64;
  if (work.decoded.size() < size) work.decoded.resize(size);
  work.next_decoded = work.cells.first - work.apron;
}

// Makes sure that all is there that the vertices of slice z of cells are occluded by.
void decode_around(Work& work, int z) {
  const int last = z + work.apron + 1;
  for (int next = std::max(work.next_decoded, z - work.apron); next <= last; ++next) decode_slice(work, next);
  work.next_decoded = last + 1;
}

void occlusion_one_by_one(Work& work, const Slice& slice, std::size_t count, const SmoothChunkMesh& out,
                          float* openness) {
  for (std::size_t i = 0; i < count; ++i) {
    const int place = work.places[i];
    const Vec3 fraction(work.fractions[0][i], work.fractions[1][i], work.fractions[2][i]);
    openness[i] = vertex_openness(
        fraction, out.normals.data()[slice.first_vertex + i], work.occlusion,
        [&](int x, int y, int z) { return work.decoded_row(row_of(place) + y, slice.z + z)[column_of(place) + x]; });
  }
}
