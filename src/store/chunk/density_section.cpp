#include "store/chunk/density_section.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "core/rows/packed_row.h"
#include "grid/density/density_storage.h"

namespace quoin::store {
namespace {

constexpr std::size_t kSlabs = 256;
constexpr std::size_t kRow = kChunkEdge;
constexpr std::size_t kSlabValues = kSlabRows * kRow;
constexpr Half kSign = 0x8000;
constexpr Half kMagnitude = 0x7FFF;

using HalfRow = std::array<Half, kRow>;
using FloatRow = std::array<float, kRow>;

// Returns the rank of a half: its signed distance from 0, counted in halves.
std::int32_t rank_of(Half half) {
  const std::int32_t magnitude = half & kMagnitude;
  return (half & kSign) != 0 ? -magnitude : magnitude;
}

Half half_of_rank(std::int32_t rank) {
  return static_cast<Half>(rank < 0 ? kSign | static_cast<std::uint32_t>(-rank) : static_cast<std::uint32_t>(rank));
}

// Returns the rank of the nearest half, clamped to `largest` in absolute value; subnormal numbers count as 0.
std::int32_t rank_of_float(float value, std::int32_t largest) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const auto half = static_cast<std::int32_t>(((bits & 0x7FFF'FFFFU) + 0x1000U) >> 13) - (112 << 10);
  const std::int32_t magnitude = std::min(std::max(half, 0), largest);
  return (bits >> 31) != 0 ? -magnitude : magnitude;
}

/// Predicts each row from the rows before it.
class Expectation {
 public:
  explicit Expectation(Half largest) : largest_(largest) {}

  /// Predicts a row. Requires: rows come in the order of z, then y.
  void expect(int y, int z, std::array<std::int32_t, kRow>& ranks) const {
    QUOIN_ASSERT(y >= 0 && y < kChunkEdge && z >= 0 && z < kChunkEdge, "0 <= y, z < 64");
    const auto row = static_cast<std::size_t>(y);
    const FloatRow& below = layers_[z & 1][y > 0 ? row - 1 : 0];
    const FloatRow& behind = layers_[(z & 1) ^ 1][row];
    const FloatRow& both = layers_[(z & 1) ^ 1][y > 0 ? row - 1 : 0];
    if (y > 0 && z > 0) {
      for (std::size_t x = 0; x < kRow; ++x) ranks[x] = rank_of_float(below[x] + behind[x] - both[x], largest_);
    } else if (y > 0) {
      for (std::size_t x = 0; x < kRow; ++x) ranks[x] = rank_of_float(below[x], largest_);
    } else if (z > 0) {
      for (std::size_t x = 0; x < kRow; ++x) ranks[x] = rank_of_float(behind[x], largest_);
    } else {
      ranks.fill(0);
    }
  }
  /// Sets the row's actual values.
  void put(int y, int z, const Half* row) {
    QUOIN_ASSERT(y >= 0 && y < kChunkEdge && z >= 0 && row != nullptr, "a row of the chunk");
    FloatRow& values = layers_[z & 1][static_cast<std::size_t>(y)];
    for (std::size_t x = 0; x < kRow; ++x) values[x] = float_from_half(row[x]);
  }
  void put(int y, int z, Half all) { layers_[z & 1][static_cast<std::size_t>(y)].fill(float_from_half(all)); }

 private:
  std::int32_t largest_;
  std::array<std::array<FloatRow, kChunkEdge>, 2> layers_{};
};

std::uint64_t solid_bits(const Half* row) {
  std::array<std::uint8_t, kRow> signs;
  for (std::size_t x = 0; x < kRow; ++x) signs[x] = static_cast<std::uint8_t>(row[x] >> 15);
  std::uint64_t mask = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    mask |= packed_row::gather_byte_bits(number_at<std::uint64_t>(reinterpret_cast<std::byte*>(&signs[8 * i])))
            << (8 * i);
  }
  return mask;
}

bool is_uniform(const DensityStorage& m, std::uint32_t entry) {
  if ((entry & ChunkStorage::kUniformSlab) != 0) return true;
  const Half* const values = m.row(entry, 0);
  // All are equal if each equals the next.
  return std::memcmp(values, values + 1, sizeof(Half) * (kSlabValues - 1)) == 0;
}

Half first_of(const DensityStorage& m, std::uint32_t entry) {
  return (entry & ChunkStorage::kUniformSlab) != 0 ? static_cast<Half>(entry) : *m.row(entry, 0);
}

Half largest_of(const DensityStorage& m) {
  std::uint32_t largest = 0;
  for (const std::uint32_t entry : m.slabs) {
    largest = std::max<std::uint32_t>(largest, first_of(m, entry) & kMagnitude);
    if ((entry & ChunkStorage::kUniformSlab) != 0) continue;
    const Half* const values = m.row(entry, 0);
    Half of_slab = 0;
    for (std::size_t i = 0; i < kSlabValues; ++i) {
      of_slab = std::max(of_slab, static_cast<Half>(values[i] & kMagnitude));
    }
    largest = std::max<std::uint32_t>(largest, of_slab);
  }
  return static_cast<Half>(largest);
}

}  // namespace

void DensityWriter::write(const DensityChunk& chunk, VoxelRunWriter& materials, BlockVector<std::byte>& out) {
  materials.write(chunk.materials(), out);
  const DensityStorage* const m = DensityStorage::of(chunk);
  const auto put_one = [&](Half density) {
    put_number(out, std::uint8_t{0});
    put_number(out, density);
  };
  if (m == nullptr) return put_one(*chunk.uniform());
  const Half first = first_of(*m, m->slabs[0]);
  bool is_one = true;
  for (std::size_t slab = 0; slab < kSlabs; ++slab) {
    is_mixed_[slab] = !is_uniform(*m, m->slabs[slab]);
    is_one = is_one && !is_mixed_[slab] && first_of(*m, m->slabs[slab]) == first;
  }
  if (is_one) return put_one(first);
  put_number(out, std::uint8_t{1});
  put_rows(chunk, out);
}

void DensityWriter::put_rows(const DensityChunk& chunk, BlockVector<std::byte>& out) {
  const DensityStorage& m = *DensityStorage::of(chunk);
  const Half largest = largest_of(m);
  put_number(out, largest);
  for (std::size_t i = 0; i < kSlabs; i += 8) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 8; ++k) bits |= (is_mixed_[i + k] ? 1U : 0U) << k;
    put_number(out, static_cast<std::uint8_t>(bits));
  }
  for (std::size_t slab = 0; slab < kSlabs; ++slab) {
    if (!is_mixed_[slab]) put_number(out, first_of(m, m.slabs[slab]));
  }
  high_.clear();
  Expectation expectation(largest);
  std::array<std::int32_t, kRow> expected{};
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const std::size_t slab = ChunkStorage::slab_index(y, z);
      const std::uint32_t entry = m.slabs[slab];
      if (!is_mixed_[slab]) {
        expectation.put(y, z, first_of(m, entry));
        continue;
      }
      const Half* const row = m.row(entry, ChunkStorage::row_in_slab(y, z));
      expectation.expect(y, z, expected);
      expectation.put(y, z, row);
      for (std::size_t x = 0; x < kRow; ++x) expected[x] = rank_of(row[x]) - expected[x];
      std::array<std::byte, kRow> low;
      std::array<std::byte, kRow> high;
      for (std::size_t x = 0; x < kRow; ++x) {
        const auto change = static_cast<std::int16_t>(expected[x] - (x == 0 ? 0 : expected[x - 1]));
        const auto number = static_cast<std::uint16_t>(static_cast<std::uint16_t>(change) << 1 ^ change >> 15);
        low[x] = static_cast<std::byte>(number & 0xFFU);
        high[x] = static_cast<std::byte>(number >> 8);
      }
      out.insert(out.end(), low.begin(), low.end());
      high_.insert(high_.end(), high.begin(), high.end());
    }
  }
  out.insert(out.end(), high_.begin(), high_.end());
}

namespace {

/// The stored halves of a band.
class StoredHalves {
 public:
  // Requires: band > 0.
  explicit StoredHalves(float band) : least_(stored_density(kMinHalf, band)), largest_(stored_density(band, band)) {
    QUOIN_ASSERT(band > 0.0F, "a positive band");
  }

  [[nodiscard]] bool has(Half half) const {
    const std::uint32_t magnitude = half & kMagnitude;
    return half == 0 || (magnitude >= least_ && magnitude <= largest_);
  }
  [[nodiscard]] bool has_row(const Half* row) const {
    std::uint32_t all = 1;
    for (std::size_t x = 0; x < kRow; ++x) all &= has(row[x]) ? 1U : 0U;
    return all != 0;
  }
  [[nodiscard]] Half largest() const { return static_cast<Half>(largest_); }

 private:
  std::uint32_t least_;
  std::uint32_t largest_;
};

Error wrong_density(std::size_t at) {
  return ContentReader::fault("invalid density: beyond the band, -0 or too close to 0", at);
}

// Decodes one row. Requires: `low` and `high` have the row's bytes.
void read_row(const std::byte* low, const std::byte* high, const std::array<std::int32_t, kRow>& expected, Half* row) {
  std::array<std::uint16_t, kRow> numbers;
  for (std::size_t x = 0; x < kRow; ++x) {
    const auto number = static_cast<std::uint16_t>(std::to_integer<std::uint32_t>(low[x]) |
                                                   std::to_integer<std::uint32_t>(high[x]) << 8);
    numbers[x] = static_cast<std::uint16_t>(number >> 1 ^ (0U - (number & 1U)));
  }
  for (std::size_t x = 1; x < kRow; ++x) numbers[x] = static_cast<std::uint16_t>(numbers[x] + numbers[x - 1]);
  for (std::size_t x = 0; x < kRow; ++x) {
    row[x] = half_of_rank(static_cast<std::int16_t>(numbers[x] + static_cast<std::uint32_t>(expected[x])));
  }
}

/// Reads the slabs of one density into the storage, and determines the mixed slabs.
Result<std::size_t> read_slabs(ContentReader& reader, const StoredHalves& stored, DensityStorage& m) {
  if (!reader.has(kSlabs / 8)) return reader.cut_off();
  const auto mixed = reader.take_bytes(kSlabs / 8);
  std::uint32_t slots = 0;
  for (std::size_t slab = 0; slab < kSlabs; ++slab) {
    if ((std::to_integer<std::uint32_t>(mixed[slab / 8]) >> (slab % 8) & 1U) != 0) {
      m.slabs[slab] = slots++;
      continue;
    }
    if (!reader.has(sizeof(Half))) return reader.cut_off();
    const auto density = reader.take<Half>();
    if (!stored.has(density)) return wrong_density(reader.at() - sizeof(Half));
    m.slabs[slab] = ChunkStorage::kUniformSlab | density;
  }
  return std::size_t{slots};
}

Status read_rows(ContentReader& reader, const StoredHalves& stored, Half largest, std::size_t slots,
                 DensityStorage& m) {
  const std::size_t begin = reader.at();
  if (!reader.has(slots * kSlabValues * sizeof(Half))) return reader.cut_off();
  QUOIN_ASSERT(slots <= kSlabs, "at most the slabs of a chunk");
  m.values = SlabValues(slots, slots);
  const std::byte* low = reader.take_bytes(m.values.size()).data();
  const std::byte* high = reader.take_bytes(m.values.size()).data();
  const std::byte* const first = low;
  Expectation expectation(largest);
  std::array<std::int32_t, kRow> expected{};
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const std::uint32_t entry = m.slabs[ChunkStorage::slab_index(y, z)];
      std::uint64_t& solid = m.solid[static_cast<std::size_t>(z * kChunkEdge + y)];
      if ((entry & ChunkStorage::kUniformSlab) != 0) {
        expectation.put(y, z, static_cast<Half>(entry));
        solid = (entry & kSign) != 0 ? ~std::uint64_t{0} : 0;
        continue;
      }
      Half* const row = m.row(entry, ChunkStorage::row_in_slab(y, z));
      expectation.expect(y, z, expected);
      read_row(low, high, expected, row);
      if (!stored.has_row(row)) return wrong_density(begin + static_cast<std::size_t>(low - first));
      expectation.put(y, z, row);
      solid = solid_bits(row);
      low += kRow;
      high += kRow;
    }
  }
  QUOIN_ASSERT(low == first + m.values.size(), "every value was read");
  return {};
}

}  // namespace

bool has_stored_densities(const DensityChunk& chunk, float band) {
  const StoredHalves stored(band);
  if (const auto all = chunk.uniform()) return stored.has(*all);
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const Half* const row = chunk.row(y, z);
      if (row == nullptr ? !stored.has(chunk.get(0, y, z)) : !stored.has_row(row)) return false;
    }
  }
  return true;
}

Result<DensityChunk> DensityReader::read(ContentReader& reader, VoxelRunReader& materials, std::size_t type_count,
                                         float band) {
  auto of_materials = materials.read(reader, type_count);
  if (!of_materials) return of_materials.error();
  if (!reader.has(3)) return reader.cut_off();
  const StoredHalves stored(band);
  const auto form = reader.take<std::uint8_t>();
  if (form > 1) return ContentReader::fault("unknown density encoding " + std::to_string(form), reader.at() - 1);
  const auto half = reader.take<Half>();
  if (!stored.has(half)) return wrong_density(reader.at() - sizeof(half));
  if (form == 0) {
    DensityChunk chunk(half);
    chunk.materials() = std::move(*of_materials);
    return chunk;
  }
  if ((half & kSign) != 0) return wrong_density(reader.at() - sizeof(half));
  Ref<DensityStorage> m = make_ref<DensityStorage>();
  const auto slots = read_slabs(reader, stored, *m);
  if (!slots) return slots.error();
  if (auto status = read_rows(reader, stored, half, *slots, *m); !status) return status.error();
  DensityChunk chunk = DensityStorage::chunk_of(std::move(m), std::move(*of_materials));
  chunk.unite_slabs();  // slabs may have one density even if the file stores them as mixed
  return chunk;
}

}  // namespace quoin::store
