#include <quoin/grid/chunk.h>

#include <algorithm>
#include <bit>
#include <cassert>

#include "grid/packed_row.h"

namespace quoin {
namespace {

constexpr std::uint64_t kAllVoxels = ~std::uint64_t{0};
constexpr int kSlabRows = 16;

int bits_for(std::size_t types) {
  if (types <= 2) return 1;
  if (types <= 4) return 2;
  if (types <= 16) return 4;
  return types <= 256 ? 8 : 16;
}

// The rows of a slab, in the order in which they are stored.
template <class Visit>
void for_each_row_of_slab(std::size_t slab, Visit&& visit) {
  const int first_y = static_cast<int>(slab % 16) * 4;
  const int first_z = static_cast<int>(slab / 16) * 4;
  for (int row = 0; row < kSlabRows; ++row) visit(row, first_y + (row & 3), first_z + (row >> 2));
}

}  // namespace

Chunk::Chunk(VoxelType uniform) : uniform_(uniform) {}

Chunk::Chunk(const Chunk& other)
    : uniform_(other.uniform_), mixed_(other.mixed_ ? std::make_unique<Mixed>(*other.mixed_) : nullptr) {}

Chunk& Chunk::operator=(const Chunk& other) {
  if (this != &other) *this = Chunk(other);
  return *this;
}

void Chunk::fill(VoxelType type) {
  mixed_.reset();
  uniform_ = type;
}

void Chunk::make_mixed() {
  mixed_ = std::make_unique<Mixed>();
  Mixed& m = *mixed_;
  m.palette.push_back(uniform_);
  m.counts.push_back(kChunkVoxels);
  m.slabs.fill(kUniformSlab | 0U);
  if (uniform_ != kAir) {
    m.non_air = kChunkVoxels;
    for (auto& axis : m.layer_counts) axis.fill(kChunkEdge * kChunkEdge);
  }
}

// The palette index of a type, adding it where it is new; may widen the voxels.
std::uint32_t Chunk::index_for(VoxelType type) {
  Mixed& m = *mixed_;
  if (m.direct()) return type;
  std::size_t unused = m.palette.size();
  for (std::size_t i = 0; i < m.palette.size(); ++i) {
    if (m.palette[i] == type) return static_cast<std::uint32_t>(i);
    if (m.counts[i] == 0) unused = i;
  }
  if (unused < m.palette.size()) {
    m.palette[unused] = type;
    return static_cast<std::uint32_t>(unused);
  }
  if (m.palette.size() == std::size_t{1} << m.bits) widen(m.bits * 2);
  if (m.direct()) return type;
  m.counts.reserve(m.counts.size() + 1);  // so that both grow or neither
  m.palette.push_back(type);
  m.counts.push_back(0);
  return static_cast<std::uint32_t>(m.palette.size() - 1);
}

void Chunk::widen(int bits) {
  Mixed& m = *mixed_;
  const auto stored_as = [&](std::uint32_t index) { return bits == 16 ? std::uint32_t{m.palette[index]} : index; };
  const std::size_t rows = m.words.size() / static_cast<std::size_t>(m.bits);
  std::vector<std::uint64_t> words(rows * static_cast<std::size_t>(bits));
  for (std::size_t row = 0; row < rows; ++row) {
    const std::uint64_t* from = m.words.data() + row * static_cast<std::size_t>(m.bits);
    std::uint64_t* to = words.data() + row * static_cast<std::size_t>(bits);
    for (int x = 0; x < kChunkEdge; ++x) packed_row::write(to, bits, x, stored_as(packed_row::read(from, m.bits, x)));
  }
  for (std::uint32_t& slab : m.slabs) {
    if ((slab & kUniformSlab) != 0) slab = kUniformSlab | stored_as(slab & ~kUniformSlab);
  }
  m.words = std::move(words);
  m.bits = bits;
  if (m.direct()) {
    m.palette = {};
    m.counts = {};
  }
}

// A slot of its own for a slab, filled with the slab's type where it had none.
std::uint32_t Chunk::slot_for_writing(std::size_t slab) {
  Mixed& m = *mixed_;
  const std::uint32_t entry = m.slabs[slab];
  if ((entry & kUniformSlab) == 0) return entry;
  const auto slab_words = static_cast<std::size_t>(kSlabRows * m.bits);
  std::uint32_t slot = 0;
  if (!m.free_slots.empty()) {
    slot = m.free_slots.back();
    m.free_slots.pop_back();
  } else {
    slot = static_cast<std::uint32_t>(m.words.size() / slab_words);
    m.words.resize(m.words.size() + slab_words);
  }
  std::fill_n(m.row(slot, 0), slab_words, packed_row::repeat(m.bits, entry & ~kUniformSlab));
  m.slabs[slab] = slot;
  return slot;
}

void Chunk::count_change(int y, int z, std::uint64_t became_air, std::uint64_t became_solid) {
  Mixed& m = *mixed_;
  const int delta = std::popcount(became_solid) - std::popcount(became_air);
  m.non_air += delta;
  m.layer_counts[1][static_cast<std::size_t>(y)] += static_cast<std::uint16_t>(delta);
  m.layer_counts[2][static_cast<std::size_t>(z)] += static_cast<std::uint16_t>(delta);
  auto& columns = m.layer_counts[0];
  if (became_solid == kAllVoxels) {
    for (std::uint16_t& count : columns) ++count;
    return;
  }
  for (std::uint64_t w = became_air; w != 0; w &= w - 1) --columns[static_cast<std::size_t>(std::countr_zero(w))];
  for (std::uint64_t w = became_solid; w != 0; w &= w - 1) ++columns[static_cast<std::size_t>(std::countr_zero(w))];
}

std::uint64_t Chunk::row_mask(int y, int z, VoxelType type) const {
  if (mixed_ == nullptr) return type == uniform_ ? kAllVoxels : 0;
  const Mixed& m = *mixed_;
  std::uint32_t index = type;
  if (!m.direct()) {
    const auto found = std::find(m.palette.begin(), m.palette.end(), type);
    if (found == m.palette.end()) return 0;
    index = static_cast<std::uint32_t>(found - m.palette.begin());
  }
  const std::uint32_t slab = m.slabs[slab_index(y, z)];
  if ((slab & kUniformSlab) != 0) return (slab & ~kUniformSlab) == index ? kAllVoxels : 0;
  return packed_row::equal_mask(m.row(slab, row_in_slab(y, z)), m.bits, index);
}

std::uint64_t Chunk::set_row(int y, int z, std::uint64_t mask, VoxelType type) {
  const std::uint64_t changed = mask & ~row_mask(y, z, type);
  if (changed == 0) return 0;
  if (mixed_ == nullptr) make_mixed();
  const std::uint64_t air = row_mask(y, z, kAir);
  const std::uint32_t index = index_for(type);
  Mixed& m = *mixed_;
  std::uint64_t* row = m.row(slot_for_writing(slab_index(y, z)), row_in_slab(y, z));
  if (!m.direct()) {
    for (std::uint64_t left = changed; left != 0;) {
      const std::uint32_t old = packed_row::read(row, m.bits, std::countr_zero(left));
      const std::uint64_t same = left & packed_row::equal_mask(row, m.bits, old);
      m.counts[old] -= static_cast<std::uint32_t>(std::popcount(same));
      left &= ~same;
    }
    m.counts[index] += static_cast<std::uint32_t>(std::popcount(changed));
  }
  packed_row::write_masked(row, m.bits, changed, index);
  if (type == kAir) {
    count_change(y, z, changed, 0);
  } else {
    count_change(y, z, 0, changed & air);
  }
  if (!m.direct() && m.counts[index] == kChunkVoxels) fill(type);
  return changed;
}

bool Chunk::set(int x, int y, int z, VoxelType type) {
  assert((x | y | z) >= 0 && (x | y | z) < kChunkEdge);
  const VoxelType old = get(x, y, z);
  if (old == type) return false;
  if (mixed_ == nullptr) make_mixed();
  const std::uint32_t index = index_for(type);
  Mixed& m = *mixed_;
  std::uint64_t* row = m.row(slot_for_writing(slab_index(y, z)), row_in_slab(y, z));
  if (!m.direct()) {
    --m.counts[packed_row::read(row, m.bits, x)];
    ++m.counts[index];
  }
  packed_row::write(row, m.bits, x, index);
  if ((old == kAir) != (type == kAir)) {
    const int delta = type == kAir ? -1 : 1;
    m.non_air += delta;
    m.layer_counts[0][static_cast<std::size_t>(x)] += static_cast<std::uint16_t>(delta);
    m.layer_counts[1][static_cast<std::size_t>(y)] += static_cast<std::uint16_t>(delta);
    m.layer_counts[2][static_cast<std::size_t>(z)] += static_cast<std::uint16_t>(delta);
  }
  if (!m.direct() && m.counts[index] == kChunkVoxels) fill(type);
  return true;
}

std::uint64_t Chunk::write_row(int y, int z, std::span<const VoxelType, kChunkEdge> types) {
  std::uint64_t changed = 0;
  for (std::uint64_t left = kAllVoxels; left != 0;) {
    const VoxelType type = types[static_cast<std::size_t>(std::countr_zero(left))];
    std::uint64_t same = 0;
    for (std::size_t x = 0; x < kChunkEdge; ++x) same |= std::uint64_t{types[x] == type} << x;
    changed |= set_row(y, z, same & left, type);
    left &= ~same;
  }
  return changed;
}

void Chunk::read_row(int y, int z, std::span<VoxelType, kChunkEdge> out) const {
  if (mixed_ == nullptr) {
    std::fill(out.begin(), out.end(), uniform_);
    return;
  }
  const Mixed& m = *mixed_;
  const auto type_of = [&](std::uint32_t index) {
    return m.direct() ? static_cast<VoxelType>(index) : m.palette[index];
  };
  const std::uint32_t slab = m.slabs[slab_index(y, z)];
  if ((slab & kUniformSlab) != 0) {
    std::fill(out.begin(), out.end(), type_of(slab & ~kUniformSlab));
    return;
  }
  const std::uint64_t* row = m.row(slab, row_in_slab(y, z));
  for (int x = 0; x < kChunkEdge; ++x) out[static_cast<std::size_t>(x)] = type_of(packed_row::read(row, m.bits, x));
}

void Chunk::fill_box(const IBox& box, VoxelType type,
                     const std::function<void(int y, int z, std::uint64_t changed)>& on_change) {
  const IBox inside = intersect(box, {IVec3{0}, IVec3{kChunkEdge}});
  if (inside.empty()) return;
  const int width = inside.max.x - inside.min.x;
  const std::uint64_t mask = (width == kChunkEdge ? kAllVoxels : (std::uint64_t{1} << width) - 1) << inside.min.x;
  for (std::size_t slab = 0; slab < 256; ++slab) {
    const int y = static_cast<int>(slab % 16) * 4;
    const int z = static_cast<int>(slab / 16) * 4;
    const IBox part = intersect(inside, {{0, y, z}, {kChunkEdge, y + 4, z + 4}});
    if (part.empty()) continue;
    for (int row_z = part.min.z; row_z < part.max.z; ++row_z) {
      for (int row_y = part.min.y; row_y < part.max.y; ++row_y) {
        const std::uint64_t changed = set_row(row_y, row_z, mask, type);
        if (changed != 0) on_change(row_y, row_z, changed);
      }
    }
    if (mask == kAllVoxels && part.size().y == 4 && part.size().z == 4) make_slab_uniform(slab, type);
  }
  if (inside == IBox{IVec3{0}, IVec3{kChunkEdge}}) fill(type);
}

// Requires: every voxel of the slab is of this type already.
void Chunk::make_slab_uniform(std::size_t slab, VoxelType type) {
  if (mixed_ == nullptr || (mixed_->slabs[slab] & kUniformSlab) != 0) return;
  mixed_->free_slots.push_back(mixed_->slabs[slab]);
  mixed_->slabs[slab] = kUniformSlab | index_for(type);
}

Chunk Chunk::from_dense(std::span<const VoxelType, kChunkVoxels> types) {
  Chunk chunk(types[0]);
  if (std::all_of(types.begin(), types.end(), [&](VoxelType t) { return t == types[0]; })) return chunk;
  chunk.mixed_ = std::make_unique<Mixed>();
  Mixed& m = *chunk.mixed_;
  constexpr std::uint32_t kUnseen = 0xFFFF'FFFFU;
  std::vector<std::uint32_t> index_of(std::size_t{1} << 16, kUnseen);
  for (const VoxelType type : types) {
    if (index_of[type] != kUnseen) {
      ++m.counts[index_of[type]];
      continue;
    }
    index_of[type] = static_cast<std::uint32_t>(m.palette.size());
    m.palette.push_back(type);
    m.counts.push_back(1);
  }
  m.bits = bits_for(m.palette.size());
  if (m.direct()) {
    for (const VoxelType type : m.palette) index_of[type] = type;
    m.palette = {};
    m.counts = {};
  }
  for (std::size_t slab = 0; slab < m.slabs.size(); ++slab) chunk.pack_slab(slab, types, index_of);
  return chunk;
}

void Chunk::pack_slab(std::size_t slab, std::span<const VoxelType, kChunkVoxels> types,
                      const std::vector<std::uint32_t>& index_of) {
  Mixed& m = *mixed_;
  const auto row_of = [&](int y, int z) {
    return types.subspan(static_cast<std::size_t>((z * kChunkEdge + y) * kChunkEdge), kChunkEdge);
  };
  const VoxelType first = row_of(static_cast<int>(slab % 16) * 4, static_cast<int>(slab / 16) * 4)[0];
  bool is_uniform = true;
  for_each_row_of_slab(slab, [&](int, int y, int z) {
    const auto row = row_of(y, z);
    std::uint64_t solid = 0;
    for (std::size_t x = 0; x < kChunkEdge; ++x) {
      is_uniform &= row[x] == first;
      solid |= std::uint64_t{row[x] != kAir} << x;
    }
    if (solid != 0) count_change(y, z, 0, solid);
  });
  m.slabs[slab] = kUniformSlab | index_of[first];
  if (is_uniform) return;
  const std::uint32_t slot = slot_for_writing(slab);
  for_each_row_of_slab(slab, [&](int stored, int y, int z) {
    const auto row = row_of(y, z);
    std::uint64_t* packed = m.row(slot, stored);
    std::fill_n(packed, m.bits, 0);
    for (std::size_t x = 0; x < kChunkEdge; ++x) {
      const std::size_t bit = x * static_cast<std::size_t>(m.bits);
      packed[bit >> 6] |= std::uint64_t{index_of[row[x]]} << (bit & 63);
    }
  });
}

int Chunk::non_air_count() const {
  if (mixed_ != nullptr) return mixed_->non_air;
  return uniform_ == kAir ? 0 : static_cast<int>(kChunkVoxels);
}

int Chunk::count(VoxelType type) const {
  if (mixed_ == nullptr) return type == uniform_ ? static_cast<int>(kChunkVoxels) : 0;
  if (!mixed_->direct()) {
    const auto found = std::find(mixed_->palette.begin(), mixed_->palette.end(), type);
    if (found == mixed_->palette.end()) return 0;
    return static_cast<int>(mixed_->counts[static_cast<std::size_t>(found - mixed_->palette.begin())]);
  }
  int total = 0;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) total += std::popcount(row_mask(y, z, type));
  }
  return total;
}

std::vector<VoxelType> Chunk::types() const {
  std::vector<VoxelType> found;
  if (mixed_ == nullptr) return {uniform_};
  const Mixed& m = *mixed_;
  if (m.direct()) {
    std::vector<bool> seen(std::size_t{1} << 16);
    std::array<VoxelType, kChunkEdge> row{};
    for (int z = 0; z < kChunkEdge; ++z) {
      for (int y = 0; y < kChunkEdge; ++y) {
        read_row(y, z, row);
        for (const VoxelType type : row) seen[type] = true;
      }
    }
    for (std::size_t type = 0; type < seen.size(); ++type) {
      if (seen[type]) found.push_back(static_cast<VoxelType>(type));
    }
    return found;
  }
  for (std::size_t i = 0; i < m.palette.size(); ++i) {
    if (m.counts[i] != 0) found.push_back(m.palette[i]);
  }
  std::sort(found.begin(), found.end());
  return found;
}

IBox Chunk::bounds() const {
  if (non_air_count() == 0) return {};
  if (mixed_ == nullptr) return {IVec3{0}, IVec3{kChunkEdge}};
  IBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const auto& counts = mixed_->layer_counts[static_cast<std::size_t>(axis)];
    const auto is_filled = [](std::uint16_t count) { return count != 0; };
    box.min[axis] = static_cast<int>(std::find_if(counts.begin(), counts.end(), is_filled) - counts.begin());
    box.max[axis] = static_cast<int>(counts.rend() - std::find_if(counts.rbegin(), counts.rend(), is_filled));
  }
  return box;
}

std::size_t Chunk::bytes() const {
  if (mixed_ == nullptr) return sizeof(Chunk);
  const Mixed& m = *mixed_;
  return sizeof(Chunk) + sizeof(Mixed) + m.palette.capacity() * sizeof(VoxelType) +
         m.counts.capacity() * sizeof(std::uint32_t) + m.words.capacity() * sizeof(std::uint64_t) +
         m.free_slots.capacity() * sizeof(std::uint32_t);
}

void Chunk::compact() {
  if (mixed_ == nullptr) return;
  std::vector<VoxelType> dense(kChunkVoxels);
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      read_row(y, z, std::span<VoxelType, kChunkEdge>(dense.data() + (z * kChunkEdge + y) * kChunkEdge, kChunkEdge));
    }
  }
  *this = from_dense(std::span<const VoxelType, kChunkVoxels>(dense));
  if (mixed_ != nullptr) mixed_->words.shrink_to_fit();
}

}  // namespace quoin
