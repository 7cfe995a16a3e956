#include <quoin/grid/density_chunk.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include <quoin/core/assert.h>

#include "core/rows/packed_row.h"
#include "grid/density/density_storage.h"

namespace quoin {
namespace {

constexpr std::size_t kSlabValues = SlabValues::kSlabValues;

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

SlabValues::SlabValues(std::size_t slots, std::size_t owned) {
  QUOIN_ASSERT(owned <= slots, "owned slots are slots");
  static_assert(alignof(Block) <= __STDCPP_DEFAULT_NEW_ALIGNMENT__ && sizeof(Block) % alignof(Owners) == 0);
  if (slots == 0) return;
  void* const memory = allocate_block(bytes_of(slots));
  block_ = Ref<Block>(new (memory) Block(slots));
  auto* const counts = reinterpret_cast<Owners*>(block_.get() + 1);
  for (std::size_t i = 0; i < slots; ++i) std::construct_at(counts + i, i < owned ? 1U : 0U);
  data_ = reinterpret_cast<Half*>(static_cast<std::byte*>(memory) + bytes_before_values(slots));
  next_ = static_cast<std::uint32_t>(owned);
}

std::size_t SlabValues::allocated() const {
  return block_ == nullptr ? 0 : bytes_of(block_->slots);
}

std::optional<std::uint32_t> SlabValues::take() {
  const auto slots = static_cast<std::uint32_t>(block_ == nullptr ? 0 : block_->slots);
  for (std::uint32_t i = 0; i < slots; ++i) {
    const std::uint32_t slot = next_ + i < slots ? next_ + i : next_ + i - slots;
    // Acquire: the last owner's reads come before the writes of this one.
    std::uint32_t none = 0;
    if (owners(slot).load(std::memory_order_relaxed) != 0 ||
        !owners(slot).compare_exchange_strong(none, 1, std::memory_order_acquire)) {
      continue;
    }
    next_ = slot + 1 == slots ? 0 : slot + 1;
    return slot;
  }
  return std::nullopt;
}

DensityStorage::DensityStorage(const DensityStorage& other)
    : RefCounted(other), slabs(other.slabs), values(other.values), solid(other.solid) {
  for (const std::uint32_t slab : slabs) {
    if (is_mixed(slab)) values.retain(slab);
  }
}

DensityStorage::~DensityStorage() {
  for (const std::uint32_t slab : slabs) {
    if (is_mixed(slab) && values.size() != 0) values.release(slab);
  }
}

void DensityStorage::move_values(std::size_t spare) {
  const std::size_t mixed = mixed_slabs();
  SlabValues moved(mixed + spare, mixed);
  std::uint32_t slot = 0;
  for (std::uint32_t& slab : slabs) {
    if (!is_mixed(slab)) continue;
    std::copy_n(row(slab, 0), kSlabValues, moved.data() + slot * kSlabValues);
    values.release(slab);
    slab = slot++;
  }
  values = std::move(moved);
}

// Replaces a block without free slots by a larger one. It has spare slots for later versions of slabs if there are
// other owners of slots, else for at most all slabs of the chunk.
void DensityStorage::add_slots() {
  const std::size_t mixed = mixed_slabs();
  if (values.is_shared()) return move_values(std::max<std::size_t>(mixed / 2, 32));
  move_values(std::clamp<std::size_t>(slabs.size() - mixed, 1, mixed / 2 + 4));
}

std::uint32_t DensityStorage::slot_for_writing(std::size_t slab) {
  QUOIN_ASSERT(slab < slabs.size(), "a slab of the chunk");
  const auto is_own = [&] { return is_mixed(slabs[slab]) && values.is_sole(slabs[slab]); };
  if (is_own()) return slabs[slab];
  std::optional<std::uint32_t> slot = values.take();
  if (!slot) {
    add_slots();
    if (is_own()) return slabs[slab];
    slot = values.take();
  }
  QUOIN_ASSERT(slot.has_value(), "a new block has free slots");
  const std::uint32_t entry = slabs[slab];
  if (is_mixed(entry)) {
    std::copy_n(row(entry, 0), kSlabValues, row(*slot, 0));
    values.release(entry);
  } else {
    std::fill_n(row(*slot, 0), kSlabValues, static_cast<Half>(entry));
  }
  slabs[slab] = *slot;
  return *slot;
}

void DensityStorage::make_uniform(std::size_t slab, Half density) {
  QUOIN_ASSERT(slab < slabs.size(), "a slab of the chunk");
  if (is_mixed(slabs[slab])) values.release(slabs[slab]);
  slabs[slab] = ChunkStorage::kUniformSlab | density;
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
  const std::uint32_t slot = storage_->slot_for_writing(ChunkStorage::slab_index(y, z));
  Half* const written = storage_->row(slot, ChunkStorage::row_in_slab(y, z));
  std::memcpy(written, densities.data(), sizeof(Half) * kChunkEdge);
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
    const std::uint32_t slot = m.slot_for_writing(slab);
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
    storage_->make_uniform(i, value);
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
  if (storage_ == nullptr || storage_.is_shared() || storage_->values.is_shared()) return;
  if (storage_->values.size() != storage_->mixed_slabs() * kSlabValues) storage_->move_values(0);
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
  return fixed + sizeof(DensityStorage) + storage_->values.allocated();
}

}  // namespace quoin
