#include "grid/halving.h"

#include <algorithm>

#include "grid/packed_row.h"

namespace quoin {
namespace {

constexpr std::uint64_t kEven = 0x5555'5555'5555'5555U;
constexpr std::uint64_t kOdd = ~kEven;

// Cells of one word of voxels, at its even bits.
struct WordCells {
  std::uint64_t any = 0;
  std::uint64_t half = 0;
  std::array<std::uint64_t, 3> rod{};
};

// `rows`: [z][y]. Adds up each cell's eight voxels, 32 cells at once: a bit of each sum in each word.
WordCells cells_of(const std::array<std::uint64_t, 4>& rows) {
  std::uint64_t ones = 0;
  std::uint64_t twos = 0;
  std::uint64_t fours = 0;
  std::uint64_t eights = 0;
  const auto add = [&](std::uint64_t bits) {
    const std::uint64_t carry = ones & bits;
    ones ^= bits;
    const std::uint64_t carry_two = twos & carry;
    twos ^= carry;
    eights |= fours & carry_two;
    fours ^= carry_two;
  };
  for (const std::uint64_t row : rows) {
    add(row & kEven);
    add(row >> 1 & kEven);
  }
  const std::uint64_t all = rows[0] | rows[1] | rows[2] | rows[3];
  const auto both = [](std::uint64_t a, std::uint64_t b) { return (a | a >> 1) & (b | b >> 1); };
  WordCells cells;
  cells.any = (all | all >> 1) & kEven;
  cells.half = fours | eights;
  const std::uint64_t few = twos & ~cells.half;
  cells.rod = {few & all & all >> 1, few & both(rows[0] | rows[2], rows[1] | rows[3]),
               few & both(rows[0] | rows[1], rows[2] | rows[3])};
  return cells;
}

// The rows of a chunk as masks of what is not air; looks air up in the palette once.
class SolidRows {
 public:
  explicit SolidRows(const Chunk& chunk) : voxels_(chunk.mixed()) {
    if (voxels_ == nullptr) {
      uniform_ = chunk.uniform() == kAir ? 0 : ~std::uint64_t{0};
      return;
    }
    if (voxels_->direct()) return;
    const auto& palette = voxels_->palette;
    const auto found = std::find(palette.begin(), palette.end(), kAir);
    has_air_ = found != palette.end();
    air_ = static_cast<std::uint32_t>(found - palette.begin());
  }

  [[nodiscard]] std::uint64_t row(int y, int z) const {
    if (voxels_ == nullptr) return uniform_;
    if (!has_air_) return ~std::uint64_t{0};
    const std::uint32_t slab = voxels_->slabs[Chunk::slab_index(y, z)];
    if ((slab & Chunk::kUniformSlab) != 0) return (slab & ~Chunk::kUniformSlab) == air_ ? 0 : ~std::uint64_t{0};
    return ~packed_row::equal_mask(voxels_->row(slab, Chunk::row_in_slab(y, z)), voxels_->bits, air_);
  }

 private:
  const Chunk::Mixed* voxels_;
  std::uint64_t uniform_ = 0;
  std::uint32_t air_ = kAir;
  bool has_air_ = true;
};

}  // namespace

HalvingMasks::HalvingMasks(const Grid& grid, IVec3 chunk)
    : fine_(std::size_t{kRows} * kRows), cells_(std::size_t{kCellRows} * kCellRows) {
  for (int z = -1; z <= 2; ++z) {
    for (int y = -1; y <= 2; ++y) {
      for (int x = -1; x <= 2; ++x) {
        const IVec3 at{x, y, z};
        int outside = 0;
        for (int axis = 0; axis < 3; ++axis) outside += at[axis] < 0 || at[axis] > 1;
        if (outside > 1) continue;
        chunks_[slot(at)] = grid.find_chunk(2 * chunk + at);
        if (chunks_[slot(at)] != nullptr) read_voxels(at);
      }
    }
  }
  for (int z = -1; z <= kChunkEdge; ++z) {
    for (int y = -1; y <= kChunkEdge; ++y) count_cells(y, z);
  }
}

void HalvingMasks::read_voxels(IVec3 octant) {
  const SolidRows solid(*chunks_[slot(octant)]);
  const IVec3 first = octant * kChunkEdge;
  const IVec3 low = glm::max(IVec3(-2) - first, IVec3(0));
  const IVec3 high = glm::min(IVec3(kFineEdge + 2) - first, IVec3(kChunkEdge));
  const auto word = static_cast<std::size_t>(octant.x + 1);
  for (int z = low.z; z < high.z; ++z) {
    for (int y = low.y; y < high.y; ++y) fine(first.y + y, first.z + z)[word] = solid.row(y, z);
  }
}

void HalvingMasks::count_cells(int y, int z) {
  const FineRow* rows[] = {&fine(2 * y, 2 * z), &fine(2 * y + 1, 2 * z), &fine(2 * y, 2 * z + 1),
                           &fine(2 * y + 1, 2 * z + 1)};
  CellRow& row = cells_[static_cast<std::size_t>((z + 1) * kCellRows + y + 1)];
  for (std::size_t word = 0; word < 4; ++word) {
    const std::array<std::uint64_t, 4> bits = {(*rows[0])[word], (*rows[1])[word], (*rows[2])[word], (*rows[3])[word]};
    if ((bits[0] | bits[1] | bits[2] | bits[3]) == 0) continue;
    const WordCells cells = cells_of(bits);
    const auto put = [word](CellBits& to, std::uint64_t from) {
      if (word == 0) to.before = (from >> 62 & 1U) != 0;
      if (word == 3) to.after = (from & 1U) != 0;
      if (word == 1) to.bits |= even_bits(from);
      if (word == 2) to.bits |= even_bits(from) << 32;
    };
    put(row.any, cells.any);
    put(row.half, cells.half);
    for (std::size_t axis = 0; axis < 3; ++axis) put(row.rod[axis], cells.rod[axis]);
  }
}

std::uint64_t HalvingMasks::kept_rods(int y, int z, int axis) const {
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

}  // namespace quoin
