// The storage of a chunk's voxels: palette, slots of slabs, and release of memory that edits left unused.

#include <algorithm>
#include <bitset>
#include <new>
#include <numeric>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "core/rows/packed_row.h"
#include "grid/chunk/chunk_data.h"
#include "grid/chunk/chunk_storage.h"

namespace quoin {
namespace {

// The cost of repacking or scanning a slab's voxels, in units of single-voxel changes.
constexpr std::uint32_t kCreditOfSlot = 4;
constexpr std::uint32_t kMaxCredit = 1U << 30;
constexpr std::size_t kAllTypes = std::size_t{1} << 16;

// Calls `visit(type, voxels)` for the types of all voxels at 16 bits; several calls may have the same type.
template <class Visit>
void for_each_type(const ChunkStorage& m, Visit&& visit) {
  std::array<VoxelType, kChunkEdge> row{};
  for (const std::uint32_t entry : m.slabs) {
    if ((entry & ChunkStorage::kUniformSlab) != 0) {
      visit(entry & ~ChunkStorage::kUniformSlab, kSlabRows * kChunkEdge);
      continue;
    }
    for (int i = 0; i < kSlabRows; ++i) {
      packed_row::unpack_as<16>(m.row(entry, i), row.data(), [](std::uint32_t v) { return static_cast<VoxelType>(v); });
      for (const VoxelType type : row) visit(type, 1);
    }
  }
}

// A palette without unused entries, and the new index of each old entry.
struct Numbering {
  BlockVector<VoxelType> palette;
  BlockVector<std::uint32_t> counts;
  BlockVector<std::uint32_t> new_index;
};

// Counts voxels by type.
BlockVector<std::uint32_t> count_types(const ChunkStorage& m) {
  BlockVector<std::uint32_t> voxels(kAllTypes);
  for_each_type(m, [&](std::uint32_t type, int count) { voxels[type] += static_cast<std::uint32_t>(count); });
  return voxels;
}

// Requires: the voxels have a palette, and `bits` suffice for its used entries.
Numbering numbering_of_palette(const ChunkStorage& m, int bits) {
  Numbering to;
  if (bits == 16) {
    to.new_index.assign(m.palette.begin(), m.palette.end());
    to.counts.resize(ChunkStorage::kRemainders);
    for (std::size_t i = 0; i < m.palette.size(); ++i) to.counts[m.palette[i] % to.counts.size()] += m.counts[i];
    return to;
  }
  to.new_index.resize(m.palette.size());
  for (std::size_t i = 0; i < m.palette.size(); ++i) {
    if (m.counts[i] == 0) continue;
    to.new_index[i] = static_cast<std::uint32_t>(to.palette.size());
    to.palette.push_back(m.palette[i]);
    to.counts.push_back(m.counts[i]);
  }
  return to;
}

// Requires: the words hold types themselves, and `bits` suffice for them.
Numbering numbering_of_types(const ChunkStorage& m, int bits) {
  Numbering to;
  to.new_index.resize(kAllTypes);
  if (bits == 16) {
    for (std::size_t type = 0; type < kAllTypes; ++type) to.new_index[type] = static_cast<std::uint32_t>(type);
    to.counts = m.counts;
    return to;
  }
  const BlockVector<std::uint32_t> voxels = count_types(m);
  for (std::size_t type = 0; type < kAllTypes; ++type) {
    if (voxels[type] == 0) continue;
    to.new_index[type] = static_cast<std::uint32_t>(to.palette.size());
    to.palette.push_back(static_cast<VoxelType>(type));
    to.counts.push_back(voxels[type]);
  }
  return to;
}

// `to` holds zeros.
void renumber_row(const std::uint64_t* from, int from_bits, const BlockVector<std::uint32_t>& new_index,
                  std::uint64_t* to, int to_bits) {
  constexpr std::size_t kFew = 6;
  if (new_index.size() > kFew) {
    for (int x = 0; x < kChunkEdge; ++x) {
      packed_row::write(to, to_bits, x, new_index[packed_row::read(from, from_bits, x)]);
    }
    return;
  }
  for (std::uint32_t i = 0; i < new_index.size(); ++i) {
    if (new_index[i] == 0) continue;
    const std::uint64_t mask = packed_row::equal_mask(from, from_bits, i);
    if (mask != 0) packed_row::write_masked(to, to_bits, mask, new_index[i]);
  }
}

}  // namespace

void Chunk::make_mixed() {
  QUOIN_ASSERT(storage_ == nullptr, "a chunk of one type");
  Ref<ChunkStorage> made = make_ref<ChunkStorage>();
  ChunkStorage& m = *made;
  m.palette.push_back(uniform_);
  m.counts.push_back(kChunkVoxels);
  m.used = 1;
  m.slabs.fill(ChunkStorage::kUniformSlab | 0U);
  if (uniform_ != kAir) {
    m.non_air = kChunkVoxels;
    for (auto& axis : m.layer_counts) axis.fill(kChunkEdge * kChunkEdge);
  }
  storage_ = std::move(made);
}

std::uint32_t Chunk::find_or_add(VoxelType type) {
  ChunkStorage& m = *storage_;
  QUOIN_ASSERT(!m.direct(), "voxels with a palette");
  const auto found = std::find(m.palette.begin(), m.palette.end(), type);
  if (found != m.palette.end()) return static_cast<std::uint32_t>(found - m.palette.begin());
  if (m.used < m.palette.size()) {
    const auto unused = std::find(m.counts.begin(), m.counts.end(), 0U);
    const auto index = static_cast<std::size_t>(unused - m.counts.begin());
    QUOIN_ASSERT(index < m.palette.size(), "an unused entry of the palette");
    m.palette[index] = type;
    return static_cast<std::uint32_t>(index);
  }
  if (m.palette.size() == std::size_t{1} << m.bits) repack(m.bits * 2);
  if (m.direct()) return 0;
  m.counts.reserve(m.counts.size() + 1);  // so that both vectors grow, or neither
  m.palette.push_back(type);
  m.counts.push_back(0);
  return static_cast<std::uint32_t>(m.palette.size() - 1);
}

// Returns an unshared slot of a slab for writing. A uniform slab gets a slot filled with its type.
std::uint32_t Chunk::slot_for_writing(std::size_t slab) {
  ChunkStorage& m = *storage_;
  const std::uint32_t entry = m.slabs[slab];
  if ((entry & ChunkStorage::kUniformSlab) == 0) {
    m.words.make_own(m.word_of(entry, 0));
    return entry;
  }
  const auto slab_words = static_cast<std::size_t>(kSlabRows * m.bits);
  std::uint32_t slot = m.first_free;
  QUOIN_ASSERT((slot == ChunkStorage::kNoSlot) == (m.free_count == 0), "free slots are counted");
  if (slot != ChunkStorage::kNoSlot) {
    m.words.make_own(m.word_of(slot, 0));
    m.first_free = static_cast<std::uint32_t>(*m.row(slot, 0));
    --m.free_count;
  } else {
    m.words.grow(m.words.size() + slab_words);
    slot = m.slot_count++;
  }
  std::fill_n(m.own_row(slot, 0), slab_words, packed_row::repeat(m.bits, entry & ~ChunkStorage::kUniformSlab));
  m.slabs[slab] = slot;
  return slot;
}

// Requires: every voxel of the slab has this index, and it was just written.
void Chunk::release_slot(std::size_t slab, std::uint32_t index) {
  ChunkStorage& m = *storage_;
  const std::uint32_t slot = std::exchange(m.slabs[slab], ChunkStorage::kUniformSlab | index);
  QUOIN_ASSERT(slot < m.slot_count && m.free_count < m.slot_count, "a used slot");
  *m.own_row(slot, 0) = m.first_free;
  m.first_free = slot;
  ++m.free_count;
}

// Detects rows and palette entries that a write of `index` made uniform or unused. Repacks voxels to fewer bits only
// after enough changes, so that alternating edits have a bounded cost each.
void Chunk::after_writing(int y, int z, std::uint32_t index, std::uint32_t changed) {
  constexpr std::uint32_t kFewFree = 8;
  ChunkStorage& m = *storage_;
  QUOIN_ASSERT(m.used != 0 && (m.direct() || index < m.palette.size()), "an index of the palette");
  QUOIN_ASSERT(changed != 0 && changed <= kChunkEdge, "changed voxels of a row");
  if (!m.direct() && m.counts[index] == kChunkVoxels) return fill(m.palette[index]);
  m.credit = std::min(m.credit, kMaxCredit) + changed;
  const std::size_t slab = ChunkStorage::slab_index(y, z);
  const std::uint32_t slot = m.slabs[slab];
  if (packed_row::all_equal(m.row(slot, ChunkStorage::row_in_slab(y, z)), m.bits, 1, index) &&
      packed_row::all_equal(m.row(slot, 0), m.bits, kSlabRows, index)) {
    release_slot(slab, index);
    if (m.free_count > kFewFree && m.free_count > m.slot_count / 4) return tidy();
  }
  if (m.used <= 1U << (m.bits / 2) && m.credit >= std::max(m.count_at, kCreditOfSlot * m.slot_count)) tidy();
}

std::size_t Chunk::used_types() const {
  const ChunkStorage& m = *storage_;
  if (!m.direct()) return m.used;
  std::bitset<kAllTypes> seen;
  for_each_type(m, [&](std::uint32_t type, int) { seen[type] = true; });
  return seen.count();
}

// Releases memory that edits left unused, if it is large.
void Chunk::tidy() {
  constexpr std::uint32_t kSoon = 64;
  ChunkStorage& m = *storage_;
  if (is_one_entry()) return fill(get(0, 0, 0));
  const bool may_narrow = m.used <= 1U << (m.bits / 2);
  const auto types = static_cast<std::uint32_t>(may_narrow ? used_types() : kAllTypes);
  const int bits = std::min(bits_for(types), m.bits);
  if (may_narrow) m.credit -= std::min(m.credit, kCreditOfSlot * m.slot_count);
  // A change removes at most one type.
  if (may_narrow && bits == 16) m.count_at = m.credit + std::max(kSoon, types - 256);
  if (bits == m.bits && m.free_count <= m.slot_count / 4) return;
  try {
    repack(bits);
  } catch (const std::bad_alloc&) {
    // The storage then keeps its size; the write is complete.
  }
}

// Returns true if all slabs are uniform with the same type.
bool Chunk::is_one_entry() const {
  const std::uint32_t first = storage_->slabs[0];
  return (first & ChunkStorage::kUniformSlab) != 0 &&
         std::all_of(storage_->slabs.begin(), storage_->slabs.end(),
                     [first](std::uint32_t entry) { return entry == first; });
}

// Repacks the voxels with `bits` bits each, without free slots and unused palette entries.
void Chunk::repack(int bits) {
  ChunkStorage& m = *storage_;
  Numbering to = m.direct() ? numbering_of_types(m, bits) : numbering_of_palette(m, bits);
  QUOIN_ASSERT(bits == 16 || to.palette.size() <= std::size_t{1} << bits, "enough bits for the palette");
  QUOIN_ASSERT(std::accumulate(to.counts.begin(), to.counts.end(), 0U) == kChunkVoxels, "each voxel is counted once");
  const bool is_same = m.direct() ? bits == 16 : bits == m.bits && to.palette.size() == m.palette.size();
  const auto old_words = static_cast<std::size_t>(kSlabRows * m.bits);
  const auto new_words = static_cast<std::size_t>(kSlabRows * bits);
  PagedWords words((m.slot_count - m.free_count) * new_words);
  std::array<std::uint32_t, 256> slabs{};
  std::uint32_t slots = 0;
  for (std::size_t i = 0; i < slabs.size(); ++i) {
    const std::size_t slab = slab_in_order(i);
    const std::uint32_t entry = m.slabs[slab];
    if ((entry & ChunkStorage::kUniformSlab) != 0) {
      slabs[slab] = ChunkStorage::kUniformSlab | to.new_index[entry & ~ChunkStorage::kUniformSlab];
      continue;
    }
    std::uint64_t* const out = words.own_at(slots * new_words);
    slabs[slab] = slots++;
    if (is_same) {
      std::copy_n(m.row(entry, 0), old_words, out);
      continue;
    }
    for (int row = 0; row < kSlabRows; ++row) {
      renumber_row(m.row(entry, row), m.bits, to.new_index, out + row * bits, bits);
    }
  }
  QUOIN_ASSERT(slots * new_words == words.size(), "each slot is free or belongs to one slab");
  m.words = std::move(words);
  m.palette = std::move(to.palette);
  m.counts = std::move(to.counts);
  m.slabs = slabs;
  m.bits = bits;
  m.used = static_cast<std::uint32_t>(m.counts.size() - static_cast<std::size_t>(std::ranges::count(m.counts, 0U)));
  m.count_at = 0;
  m.recent = 0;
  m.first_free = ChunkStorage::kNoSlot;
  m.free_count = 0;
  m.slot_count = slots;
}

Chunk Chunk::renumbered(FunctionRef<VoxelType(VoxelType)> number) const {
  QUOIN_ASSERT(number(kAir) == kAir, "air stays air");
  Chunk result;
  if (storage_ == nullptr) {
    result.uniform_ = number(uniform_);
  } else if (storage_->direct() || storage_->used < storage_->palette.size()) {
    std::array<VoxelType, kChunkEdge> row{};
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y) {
        read_row(y, z, row);
        for (VoxelType& type : row) type = number(type);
        result.write_row(y, z, row);
      }
    }
  } else {
    auto storage = make_ref<ChunkStorage>(*storage_);
    for (VoxelType& type : storage->palette) type = number(type);
    result.storage_ = std::move(storage);
  }
  result.data_ = data_;
  QUOIN_ASSERT(result.non_air_count() == non_air_count(), "only air has air's number");
  return result;
}

std::size_t Chunk::bytes() const {
  const std::size_t of_data = data_ == nullptr ? 0 : data_->allocated();
  if (storage_ == nullptr) return sizeof(Chunk) + of_data;
  const ChunkStorage& m = *storage_;
  return sizeof(Chunk) + of_data + sizeof(ChunkStorage) + m.palette.capacity() * sizeof(VoxelType) +
         m.counts.capacity() * sizeof(std::uint32_t) + m.words.allocated();
}

void Chunk::compact() {
  if (storage_ == nullptr) return;
  if (is_one_entry()) return fill(get(0, 0, 0));
  // Copies would keep the shared memory anyway.
  if (storage_.is_shared() || storage_->words.has_shared_pages()) return;
  repack(bits_for(used_types()));
  storage_->palette.shrink_to_fit();
  storage_->counts.shrink_to_fit();
}

}  // namespace quoin
