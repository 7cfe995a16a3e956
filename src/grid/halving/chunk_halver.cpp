#include "grid/halving/chunk_halver.h"

#include <algorithm>
#include <bit>
#include <map>

#include <quoin/core/assert.h>

#include "core/rows/packed_row.h"
#include "grid/chunk/chunk_storage.h"

namespace quoin {
namespace {

constexpr std::uint64_t kOdd = 0xAAAA'AAAA'AAAA'AAAAU;
constexpr std::uint64_t kLowHalf = 0xFFFF'FFFFU;

// Masks with one bit per cell.
struct WordCells {
  std::uint64_t any = 0;
  std::uint64_t half = 0;
  std::array<std::uint64_t, 3> rod{};
};

// The voxels in four rows [z][y] that make a row of cells: of each cell the one with the lower x, and the other.
struct CellVoxels {
  std::array<std::uint64_t, 4> lower{};
  std::array<std::uint64_t, 4> upper{};
};

std::uint64_t at_least_two(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  return (a & b) | (c & (a ^ b));
}

// Adds up each cell's eight voxels, 64 cells at once.
WordCells cells_of(const CellVoxels& voxels) {
  const auto& [lower, upper] = voxels;
  const std::array<std::uint64_t, 4> pairs = {
      at_least_two(lower[0], upper[0], lower[1]), at_least_two(upper[1], lower[2], upper[2]), lower[3] & upper[3],
      at_least_two(lower[0] ^ upper[0] ^ lower[1], upper[1] ^ lower[2] ^ upper[2], lower[3] ^ upper[3])};
  std::array<std::uint64_t, 4> any{};
  for (std::size_t i = 0; i < any.size(); ++i) any[i] = lower[i] | upper[i];
  WordCells cells;
  cells.any = any[0] | any[1] | any[2] | any[3];
  cells.half = (pairs[0] & pairs[1]) | (pairs[2] & pairs[3]) | ((pairs[0] | pairs[1]) & (pairs[2] | pairs[3]));
  const std::uint64_t few = (pairs[0] | pairs[1] | pairs[2] | pairs[3]) & ~cells.half;
  cells.rod = {few & (lower[0] | lower[1] | lower[2] | lower[3]) & (upper[0] | upper[1] | upper[2] | upper[3]),
               few & (any[0] | any[2]) & (any[1] | any[3]), few & (any[0] | any[1]) & (any[2] | any[3])};
  return cells;
}

// The rows of a chunk as masks of non-air voxels without shapes. Looks up air in the palette once.
class SolidRows {
 public:
  SolidRows(const Chunk& chunk, const VoxelRegistry& types) : voxels_(ChunkStorage::of(chunk)) {
    if (voxels_ == nullptr) {
      const VoxelType type = *chunk.uniform();
      uniform_ = type == kAir || types.is_shaped(type) ? 0 : ~std::uint64_t{0};
      return;
    }
    if (types.has_shapes()) find_shaped(types);
    if (voxels_->direct()) return;
    const auto& palette = voxels_->palette;
    const auto found = std::find(palette.begin(), palette.end(), kAir);
    has_air_ = found != palette.end();
    air_ = static_cast<std::uint32_t>(found - palette.begin());
  }

  [[nodiscard]] std::uint64_t row(int y, int z) const {
    if (voxels_ == nullptr) return uniform_;
    if (!shaped_.empty()) [[unlikely]]
      return row_without_shapes(y, z);
    if (!has_air_) return ~std::uint64_t{0};
    const std::uint32_t slab = voxels_->slabs[ChunkStorage::slab_index(y, z)];
    if ((slab & ChunkStorage::kUniformSlab) != 0)
      return (slab & ~ChunkStorage::kUniformSlab) == air_ ? 0 : ~std::uint64_t{0};
    return ~packed_row::equal_mask(voxels_->row(slab, ChunkStorage::row_in_slab(y, z)), voxels_->bits, air_);
  }

  /// The first two voxels of a row, at their bits, or the last two.
  [[nodiscard]] std::uint64_t end_of_row(int y, int z, bool is_first) const {
    const std::uint64_t ends = is_first ? 3U : std::uint64_t{3} << 62;
    if (voxels_ == nullptr) return uniform_ & ends;
    if (!shaped_.empty()) [[unlikely]]
      return row_without_shapes(y, z) & ends;
    if (!has_air_) return ends;
    const std::uint32_t slab = voxels_->slabs[ChunkStorage::slab_index(y, z)];
    if ((slab & ChunkStorage::kUniformSlab) != 0) return (slab & ~ChunkStorage::kUniformSlab) == air_ ? 0 : ends;
    const int row = ChunkStorage::row_in_slab(y, z);
    const int x = is_first ? 0 : kChunkEdge - 2;
    return (std::uint64_t{voxels_->read(slab, row, x) != air_} | std::uint64_t{voxels_->read(slab, row, x + 1) != air_}
                                                                     << 1)
           << x;
  }

  /// The 16 rows of a slab in the order in which they are stored.
  void slab(std::size_t index, std::array<std::uint64_t, 16>& out) const {
    const std::uint32_t slot = voxels_ == nullptr ? ChunkStorage::kUniformSlab : voxels_->slabs[index];
    if (!shaped_.empty()) [[unlikely]] {
      for (int i = 0; i < 16; ++i) {
        const int y = static_cast<int>(index % 16) * 4 + i % 4;
        const int z = static_cast<int>(index / 16) * 4 + i / 4;
        out[static_cast<std::size_t>(ChunkStorage::row_in_slab(y, z))] = row_without_shapes(y, z);
      }
    } else if ((slot & ChunkStorage::kUniformSlab) != 0 || !has_air_) {
      const int y = static_cast<int>(index % 16) * 4;
      const int z = static_cast<int>(index / 16) * 4;
      out.fill(row(y, z));
    } else if (voxels_->bits == 2) {
      where_not_air_of_two_bits(voxels_->row(slot, 0), out);
    } else {
      for (int i = 0; i < 16; ++i) {
        out[static_cast<std::size_t>(i)] = ~packed_row::equal_mask(voxels_->row(slot, i), voxels_->bits, air_);
      }
    }
  }

 private:
  // Lists air and the types with shapes by their numbers in the chunk, if there are any with shapes.
  void find_shaped(const VoxelRegistry& types) {
    const std::size_t count = voxels_->direct() ? types.size() : voxels_->palette.size();
    for (std::size_t i = 0; i < count; ++i) {
      const VoxelType type = voxels_->direct() ? static_cast<VoxelType>(i) : voxels_->palette[i];
      if (types.is_shaped(type)) shaped_.push_back(static_cast<std::uint32_t>(i));
    }
    if (shaped_.empty()) return;
    for (std::size_t i = 0; i < count; ++i) {
      const VoxelType type = voxels_->direct() ? static_cast<VoxelType>(i) : voxels_->palette[i];
      if (type == kAir) shaped_.push_back(static_cast<std::uint32_t>(i));
    }
  }
  [[nodiscard]] std::uint64_t row_without_shapes(int y, int z) const {
    const std::uint32_t slab = voxels_->slabs[ChunkStorage::slab_index(y, z)];
    const bool is_uniform = (slab & ChunkStorage::kUniformSlab) != 0;
    std::uint64_t others = 0;
    for (const std::uint32_t number : shaped_) {
      if (is_uniform) {
        if ((slab & ~ChunkStorage::kUniformSlab) == number) return 0;
      } else {
        others |= packed_row::equal_mask(voxels_->row(slab, ChunkStorage::row_in_slab(y, z)), voxels_->bits, number);
      }
    }
    return ~others;
  }
  // Processes all words first, in a loop that compilers vectorise.
  void where_not_air_of_two_bits(const std::uint64_t* words, std::array<std::uint64_t, 16>& out) const {
    const std::uint64_t air = packed_row::repeat(2, air_);
    std::array<std::uint64_t, 32> halves;
    for (std::size_t i = 0; i < halves.size(); ++i) {
      const std::uint64_t other = words[i] ^ air;
      halves[i] = packed_row::gather_even_bits(other | other >> 1);
    }
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = halves[2 * i] | halves[2 * i + 1] << 32;
  }

  const ChunkStorage* voxels_;
  std::uint64_t uniform_ = 0;
  std::uint32_t air_ = kAir;
  bool has_air_ = true;
  std::vector<std::uint32_t> shaped_;  // air and types with shapes; empty if there are none with shapes
};

}  // namespace

HalvingMasks::HalvingMasks(const Grid& grid, const VoxelRegistry& types, IVec3 chunk)
    : fine_(std::size_t{kRows} * kRows), cells_(std::size_t{kCellRows} * kCellRows) {
  for (int z = -1; z <= 2; ++z) {
    for (int y = -1; y <= 2; ++y) {
      for (int x = -1; x <= 2; ++x) {
        const IVec3 at{x, y, z};
        int outside = 0;
        for (int axis = 0; axis < 3; ++axis) outside += at[axis] < 0 || at[axis] > 1;
        if (outside > 1) continue;
        chunks_[slot(at)] = grid.find_chunk(2 * chunk + at);
        if (chunks_[slot(at)] != nullptr) read_voxels(at, types);
      }
    }
  }
  for (int z = -1; z <= kChunkEdge; ++z) {
    for (int y = -1; y <= kChunkEdge; ++y) count_cells(y, z);
  }
}

void HalvingMasks::read_voxels(IVec3 octant, const VoxelRegistry& types) {
  const SolidRows solid(*chunks_[slot(octant)], types);
  const IVec3 first = octant * kChunkEdge;
  const IVec3 low = glm::max(IVec3(-2) - first, IVec3(0));
  const IVec3 high = glm::min(IVec3(kFineEdge + 2) - first, IVec3(kChunkEdge));
  const auto word = static_cast<std::size_t>(octant.x + 1);
  if (high.x - low.x < kChunkEdge) {
    for (int z = low.z; z < high.z; ++z) {
      for (int y = low.y; y < high.y; ++y) fine(first.y + y, first.z + z)[word] = solid.end_of_row(y, z, low.x == 0);
    }
    return;
  }
  std::array<std::uint64_t, 16> rows;
  for (int z = low.z & ~3; z < high.z; z += 4) {
    for (int y = low.y & ~3; y < high.y; y += 4) {
      solid.slab(ChunkStorage::slab_index(y, z), rows);
      const int last_y = std::min(y + 4, high.y);
      const int last_z = std::min(z + 4, high.z);
      for (int row_z = std::max(z, low.z); row_z < last_z; ++row_z) {
        for (int row_y = std::max(y, low.y); row_y < last_y; ++row_y) {
          fine(first.y + row_y, first.z + row_z)[word] =
              rows[static_cast<std::size_t>(ChunkStorage::row_in_slab(row_y, row_z))];
        }
      }
    }
  }
}

void HalvingMasks::count_cells(int y, int z) {
  const std::array<const FineRow*, 4> rows = {&fine(2 * y, 2 * z), &fine(2 * y + 1, 2 * z), &fine(2 * y, 2 * z + 1),
                                              &fine(2 * y + 1, 2 * z + 1)};
  const auto any_of = [&rows](std::size_t word) {
    return (*rows[0])[word] | (*rows[1])[word] | (*rows[2])[word] | (*rows[3])[word];
  };
  CellRow& row = cells_[static_cast<std::size_t>((z + 1) * kCellRows + y + 1)];
  if ((any_of(1) | any_of(2)) != 0) {
    std::array<std::uint64_t, 8> words;
    for (std::size_t i = 0; i < words.size(); ++i) words[i] = (*rows[i / 2])[1 + i % 2];
    for (std::uint64_t& word : words) word = packed_row::split_pairs(word);
    CellVoxels voxels;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      voxels.lower[i] = (words[2 * i] & kLowHalf) | words[2 * i + 1] << 32;
      voxels.upper[i] = words[2 * i] >> 32 | (words[2 * i + 1] & ~kLowHalf);
    }
    const WordCells cells = cells_of(voxels);
    row.any.bits = cells.any;
    row.half.bits = cells.half;
    for (std::size_t axis = 0; axis < 3; ++axis) row.rod[axis].bits = cells.rod[axis];
  }
  if ((any_of(0) | any_of(3)) == 0) return;
  CellVoxels voxels;  // the cell before as bit 0, the one after as bit 1
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const FineRow& of = *rows[i];
    voxels.lower[i] = (of[0] >> 62 & 1U) | (of[3] & 1U) << 1;
    voxels.upper[i] = of[0] >> 63 | (of[3] & 2U);
  }
  const WordCells cells = cells_of(voxels);
  const auto put = [](CellBits& to, std::uint64_t from) {
    to.before = (from & 1U) != 0;
    to.after = (from & 2U) != 0;
  };
  put(row.any, cells.any);
  put(row.half, cells.half);
  for (std::size_t axis = 0; axis < 3; ++axis) put(row.rod[axis], cells.rod[axis]);
}

std::uint64_t HalvingMasks::kept_rods(int y, int z, int axis) const {
  QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge && axis >= 0 && axis < 3, "a row of the chunk, and an axis");
  const CellRow& here = cells(y, z);
  const auto of = static_cast<std::size_t>(axis);
  std::uint64_t kept = here.rod[of].bits;
  if (kept == 0) return 0;
  const CellRow& lower_y = cells(y - 1, z);
  const CellRow& upper_y = cells(y + 1, z);
  const CellRow& lower_z = cells(y, z - 1);
  const CellRow& upper_z = cells(y, z + 1);
  if (axis == 0) {
    kept &= here.any.lower() | here.any.upper();
  } else {
    kept &= ~(here.half.lower() | here.half.upper()) & ~(here.rod[of].lower() & kOdd);
  }
  if (axis == 1) {
    kept &= lower_y.any.bits | upper_y.any.bits;
  } else {
    kept &= ~(lower_y.half.bits | upper_y.half.bits);
    if ((y & 1) != 0) kept &= ~lower_y.rod[of].bits;
  }
  if (axis == 2) {
    kept &= lower_z.any.bits | upper_z.any.bits;
  } else {
    kept &= ~(lower_z.half.bits | upper_z.half.bits);
    if ((z & 1) != 0) kept &= ~lower_z.rod[of].bits;
  }
  return kept;
}

std::uint64_t HalvingMasks::solid_cells(int y, int z) const {
  std::uint64_t solid = cells(y, z).half.bits;
  for (int axis = 0; axis < 3; ++axis) solid |= kept_rods(y, z, axis);
  return solid;
}

std::array<std::uint64_t, 3> HalvingMasks::exposed_faces(int half, int y, int z) const {
  QUOIN_ASSERT(half == 0 || half == 1, "one of two halves");
  const auto word = static_cast<std::size_t>(half + 1);
  const FineRow& row = fine(y, z);
  const std::uint64_t lower_x = ~(row[word] << 1 | row[word - 1] >> 63);
  const std::uint64_t upper_x = ~(row[word] >> 1 | row[word + 1] << 63);
  const std::array<std::uint64_t, 4> others = {~fine(y - 1, z)[word], ~fine(y + 1, z)[word], ~fine(y, z - 1)[word],
                                               ~fine(y, z + 1)[word]};
  struct Sum {
    std::uint64_t ones;
    std::uint64_t twos;
  };
  const auto add = [](std::uint64_t a, std::uint64_t b, std::uint64_t c) {
    return Sum{a ^ b ^ c, (a & b) | (c & (a ^ b))};
  };
  const Sum first = add(lower_x, upper_x, others[0]);
  const Sum second = add(others[1], others[2], others[3]);
  const Sum twos = add(first.twos, second.twos, first.ones & second.ones);
  return {first.ones ^ second.ones, twos.ones, twos.twos};
}

namespace {

constexpr int kHalfEdge = kChunkEdge / 2;
constexpr std::uint64_t kHalfRow = 0xFFFF'FFFFU;

// The eight voxels of a cell of four rows, as bits.
unsigned cell_bits(const std::array<std::uint64_t, 4>& rows, int x) {
  QUOIN_ASSERT(x >= 0 && x < kHalfEdge, "0 <= x < 32");
  unsigned bits = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) bits |= static_cast<unsigned>(rows[i] >> (2 * x) & 3U) << (2 * i);
  return bits;
}

int count_bits(unsigned byte) {
  static constexpr auto kCounts = [] {
    std::array<std::uint8_t, 256> counts{};
    for (unsigned i = 0; i < counts.size(); ++i) counts.at(i) = static_cast<std::uint8_t>(std::popcount(i));
    return counts;
  }();
  return kCounts[byte & 0xFFU];
}

}  // namespace

Chunk ChunkHalver::make() {
  Chunk made;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const std::uint64_t solid = masks_.solid_cells(y, z);
      if (solid == 0) continue;
      runs_.clear();
      for (int half = 0; half < 2; ++half) {
        const std::uint64_t of_half = solid >> (half * kHalfEdge) & kHalfRow;
        if (of_half != 0) fill_half(half, y, z, of_half);
      }
      for (const Run& run : runs_) made.fill_row(y, z, run.cells, run.type);
    }
  }
  if (types_->has_shapes()) add_shapes(made);
  if (types_->has_turned_by_state()) copy_states(made);
  made.compact();
  return made;
}

void ChunkHalver::add(VoxelType type, int half, std::uint64_t cells) {
  QUOIN_ASSERT((half == 0 || half == 1) && (cells & ~kHalfRow) == 0, "32 cells of half a row");
  if (cells == 0) return;
  const auto found = std::find_if(runs_.begin(), runs_.end(), [type](const Run& run) { return run.type == type; });
  const std::uint64_t shifted = cells << (half * kHalfEdge);
  if (found == runs_.end()) {
    runs_.push_back({type, shifted});
  } else {
    found->cells |= shifted;
  }
}

void ChunkHalver::fill_half(int half, int y, int z, std::uint64_t solid) {
  // Solid cells hold voxels, so there is a chunk.
  const Chunk* const octant = masks_.octant({half, y / kHalfEdge, z / kHalfEdge});
  QUOIN_ASSERT(octant != nullptr, "solid cells hold voxels");
  const Chunk& chunk = *octant;
  const ChunkStorage* mixed = ChunkStorage::of(chunk);
  if (mixed == nullptr) return add(*chunk.uniform(), half, solid);
  const int fine_y = 2 * (y % kHalfEdge);
  const int fine_z = 2 * (z % kHalfEdge);
  const std::uint32_t slab = mixed->slabs[ChunkStorage::slab_index(fine_y, fine_z)];
  if ((slab & ChunkStorage::kUniformSlab) != 0) return add(chunk.get(0, fine_y, fine_z), half, solid);
  find_layers(chunk, slab, half, y, z);
  std::uint64_t found = 0;
  std::uint64_t several = 0;
  for (const Layer& layer : layers_) {
    several |= found & layer.cells;
    found |= layer.cells;
  }
  for (const Layer& layer : layers_) add(layer.type, half, layer.cells & solid & ~several);
  if ((several & solid) != 0) fill_mixed(half, y, z, several & solid);
}

// Finds the types in the four rows of half a row of cells, for a slab with a slot.
void ChunkHalver::find_layers(const Chunk& chunk, std::uint32_t slab, int half, int y, int z) {
  const ChunkStorage& mixed = *ChunkStorage::of(chunk);
  std::array<const std::uint64_t*, 4> rows{};
  std::array<std::uint64_t, 4> left{};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const int fine_y = 2 * y + static_cast<int>(i & 1);
    const int fine_z = 2 * z + static_cast<int>(i >> 1);
    rows[i] = mixed.row(slab, ChunkStorage::row_in_slab(fine_y, fine_z));
    left[i] = masks_.voxels(half, fine_y, fine_z);
  }
  layers_.clear();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    while (left[i] != 0) {
      const std::uint32_t index = packed_row::read(rows[i], mixed.bits, std::countr_zero(left[i]));
      Layer& layer = layers_.emplace_back();
      layer.type = mixed.direct() ? static_cast<VoxelType>(index) : mixed.palette[index];
      layer.is_opaque = types_->is_opaque(layer.type);
      std::uint64_t any = 0;
      for (std::size_t k = i; k < rows.size(); ++k) {
        if (left[k] == 0) continue;
        layer.voxels[k] = packed_row::equal_mask(rows[k], mixed.bits, index);
        left[k] &= ~layer.voxels[k];
        any |= layer.voxels[k];
      }
      layer.cells = even_bits(any | any >> 1);
    }
  }
}

// The cells that hold several types.
void ChunkHalver::fill_mixed(int half, int y, int z, std::uint64_t mixed) {
  Exposed exposed{};
  for (std::size_t i = 0; i < exposed.size(); ++i) {
    exposed[i] = masks_.exposed_faces(half, 2 * y + static_cast<int>(i & 1), 2 * z + static_cast<int>(i >> 1));
  }
  for (Layer& layer : layers_) layer.won = 0;
  for (; mixed != 0; mixed &= mixed - 1) {
    const int x = std::countr_zero(mixed);
    layers_[heaviest(exposed, x)].won |= std::uint64_t{1} << x;
  }
  for (const Layer& layer : layers_) add(layer.type, half, layer.won);
}

void ChunkHalver::copy_states(Chunk& made) const {
  std::vector<std::uint32_t> cells;  // that hold turned voxels
  for (int i = 0; i < 8; ++i) {
    const IVec3 octant{i & 1, i >> 1 & 1, i >> 2};
    const Chunk* const chunk = masks_.octant(octant);
    if (chunk == nullptr || chunk->data_count() == 0) continue;
    chunk->for_each_data([&](IVec3 local, const VoxelData& data) {
      if (data.state == 0 || !types_->is_turned_by_state(chunk->get(local))) return;
      cells.push_back(number_of((octant * kChunkEdge + local) / 2));
    });
  }
  std::ranges::sort(cells);
  cells.erase(std::ranges::unique(cells).begin(), cells.end());
  for (const std::uint32_t number : cells) {
    const IVec3 cell = cell_of(number);
    const VoxelType type = made.get(cell);
    if (!types_->is_turned_by_state(type)) continue;
    if (const std::uint32_t state = state_of(cell, type); state != 0) made.set_data(cell, {.state = state});
  }
}

// Returns the state of the greatest weight among a cell's voxels of a type; the lower one on ties.
std::uint32_t ChunkHalver::state_of(IVec3 cell, VoxelType type) const {
  std::map<std::uint32_t, int> weights;
  for (int i = 0; i < 8; ++i) {
    const IVec3 fine = 2 * cell + IVec3{i & 1, i >> 1 & 1, i >> 2};
    const Chunk* const chunk = masks_.octant(fine / kChunkEdge);
    const IVec3 local = fine % kChunkEdge;
    if (chunk == nullptr || chunk->get(local) != type) continue;
    int weight = 1;
    const auto exposed = masks_.exposed_faces(fine.x / kChunkEdge, fine.y, fine.z);
    for (std::size_t digit = 0; digit < exposed.size(); ++digit) {
      weight += static_cast<int>(exposed[digit] >> local.x & 1U) << (3 + digit);
    }
    weights[chunk->data(local).state] += weight;
  }
  const auto best = std::ranges::max_element(weights, {}, [](const auto& each) { return each.second; });
  return best == weights.end() ? 0 : best->first;
}

std::size_t ChunkHalver::heaviest(const Exposed& exposed, int x) const {
  std::array<unsigned, 3> faces{};
  for (std::size_t digit = 0; digit < faces.size(); ++digit) {
    faces[digit] = cell_bits({exposed[0][digit], exposed[1][digit], exposed[2][digit], exposed[3][digit]}, x);
  }
  std::size_t best = 0;
  int best_weight = 0;
  bool is_best_opaque = false;
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    const Layer& layer = layers_[i];
    if ((layer.cells >> x & 1U) == 0) continue;
    const unsigned voxels = cell_bits(layer.voxels, x);
    int weight = count_bits(voxels);
    for (std::size_t digit = 0; digit < faces.size(); ++digit)
      weight += count_bits(voxels & faces[digit]) << (3 + digit);
    const bool is_better = layer.is_opaque != is_best_opaque
                               ? layer.is_opaque
                               : weight > best_weight || (weight == best_weight && layer.type < layers_[best].type);
    if (!is_better) continue;
    best = i;
    best_weight = weight;
    is_best_opaque = layer.is_opaque;
  }
  return best;
}

}  // namespace quoin
