#include <quoin/mesh/smooth.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "core/moved_from.h"
#include "grid/density/density_storage.h"
#include "mesh/smooth/level_cells.h"
#include "mesh/smooth/smooth_cell.h"
#include "mesh/smooth/smooth_mesher.h"

namespace quoin::smooth {
namespace {

// Gathers the samples that a chunk's mesh reads from the chunk and its neighbours.

constexpr std::uint64_t kAllSolid = ~std::uint64_t{0};

// A lattice coordinate, split into a chunk (-1, 0, 1) and a sample in it.
struct ChunkCoordinate {
  int chunk;
  int sample;
};

ChunkCoordinate chunk_coordinate(int point, int level) {
  const int sample = point * (1 << level);
  QUOIN_ASSERT(sample >= -kChunkEdge && sample < 2 * kChunkEdge, "a sample of the chunk or of a neighbour");
  return {sample >> kChunkShift, sample & (kChunkEdge - 1)};
}

std::uint64_t solid_row(const DensityChunk* chunk, Half outside, ChunkCoordinate y, ChunkCoordinate z) {
  if (chunk == nullptr) return DensityChunk::is_solid(outside) ? kAllSolid : 0;
  return chunk->solid_row(y.sample, z.sample);
}

// A range of rows in a slice of a chunk.
struct Rows {
  int first = 0;
  int count = kChunkEdge;
};

// Copies the signs of several rows of one chunk column, in storage order.
void copy_signs(const DensityChunk* chunk, Half outside, int z, Rows rows, std::uint64_t* to) {
  QUOIN_ASSERT(z >= 0 && z < kChunkEdge && rows.first >= 0 && rows.first + rows.count <= kChunkEdge,
               "rows of the chunk");
  const DensityStorage* const storage = chunk == nullptr ? nullptr : DensityStorage::of(*chunk);
  if (storage != nullptr) {
    std::copy_n(storage->solid.data() + kChunkEdge * z + rows.first, rows.count, to);
    return;
  }
  const Half value = chunk == nullptr ? outside : *chunk->uniform();
  std::fill_n(to, rows.count, DensityChunk::is_solid(value) ? kAllSolid : 0);
}

// Gathers rows 0 to 63 of slice z at level 0.
void gather_inner_signs(const DensityNeighbourhood& chunks, int z, Work& work) {
  const ChunkCoordinate cz = chunk_coordinate(z, 0);
  copy_signs(chunks.at(0, 0, cz.chunk), chunks.outside, cz.sample, {}, work.solid[z + 1] + 1);
  copy_signs(chunks.at(-1, 0, cz.chunk), chunks.outside, cz.sample, {}, work.before[z + 1] + 1);
  copy_signs(chunks.at(1, 0, cz.chunk), chunks.outside, cz.sample, {}, work.after[z + 1] + 1);
  for (int y = 1; y <= kChunkEdge; ++y) work.before[z + 1][y] >>= kChunkEdge - 1;
  for (int y = 1; y <= kChunkEdge; ++y) work.after[z + 1][y] &= 1U;
}

void gather_signs(const DensityNeighbourhood& chunks, Work& work) {
  const int last = work.cells.last;  // the last point
  for (int z = work.cells.first; z <= last; ++z) {
    const ChunkCoordinate cz = chunk_coordinate(z, work.level);
    if (work.level == 0) gather_inner_signs(chunks, z, work);
    for (int y = work.cells.first; y <= last; ++y) {
      if (work.level == 0 && y == 0) y = kChunkEdge;
      if (y > last) break;
      const ChunkCoordinate cy = chunk_coordinate(y, work.level);
      const auto row = [&](int dx) { return solid_row(chunks.at(dx, cy.chunk, cz.chunk), chunks.outside, cy, cz); };
      work.solid[z + 1][y + 1] = thinned(row(0), work.level);
      work.before[z + 1][y + 1] = row(-1) >> (kChunkEdge - (1 << work.level)) & 1U;
      work.after[z + 1][y + 1] = row(1) & 1U;
    }
  }
}

RowPart row_part(const DensityChunk* chunk, Half outside, ChunkCoordinate y, ChunkCoordinate z) {
  if (chunk == nullptr) return {nullptr, outside};
  const Half* const samples = chunk->row(y.sample, z.sample);
  return {samples, samples == nullptr ? chunk->get(0, y.sample, z.sample) : Half{0}};
}

// Reads `kCount` points of a row of one chunk at level 0, starting at `first`.
template <int kCount>
[[gnu::always_inline]] inline void copy_part(const DensityChunk* chunk, Half outside, ChunkCoordinate y,
                                             ChunkCoordinate z, int first, Half* to) {
  const DensityStorage* const storage = chunk == nullptr ? nullptr : DensityStorage::of(*chunk);
  if (storage == nullptr) {
    std::fill_n(to, kCount, chunk == nullptr ? outside : *chunk->uniform());
    return;
  }
  const std::uint32_t slab = storage->slabs[ChunkStorage::slab_index(y.sample, z.sample)];
  if ((slab & ChunkStorage::kUniformSlab) != 0) {
    std::fill_n(to, kCount, static_cast<Half>(slab));
  } else {
    std::memcpy(to, storage->row(slab, ChunkStorage::row_in_slab(y.sample, z.sample)) + first, kCount * sizeof(Half));
  }
}

// Copies all points of a row of one chunk at a coarser level.
void copy_thinned(const RowPart& part, int level, Half* to) {
  const int n = kChunkEdge >> level;
  for (int i = 0; i < n; ++i) to[i] = part.samples == nullptr ? part.value : part.samples[i << level];
}

// A row of points of the chunk, with sixteen before and after: window 0 starts at column -16, window 1 at 16.
struct Windows {
  std::uint64_t first = 0;
  std::uint64_t second = 0;
};

Windows windows_of(std::uint64_t before, std::uint64_t own, std::uint64_t after, int n) {
  const int side = std::min(n, kPointX);
  Windows windows;
  windows.first = (before >> (n - side) & low_bits(side)) << (kPointX - side) | own << kPointX;
  if (n == kChunkEdge) {
    windows.second = own >> kPointX | after << (kChunkEdge - kPointX);
  } else {
    const int end = kPointX + std::min(n, kChunkEdge / 2);  // n is half a chunk's at most
    windows.first |= (after & low_bits(side)) << end;
    windows.second = windows.first >> kSecondWindow;
  }
  return windows;
}

// Copies 96 rows of signs of one chunk column at level 0: 16 of the chunk before along y, 64, 16 of the chunk after.
void copy_column(const DensityNeighbourhood& chunks, int dx, ChunkCoordinate z, std::uint64_t* to) {
  constexpr std::array<Rows, 3> kRows = {{{kChunkEdge - kPointX, kPointX}, {}, {0, kPointX}}};
  for (int dy = -1; dy <= 1; ++dy) {
    const Rows rows = kRows[static_cast<std::size_t>(dy + 1)];
    copy_signs(chunks.at(dx, dy, z.chunk), chunks.outside, z.sample, rows, to);
    to += rows.count;
  }
}

// Returns true if the chunk and all samples that its cells touch have the same sign. The mesh is empty then.
bool is_of_one_sign(const DensityNeighbourhood& chunks) {
  bool is_solid = false;
  bool is_air = false;
  for (const DensityChunk* chunk : chunks.chunks) {
    const auto uniform = chunk == nullptr ? std::optional(chunks.outside) : chunk->uniform();
    if (!uniform) return false;
    (DensityChunk::is_solid(*uniform) ? is_solid : is_air) = true;
  }
  return !(is_solid && is_air);
}

}  // namespace

int apron_of(const SmoothOcclusionOptions& occlusion) {
  if (occlusion.method == SmoothOcclusion::None) return 0;
  // The largest n_x (|n_x| + |n_y| + |n_z|) of a unit vector is (1 + sqrt(3)) / 2.
  const double reach = 1.3660254037844388 * double{occlusion.spread} + 0.1 + double{occlusion.spread};
  return static_cast<int>(std::floor(reach + 1e-3)) + 1;
}

SmoothOcclusionOptions within_limits(SmoothOcclusionOptions occlusion, int level) {
  const SmoothOcclusionOptions defaults;
  const auto limit = [](float& value, float least, float most, float otherwise) {
    value = std::isnan(value) ? otherwise : std::clamp(value, least, most);
  };
  limit(occlusion.spread, 1.0F / 16.0F, 4.0F, defaults.spread);
  occlusion.spread = snap(occlusion.spread * depth_unit(level));
  limit(occlusion.offset, 0.0F, 0.99F, defaults.offset);
  limit(occlusion.power, 1.0F / 16.0F, 64.0F, defaults.power);
  return occlusion;
}

bool prepare(const DensityNeighbourhood& chunks, Work& work) {
  if (is_of_one_sign(chunks)) return false;
  work.chunks = &chunks;
  work.apron = apron_of(work.occlusion);
  gather_signs(chunks, work);
  return true;
}

std::array<RowPart, 3> row_parts(const Work& work, int y, int z) {
  const ChunkCoordinate cy = chunk_coordinate(y, work.level);
  const ChunkCoordinate cz = chunk_coordinate(z, work.level);
  const DensityNeighbourhood& chunks = *work.chunks;
  const auto part = [&](int dx) { return row_part(chunks.at(dx, cy.chunk, cz.chunk), chunks.outside, cy, cz); };
  return {part(-1), part(0), part(1)};
}

void gather_row(const Work& work, int y, int z, Half* row) {
  if (work.level == 0) {
    const ChunkCoordinate cy = chunk_coordinate(y, 0);
    const ChunkCoordinate cz = chunk_coordinate(z, 0);
    const DensityNeighbourhood& chunks = *work.chunks;
    const auto chunk = [&](int dx) { return chunks.at(dx, cy.chunk, cz.chunk); };
    copy_part<kPointX>(chunk(-1), chunks.outside, cy, cz, kChunkEdge - kPointX, row - kPointX);
    copy_part<kChunkEdge>(chunk(0), chunks.outside, cy, cz, 0, row);
    copy_part<kPointX>(chunk(1), chunks.outside, cy, cz, 0, row + kChunkEdge);
    return;
  }
  const std::array<RowPart, 3> parts = row_parts(work, y, z);
  std::array<Half, kChunkEdge> before{};
  copy_thinned(parts[0], work.level, before.data());
  const int side = std::min(work.n, kPointX);
  std::copy_n(before.data() + work.n - side, side, row - side);
  copy_thinned(parts[1], work.level, row);
  copy_thinned(parts[2], work.level, row + work.n);
}

void add_occlusion_rows(Work& work, RowSet rows, int z) {
  QUOIN_ASSERT(z >= work.apron - kWidestApron && z + work.apron + 1 < kApronRows - kWidestApron, "slices within reach");
  for (int i = 0; i < work.apron; ++i) {
    const RowSet raised = rows.raised();
    rows.unite(rows.lowered());
    rows.unite(raised);
  }
  for (int dz = -work.apron; dz <= work.apron + 1; ++dz) {
    work.occlusion_rows[static_cast<std::size_t>(z + dz + kWidestApron)].unite(rows);
  }
}

void find_signs(Work& work, int z) {
  const DensityNeighbourhood& chunks = *work.chunks;
  std::uint64_t* const first = work.signs[z & 1][0];
  std::uint64_t* const second = work.signs[z & 1][1];
  const ChunkCoordinate cz = chunk_coordinate(z, work.level);
  if (work.level == 0) {
    alignas(64) std::uint64_t columns[3][kReachRows];
    for (int dx = -1; dx <= 1; ++dx) copy_column(chunks, dx, cz, columns[dx + 1]);
    for (int row = 0; row < kReachRows; ++row) {
      first[row] = columns[0][row] >> (kChunkEdge - kPointX) | columns[1][row] << kPointX;
      second[row] = columns[1][row] >> kPointX | columns[2][row] << (kChunkEdge - kPointX);
    }
    return;
  }
  std::fill_n(first, kReachRows, 0);
  std::fill_n(second, kReachRows, 0);
  const RowSet& rows = work.occlusion_rows[static_cast<std::size_t>(z + kWidestApron)];
  rows.for_each([&](int y) {
    const ChunkCoordinate cy = chunk_coordinate(y, work.level);
    const auto signs = [&](int dx) {
      return thinned(solid_row(chunks.at(dx, cy.chunk, cz.chunk), chunks.outside, cy, cz), work.level);
    };
    const Windows windows = windows_of(signs(-1), signs(0), signs(1), work.n);
    first[y + kPointX] = windows.first;
    second[y + kPointX] = windows.second;
  });
}

void begin_occlusion(Work& work) {
  QUOIN_ASSERT(work.apron >= 0 && work.apron < kWidestApron, "an apron of the neighbours");
  // The slices from `apron` below a cell to `apron` above its upper points.
  const std::size_t slices = work.apron <= 6 ? 16 : kMostSlices;
  work.ring_mask = static_cast<int>(slices) - 1;
  work.next_slice = work.cells.first - work.apron;
  const auto grow = [](auto& values, std::size_t size) {
    if (values.size() < size) values.resize(size);
  };
  if (work.is_dense) return grow(work.decoded, (slices + kRepeatedSlices) * kDecodedSlice + 64);
  // The first slice is not gathered yet.
  --work.next_slice;
  grow(work.cell_words, slices * 2 * Work::kSlots + 4);
  grow(work.sampled, slices * kSampledSlice + 64);
}

}  // namespace quoin::smooth

namespace quoin {

int reach_of(const SmoothOcclusionOptions& occlusion, int coarsest_level) {
  const int level = std::clamp(coarsest_level, 0, kMaxSmoothLevel);
  const SmoothOcclusionOptions limited = smooth::within_limits(occlusion, level);
  // Without occlusion, splitting sheets still reads the cells next to a cell.
  return (std::max(smooth::apron_of(limited), 1) + 1) << level;
}

struct SmoothMesher::Scratch : LargeObject {
  const smooth::Kernel& kernel = smooth::kKernels.widest();
  smooth::Work work;

  // Replaces `out` by the surface of a range of cells of the centre chunk.
  void mesh(const DensityNeighbourhood& chunks, const SmoothOptions& options, smooth::CellRange cells,
            SmoothChunkMesh& out) {
    out.clear();
    work.level = options.levels[13];
    work.n = kChunkEdge >> work.level;
    work.cells = cells;
    work.occlusion = smooth::within_limits(options.occlusion, work.level);
    if (smooth::prepare(chunks, work)) kernel.mesh(work, out);
  }
};

SmoothMesher::SmoothMesher() : scratch_(std::make_unique<Scratch>()) {}
SmoothMesher::SmoothMesher(SmoothMesher&&) noexcept = default;
SmoothMesher& SmoothMesher::operator=(SmoothMesher&&) noexcept = default;
SmoothMesher::~SmoothMesher() = default;

void SmoothMesher::mesh(const DensityNeighbourhood& chunks, const SmoothOptions& wanted, SmoothChunkMesh& out) {
  SmoothOptions options = wanted;
  for (std::uint8_t& level : options.levels) level = std::min<std::uint8_t>(level, kMaxSmoothLevel);
  const int n = kChunkEdge >> options.levels[13];
  const bool is_open = options.border == SmoothBorder::Open;
  if (!is_open && !smooth::ChunkLevels(options.levels).all_same()) {
    const auto own_cells = [&](SmoothChunkMesh& mesh) { impl_of(scratch_).mesh(chunks, options, {0, n}, mesh); };
    return smooth::mesh_with_transitions(chunks, options, own_cells, out);
  }
  impl_of(scratch_).mesh(chunks, options, is_open ? smooth::CellRange{0, n - 1} : smooth::CellRange{-1, n}, out);
  if (options.split_sheets) smooth::split_sheets(chunks, options, out.indices.size(), out);
}

void SmoothChunkMesh::clear() {
  positions.clear();
  normals.clear();
  occlusion.clear();
  cells.clear();
  indices.clear();
}

}  // namespace quoin
