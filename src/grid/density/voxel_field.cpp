#include <quoin/grid/voxel_field.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <quoin/core/assert.h>

#include "core/coordinates/chunk_order.h"
#include "grid/density/density_storage.h"

namespace quoin {
namespace {

// Squared distances are stored in bytes; anything beyond the reach is clamped to reach + 1.
constexpr int kReach = 8;
constexpr int kFarSquared = (kReach + 1) * (kReach + 1);
// Half the width of the smoothing kernel.
constexpr int kBlur = 2;
constexpr int kSmoothed = kChunkEdge + 2 * kBlur;  // samples per edge with a wanted distance
constexpr int kMargin = kReach + kBlur;
constexpr int kRegion = kChunkEdge + 2 * kMargin;  // number of voxels read along an edge
constexpr int kPitch = 80;                         // kSmoothed, rounded up to whole vectors
// Solid voxels keep more of their distance of 0.5 than air does; otherwise features one voxel thick would shrink to a
// wire.
constexpr float kLeastSolid = 0.35F;
constexpr float kLeastAir = 0.1F;
constexpr float kBand = 8.0F;
static_assert(kMargin == kVoxelFieldReach);

using ByteRow = std::array<std::uint8_t, kPitch>;

/// The voxels of a row of the region that are not air; bit 0 is the first.
struct RegionRow {
  std::uint64_t low = 0;
  std::uint64_t high = 0;

  static constexpr std::uint64_t kHighBits = (std::uint64_t{1} << (kRegion - 64)) - 1;
  [[nodiscard]] bool has_none() const { return (low | high) == 0; }
  [[nodiscard]] bool has_all() const { return ~low == 0 && high == kHighBits; }
};

struct Scratch {
  std::array<RegionRow, kRegion * kRegion> rows;  // [z][y]
  // Squared distances to the nearest voxel of a kind: along x, then in x and y, then in space.
  std::array<ByteRow, kRegion * kRegion> along_x;       // [z][y]
  std::array<ByteRow, kRegion * kSmoothed> along_xy;    // [z][y]
  std::array<ByteRow, kSmoothed * kSmoothed> to_solid;  // [z][y]
  std::array<ByteRow, kSmoothed * kSmoothed> to_air;
  std::array<float, kSmoothed * kSmoothed * kChunkEdge> blurred_x;   // [z][y][x]
  std::array<float, kSmoothed * kChunkEdge * kChunkEdge> blurred_y;  // [z][y][x]
};

/// The rows along x whose densities are wanted, of a chunk; intermediate rows begin at the same numbers.
struct Window {
  int first_y = 0;
  int last_y = kChunkEdge;  // excluded
  int first_z = 0;
  int last_z = kChunkEdge;

  [[nodiscard]] bool empty() const { return first_y >= last_y || first_z >= last_z; }
};

/// Visits (y, z) of a window enlarged by `more_y` and `more_z` at its ends.
template <class Visit>
void for_each_row(const Window& window, int more_y, int more_z, Visit visit) {
  QUOIN_ASSERT(window.first_y >= 0 && window.last_y <= kChunkEdge && window.first_z >= 0 && window.last_z <= kChunkEdge,
               "rows of the chunk");
  for (int z = window.first_z; z < window.last_z + more_z; ++z) {
    for (int y = window.first_y; y < window.last_y + more_y; ++y) visit(y, z);
  }
}

// Returns the non-air voxels of a row of the neighbourhood's chunks. Requires: -64 <= y, z < 128.
std::uint64_t solid_row(const Neighbourhood& chunks, int dx, int y, int z) {
  QUOIN_ASSERT(y >= -kChunkEdge && y < 2 * kChunkEdge && z >= -kChunkEdge && z < 2 * kChunkEdge, "-64 <= y, z < 128");
  const Chunk* chunk = chunks.at(dx, y >> kChunkShift, z >> kChunkShift);
  return chunk == nullptr ? 0 : ~chunk->row_mask(y & (kChunkEdge - 1), z & (kChunkEdge - 1), kAir);
}

/// The voxels of a region.
struct RegionContent {
  bool is_all_solid = true;
  bool is_all_air = true;
  Window near_solid{kChunkEdge, 0, kChunkEdge, 0};  // the rows with solid voxels in their reach; others are far away
};

RegionContent read_region(const Neighbourhood& chunks, const Window& window, Scratch& scratch) {
  RegionContent content;
  Window& near = content.near_solid;
  for_each_row(window, 2 * kMargin, 2 * kMargin, [&](int y, int z) {
    const auto part = [&](int dx) { return solid_row(chunks, dx, y - kMargin, z - kMargin); };
    const std::uint64_t middle = part(0);
    RegionRow& row = scratch.rows[static_cast<std::size_t>(z * kRegion + y)];
    row.low = part(-1) >> (64 - kMargin) | middle << kMargin;
    row.high = (middle >> (64 - kMargin) | part(1) << kMargin) & RegionRow::kHighBits;
    content.is_all_solid = content.is_all_solid && row.has_all();
    if (row.has_none()) return;
    content.is_all_air = false;
    near.first_y = std::min(near.first_y, std::max(y - 2 * kMargin, 0));
    near.last_y = std::max(near.last_y, std::min(y + 1, kChunkEdge));
    near.first_z = std::min(near.first_z, std::max(z - 2 * kMargin, 0));
    near.last_z = std::max(near.last_z, std::min(z + 1, kChunkEdge));
  });
  return content;
}

// For each byte, its bits as eight bytes of 0 or 1.
constexpr std::array<std::uint64_t, 256> make_spread_bits() {
  std::array<std::uint64_t, 256> table{};
  for (std::size_t bits = 0; bits < 256; ++bits) {
    for (std::size_t i = 0; i < 8; ++i) table[bits] |= std::uint64_t{bits >> i & 1U} << (8 * i);
  }
  return table;
}
constexpr std::array<std::uint64_t, 256> kSpreadBits = make_spread_bits();

// Squared distances along a row to the nearest voxel that is solid, or is not: in how many of the rows that are wider
// by 0, 1, ... a voxel is counts down from the reach, eight voxels in a word.
void measure_row(const RegionRow& row, bool solid, ByteRow& out) {
  if (solid ? row.has_none() : row.has_all()) return out.fill(kFarSquared);
  if (solid ? row.has_all() : row.has_none()) return out.fill(0);
  RegionRow wide = row;
  if (!solid) wide = {~row.low, ~row.high & RegionRow::kHighBits};
  std::array<std::uint64_t, kPitch / 8> within{};
  constexpr std::uint64_t kLastBits = (std::uint64_t{1} << (kSmoothed - 64)) - 1;
  for (int distance = 0; distance <= kReach; ++distance) {
    const std::uint64_t first = wide.low >> kReach | wide.high << (64 - kReach);
    const std::uint64_t last = wide.high >> kReach & kLastBits;
    for (std::size_t i = 0; i < 8; ++i) within[i] += kSpreadBits[first >> (8 * i) & 0xFFU];
    within[8] += kSpreadBits[last];
    const RegionRow before = wide;
    wide.low |= before.low << 1 | before.low >> 1 | before.high << 63;
    wide.high |= (before.high << 1 | before.low >> 63 | before.high >> 1) & RegionRow::kHighBits;
  }
  std::memcpy(out.data(), within.data(), sizeof out);
  for (std::uint8_t& count : out) {
    const auto distance = static_cast<std::uint8_t>(kReach + 1 - count);
    count = static_cast<std::uint8_t>(distance * distance);
  }
}

// Extends the distances along another axis: the minimum of the neighbours' squared distances plus squared offsets.
void spread(const ByteRow* middle, int stride, ByteRow& out) {
  out = *middle;
  for (int offset = 1; offset <= kReach; ++offset) {
    const ByteRow& before = *(middle - offset * stride);
    const ByteRow& after = *(middle + offset * stride);
    const auto square = static_cast<std::uint8_t>(offset * offset);
    for (std::size_t x = 0; x < kPitch; ++x) {
      const auto through = static_cast<std::uint8_t>(std::min(before[x], after[x]) + square);
      out[x] = std::min(out[x], through);
    }
  }
}

// The squared distance of every sample to the nearest solid voxel, or the nearest that is air.
// Source: P. Felzenszwalb, D. Huttenlocher, "Distance Transforms of Sampled Functions" (2012), an axis at a time, with
//         a short reach in place of envelopes.
void measure(Scratch& scratch, const Window& window, bool solid, std::array<ByteRow, kSmoothed * kSmoothed>& out) {
  for_each_row(window, 2 * kMargin, 2 * kMargin, [&](int y, int z) {
    const auto row = static_cast<std::size_t>(z * kRegion + y);
    measure_row(scratch.rows[row], solid, scratch.along_x[row]);
  });
  for_each_row(window, 2 * kBlur, 2 * kMargin, [&](int y, int z) {
    spread(&scratch.along_x[static_cast<std::size_t>(z * kRegion + y + kReach)], 1,
           scratch.along_xy[static_cast<std::size_t>(z * kSmoothed + y)]);
  });
  for_each_row(window, 2 * kBlur, 2 * kBlur, [&](int y, int z) {
    spread(&scratch.along_xy[static_cast<std::size_t>((z + kReach) * kSmoothed + y)], kSmoothed,
           out[static_cast<std::size_t>(z * kSmoothed + y)]);
  });
}

// Distances to the surface by squared distances to the nearest voxel of the other kind.
std::array<float, kFarSquared + 1> surface_distances() {
  std::array<float, kFarSquared + 1> table{};
  for (std::size_t i = 1; i < table.size(); ++i) table[i] = std::sqrt(static_cast<float>(i)) - 0.5F;
  return table;
}

constexpr std::array<float, 5> kKernel = {1.0F / 16.0F, 4.0F / 16.0F, 6.0F / 16.0F, 4.0F / 16.0F, 1.0F / 16.0F};

// Smooths the signed distances along x.
void blur_along_x(Scratch& scratch, const Window& window) {
  static const std::array<float, kFarSquared + 1> distance_of = surface_distances();
  std::array<float, kSmoothed> signed_distances;
  for_each_row(window, 2 * kBlur, 2 * kBlur, [&](int y, int z) {
    const auto row = static_cast<std::size_t>(z * kSmoothed + y);
    const ByteRow& to_solid = scratch.to_solid[row];
    const ByteRow& to_air = scratch.to_air[row];
    // One of the two is 0.
    for (std::size_t x = 0; x < kSmoothed; ++x) signed_distances[x] = distance_of[to_solid[x]] - distance_of[to_air[x]];
    float* out = scratch.blurred_x.data() + row * kChunkEdge;
    for (std::size_t x = 0; x < kChunkEdge; ++x) {
      const float* d = signed_distances.data() + x;
      out[x] = (kKernel[0] * (d[0] + d[4]) + kKernel[1] * (d[1] + d[3])) + kKernel[2] * d[2];
    }
  });
}

// Smooths a row of 64 with its neighbouring rows, `stride` values apart.
void blur_rows(const float* first, std::size_t stride, float* out) {
  for (std::size_t x = 0; x < kChunkEdge; ++x) {
    const float* d = first + x;
    const float outer = d[0] + d[4 * stride];
    const float inner = d[stride] + d[3 * stride];
    out[x] = (kKernel[0] * outer + kKernel[1] * inner) + kKernel[2] * d[2 * stride];
  }
}

void blur_along_y(Scratch& scratch, const Window& window) {
  for_each_row(window, 0, 2 * kBlur, [&](int y, int z) {
    blur_rows(scratch.blurred_x.data() + static_cast<std::size_t>(z * kSmoothed + y) * kChunkEdge, kChunkEdge,
              scratch.blurred_y.data() + static_cast<std::size_t>(z * kChunkEdge + y) * kChunkEdge);
  });
}

// `stored_within` for lengths that are neither 0 nor subnormal as halves, without a branch: loops of it are vectors.
Half stored_distance(float distance, float band) {
  const auto bits = std::bit_cast<std::uint32_t>(std::clamp(distance, -band, band));
  const std::uint32_t magnitude = bits & 0x7FFF'FFFFU;
  // Rounds like half_from_float.
  const std::uint32_t rounded = (magnitude + 0xC800'0FFFU + (magnitude >> 13 & 1U)) >> 13;
  return static_cast<Half>((bits >> 16 & 0x8000U) | rounded);
}
static_assert(kLeastAir > 1e-3F && kLeastSolid > 1e-3F);

// The last axis; densities keep the signs of their voxels.
void write_densities(const Scratch& scratch, const Window& window, Half far, DensityChunk& out) {
  constexpr std::size_t kPlane = std::size_t{kChunkEdge} * kChunkEdge;
  std::array<float, kChunkEdge> smoothed;
  std::array<Half, kChunkEdge> row;
  const float band = float_from_half(far);
  for_each_row(window, 0, 0, [&](int y, int z) {
    const auto first = static_cast<std::size_t>(z * kChunkEdge + y) * kChunkEdge;
    blur_rows(scratch.blurred_y.data() + first, kPlane, smoothed.data());
    const ByteRow& to_solid = scratch.to_solid[static_cast<std::size_t>((z + kBlur) * kSmoothed + y + kBlur)];
    for (std::size_t x = 0; x < kChunkEdge; ++x) {
      const bool is_solid = to_solid[x + kBlur] == 0;
      row[x] = stored_distance(is_solid ? std::min(smoothed[x], -kLeastSolid) : std::max(smoothed[x], kLeastAir), band);
    }
    out.write_row(y, z, row);
  });
}

void write_window(Scratch& scratch, const Window& window, Half far, DensityChunk& out) {
  measure(scratch, window, true, scratch.to_solid);
  measure(scratch, window, false, scratch.to_air);
  blur_along_x(scratch, window);
  blur_along_y(scratch, window);
  write_densities(scratch, window, far, out);
  out.unite_slabs();
}

bool is_one_kind_throughout(const Neighbourhood& chunks) {
  const auto kind = [](const Chunk* chunk) -> std::optional<bool> {
    if (chunk == nullptr) return false;
    const auto uniform = chunk->uniform();
    return uniform ? std::optional(*uniform != kAir) : std::nullopt;
  };
  const std::optional<bool> first = kind(chunks.chunks[0]);
  return first.has_value() && std::all_of(chunks.chunks.begin(), chunks.chunks.end(),
                                          [&](const Chunk* chunk) { return kind(chunk) == first; });
}

// The chunks that contain voxels, and their neighbours: the band extends into these.
std::vector<IVec3> chunks_near(const Grid& grid) {
  std::vector<IVec3> all;
  for (const IVec3 at : grid.chunks()) {
    for (int i = 0; i < 27; ++i) all.push_back(at + Neighbourhood::offset(i));
  }
  sort_and_unite(all);
  return all;
}

}  // namespace

DensityChunk density_of_voxels(const Neighbourhood& chunks) {
  const Half far = largest_within(kBand);
  const Half deep = stored_within(-kBand, far);
  const Chunk* voxels = chunks.at(0, 0, 0);
  DensityChunk made(far);
  if (voxels != nullptr) made.materials() = *voxels;
  if (is_one_kind_throughout(chunks)) {
    if (voxels != nullptr) made.fill(deep);
    return made;
  }
  const std::unique_ptr<Scratch> scratch(new Scratch);  // without writing zeros first
  const RegionContent content = read_region(chunks, {}, *scratch);
  if (content.is_all_solid) made.fill(deep);
  if (!content.is_all_solid && !content.is_all_air) write_window(*scratch, content.near_solid, far, made);
  return made;
}

void update_density_of_voxels(const Neighbourhood& chunks, const IBox& changed, DensityChunk& densities) {
  const auto first = [](int from) { return std::clamp(from - kVoxelFieldReach, 0, kChunkEdge); };
  const auto last = [](int to) { return std::clamp(to + kVoxelFieldReach, 0, kChunkEdge); };
  const Chunk* const voxels = chunks.centre();
  densities.materials() = voxels == nullptr ? Chunk(kAir) : *voxels;
  if (changed.empty()) return;
  const Window window{first(changed.min.y), last(changed.max.y), first(changed.min.z), last(changed.max.z)};
  if (window.empty()) return;
  const std::unique_ptr<Scratch> scratch(new Scratch);  // without writing zeros first
  (void)read_region(chunks, window, *scratch);
  write_window(*scratch, window, largest_within(kBand), densities);
}

namespace {

/// The materials of a chunk's solid samples; air elsewhere.
Chunk solid_materials(const DensityChunk& samples, VoxelType unnamed) {
  Chunk made(kAir);
  std::array<VoxelType, kChunkEdge> row{};
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const std::uint64_t solid = samples.solid_row(y, z);
      if (solid == 0) continue;
      samples.materials().read_row(y, z, row);
      for (VoxelType& type : row) type = type == kAir ? unnamed : type;
      made.write_row(y, z, solid, row);
    }
  }
  made.compact();
  return made;
}

}  // namespace

Grid grid_from_field(const DensityGrid& field, VoxelType unnamed, Threads threads) {
  Grid grid;
  const std::vector<IVec3> places = field.chunks();
  constexpr std::size_t kBatch = 64;
  std::vector<Chunk> made(std::min(kBatch, places.size()));
  for (std::size_t first = 0; first < places.size(); first += kBatch) {
    const std::size_t count = std::min(kBatch, places.size() - first);
    parallel_for(count, threads,
                 [&](std::size_t i) { made[i] = solid_materials(*field.find_chunk(places[first + i]), unnamed); });
    for (std::size_t i = 0; i < count; ++i) grid.put_chunk(places[first + i], std::move(made[i]));
  }
  return grid;
}

Result<DensityGrid> field_from_grid(const Grid& grid, Threads threads, const Progress& progress) {
  DensityGrid field(kBand);
  const std::vector<IVec3> places = chunks_near(grid);
  // Works in batches, so that few finished chunks wait to be stored.
  constexpr std::size_t kBatch = 64;
  std::vector<std::optional<DensityChunk>> made(std::min(kBatch, places.size()));
  for (std::size_t first = 0; first < places.size(); first += kBatch) {
    const std::size_t count = std::min(kBatch, places.size() - first);
    parallel_for(count, threads,
                 [&](std::size_t i) { made[i] = density_of_voxels(grid.neighbourhood(places[first + i])); });
    for (std::size_t i = 0; i < count; ++i) field.put_chunk(places[first + i], std::move(*made[i]));
    const std::size_t done = first + count;
    if (progress && !progress(static_cast<double>(done) / static_cast<double>(places.size()))) {
      return make_error(ErrorCode::Cancelled, "cancelled");
    }
  }
  return field;
}

}  // namespace quoin
