#include <quoin/grid/chunk.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <optional>
#include <utility>

#include <quoin/core/assert.h>
#include <quoin/core/memory.h>

#include "core/rows/packed_row.h"
#include "grid/chunk/chunk_data.h"
#include "grid/chunk/chunk_storage.h"

namespace quoin {
namespace {

constexpr std::uint64_t kAllVoxels = ~std::uint64_t{0};

// Returns 1 in each of four counts whose bit is set.
constexpr auto kFourOnes = [] {
  std::array<std::uint64_t, 16> ones{};
  for (unsigned bits = 0; bits < ones.size(); ++bits) {
    std::array<std::uint16_t, 4> counts{};
    for (unsigned i = 0; i < counts.size(); ++i) counts.at(i) = static_cast<std::uint16_t>(bits >> i & 1U);
    ones.at(bits) = std::bit_cast<std::uint64_t>(counts);
  }
  return ones;
}();

// Adds 1 or -1 to the counts whose bits are set, four at once. Counts stay within 0 to 4,096, so there is no carry.
void add_columns(std::array<std::uint16_t, kChunkEdge>& counts, std::uint64_t mask, int delta) {
  QUOIN_ASSERT(delta == 1 || delta == -1, "voxels are added or removed");
  if (mask == 0) return;
  if (mask == kAllVoxels) {
    for (std::uint16_t& count : counts) count = static_cast<std::uint16_t>(count + delta);
    return;
  }
  for (std::size_t i = 0; i < kChunkEdge; i += 4) {
    std::uint64_t four = 0;
    std::memcpy(&four, &counts[i], sizeof four);
    const std::uint64_t ones = kFourOnes[mask >> i & 15U];
    four = delta > 0 ? four + ones : four - ones;
    std::memcpy(&counts[i], &four, sizeof four);
  }
}

bool is_one_type(std::span<const VoxelType> types) {
  return std::memcmp(types.data(), types.data() + 1, types.size_bytes() - sizeof(VoxelType)) == 0;
}

// Calls `visit(type, voxels)` for the types of a row, in order of appearance. If there are many types, some are visited
// more than once.
template <class Visit>
void for_each_run(std::span<const VoxelType, kChunkEdge> row, Visit&& visit) {
  constexpr int kFewTypes = 6;
  if (is_one_type(row)) return visit(row[0], kAllVoxels);
  std::uint64_t left = kAllVoxels;
  for (int i = 0; i < kFewTypes && left != 0; ++i) {
    const VoxelType type = row[static_cast<std::size_t>(std::countr_zero(left))];
    const std::uint64_t same = packed_row::where_equal(row.data(), type);
    visit(type, same);
    left &= ~same;
  }
  for (; left != 0; left &= left - 1) {
    visit(row[static_cast<std::size_t>(std::countr_zero(left))], left & (~left + 1));
  }
}

// The rows of a slab, in storage order.
template <class Visit>
void for_each_row_of_slab(std::size_t slab, Visit&& visit) {
  const int first_y = static_cast<int>(slab % 16) * 4;
  const int first_z = static_cast<int>(slab / 16) * 4;
  for (int row = 0; row < kSlabRows; ++row) visit(row, first_y + (row & 3), first_z + (row >> 2));
}

// Returns the type of all voxels of a row, if there is one and it is cheap to detect.
std::optional<VoxelType> one_type_of_row(const Chunk& chunk, int y, int z) {
  const ChunkStorage* m = ChunkStorage::of(chunk);
  if (m == nullptr) return chunk.uniform();
  const std::uint32_t slab = m->slabs[ChunkStorage::slab_index(y, z)];
  std::uint32_t index = slab & ~ChunkStorage::kUniformSlab;
  if ((slab & ChunkStorage::kUniformSlab) == 0) {
    const std::uint64_t* row = m->row(slab, ChunkStorage::row_in_slab(y, z));
    index = packed_row::read(row, m->bits, 0);
    if (!packed_row::all_equal(row, m->bits, 1, index)) return std::nullopt;
  }
  return m->direct() ? static_cast<VoxelType>(index) : m->palette[index];
}

}  // namespace

Chunk::Chunk(VoxelType uniform) : uniform_(uniform) {}
Chunk::Chunk(const Chunk&) = default;
Chunk::Chunk(Chunk&&) noexcept = default;
Chunk& Chunk::operator=(const Chunk&) = default;
Chunk& Chunk::operator=(Chunk&&) noexcept = default;
Chunk::~Chunk() = default;

VoxelType Chunk::get(int x, int y, int z) const {
  QUOIN_ASSERT((x | y | z) >= 0 && (x | y | z) < kChunkEdge, "0 <= x, y, z < 64");
  return storage_ == nullptr ? uniform_ : storage_->type(x, y, z);
}

int Chunk::non_air_count() const {
  if (storage_ != nullptr) return storage_->non_air;
  return uniform_ == kAir ? 0 : static_cast<int>(kChunkVoxels);
}

void Chunk::copy_storage() {
  storage_.make_own();
}

void Chunk::fill(VoxelType type) {
  for (int z = 0; z < kChunkEdge && data_ != nullptr; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) types_will_change(y, z, ~row_mask(y, z, type));
  }
  storage_.reset();
  uniform_ = type;
}

void Chunk::count_change(int y, int z, std::uint64_t became_air, std::uint64_t became_solid) {
  QUOIN_ASSERT((became_air & became_solid) == 0, "each voxel changes once");
  ChunkStorage& m = *storage_;
  const int delta = std::popcount(became_solid) - std::popcount(became_air);
  m.non_air += delta;
  QUOIN_ASSERT(m.non_air >= 0 && m.non_air <= static_cast<int>(kChunkVoxels), "0 <= voxels <= voxels per chunk");
  m.layer_counts[1][static_cast<std::size_t>(y)] += static_cast<std::uint16_t>(delta);
  m.layer_counts[2][static_cast<std::size_t>(z)] += static_cast<std::uint16_t>(delta);
  add_columns(m.layer_counts[0], became_solid, 1);
  add_columns(m.layer_counts[0], became_air, -1);
}

VoxelData Chunk::data(IVec3 local) const {
  QUOIN_ASSERT(kWholeChunk.contains(local), "0 <= x, y, z < 64");
  return data_ == nullptr ? VoxelData{} : data_->get(local.x, local.y, local.z);
}

int Chunk::data_count() const {
  return data_ == nullptr ? 0 : data_->count();
}

bool Chunk::set_data(IVec3 local, const VoxelData& data) {
  QUOIN_ASSERT(data.bytes.size() <= kMaxVoxelDataBytes, "no more bytes than a voxel can hold");
  if (get(local) == kAir || this->data(local) == data) return false;
  if (data.empty()) {
    clear_data(local.y, local.z, std::uint64_t{1} << local.x);
    return true;
  }
  if (data_ == nullptr) {
    data_ = make_ref<ChunkData>();
  } else {
    data_.make_own();
  }
  data_->put(local.x, local.y, local.z, data);
  return true;
}

void Chunk::clear_data(int y, int z, std::uint64_t voxels) {
  QUOIN_ASSERT(data_ != nullptr, "a chunk with data");
  if ((data_->voxels(y, z) & voxels) == 0) return;
  data_.make_own();
  data_->clear(y, z, voxels);
  if (data_->count() == 0) data_.reset();
}

void Chunk::for_each_data(FunctionRef<void(IVec3 local, const VoxelData& data)> visit) const {
  for (int z = 0; z < kChunkEdge && data_ != nullptr; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      for (std::uint64_t left = data_->voxels(y, z); left != 0; left &= left - 1) {
        const int x = std::countr_zero(left);
        visit({x, y, z}, data_->get(x, y, z));
      }
    }
  }
}

std::uint64_t Chunk::row_mask(int y, int z, VoxelType type) const {
  QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
  if (storage_ == nullptr) return type == uniform_ ? kAllVoxels : 0;
  const ChunkStorage& m = *storage_;
  std::uint32_t index = type;
  if (!m.direct()) {
    const auto found = std::find(m.palette.begin(), m.palette.end(), type);
    if (found == m.palette.end()) return 0;
    index = static_cast<std::uint32_t>(found - m.palette.begin());
  }
  const std::uint32_t slab = m.slabs[ChunkStorage::slab_index(y, z)];
  if ((slab & ChunkStorage::kUniformSlab) != 0) return (slab & ~ChunkStorage::kUniformSlab) == index ? kAllVoxels : 0;
  return packed_row::equal_mask(m.row(slab, ChunkStorage::row_in_slab(y, z)), m.bits, index);
}

// Returns the palette index of a type and adds new types, which may widen the voxels. Inline next to its callers,
// so that setting a voxel does not pay for a call.
inline std::uint32_t Chunk::index_for(VoxelType type) {
  ChunkStorage& m = *storage_;
  if (m.direct()) return type;
  QUOIN_ASSERT(m.recent < m.palette.size(), "an index of the palette");
  if (m.palette[m.recent] != type) m.recent = find_or_add(type);
  return m.direct() ? type : m.recent;
}

// Replaces the types of voxels that have other types. Updates the palette's counts, but not the air counts
// (see count_change).
std::uint32_t Chunk::replace(int y, int z, std::uint64_t changed, VoxelType type) {
  QUOIN_ASSERT(changed != 0, "voxels that change type");
  types_will_change(y, z, changed);
  if (storage_ == nullptr) make_mixed();
  ChunkStorage& m = own();
  const std::uint32_t index = index_for(type);
  std::uint64_t* row = m.own_row(slot_for_writing(ChunkStorage::slab_index(y, z)), ChunkStorage::row_in_slab(y, z));
  const std::uint32_t first = packed_row::read(row, m.bits, 0);
  if (packed_row::all_equal(row, m.bits, 1, first)) {
    m.move_counts(first, index, static_cast<std::uint32_t>(std::popcount(changed)));
    packed_row::write_masked(row, m.bits, changed, index);
    return index;
  }
  for (std::uint64_t left = changed; left != 0;) {
    const std::uint32_t old = packed_row::read(row, m.bits, std::countr_zero(left));
    const std::uint64_t same = left & packed_row::equal_mask(row, m.bits, old);
    m.move_counts(old, index, static_cast<std::uint32_t>(std::popcount(same)));
    left &= ~same;
  }
  packed_row::write_masked(row, m.bits, changed, index);
  return index;
}

std::uint64_t Chunk::fill_row(int y, int z, std::uint64_t mask, VoxelType type) {
  QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
  const std::optional<VoxelType> old = one_type_of_row(*this, y, z);
  const auto where = [&](VoxelType wanted) {
    if (old.has_value()) return *old == wanted ? kAllVoxels : 0;
    return row_mask(y, z, wanted);
  };
  const std::uint64_t changed = mask & ~where(type);
  if (changed == 0) return 0;
  const std::uint64_t air = type == kAir ? 0 : where(kAir);
  const std::uint32_t index = replace(y, z, changed, type);
  count_change(y, z, type == kAir ? changed : 0, changed & air);
  after_writing(y, z, index, static_cast<std::uint32_t>(std::popcount(changed)));
  return changed;
}

bool Chunk::set(int x, int y, int z, VoxelType type) {
  QUOIN_ASSERT((x | y | z) >= 0 && (x | y | z) < kChunkEdge, "0 <= x, y, z < 64");
  if (storage_ == nullptr) return type != uniform_ && set_anywhere(x, y, z, type);
  ChunkStorage& m = *storage_;
  const std::uint32_t slot = m.slabs[ChunkStorage::slab_index(y, z)];
  if ((slot & ChunkStorage::kUniformSlab) != 0 || m.direct() || storage_.is_shared())
    return set_anywhere(x, y, z, type);
  std::uint32_t index = m.recent;
  if (m.palette[index] != type) {
    const auto found = std::find(m.palette.begin(), m.palette.end(), type);
    if (found == m.palette.end()) return set_anywhere(x, y, z, type);
    index = static_cast<std::uint32_t>(found - m.palette.begin());
  }
  const auto bit = static_cast<unsigned>(x * m.bits);
  const std::size_t at = m.word_of(slot, ChunkStorage::row_in_slab(y, z)) + (bit >> 6);
  if (!m.words.owns(at)) return set_anywhere(x, y, z, type);
  std::uint64_t& word = *m.words.own_at(at);
  const std::uint32_t old = static_cast<std::uint32_t>(word >> (bit & 63U)) & ((1U << m.bits) - 1U);
  if (old == index) return false;
  m.recent = index;
  types_will_change(y, z, std::uint64_t{1} << x);
  word ^= std::uint64_t{old ^ index} << (bit & 63U);
  m.move_counts(old, index, 1);
  if (type == kAir) {
    m.count_voxel(x, y, z, -1);
  } else if (m.palette[old] == kAir) {
    m.count_voxel(x, y, z, 1);
  }
  after_writing(y, z, index, 1);
  return true;
}

// Sets a voxel of any slab, including slabs without a slot, to any type, including types that are not in the palette.
bool Chunk::set_anywhere(int x, int y, int z, VoxelType type) {
  const VoxelType old = storage_ == nullptr ? uniform_ : storage_->type(x, y, z);
  if (old == type) return false;
  types_will_change(y, z, std::uint64_t{1} << x);
  if (storage_ == nullptr) make_mixed();
  ChunkStorage& m = own();
  const std::uint32_t index = index_for(type);
  const std::size_t slab = ChunkStorage::slab_index(y, z);
  std::uint64_t* row = m.own_row(slot_for_writing(slab), ChunkStorage::row_in_slab(y, z));
  m.move_counts(packed_row::read(row, m.bits, x), index, 1);
  packed_row::write(row, m.bits, x, index);
  if ((old == kAir) != (type == kAir)) m.count_voxel(x, y, z, type == kAir ? -1 : 1);
  after_writing(y, z, index, 1);
  return true;
}

std::uint64_t Chunk::write_row(int y, int z, std::uint64_t mask, std::span<const VoxelType, kChunkEdge> types) {
  constexpr int kFewTypes = 6;
  const std::uint64_t air = row_mask(y, z, kAir);
  std::uint64_t changed = 0;
  std::uint64_t left = mask;
  std::uint32_t index = 0;
  for (int i = 0; i < kFewTypes && left != 0; ++i) {
    const VoxelType type = types[static_cast<std::size_t>(std::countr_zero(left))];
    const std::uint64_t same = left & packed_row::where_equal(types.data(), type);
    const std::uint64_t others = same & ~row_mask(y, z, type);
    left &= ~same;
    if (others == 0) continue;
    index = replace(y, z, others, type);
    // Counts at once, because the next steps may throw.
    count_change(y, z, type == kAir ? others : 0, others & air);
    changed |= others;
  }
  if (changed != 0) {
    after_writing(y, z, index, static_cast<std::uint32_t>(std::popcount(changed)));
  }
  for (; left != 0; left &= left - 1) {
    const int x = std::countr_zero(left);
    if (set(x, y, z, types[static_cast<std::size_t>(x)])) changed |= std::uint64_t{1} << x;
  }
  return changed;
}

void Chunk::read_row(int y, int z, std::span<VoxelType, kChunkEdge> out) const {
  QUOIN_ASSERT((y | z) >= 0 && (y | z) < kChunkEdge, "0 <= y, z < 64");
  if (storage_ == nullptr) {
    std::fill(out.begin(), out.end(), uniform_);
    return;
  }
  const ChunkStorage& m = *storage_;
  const auto type_of = [&](std::uint32_t index) {
    return m.direct() ? static_cast<VoxelType>(index) : m.palette[index];
  };
  const std::uint32_t slab = m.slabs[ChunkStorage::slab_index(y, z)];
  if ((slab & ChunkStorage::kUniformSlab) != 0) {
    std::fill(out.begin(), out.end(), type_of(slab & ~ChunkStorage::kUniformSlab));
    return;
  }
  packed_row::unpack(m.row(slab, ChunkStorage::row_in_slab(y, z)), m.bits, m.palette.data(), m.palette.size(),
                     out.data());
}

void Chunk::fill_box(const IBox& box, VoxelType type,
                     FunctionRef<void(int y, int z, std::uint64_t changed)> on_change) {
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
        const std::uint64_t changed = fill_row(row_y, row_z, mask, type);
        if (changed != 0) on_change(row_y, row_z, changed);
      }
    }
  }
  if (inside == IBox{IVec3{0}, IVec3{kChunkEdge}}) fill(type);
}

Chunk Chunk::from_dense(std::span<const VoxelType, kChunkVoxels> types) {
  Chunk chunk(types[0]);
  if (is_one_type(types)) return chunk;
  chunk.storage_ = make_ref<ChunkStorage>();
  ChunkStorage& m = *chunk.storage_;
  constexpr std::uint32_t kUnseen = 0xFFFF'FFFFU;
  BlockVector<std::uint32_t> index_of(std::size_t{1} << 16, kUnseen);
  for (std::size_t first = 0; first < types.size(); first += kChunkEdge) {
    for_each_run(types.subspan(first).first<kChunkEdge>(), [&](VoxelType type, std::uint64_t voxels) {
      if (index_of[type] == kUnseen) {
        index_of[type] = static_cast<std::uint32_t>(m.palette.size());
        m.palette.push_back(type);
        m.counts.push_back(0);
      }
      m.counts[index_of[type]] += static_cast<std::uint32_t>(std::popcount(voxels));
    });
  }
  m.bits = bits_for(m.palette.size());
  QUOIN_ASSERT(std::accumulate(m.counts.begin(), m.counts.end(), 0U) == kChunkVoxels, "each voxel has one type");
  if (m.direct()) {
    BlockVector<std::uint32_t> counts(ChunkStorage::kRemainders);
    for (const VoxelType type : m.palette) {
      counts[type % ChunkStorage::kRemainders] += m.counts[index_of[type]];
      index_of[type] = type;
    }
    m.palette = {};
    m.counts = std::move(counts);
  }
  m.used = static_cast<std::uint32_t>(m.counts.size() - static_cast<std::size_t>(std::ranges::count(m.counts, 0U)));
  for (std::size_t i = 0; i < m.slabs.size(); ++i) chunk.pack_slab(slab_in_order(i), types, index_of);
  QUOIN_ASSERT(m.non_air == static_cast<int>(kChunkVoxels) - chunk.count(kAir), "air is counted");
  m.words.shrink_to_fit();
  return chunk;
}

void Chunk::pack_slab(std::size_t slab, std::span<const VoxelType, kChunkVoxels> types,
                      std::span<const std::uint32_t> index_of) {
  ChunkStorage& m = *storage_;
  const auto row_of = [&](int y, int z) {
    return types.subspan(static_cast<std::size_t>((z * kChunkEdge + y) * kChunkEdge)).first<kChunkEdge>();
  };
  const VoxelType first = row_of(static_cast<int>(slab % 16) * 4, static_cast<int>(slab / 16) * 4)[0];
  bool is_uniform = true;
  for_each_row_of_slab(slab, [&](int, int y, int z) {
    const auto row = row_of(y, z);
    is_uniform = is_uniform && row[0] == first && is_one_type(row);
  });
  QUOIN_ASSERT((index_of[first] & ChunkStorage::kUniformSlab) == 0, "a type of the palette");
  m.slabs[slab] = ChunkStorage::kUniformSlab | index_of[first];
  const std::uint32_t slot = is_uniform ? 0 : slot_for_writing(slab);
  for_each_row_of_slab(slab, [&](int stored, int y, int z) {
    std::uint64_t solid = first == kAir ? 0 : kAllVoxels;
    if (!is_uniform) {
      solid = 0;
      for_each_run(row_of(y, z), [&](VoxelType type, std::uint64_t voxels) {
        packed_row::write_masked(m.own_row(slot, stored), m.bits, voxels, index_of[type]);
        if (type != kAir) solid |= voxels;
      });
    }
    if (solid != 0) count_change(y, z, 0, solid);
  });
}

int Chunk::count(VoxelType type) const {
  if (storage_ == nullptr) return type == uniform_ ? static_cast<int>(kChunkVoxels) : 0;
  if (!storage_->direct()) {
    const auto found = std::find(storage_->palette.begin(), storage_->palette.end(), type);
    if (found == storage_->palette.end()) return 0;
    return static_cast<int>(storage_->counts[static_cast<std::size_t>(found - storage_->palette.begin())]);
  }
  int total = 0;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) total += std::popcount(row_mask(y, z, type));
  }
  return total;
}

std::vector<VoxelType> Chunk::types() const {
  std::vector<VoxelType> found;
  if (storage_ == nullptr) return {uniform_};
  const ChunkStorage& m = *storage_;
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
  if (storage_ == nullptr) return {IVec3{0}, IVec3{kChunkEdge}};
  IBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const auto& counts = storage_->layer_counts[static_cast<std::size_t>(axis)];
    const auto is_filled = [](std::uint16_t count) { return count != 0; };
    box.min[axis] = static_cast<int>(std::find_if(counts.begin(), counts.end(), is_filled) - counts.begin());
    box.max[axis] = static_cast<int>(counts.rend() - std::find_if(counts.rbegin(), counts.rend(), is_filled));
  }
  return box;
}

bool Chunk::operator==(const Chunk& other) const {
  if (shares_storage_with(other)) return true;
  if (non_air_count() != other.non_air_count() || data_count() != other.data_count()) return false;
  if (data_count() != 0 && !(*data_ == *other.data_)) return false;
  std::array<VoxelType, kChunkEdge> row{};
  std::array<VoxelType, kChunkEdge> other_row{};
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      read_row(y, z, row);
      other.read_row(y, z, other_row);
      if (row != other_row) return false;
    }
  }
  return true;
}

std::uint64_t Chunk::content_hash() const {
  std::uint64_t hash = kHashSeed;
  std::array<VoxelType, kChunkEdge> row{};
  std::optional<VoxelType> hashed;  // the type of the last hashed row, if uniform
  std::uint64_t row_hash = 0;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const std::optional<VoxelType> one = one_type_of_row(*this, y, z);
      if (!one.has_value() || one != hashed) {
        read_row(y, z, row);
        row_hash = hash_of_row(row);
        hashed = one;
      }
      hash = mixed_with(hash, row_hash);
    }
  }
  for_each_data([&](IVec3 local, const VoxelData& data) {
    hash = mixed_with(hash, static_cast<std::uint64_t>((local.z * kChunkEdge + local.y) * kChunkEdge + local.x));
    hash = mixed_with(hash, std::uint64_t{data.state} << 32 | data.bytes.size());
    for (const std::byte byte : data.bytes) hash = mixed_with(hash, std::to_integer<std::uint64_t>(byte));
  });
  return hash;
}

}  // namespace quoin
