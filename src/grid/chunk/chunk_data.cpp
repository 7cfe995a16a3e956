#include "grid/chunk/chunk_data.h"

#include <algorithm>

#include <quoin/core/assert.h>

#include "core/memory/make_room.h"
#include "core/rows/packed_row.h"

namespace quoin {

std::size_t SlabData::rank(int row, int x) const {
  QUOIN_ASSERT(row >= 0 && row < kSlabRows && x >= 0 && x < kChunkEdge, "a voxel of the slab");
  std::size_t before = packed_row::count_bits(stateful_[static_cast<std::size_t>(row)] & ((std::uint64_t{1} << x) - 1));
  for (int i = 0; i < row; ++i) before += packed_row::count_bits(stateful_[static_cast<std::size_t>(i)]);
  return before;
}

std::size_t SlabData::first_from(std::uint32_t place) const {
  const auto found = std::ranges::lower_bound(bytes_, place, {}, &Placed::place);
  return static_cast<std::size_t>(found - bytes_.begin());
}

std::uint64_t SlabData::voxels(int row) const {
  QUOIN_ASSERT(row >= 0 && row < kSlabRows, "a row of the slab");
  std::uint64_t found = stateful_[static_cast<std::size_t>(row)];
  const std::uint32_t end = place_of(row + 1, 0);
  for (std::size_t i = first_from(place_of(row, 0)); i < bytes_.size() && bytes_[i].place < end; ++i) {
    found |= std::uint64_t{1} << (bytes_[i].place % kChunkEdge);
  }
  return found;
}

RowStates SlabData::states(int row) const {
  QUOIN_ASSERT(row >= 0 && row < kSlabRows, "a row of the slab");
  const std::uint64_t voxels = stateful_[static_cast<std::size_t>(row)];
  return voxels == 0 ? RowStates{} : RowStates{voxels, states_.data() + rank(row, 0)};
}

VoxelData SlabData::get(int row, int x) const {
  QUOIN_ASSERT(row >= 0 && row < kSlabRows && x >= 0 && x < kChunkEdge, "a voxel of the slab");
  VoxelData data;
  if ((stateful_[static_cast<std::size_t>(row)] >> x & 1U) != 0) data.state = states_[rank(row, x)];
  const std::size_t at = first_from(place_of(row, x));
  if (at < bytes_.size() && bytes_[at].place == place_of(row, x)) data.bytes = bytes_[at].bytes->all;
  return data;
}

void SlabData::put(int row, int x, const VoxelData& data) {
  QUOIN_ASSERT(!data.empty() && data.bytes.size() <= kMaxVoxelDataBytes, "data that a voxel can hold");
  Ref<Bytes> bytes;
  if (!data.bytes.empty()) {
    bytes = make_ref<Bytes>();
    bytes->all.assign(data.bytes.begin(), data.bytes.end());
    make_room(bytes_);
  }
  if (data.state != 0) make_room(states_);
  put_bytes(row, x, std::move(bytes));
  put_state(row, x, data.state);
}

void SlabData::put_state(int row, int x, std::uint32_t state) {
  const std::size_t at = rank(row, x);
  QUOIN_ASSERT(at <= states_.size(), "a state for each bit");
  std::uint64_t& voxels = stateful_[static_cast<std::size_t>(row)];
  const std::uint64_t bit = std::uint64_t{1} << x;
  const auto place = states_.begin() + static_cast<std::ptrdiff_t>(at);
  if ((voxels & bit) == 0) {
    if (state == 0) return;
    states_.insert(place, state);
    voxels |= bit;
  } else if (state != 0) {
    *place = state;
  } else {
    states_.erase(place);
    voxels ^= bit;
  }
}

void SlabData::put_bytes(int row, int x, Ref<Bytes> bytes) {
  const std::uint32_t place = place_of(row, x);
  const std::size_t at = first_from(place);
  const bool is_there = at < bytes_.size() && bytes_[at].place == place;
  const auto where = bytes_.begin() + static_cast<std::ptrdiff_t>(at);
  if (bytes == nullptr) {
    if (is_there) bytes_.erase(where);
  } else if (is_there) {
    where->bytes = std::move(bytes);
  } else {
    bytes_.insert(where, {place, std::move(bytes)});
  }
}

void SlabData::clear(int row, std::uint64_t mask) {
  std::uint64_t& voxels = stateful_[static_cast<std::size_t>(row)];
  if (const std::uint64_t gone = voxels & mask; gone != 0) {
    const std::size_t first = rank(row, 0);
    std::size_t kept = first;
    std::size_t at = first;
    for (std::uint64_t left = voxels; left != 0; left &= left - 1, ++at) {
      if ((left & (~left + 1) & gone) == 0) states_[kept++] = states_[at];
    }
    QUOIN_ASSERT(at <= states_.size(), "a state for each bit");
    states_.erase(states_.begin() + static_cast<std::ptrdiff_t>(kept),
                  states_.begin() + static_cast<std::ptrdiff_t>(at));
    voxels ^= gone;
  }
  std::erase_if(bytes_, [&](const Placed& each) {
    const int of_row = static_cast<int>(each.place / kChunkEdge);
    return of_row == row && (mask >> (each.place % kChunkEdge) & 1U) != 0;
  });
}

std::size_t SlabData::allocated() const {
  std::size_t total = sizeof(SlabData) + states_.capacity() * sizeof(states_[0]) + bytes_.capacity() * sizeof(Placed);
  for (const Placed& each : bytes_) total += sizeof(Bytes) + each.bytes->all.capacity();
  return total;
}

void ChunkData::put(int x, int y, int z, const VoxelData& data) {
  Ref<SlabData>& slab = slabs_[ChunkStorage::slab_index(y, z)];
  QUOIN_ASSERT(!data.empty(), "data that is not empty");
  const bool had_some = !get(x, y, z).empty();
  if (slab == nullptr) {
    slab = make_ref<SlabData>();
  } else {
    slab.make_own();
  }
  slab->put(ChunkStorage::row_in_slab(y, z), x, data);
  if (!had_some) ++count_;
}

void ChunkData::clear(int y, int z, std::uint64_t mask) {
  Ref<SlabData>& slab = slabs_[ChunkStorage::slab_index(y, z)];
  const std::uint64_t gone = voxels(y, z) & mask;
  if (gone == 0) return;
  slab.make_own();
  slab->clear(ChunkStorage::row_in_slab(y, z), gone);
  count_ -= std::popcount(gone);
  QUOIN_ASSERT(count_ >= 0, "a count that is not negative");
  if (slab->empty()) slab.reset();
}

RowStates RowStates::of(const Chunk& chunk, int y, int z) {
  const ChunkData* const data = ChunkData::of(chunk);
  const SlabData* const slab = data == nullptr ? nullptr : data->slab(ChunkStorage::slab_index(y, z));
  return slab == nullptr ? RowStates{} : slab->states(ChunkStorage::row_in_slab(y, z));
}

bool ChunkData::operator==(const ChunkData& other) const {
  if (count_ != other.count_) return false;
  for (std::size_t i = 0; i < slabs_.size(); ++i) {
    if (slabs_[i] == other.slabs_[i]) continue;
    if (slabs_[i] == nullptr || other.slabs_[i] == nullptr) return false;
    for (int row = 0; row < kSlabRows; ++row) {
      std::uint64_t left = slabs_[i]->voxels(row);
      if (left != other.slabs_[i]->voxels(row)) return false;
      for (; left != 0; left &= left - 1) {
        const int x = std::countr_zero(left);
        if (slabs_[i]->get(row, x) != other.slabs_[i]->get(row, x)) return false;
      }
    }
  }
  return true;
}

std::size_t ChunkData::allocated() const {
  std::size_t total = sizeof(ChunkData);
  for (const Ref<SlabData>& slab : slabs_) total += slab == nullptr ? 0 : slab->allocated();
  return total;
}

void visit_other_data(const Chunk* before, const Chunk* after,
                      FunctionRef<void(IVec3 local, const VoxelData& before, const VoxelData& after)> visit) {
  static const ChunkData none;
  const auto data_of = [](const Chunk* chunk) -> const ChunkData& {
    const ChunkData* const data = chunk == nullptr ? nullptr : ChunkData::of(*chunk);
    return data == nullptr ? none : *data;
  };
  const ChunkData& old_data = data_of(before);
  const ChunkData& new_data = data_of(after);
  if (&old_data == &new_data) return;
  for (int z = 0; z < kChunkEdge; ++z) {
    for (int y = 0; y < kChunkEdge; ++y) {
      const std::size_t slab = ChunkStorage::slab_index(y, z);
      if (old_data.slab(slab) == new_data.slab(slab)) continue;
      for (std::uint64_t left = old_data.voxels(y, z) | new_data.voxels(y, z); left != 0; left &= left - 1) {
        const int x = std::countr_zero(left);
        const VoxelData one = old_data.get(x, y, z);
        const VoxelData other = new_data.get(x, y, z);
        if (one != other) visit({x, y, z}, one, other);
      }
    }
  }
}

}  // namespace quoin
