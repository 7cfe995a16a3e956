#include <quoin/grid/density_chunk.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "core/rows/packed_row.h"
#include "grid/density/density_storage.h"

namespace quoin {
namespace {

constexpr std::size_t kSlabValues = std::size_t{kSlabRows} * kChunkEdge;

std::uint64_t differences(const Half* a, const Half* b) {
  std::uint64_t mask = 0;
  for (std::size_t x = 0; x < kChunkEdge; ++x) mask |= std::uint64_t{a[x] != b[x]} << x;
  return mask;
}

std::uint64_t solid_bits(const Half* row) {
  std::uint64_t mask = 0;
  for (std::size_t x = 0; x < kChunkEdge; ++x) mask |= std::uint64_t{row[x]} >> 15 << x;
  return mask;
}

// Returns false for values that no band stores: -0, infinities, NaN.
[[maybe_unused]] bool is_stored(Half density) {
  return density != 0x8000U && (density & 0x7C00U) != 0x7C00U;
}

}  // namespace

Half stored_density(float density, float band) {
  QUOIN_ASSERT(band > 0.0F, "a positive band");
  return stored_within(density, largest_within(band));
}

DensityChunk::DensityChunk(Half density, VoxelType material) : uniform_(density), materials_(material) {
  QUOIN_ASSERT(is_stored(density), "a stored_density");
}
DensityChunk::DensityChunk(const DensityChunk&) = default;
DensityChunk::DensityChunk(DensityChunk&&) noexcept = default;
DensityChunk& DensityChunk::operator=(const DensityChunk&) = default;
DensityChunk& DensityChunk::operator=(DensityChunk&&) noexcept = default;
DensityChunk::~DensityChunk() = default;

Half DensityChunk::get(int x, int y, int z) const {
  QUOIN_ASSERT((x | y | z) >= 0 && (x | y | z) < kChunkEdge, "0 <= x, y, z < 64");
  if (storage_ == nullptr) return uniform_;
  const std::uint32_t slab = storage_->slabs[ChunkStorage::slab_index(y, z)];
  if ((slab & ChunkStorage::kUniformSlab) != 0) return static_cast<Half>(slab);
  return storage_->row(slab, ChunkStorage::row_in_slab(y, z))[x];
}

std::uint64_t DensityChunk::solid_row(int y, int z) const {
  QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
  if (storage_ == nullptr) return is_solid(uniform_) ? ~std::uint64_t{0} : 0;
  return storage_->solid[static_cast<std::size_t>(z * kChunkEdge + y)];
}

const Half* DensityChunk::row(int y, int z) const {
  QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
  if (storage_ == nullptr) return nullptr;
  const std::uint32_t slab = storage_->slabs[ChunkStorage::slab_index(y, z)];
  const bool is_uniform = (slab & ChunkStorage::kUniformSlab) != 0;
  return is_uniform ? nullptr : storage_->row(slab, ChunkStorage::row_in_slab(y, z));
}

void DensityChunk::fill(Half density) {
  QUOIN_ASSERT(is_stored(density), "a stored_density");
  storage_.reset();
  uniform_ = density;
}

void DensityChunk::read_row(int y, int z, std::span<Half, kChunkEdge> out) const {
  const Half* samples = row(y, z);
  if (samples != nullptr) {
    std::memcpy(out.data(), samples, sizeof(Half) * kChunkEdge);
  } else {
    std::fill(out.begin(), out.end(), get(0, y, z));
  }
}

void DensityChunk::make_mixed() {
  storage_ = make_ref<DensityStorage>();
  storage_->slabs.fill(ChunkStorage::kUniformSlab | uniform_);
  storage_->solid.fill(is_solid(uniform_) ? ~std::uint64_t{0} : 0);
}

// Returns a slot of a slab for writing. A uniform slab gets a slot filled with its density.
std::uint32_t DensityChunk::slot_for_writing(std::size_t slab) {
  DensityStorage& m = *storage_;
  QUOIN_ASSERT(slab < m.slabs.size() && m.values.size() % kSlabValues == 0, "a slab of the chunk, and whole slots");
  const std::uint32_t entry = m.slabs[slab];
  if ((entry & ChunkStorage::kUniformSlab) == 0) return entry;
  std::uint32_t slot = 0;
  if (!m.free_slots.empty()) {
    slot = m.free_slots.back();
    m.free_slots.pop_back();
  } else {
    slot = static_cast<std::uint32_t>(m.values.size() / kSlabValues);
    m.values.resize(m.values.size() + kSlabValues);
  }
  std::fill_n(m.values.data() + std::size_t{slot} * kSlabValues, kSlabValues, static_cast<Half>(entry));
  m.slabs[slab] = slot;
  return slot;
}

std::uint64_t DensityChunk::write_row(int y, int z, std::span<const float, kChunkEdge> densities, float band) {
  QUOIN_ASSERT(band > 0.0F, "a positive band");
  const Half far = largest_within(band);
  std::array<Half, kChunkEdge> stored;
  std::ranges::transform(densities, stored.begin(), [&](float density) { return stored_within(density, far); });
  return write_row(y, z, stored);
}

std::uint64_t DensityChunk::write_row(int y, int z, std::span<const Half, kChunkEdge> densities) {
  QUOIN_ASSERT(std::all_of(densities.begin(), densities.end(), is_stored), "every density is a stored_density");
  std::array<Half, kChunkEdge> uniform_row;
  const Half* old = row(y, z);
  if (old == nullptr) {
    uniform_row.fill(get(0, y, z));
    old = uniform_row.data();
  }
  if (std::memcmp(old, densities.data(), sizeof(Half) * kChunkEdge) == 0) return 0;
  const std::uint64_t changed = differences(old, densities.data());
  if (storage_ == nullptr) make_mixed();
  storage_.make_own();
  const std::uint32_t slot = slot_for_writing(ChunkStorage::slab_index(y, z));
  const std::size_t first = (std::size_t{slot} * kSlabRows + static_cast<std::size_t>(ChunkStorage::row_in_slab(y, z)));
  std::memcpy(storage_->values.data() + first * kChunkEdge, densities.data(), sizeof(Half) * kChunkEdge);
  storage_->solid[static_cast<std::size_t>(z * kChunkEdge + y)] = solid_bits(densities.data());
  return changed;
}

void DensityStorage::turn_outward(DensityChunk& chunk, const std::array<std::uint64_t, kChunkEdge * kChunkEdge>& rows) {
  constexpr Half kMagnitude = 0x7FFF;
  if (std::all_of(rows.begin(), rows.end(), [](std::uint64_t row) { return row == 0; })) return;
  if (chunk.storage_ == nullptr) chunk.make_mixed();
  chunk.storage_.make_own();
  DensityStorage& m = *chunk.storage_;
  for (std::size_t slab = 0; slab < m.slabs.size(); ++slab) {
    const auto number = [&](std::size_t row) {
      return (slab / 16 * 4 + row / 4) * kChunkEdge + slab % 16 * 4 + row % 4;
    };
    std::uint64_t any = 0;
    std::uint64_t all = ~std::uint64_t{0};
    for (std::size_t row = 0; row < kSlabRows; ++row) {
      QUOIN_ASSERT((rows[number(row)] & ~m.solid[number(row)]) == 0, "solid samples");
      any |= rows[number(row)];
      all &= rows[number(row)];
      m.solid[number(row)] &= ~rows[number(row)];
    }
    if (any == 0) continue;
    if ((m.slabs[slab] & ChunkStorage::kUniformSlab) != 0 && ~all == 0) {
      m.slabs[slab] &= ChunkStorage::kUniformSlab | kMagnitude;
      continue;
    }
    const std::uint32_t slot = chunk.slot_for_writing(slab);
    for (std::size_t row = 0; row < kSlabRows; ++row) {
      const std::uint64_t turned = rows[number(row)];
      Half* const values = m.row(slot, static_cast<int>(row));
      for (std::size_t x = 0; x < kChunkEdge && turned != 0; ++x)
        values[x] &= (turned >> x & 1U) != 0 ? kMagnitude : 0xFFFFU;
    }
  }
  chunk.unite_slabs();
}

void DensityChunk::unite_slabs() {
  if (storage_ == nullptr) return;
  for (std::size_t i = 0; i < storage_->slabs.size(); ++i) {
    const std::uint32_t slab = storage_->slabs[i];
    if ((slab & ChunkStorage::kUniformSlab) != 0) continue;
    const Half* values = storage_->row(slab, 0);
    // All values are equal if each equals the next.
    if (std::memcmp(values, values + 1, sizeof(Half) * (kSlabValues - 1)) != 0) continue;
    const Half value = *values;
    storage_.make_own();
    storage_->free_slots.push_back(slab);
    storage_->slabs[i] = ChunkStorage::kUniformSlab | value;
  }
  const std::uint32_t first = storage_->slabs[0];
  if ((first & ChunkStorage::kUniformSlab) == 0) return;
  const bool is_uniform =
      std::all_of(storage_->slabs.begin(), storage_->slabs.end(), [&](std::uint32_t s) { return s == first; });
  if (is_uniform) fill(static_cast<Half>(first));
}

void DensityChunk::compact() {
  unite_slabs();
  materials_.compact();
  // Copies would keep the shared memory anyway.
  if (storage_ == nullptr || storage_.is_shared()) return;
  BlockVector<Half> values;
  DensityStorage& m = *storage_;
  values.reserve(m.values.size() - m.free_slots.size() * kSlabValues);
  for (std::uint32_t& slab : m.slabs) {
    if ((slab & ChunkStorage::kUniformSlab) != 0) continue;
    const Half* from = m.row(slab, 0);
    slab = static_cast<std::uint32_t>(values.size() / kSlabValues);
    values.insert(values.end(), from, from + kSlabValues);
  }
  QUOIN_ASSERT(values.size() == m.values.size() - m.free_slots.size() * kSlabValues, "each slot is free or in use");
  m.values = std::move(values);
  m.free_slots = {};
}

bool DensityChunk::is_full() const {
  if (storage_ == nullptr) return is_solid(uniform_);
  return std::all_of(storage_->solid.begin(), storage_->solid.end(), [](std::uint64_t row) { return ~row == 0; });
}

bool DensityChunk::operator==(const DensityChunk& other) const {
  if (storage_ != other.storage_ || uniform() != other.uniform()) {
    std::array<Half, kChunkEdge> row{};
    std::array<Half, kChunkEdge> others{};
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y) {
        read_row(y, z, row);
        other.read_row(y, z, others);
        if (row != others) return false;
      }
    }
  }
  return materials_ == other.materials_;
}

std::uint64_t DensityChunk::content_hash() const {
  std::uint64_t hash = materials_.content_hash();
  std::array<Half, kChunkEdge> row{};
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      read_row(y, z, row);
      hash = mixed_with(hash, hash_of_row(row));
    }
  }
  return hash;
}

std::size_t DensityChunk::bytes() const {
  const std::size_t fixed = sizeof(DensityChunk) - sizeof(Chunk) + materials_.bytes();
  if (storage_ == nullptr) return fixed;
  return fixed + sizeof(DensityStorage) + storage_->values.capacity() * sizeof(Half) +
         storage_->free_slots.capacity() * sizeof(std::uint32_t);
}

}  // namespace quoin
