#include <quoin/grid/density_chunk.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>

#include "grid/stored_density.h"

namespace quoin {
namespace {

constexpr std::size_t kSlabRows = 16;
constexpr std::size_t kSlabValues = kSlabRows * kChunkEdge;

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

}  // namespace

Half stored_density(float density, float band) {
  assert(band > 0.0F);
  return stored_within(density, largest_within(band));
}

DensityChunk::DensityChunk(Half density, VoxelType material) : uniform_(density), materials_(material) {}

DensityChunk::DensityChunk(const DensityChunk& other)
    : uniform_(other.uniform_),
      materials_(other.materials_),
      mixed_(other.mixed_ ? std::make_unique<Mixed>(*other.mixed_) : nullptr) {}

DensityChunk& DensityChunk::operator=(const DensityChunk& other) {
  if (this != &other) *this = DensityChunk(other);
  return *this;
}

void DensityChunk::fill(Half density) {
  mixed_.reset();
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
  mixed_ = std::make_unique<Mixed>();
  mixed_->slabs.fill(kUniformSlab | uniform_);
  mixed_->solid.fill(is_solid(uniform_) ? ~std::uint64_t{0} : 0);
}

// A slot of its own for a slab, filled with the slab's density where it had none.
std::uint32_t DensityChunk::slot_for_writing(std::size_t slab) {
  Mixed& m = *mixed_;
  const std::uint32_t entry = m.slabs[slab];
  if ((entry & kUniformSlab) == 0) return entry;
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

std::uint64_t DensityChunk::write_row(int y, int z, std::span<const Half, kChunkEdge> densities) {
  std::array<Half, kChunkEdge> uniform_row;
  const Half* old = row(y, z);
  if (old == nullptr) {
    uniform_row.fill(get(0, y, z));
    old = uniform_row.data();
  }
  if (std::memcmp(old, densities.data(), sizeof(Half) * kChunkEdge) == 0) return 0;
  const std::uint64_t changed = differences(old, densities.data());
  if (mixed_ == nullptr) make_mixed();
  const std::uint32_t slot = slot_for_writing(Chunk::slab_index(y, z));
  const std::size_t first = (std::size_t{slot} * kSlabRows + static_cast<std::size_t>(Chunk::row_in_slab(y, z)));
  std::memcpy(mixed_->values.data() + first * kChunkEdge, densities.data(), sizeof(Half) * kChunkEdge);
  mixed_->solid[static_cast<std::size_t>(z * kChunkEdge + y)] = solid_bits(densities.data());
  return changed;
}

void DensityChunk::unite_slabs() {
  if (mixed_ == nullptr) return;
  Mixed& m = *mixed_;
  for (std::uint32_t& slab : m.slabs) {
    if ((slab & kUniformSlab) != 0) continue;
    const Half* values = m.row(slab, 0);
    // All are equal when each equals the next.
    if (std::memcmp(values, values + 1, sizeof(Half) * (kSlabValues - 1)) != 0) continue;
    m.free_slots.push_back(slab);
    slab = kUniformSlab | *values;
  }
  const std::uint32_t first = m.slabs[0];
  if ((first & kUniformSlab) == 0) return;
  const bool is_uniform = std::all_of(m.slabs.begin(), m.slabs.end(), [&](std::uint32_t s) { return s == first; });
  if (is_uniform) fill(static_cast<Half>(first));
}

void DensityChunk::compact() {
  unite_slabs();
  materials_.compact();
  if (mixed_ == nullptr) return;
  std::vector<Half> values;
  Mixed& m = *mixed_;
  values.reserve(m.values.size() - m.free_slots.size() * kSlabValues);
  for (std::uint32_t& slab : m.slabs) {
    if ((slab & kUniformSlab) != 0) continue;
    const Half* from = m.row(slab, 0);
    slab = static_cast<std::uint32_t>(values.size() / kSlabValues);
    values.insert(values.end(), from, from + kSlabValues);
  }
  m.values = std::move(values);
  m.free_slots = {};
}

std::size_t DensityChunk::bytes() const {
  const std::size_t fixed = sizeof(DensityChunk) - sizeof(Chunk) + materials_.bytes();
  if (mixed_ == nullptr) return fixed;
  return fixed + sizeof(Mixed) + mixed_->values.capacity() * sizeof(Half) +
         mixed_->free_slots.capacity() * sizeof(std::uint32_t);
}

}  // namespace quoin
